//! How the statistics of right worlds spread, and what is farthest off.

use crate::constants::{ABSENT, LIKE_MIN, LIKENESS_LEAST};
use crate::decision::model::{BLOCKS, Model, Statistics};
use crate::decision::view::View;
use crate::numbers::{count, mean, percentile, single};
use grideye_draw::text::fixed;

/// One statistic of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Statistic {
    Lag,
    Misfit,
    /// The block that is farthest warmer, or colder, than the scene: of a stretch, or all the time.
    Block {
        is_warmer: bool,
        stays: bool,
    },
    /// The warmest block of each stretch, in the mean: somebody who goes about, a little in each.
    Somewhere,
    /// Of a subject.
    Contrast(usize),
    /// To the scene rather than to an alternative.
    Likeness(usize),
}

/// Kinds of statistics: of what the scene explains; of blocks; of alternatives.
const KINDS: usize = 3;

impl Statistic {
    /// All that a recording has.
    fn all(of: &Statistics) -> Vec<Self> {
        let mut all = vec![Self::Lag, Self::Misfit, Self::Somewhere];
        for stays in [false, true] {
            all.extend([true, false].map(|is_warmer| Self::Block { is_warmer, stays }));
        }
        all.extend((0..of.contrasts.len()).map(Self::Contrast));
        all.extend((0..of.likeness.len()).map(Self::Likeness));
        all
    }

    fn kind(self) -> usize {
        match self {
            Self::Lag | Self::Misfit | Self::Contrast(_) => 0,
            Self::Block { .. } | Self::Somewhere => 1,
            Self::Likeness(_) => 2,
        }
    }

    /// Whether it may be off either way; of the others, larger is farther from the scene.
    fn is_either_way(self) -> bool {
        matches!(self, Self::Lag | Self::Contrast(_))
    }
}

/// How surprising what one in twenty exceeds is: ln 20.
const ONE_IN_TWENTY: f64 = 2.996;

/// The distribution of one statistic in right worlds.
#[derive(Clone, Copy)]
struct Distribution {
    middle: f64,
    /// What one in twenty exceeds upward and downward, and how far these are beyond it in the mean.
    tails: [(f64, f64); 2],
}

impl Distribution {
    fn new(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let at = |percent| -> f64 { percentile(&values, percent).unwrap_or(0.0) };
        let sd = (0.5 * (at(84) - at(16))).max(1e-6);
        // Of a normal law it is 0.4 standard deviations.
        let tail = |sign, from| (from, excess(&values, sign, from).max(0.2 * sd));
        Self {
            middle: at(50),
            tails: [tail(1.0, at(95)), tail(-1.0, at(5))],
        }
    }

    /// How surprising so high a value is: the negative logarithm of the share that is, by an exponential tail. It goes
    /// on falling below the middle, so that no two recordings tie.
    fn surprise(&self, sign: f64, value: f64) -> f64 {
        let (from, mean) = self.tails[usize::from(sign < 0.0)];
        let further = sign * (value - from);
        if further > 0.0 {
            return ONE_IN_TWENTY + further / mean;
        }
        let inside = sign * (value - self.middle) / (sign * (from - self.middle)).max(1e-9);
        ONE_IN_TWENTY * inside.min(1.0)
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

/// Of right worlds, the farthest that set the scale of a block by their mean. The very farthest varies by a seventh, and in a
/// few of so many blocks it is half too far.
const FARTHEST: usize = 8;
/// How far these are in the mean, of 260 draws of a normal law, in standard deviations.
const FARTHEST_SDS: f32 = 2.23;

/// Location and scale of each statistic in right worlds.
pub(crate) struct Spread {
    of: Vec<(Statistic, Distribution)>,
    /// Of the most surprising statistic of each kind.
    kinds: [Distribution; KINDS],
    /// Mean and scales upward and downward of the warmth beyond the scene in each stretch and block.
    blocks: Vec<(f32, [f32; 2])>,
}

impl Spread {
    /// The law of a kind is of other worlds than those of its statistics, and theirs than the scales of blocks: within their
    /// own worlds nothing would be far.
    pub(crate) fn new(of_statistics: &[Statistics], of_kinds: &[Statistics]) -> Self {
        let number = of_statistics.first().map_or(0, |one| one.blocks.len());
        let share = single(1.0 / count(of_statistics.len()));
        let blocks = (0..number).map(|index| {
            let values = || of_statistics.iter().map(|one| one.blocks[index]);
            let mean = share * values().sum::<f32>();
            let variance = share * values().map(|value| (value - mean).powi(2)).sum::<f32>();
            // Next to a person who may be elsewhere the law has long tails.
            let scale = |sign: f32| {
                let mut away: Vec<f32> = values().map(|value| sign * (value - mean)).collect();
                let (farthest, ..) = away.select_nth_unstable_by(FARTHEST, |a, b| b.total_cmp(a));
                let farthest = farthest.iter().sum::<f32>() / single(count(FARTHEST));
                variance.sqrt().max(farthest / FARTHEST_SDS).max(1e-6)
            };
            (mean, [scale(1.0), scale(-1.0)])
        });
        let mut spread = Self {
            blocks: blocks.collect(),
            of: Vec::new(),
            kinds: [Distribution::new(Vec::new()); KINDS],
        };
        let all = of_statistics
            .first()
            .map(Statistic::all)
            .unwrap_or_default();
        let distribution = |statistic: Statistic| {
            // The five of blocks are too few to be far in their own worlds.
            let worlds = match statistic {
                Statistic::Block { .. } | Statistic::Somewhere => of_kinds,
                _ => of_statistics,
            };
            let values = worlds.iter().map(|one| spread.value(statistic, one));
            (statistic, Distribution::new(values.collect()))
        };
        spread.of = all.into_iter().map(distribution).collect();
        let of_kinds = of_kinds.iter();
        let all: Vec<_> = of_kinds.map(|one| spread.farthest_by_kind(one)).collect();
        spread.kinds = std::array::from_fn(|kind| {
            Distribution::new(all.iter().map(|farthest| farthest[kind].1).collect())
        });
        spread
    }

    /// The block farthest beyond the scene, in standard deviations.
    fn block(&self, statistics: &Statistics, is_warmer: bool, stays: bool) -> (usize, f64) {
        let sign = if is_warmer { 1.0 } else { -1.0 };
        // The last blocks are those of the whole recording.
        let first = statistics.blocks.len().saturating_sub(BLOCKS);
        let all = statistics.blocks.iter().zip(&self.blocks).enumerate();
        let all = all.filter(|(index, _)| (*index >= first) == stays);
        let far = all.map(|(index, (value, (mean, scales)))| {
            (
                index,
                f64::from(sign * (value - mean) / scales[usize::from(sign < 0.0)]),
            )
        });
        far.fold((0, f64::NEG_INFINITY), farther)
    }

    /// How far the warmest block of each stretch is beyond the scene, in standard deviations, in the mean.
    fn somewhere(&self, statistics: &Statistics) -> f64 {
        let blocks = statistics.blocks.chunks(BLOCKS);
        let stretches = blocks.zip(self.blocks.chunks(BLOCKS));
        let number = (statistics.blocks.len() / BLOCKS).saturating_sub(1);
        let warmest = stretches.take(number).map(|(blocks, laws)| {
            let far = blocks.iter().zip(laws);
            let far = far.map(|(value, (mean, scales))| (value - mean) / scales[0]);
            f64::from(far.fold(f32::NEG_INFINITY, f32::max))
        });
        warmest.sum::<f64>() / count(number.max(1))
    }

    fn value(&self, statistic: Statistic, of: &Statistics) -> f64 {
        match statistic {
            Statistic::Lag => of.lag_s,
            Statistic::Misfit => of.misfit,
            Statistic::Block { is_warmer, stays } => self.block(of, is_warmer, stays).1,
            Statistic::Somewhere => self.somewhere(of),
            Statistic::Contrast(subject) => of.contrasts[subject].max(0.01).ln(),
            Statistic::Likeness(alternative) => -of.likeness[alternative].max(LIKENESS_LEAST),
        }
    }

    /// The most surprising statistic, and how surprising it is beside the most surprising of its kind in right worlds.
    pub(crate) fn farthest(&self, statistics: &Statistics) -> (Statistic, f64) {
        let far = self.farthest_by_kind(statistics);
        let far = far.into_iter().zip(&self.kinds);
        far.map(|((statistic, off), kind)| (statistic, kind.surprise(1.0, off)))
            .fold((Statistic::Lag, f64::NEG_INFINITY), farther)
    }

    fn farthest_by_kind(&self, statistics: &Statistics) -> [(Statistic, f64); KINDS] {
        let mut far = [(Statistic::Lag, f64::NEG_INFINITY); KINDS];
        for (statistic, distribution) in &self.of {
            let value = self.value(*statistic, statistics);
            let mut surprise = distribution.surprise(1.0, value);
            if statistic.is_either_way() {
                surprise = surprise.max(distribution.surprise(-1.0, value));
            }
            let kind = &mut far[statistic.kind()];
            *kind = farther(*kind, (*statistic, surprise));
        }
        far
    }

    /// The contrasts that all but .5 % of right worlds show.
    pub(crate) fn contrasts(&self, of: &Statistics) -> impl Iterator<Item = [f64; 2]> {
        let number = of.contrasts.len();
        (0..number).map(move |subject| {
            let statistic = Statistic::Contrast(subject);
            self.range(statistic, number).map(f64::exp)
        })
    }

    /// The delays that all but .5 % of right worlds show.
    pub(crate) fn delays(&self) -> [f64; 2] {
        self.range(Statistic::Lag, 1)
    }

    pub(crate) fn has_off_contrast(&self, of: &Statistics) -> bool {
        let mut all = of.contrasts.iter().zip(self.contrasts(of));
        all.any(|(found, range)| is_outside(*found, range))
    }

    /// The range of a statistic that `of` share alike: all of them are in theirs in all but .5 % of right worlds.
    fn range(&self, statistic: Statistic, of: usize) -> [f64; 2] {
        // Of a normal law at .5 % over 1, 2, 3 and 4 (Bonferroni), over where its tail begins: noise makes one longer.
        const TAILS: [f64; 4] = [1.706, 1.838, 1.911, 1.962];
        let times = TAILS[of.clamp(1, TAILS.len()) - 1];
        let found = self.of.iter().find(|(other, _)| *other == statistic);
        let Some((_, Distribution { middle, tails })) = found else {
            return [f64::NEG_INFINITY, f64::INFINITY];
        };
        let [(high, _), (low, _)] = tails;
        [low, high].map(|from| middle + times * (from - middle))
    }

    /// What is farthest off, in words.
    pub(crate) fn worst(&self, statistics: &Statistics, model: &Model, view: &View) -> String {
        let block = |is_warmer, stays| {
            let index = self.block(statistics, is_warmer, stays).0;
            let (stretch, row, column) = model.block(index);
            let root = count(stretch.len()).sqrt();
            let by_c = f64::from(statistics.blocks[index] - self.blocks[index].0) / root;
            let size = fixed(by_c.abs(), 1);
            let when = match stretch.len() == view.len() {
                true => "all the time".to_owned(),
                false => format!("at second {}", fixed(view.times_s[stretch.start], 1)),
            };
            let word = if is_warmer { "warmer" } else { "colder" };
            format!(
                "the pixels in rows {} and {} and columns {} and {} are {size} °C {word} than in the scene, {when}",
                row + 1,
                row + 2,
                column + 1,
                column + 2
            )
        };
        match self.farthest(statistics).0 {
            Statistic::Lag => {
                let (by, word) = match statistics.lag_s < 0.0 {
                    true => (-statistics.lag_s, "earlier"),
                    false => (statistics.lag_s, "later"),
                };
                format!("the recording is {} s {word} than the scene", fixed(by, 2))
            }
            Statistic::Misfit => "the whole image differs from the scene".to_owned(),
            Statistic::Block { is_warmer, stays } => block(is_warmer, stays),
            Statistic::Somewhere => format!(
                "again and again some pixels are warmer than in the scene; most of all, {}",
                block(true, false)
            ),
            Statistic::Contrast(subject) => {
                let walker = view.people.get(subject);
                let name = walker.map(|walker| walker.name.as_str());
                contrast_in_words(name, statistics.contrasts[subject])
            }
            Statistic::Likeness(_) => likest(statistics, model, view),
        }
    }
}

/// The contrast of this person, or of all objects, as a sentence without its end.
pub(crate) fn contrast_in_words(person: Option<&str>, found: f64) -> String {
    let name = person.map_or("what is warm".to_owned(), |name| format!("`{name}`"));
    let times = format!("{} times the scene's", fixed(found, 2));
    match found < ABSENT {
        true => {
            format!("{name} is not where or when the scene says: the contrast there is {times}")
        }
        false => format!("the contrast of {name} to the room is {times}"),
    }
}

/// The alternative that a recording looks like most.
fn likest(statistics: &Statistics, model: &Model, view: &View) -> String {
    // Farther below 0 than the alternative itself, it is neither.
    let near = statistics.likeness.iter().zip(&model.hypotheses);
    let near = near.filter(|(likeness, _)| **likeness < LIKE_MIN);
    match near.min_by(|a, b| a.0.abs().total_cmp(&b.0.abs())) {
        None => "the recording does not look like the scene".to_owned(),
        Some((_, hypothesis)) => format!(
            "the recording looks more like {} than like the scene",
            hypothesis.what.in_words(view)
        ),
    }
}

fn farther<T>(far: (T, f64), one: (T, f64)) -> (T, f64) {
    if one.1 > far.1 { one } else { far }
}

pub(crate) fn is_outside(found: f64, [low, high]: [f64; 2]) -> bool {
    found < low || found > high
}
