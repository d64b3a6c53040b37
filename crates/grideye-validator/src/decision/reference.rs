//! How the statistics of simulated recordings of a scene are distributed, and how far from them one recording's are.
//!
//! The distance of a recording is that of its farthest statistic. A statistic's distance is the negative logarithm of the
//! share of simulated recordings in which it is as far off, by their tail. Warmth in blocks of pixels and likeness to
//! alternatives are fields of many values: of each field, the value that is farthest off in its own standard deviations is one
//! statistic. What a simulated recording sets is taken without itself, since nothing is far off in what it set.

use crate::decision::constants::{ABSENT, FARTHEST, FARTHEST_SDS, LIKE, UNLIKE};
use crate::decision::film::Film;
use crate::decision::model::{BLOCKS, Model, Statistics};
use crate::numbers::{count, mean, percentile, single};
use grideye_draw::text::fixed;

/// What may be off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Statistic {
    Delay,
    Misfit,
    /// Of a person, or of the objects.
    Contrast(usize),
    /// Of a block with this place: warmth beyond the scene, or that it lacks.
    Extra(usize),
    Missing(usize),
    /// Likeness to the scene rather than to an alternative.
    Alternative,
}

/// How surprising what one in twenty exceeds is: ln 20.
const ONE_IN_TWENTY: f64 = 2.996;

/// Location and scale of each statistic in simulated recordings of the scene.
pub(crate) struct Reference {
    beyond: Vec<Spread>,
    likeness: Vec<Spread>,
    tails: Vec<Tails>,
}

/// The distribution of one value of a field.
struct Spread {
    number: f64,
    sum: f64,
    squares: f64,
    /// Upward, and downward with signs turned: next to a person who may be elsewhere tails are long.
    ends: [End; 2],
}

/// The sum of the farthest, the last of them, and the next.
struct End {
    sum: f64,
    last: f64,
    next: f64,
}

/// The distribution of one statistic.
struct Tails {
    middle: f64,
    /// What one in twenty exceeds upward and downward, and how far these are beyond it in the mean.
    ends: [(f64, f64); 2],
}

impl Reference {
    pub(crate) fn new(simulated: &[Statistics]) -> Self {
        let likeness: Vec<Vec<f32>> = simulated.iter().map(unlikeness).collect();
        let likeness: Vec<&[f32]> = likeness.iter().map(Vec::as_slice).collect();
        let beyond: Vec<&[f32]> = simulated.iter().map(|one| one.beyond.as_slice()).collect();
        let mut reference = Self {
            beyond: Spread::of_all(&beyond),
            likeness: Spread::of_all(&likeness),
            tails: Vec::new(),
        };
        let rows = simulated.iter().map(|one| reference.values(one, true));
        let rows: Vec<Vec<(Statistic, f64)>> = rows.collect();
        let number = rows.first().map_or(0, Vec::len);
        let column = |place: usize| rows.iter().map(|row| row[place].1).collect();
        reference.tails = (0..number).map(|place| Tails::new(column(place))).collect();
        reference
    }

    /// The vector of statistics: the contrasts, the delay and the misfit, then the farthest of each field. `is_own` for one that
    /// the reference was made from.
    fn values(&self, of: &Statistics, is_own: bool) -> Vec<(Statistic, f64)> {
        let contrasts = of.contrasts.iter().enumerate();
        let contrasts =
            contrasts.map(|(subject, found)| (Statistic::Contrast(subject), found.max(0.01).ln()));
        let mut all: Vec<(Statistic, f64)> = contrasts.collect();
        all.push((Statistic::Delay, of.delay_s));
        all.push((Statistic::Misfit, of.misfit));
        // The last blocks are those of the whole recording.
        let stays = of.beyond.len().saturating_sub(BLOCKS);
        for range in [0..stays, stays..of.beyond.len()] {
            let [up, down] = [1.0, -1.0].map(|sign| {
                let (spreads, values) = (&self.beyond[range.clone()], &of.beyond[range.clone()]);
                let (place, far) = farthest(spreads, values, sign, is_own);
                (range.start + place, far)
            });
            all.push((Statistic::Extra(up.0), up.1));
            all.push((Statistic::Missing(down.0), down.1));
        }
        let (_, far) = farthest(&self.likeness, &unlikeness(of), 1.0, is_own);
        all.push((Statistic::Alternative, far));
        all
    }

    /// How far each statistic of another recording is off.
    fn distances(&self, of: &Statistics) -> impl Iterator<Item = (Statistic, f64)> {
        let values = self.values(of, false).into_iter().zip(&self.tails);
        values.map(|((what, value), tails)| {
            let either_way = matches!(what, Statistic::Delay | Statistic::Contrast(_));
            let below = if either_way {
                tails.beyond(-1.0, value)
            } else {
                f64::NEG_INFINITY
            };
            (what, tails.beyond(1.0, value).max(below))
        })
    }

    /// What is farthest off, and how far.
    pub(crate) fn distance(&self, of: &Statistics) -> (Statistic, f64) {
        let farthest = self.distances(of).max_by(|a, b| a.1.total_cmp(&b.1));
        farthest.unwrap_or((Statistic::Misfit, 0.0))
    }

    /// What to say is off: the farthest. That it looks like an alternative is only said if nothing else is far: a person elsewhere
    /// looks like many.
    pub(crate) fn cause(&self, of: &Statistics, is_far: &impl Fn(f64) -> bool) -> Statistic {
        let far = self.distances(of).filter(|(_, distance)| is_far(*distance));
        let far = far.filter(|(what, _)| *what != Statistic::Alternative);
        let farthest = far.max_by(|a, b| a.1.total_cmp(&b.1));
        farthest.unwrap_or(self.distance(of)).0
    }

    /// How far off warmth beyond the scene is.
    pub(crate) fn extra(&self, of: &Statistics) -> f64 {
        let extra = self.distances(of);
        let extra = extra.filter(|(what, _)| matches!(what, Statistic::Extra(_)));
        extra.map(|(_, distance)| distance).fold(0.0, f64::max)
    }

    /// The delay that all but .5 % of right recordings show, seconds.
    pub(crate) fn delay_s(&self, subjects: usize) -> [f64; 2] {
        self.tails[subjects].range(1)
    }

    /// The contrasts that all but .5 % of right recordings show.
    pub(crate) fn contrasts(&self, subjects: usize) -> impl Iterator<Item = [f64; 2]> {
        let tails = self.tails.iter().take(subjects);
        tails.map(move |tails| tails.range(subjects).map(f64::exp))
    }

    pub(crate) fn has_off_contrast(&self, of: &Statistics) -> bool {
        let found = of.contrasts.iter();
        let mut all = found.zip(self.contrasts(of.contrasts.len()));
        all.any(|(found, range)| is_outside(*found, range))
    }

    /// What is farthest off, in words.
    pub(crate) fn in_words(
        &self,
        what: Statistic,
        of: &Statistics,
        model: &Model,
        film: &Film,
    ) -> String {
        match what {
            Statistic::Delay => {
                let word = if of.delay_s < 0.0 { "earlier" } else { "later" };
                let by = fixed(of.delay_s.abs(), 2);
                format!("it is {by} s {word} than the scene")
            }
            Statistic::Misfit => "it differs from the scene all over".to_owned(),
            Statistic::Extra(index) | Statistic::Missing(index) => {
                let (stretch, row, column) = model.block(index);
                let root = count(stretch.len()).sqrt();
                let by_c = (f64::from(of.beyond[index]) - self.beyond[index].mean()) / root;
                let when = match stretch.len() == film.len() {
                    true => "all the time".to_owned(),
                    false => {
                        let second = fixed(film.times_s[stretch.start], 1);
                        format!("at second {second} of the scene")
                    }
                };
                format!(
                    "{when}, rows {} and {}, columns {} and {} are {} °C {} than the scene",
                    row + 1,
                    row + 2,
                    column + 1,
                    column + 2,
                    fixed(by_c.abs(), 1),
                    if by_c > 0.0 { "warmer" } else { "colder" }
                )
            }
            Statistic::Contrast(subject) => {
                let name = film.people.get(subject);
                let name = name.map(|person| format!("`{}`", person.name));
                let name = name.unwrap_or("what is warm".to_owned());
                let times = fixed(of.contrasts[subject], 2);
                let why = match of.contrasts[subject] < ABSENT {
                    true => ": it is not where or when the scene has it",
                    false => "",
                };
                format!("{name} has {times} times the scene's contrast{why}")
            }
            Statistic::Alternative => {
                // Farther below 0 than the alternative itself, it is neither.
                let near = of.likeness.iter().zip(&model.differences);
                let near = near.filter(|(likeness, _)| **likeness < LIKE);
                match near.min_by(|a, b| a.0.abs().total_cmp(&b.0.abs())) {
                    None => "it does not look like the scene".to_owned(),
                    Some((_, one)) => format!("it looks more like {}", one.from.in_words(film)),
                }
            }
        }
    }
}

/// So that more is farther from the scene.
fn unlikeness(of: &Statistics) -> Vec<f32> {
    let likeness = of.likeness.iter();
    likeness.map(|one| single(-one.max(UNLIKE))).collect()
}

/// The value of a field that is farthest off, in its standard deviations.
fn farthest(spreads: &[Spread], values: &[f32], sign: f64, is_own: bool) -> (usize, f64) {
    let all = spreads.iter().zip(values).enumerate();
    let all = all.map(|(place, (spread, value))| (place, spread.off(*value, sign, is_own)));
    all.fold((0, f64::NEG_INFINITY), |far, one| match one.1 > far.1 {
        true => one,
        false => far,
    })
}

impl Spread {
    /// Of each value of a field.
    fn of_all(fields: &[&[f32]]) -> Vec<Self> {
        let number = fields.first().map_or(0, |field| field.len());
        let column = |place: usize| fields.iter().map(|field| field[place]).collect();
        (0..number).map(|place| Self::new(column(place))).collect()
    }

    fn new(mut values: Vec<f32>) -> Self {
        let double = || values.iter().map(|value| f64::from(*value));
        let sum = double().sum();
        let squares = double().map(|value| value * value).sum();
        let ends = [1.0_f32, -1.0].map(|sign| {
            let farthest = FARTHEST.min(values.len() - 1);
            let order = |a: &f32, b: &f32| (sign * b).total_cmp(&(sign * a));
            let (far, next, _) = values.select_nth_unstable_by(farthest, order);
            let far = || far.iter().map(|value| f64::from(sign * value));
            End {
                sum: far().sum(),
                last: far().fold(f64::INFINITY, f64::min),
                next: f64::from(sign * *next),
            }
        });
        Self {
            number: count(values.len()),
            sum,
            squares,
            ends,
        }
    }

    fn mean(&self) -> f64 {
        self.sum / self.number
    }

    /// How many standard deviations a value is off, upward or downward; `is_own` if it is one of these.
    fn off(&self, value: f32, sign: f64, is_own: bool) -> f64 {
        let value = f64::from(value);
        let [number, sum, squares] = match is_own {
            true => [
                self.number - 1.0,
                self.sum - value,
                self.squares - value * value,
            ],
            false => [self.number, self.sum, self.squares],
        };
        let mean = sum / number;
        let sd = (squares / number - mean * mean).max(0.0).sqrt();
        let end = &self.ends[usize::from(sign < 0.0)];
        let mut far = end.sum;
        if is_own && sign * value >= end.last {
            far += end.next - sign * value;
        }
        let far = far / count(FARTHEST) - sign * mean;
        sign * (value - mean) / sd.max(far / FARTHEST_SDS).max(1e-6)
    }
}

impl Tails {
    fn new(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let at = |percent| -> f64 { percentile(&values, percent).unwrap_or(0.0) };
        let sd = (0.5 * (at(84) - at(16))).max(1e-6);
        // Of a normal law it is 0.4 standard deviations.
        let end = |sign, from| (from, excess(&values, sign, from).max(0.2 * sd));
        Self {
            middle: at(50),
            ends: [end(1.0, at(95)), end(-1.0, at(5))],
        }
    }

    /// The negative logarithm of the share that is so far off, by an exponential tail. It goes on falling below the middle, so
    /// that no two recordings tie.
    fn beyond(&self, sign: f64, value: f64) -> f64 {
        let (from, mean) = self.ends[usize::from(sign < 0.0)];
        let beyond = sign * (value - from);
        if beyond > 0.0 {
            return ONE_IN_TWENTY + beyond / mean;
        }
        let inside = sign * (value - self.middle) / (sign * (from - self.middle)).max(1e-9);
        ONE_IN_TWENTY * inside.min(1.0)
    }

    /// In which as many statistics as `of` all are, in all but .5 % of right recordings.
    fn range(&self, of: usize) -> [f64; 2] {
        // Of a normal law at .5 % over 1, 2, 3 and 4 (Bonferroni), over where its tail begins: noise makes one longer.
        const TAILS: [f64; 4] = [1.706, 1.838, 1.911, 1.962];
        let times = TAILS[of.clamp(1, TAILS.len()) - 1];
        let [(high, _), (low, _)] = self.ends;
        [low, high].map(|from| self.middle + times * (from - self.middle))
    }
}

/// How far values are beyond a limit in the mean, of those that are.
fn excess(values: &[f64], sign: f64, from: f64) -> f64 {
    let beyond = values.iter().map(|value| sign * (value - from));
    let beyond: Vec<f64> = beyond.filter(|beyond| *beyond > 0.0).collect();
    mean(&beyond).unwrap_or(0.0)
}

/// What one in a hundred of `number` values exceeds, of which those above `lowest` are given, sorted: by an exponential tail of
/// those beyond the highest twentieth, but no more than the highest, because some alternatives show nothing at all of the
/// scene.
pub(crate) fn one_in_a_hundred(above: &[f64], lowest: f64, number: usize) -> f64 {
    let twentieth = above.len().saturating_sub(number / 20);
    let from = match twentieth {
        0 => lowest,
        _ => above[twentieth - 1],
    };
    let beyond = &above[twentieth..];
    let hundreds = (100.0 * count(beyond.len()) / count(number)).max(1.0);
    let highest = above.last().copied().unwrap_or(lowest);
    let limit = from + hundreds.ln() * excess(beyond, 1.0, from);
    limit.min(highest).max(lowest)
}

pub(crate) fn is_outside(found: f64, [low, high]: [f64; 2]) -> bool {
    found < low || found > high
}
