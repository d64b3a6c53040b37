//! From worlds to a decision.

use crate::decision::alternative::Alternative;
use crate::decision::film::{Film, Image, add};
use crate::decision::judge::{Judge, Statistics};
use crate::decision::recording::Recording;
use crate::decision::world::Drawn;
use crate::numbers::{count, percentile};
use grideye_draw::text::fixed;
use grideye_scene::Laws;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// What a recording says about its scene, by recordings that could be: worlds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decision {
    /// Share of right worlds that are as far from the scene as the recording, or farther.
    pub right: f64,
    /// What is farthest off, in words.
    pub worst: String,
    /// By how many standard deviations of right worlds.
    pub worst_sds: f64,
    #[serde(skip)]
    pub(crate) cause: Cause,
    /// Of each person, or of all objects together.
    pub contrasts: Vec<Contrast>,
    /// How much later than the scene the recording is, seconds, and what all but .5 % of right worlds show.
    pub delay_s: f64,
    /// Lowest and highest.
    pub delay_range_s: [f64; 2],
    /// The smallest of [`OFFSETS_M`] by which the first person must be aside so that nine of ten recordings would not
    /// agree; `None` if none of them is.
    pub refused_aside_m: Option<f64>,
    /// What else the recording could show.
    pub alternatives: Vec<Alternatively>,
    /// Sum of squares of what the recording shows beyond the room, as a share of that of noise.
    pub excess: f64,
    /// How far the level of all pixels runs away from the scene's, beyond the slow drift that was removed, °C.
    pub drift_c: f64,
    /// Frames that it was judged by.
    pub frames: usize,
    /// Pictures that it was judged by, each the mean of neighboring frames if there are many.
    pub pictures: usize,
    /// Frames that resemble neither neighbor, left out.
    pub strays: usize,
}

/// How warm a person is over the room.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contrast {
    /// The person; `None` if there are only objects.
    pub of: Option<String>,
    /// In the recording, over the scene's.
    pub found: f64,
    /// Of all but .5 % of right worlds: lowest and highest.
    pub range: [f64; 2],
}

/// Whether something else than the scene explains the recording too.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternatively {
    /// In words.
    pub what: String,
    #[serde(skip)]
    pub(crate) of: Alternative,
    /// 1 for the scene, 0 for the alternative, less what noise may add.
    pub likeness: f64,
    /// What worlds of the alternative stay below.
    pub limit: f64,
    /// Share of right worlds above that limit.
    pub power: f64,
    /// Whether the two differ by less than noise.
    pub is_alike: bool,
}

/// What is farthest off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cause {
    Contrast,
    Lag,
    Misfit,
    Extra,
    Missing,
    Alternative,
}

/// Right worlds: half set the law of each statistic, half its rank.
const RIGHT: usize = 400;
const OF_ALTERNATIVE: usize = 100;
/// Sum of squares beyond that of noise, as its share, that shows something.
const EMPTY: f64 = 0.2;
/// Worlds of each offset that is tried.
const OF_OFFSET: usize = 30;
/// Standard deviations by which an alternative that noise hides differs from the scene.
const ALIKE: f64 = 2.0;
/// Statistics before the contrasts and the alternatives.
const OWN: usize = 4;
/// Offsets that are tried for [`Decision::refused_aside_m`], meters.
pub const OFFSETS_M: [f64; 6] = [0.1, 0.15, 0.2, 0.3, 0.4, 0.5];

impl Decision {
    /// Whether the recording shows nothing but the room and noise.
    pub(crate) fn is_empty(&self) -> bool {
        self.excess < EMPTY
    }

    pub(crate) fn is_agreed(&self, right_min: f64) -> bool {
        self.right > right_min && self.off_contrast().is_none() && self.untold().next().is_none()
    }

    /// The contrast farthest out of its range, if any is out.
    pub(crate) fn off_contrast(&self) -> Option<&Contrast> {
        let off = |one: &&Contrast| one.found < one.range[0] || one.found > one.range[1];
        let by = |one: &Contrast| (one.range[0] / one.found.max(0.01)).max(one.found / one.range[1]);
        self.contrasts.iter().filter(off).max_by(|a, b| by(a).total_cmp(&by(b)))
    }

    /// Alternatives that the recording could come from too.
    pub(crate) fn untold(&self) -> impl Iterator<Item = &Alternatively> {
        self.alternatives.iter().filter(|one| !one.is_told() && one.counts())
    }

    /// Alternatives that noise makes the scene itself.
    pub(crate) fn alike(&self) -> impl Iterator<Item = &Alternatively> {
        self.alternatives.iter().filter(|one| !one.counts())
    }
}

impl Alternatively {
    /// Whether the recording excludes it.
    #[must_use]
    pub fn is_told(&self) -> bool {
        !self.is_alike && self.likeness > self.limit
    }

    /// Whether agreeing takes excluding it: a symmetric scene is the scene.
    #[must_use]
    pub fn counts(&self) -> bool {
        !self.is_alike || self.of == Alternative::Nobody
    }
}

pub(crate) fn decide(film: &mut Film, recording: &Recording, laws: &Laws, right_min: f64) -> Decision {
    let mut random = ChaCha8Rng::seed_from_u64(0x0064_6563_6964_6500);
    let unit = &recording.unit;
    let judge = Judge::new(film, laws, unit, &mut random);
    let mut errors: Vec<Vec<Image>> = Vec::with_capacity(OF_ALTERNATIVE);
    let right: Vec<Statistics> = (0..RIGHT)
        .map(|_| {
            let shown = Drawn::of(film, laws, &mut random).as_claimed(film);
            let error = unit.errors(film.len(), &mut random);
            let statistics = judge.of(&sum(shown, &error));
            if errors.len() < OF_ALTERNATIVE {
                errors.push(error);
            }
            statistics
        })
        .collect();
    let law = Law::new(&right[..RIGHT / 2]);
    let mut held: Vec<f64> = right[RIGHT / 2..].iter().map(|one| law.farthest(one).1).collect();
    held.sort_by(f64::total_cmp);
    let found = judge.of(&recording.pictures);
    let (place, off) = law.farthest(&found);
    let farther = held.iter().filter(|other| **other >= off).count();
    let mut alternatives = Vec::with_capacity(judge.rivals.len());
    for (number, rival) in judge.rivals.iter().enumerate() {
        let drawn = errors.iter().map(|error| {
            let drawn = Drawn::of(film, laws, &mut random);
            judge.likeness(number, &sum(rival.what.shown(film, &drawn), error))
        });
        let limit = drawn.fold(f64::NEG_INFINITY, f64::max);
        let above = right.iter().filter(|right| right.likeness[number] > limit).count();
        alternatives.push(Alternatively {
            what: rival.what.in_words(film),
            of: rival.what.clone(),
            likeness: found.likeness[number],
            limit,
            power: count(above) / count(RIGHT),
            is_alike: rival.apart < ALIKE,
        });
    }
    let refused = held[held.len() - 1 - (right_min * count(held.len() + 1)) as usize];
    let mut is_refused = |aside_m: f64, film: &mut Film| {
        let number = errors.len().min(OF_OFFSET);
        let not_agreed = errors.iter().take(number).enumerate().filter(|(index, error)| {
            let angle = std::f64::consts::TAU * count(*index) / count(number);
            let by_m = [aside_m * angle.cos(), aside_m * angle.sin()];
            let shown = Drawn::of(film, laws, &mut random).moved(0, by_m).as_claimed(film);
            let statistics = judge.of(&sum(shown, error));
            law.farthest(&statistics).1 > refused
                || alternatives
                    .iter()
                    .zip(&statistics.likeness)
                    .any(|(one, likeness)| one.counts() && *likeness <= one.limit)
        });
        count(not_agreed.count()) >= 0.9 * count(number)
    };
    let has_people = !film.people.is_empty();
    let mut offsets = OFFSETS_M.into_iter();
    let refused_aside_m = offsets.find(|aside_m| has_people && is_refused(*aside_m, film));
    let (cause, worst) = law.worst(place, &found, &judge, film);
    Decision {
        right: (count(farther) + 1.0) / (count(held.len()) + 1.0),
        worst,
        worst_sds: off,
        cause,
        contrasts: (0..found.contrasts.len())
            .map(|subject| Contrast {
                of: film.people.get(subject).map(|walker| walker.name.clone()),
                found: found.contrasts[subject],
                range: law.range(OWN + subject).map(f64::exp),
            })
            .collect(),
        delay_s: found.lag_s,
        delay_range_s: law.range(0),
        refused_aside_m,
        alternatives,
        excess: judge.excess(&recording.pictures),
        drift_c: film.drift_c(&recording.pictures),
        frames: recording.frames - recording.strays.len(),
        pictures: recording.pictures.len(),
        strays: recording.strays.len(),
    }
}

fn sum(mut shown: Vec<Image>, error: &[Image]) -> Vec<Image> {
    for (shown, error) in shown.iter_mut().zip(error) {
        add(shown, error, 1.0);
    }
    shown
}

/// The farthest of 200 draws of a normal law, in standard deviations.
const LONGEST_SDS: f32 = 2.75;

/// Location and scale of each statistic in right worlds.
struct Law {
    of: Vec<(f64, f64)>,
    /// Mean and scales upward and downward of the warmth beyond the scene in each stretch and block.
    beyond: Vec<(f32, [f32; 2])>,
}

impl Law {
    fn new(right: &[Statistics]) -> Self {
        let number = right.first().map_or(0, |one| one.beyond.len());
        let share = 1.0 / right.len() as f32;
        let beyond = (0..number).map(|index| {
            let values = || right.iter().map(|one| one.beyond[index]);
            let mean = share * values().sum::<f32>();
            let variance = share * values().map(|value| (value - mean).powi(2)).sum::<f32>();
            // Next to a person who may be elsewhere the law has long tails.
            let scale = |sign: f32| {
                let most = values().map(|value| sign * (value - mean)).fold(0.0, f32::max);
                variance.sqrt().max(most / LONGEST_SDS).max(1e-6)
            };
            (mean, [scale(1.0), scale(-1.0)])
        });
        let mut law = Self {
            beyond: beyond.collect(),
            of: Vec::new(),
        };
        let all = OWN + right.first().map_or(0, |one| one.contrasts.len() + one.likeness.len());
        law.of = (0..all)
            .map(|place| {
                let mut values: Vec<f64> = right.iter().map(|one| law.value(place, one)).collect();
                values.sort_by(f64::total_cmp);
                let at = |percent| -> f64 { percentile(&values, percent).unwrap_or(0.0) };
                (at(50), (0.5 * (at(84) - at(16))).max(1e-6))
            })
            .collect();
        law
    }

    /// The block farthest beyond the scene, in standard deviations.
    fn block(&self, statistics: &Statistics, sign: f32) -> (usize, f64) {
        let all = statistics.beyond.iter().zip(&self.beyond);
        let side = usize::from(sign < 0.0);
        let far = all.map(|(value, (mean, scales))| sign * (value - mean) / scales[side]);
        let far = far.enumerate().fold((0, f32::NEG_INFINITY), |far, one| if one.1 > far.1 { one } else { far });
        (far.0, f64::from(far.1))
    }

    /// Each statistic so that larger is farther from the scene; delay and contrasts may be off either way.
    fn value(&self, place: usize, statistics: &Statistics) -> f64 {
        let contrasts = statistics.contrasts.len();
        match place {
            0 => statistics.lag_s,
            1 => statistics.misfit,
            2 => self.block(statistics, 1.0).1,
            3 => self.block(statistics, -1.0).1,
            more if more < OWN + contrasts => statistics.contrasts[more - OWN].max(0.01).ln(),
            more => -statistics.likeness[more - OWN - contrasts],
        }
    }

    fn farthest(&self, statistics: &Statistics) -> (usize, f64) {
        let contrasts = OWN..OWN + statistics.contrasts.len();
        let off = self.of.iter().enumerate().map(|(place, (location, scale))| {
            let off = (self.value(place, statistics) - location) / scale;
            let is_either_way = place == 0 || contrasts.contains(&place);
            (place, if is_either_way { off.abs() } else { off })
        });
        off.fold((0, f64::NEG_INFINITY), |far, one| if one.1 > far.1 { one } else { far })
    }

    /// The range of all but .5 % of right worlds.
    fn range(&self, place: usize) -> [f64; 2] {
        const SDS: f64 = 2.807;
        let (location, scale) = self.of[place];
        [location - SDS * scale, location + SDS * scale]
    }

    fn worst(&self, place: usize, statistics: &Statistics, judge: &Judge, film: &Film) -> (Cause, String) {
        let warmer = |sign: f32| {
            let index = self.block(statistics, sign).0;
            let (stretch, row, column) = judge.block(index);
            let root = count(stretch.len()).sqrt();
            let by_c = f64::from(statistics.beyond[index] - self.beyond[index].0) / root;
            let (from, size) = (fixed(film.times_s[stretch.start], 1), fixed(by_c.abs(), 1));
            let word = if sign > 0.0 { "warmer" } else { "colder" };
            format!(
                "at second {from} of the scene, rows {} and {}, columns {} and {} are {size} °C {word} than the scene",
                row + 1,
                row + 2,
                column + 1,
                column + 2
            )
        };
        let contrasts = statistics.contrasts.len();
        match place {
            0 => {
                let (by, word) = match statistics.lag_s < 0.0 {
                    true => (-statistics.lag_s, "earlier"),
                    false => (statistics.lag_s, "later"),
                };
                (Cause::Lag, format!("it is {} s {word} than the scene", fixed(by, 2)))
            }
            1 => (Cause::Misfit, "it differs from the scene all over".to_owned()),
            2 => (Cause::Extra, warmer(1.0)),
            3 => (Cause::Missing, warmer(-1.0)),
            more if more < OWN + contrasts => {
                let subject = more - OWN;
                let times = fixed(statistics.contrasts[subject], 2);
                let name = film.people.get(subject).map(|walker| format!("`{}`", walker.name));
                let name = name.unwrap_or("what is warm".to_owned());
                (Cause::Contrast, format!("{name} has {times} times the scene's contrast"))
            }
            _ => {
                // Farther below 0 than the alternative itself, it is neither.
                let mut near: Vec<(f64, usize)> = statistics.likeness.iter().copied().zip(0..).collect();
                near.retain(|(likeness, _)| *likeness < LIKE);
                near.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
                let what = near.first().map(|(_, rival)| judge.rivals[*rival].what.in_words(film));
                let words = what.map_or_else(
                    || "it does not look like the scene".to_owned(),
                    |what| format!("it looks more like {what}"),
                );
                (Cause::Alternative, words)
            }
        }
    }
}

/// Likeness below which a recording looks more like an alternative than like the scene.
const LIKE: f64 = 0.3;
