//! From worlds to a decision.

use crate::decision::alternative::Alternative;
use crate::decision::film::{Film, Image, add};
use crate::decision::judge::{Judge, Statistics};
use crate::decision::law::Laws;
use crate::decision::recording::Recording;
use crate::decision::world::Drawn;
use crate::numbers::{count, percentile};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::ops::Range;

/// What a recording says about its scene.
#[derive(Debug, Clone)]
pub(crate) struct Decision {
    /// Share of right worlds that are as far from the scene as the recording, or farther.
    pub(crate) right: f64,
    /// What is farthest off, and by how many standard deviations of right worlds.
    pub(crate) worst: (Worst, f64),
    /// The recording's contrast over the scene's, and the range of 99.5 % of right worlds.
    pub(crate) contrast: f64,
    pub(crate) contrast_range: [f64; 2],
    pub(crate) lag_s: f64,
    pub(crate) lag_range_s: [f64; 2],
    pub(crate) alternatives: Vec<Told>,
}

/// Whether an alternative can be told from the scene.
#[derive(Debug, Clone)]
pub(crate) struct Told {
    pub(crate) what: Alternative,
    /// How much more the recording resembles the scene: 1 as the scene, 0 as the alternative, less what noise may add.
    pub(crate) likeness: f64,
    /// What worlds of the alternative stay below.
    pub(crate) limit: f64,
    /// Share of right worlds above that limit.
    pub(crate) power: f64,
    /// Whether the two differ by less than noise.
    pub(crate) is_alike: bool,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Worst {
    Contrast,
    Lag,
    Misfit,
    /// Pictures, and row and column of the upper left of four pixels.
    Extra(Range<usize>, usize, usize),
    Missing(Range<usize>, usize, usize),
    Alternative(Alternative),
}

/// Right worlds: half set the law of each statistic, half its rank.
const RIGHT: usize = 400;
const OF_ALTERNATIVE: usize = 100;
/// Standard deviations by which an alternative that noise hides differs from the scene.
const ALIKE: f64 = 2.0;
/// Statistics before those of the alternatives.
const OWN: usize = 5;

impl Decision {
    /// Whether the recording is hardly one of the scene's.
    pub(crate) fn is_refused(&self) -> bool {
        const RIGHT_MIN: f64 = 0.015;
        let [low, high] = self.contrast_range;
        self.right <= RIGHT_MIN || !(low..=high).contains(&self.contrast)
    }

    /// Alternatives that the recording could come from too.
    pub(crate) fn untold(&self) -> impl Iterator<Item = &Told> {
        self.alternatives.iter().filter(|told| !told.is_told() && told.counts())
    }
}

impl Told {
    pub(crate) fn is_told(&self) -> bool {
        self.likeness > self.limit
    }

    /// Whether agreeing takes telling it apart: a symmetric scene is the scene.
    pub(crate) fn counts(&self) -> bool {
        !self.is_alike || self.what == Alternative::Nobody
    }
}

pub(crate) fn decide(film: &mut Film, recording: &Recording, laws: &Laws) -> Decision {
    let mut random = ChaCha8Rng::seed_from_u64(0x0064_6563_6964_6500);
    let unit = &recording.unit;
    let judge = Judge::new(film, laws, unit, &mut random);
    let mut errors: Vec<Vec<Image>> = Vec::with_capacity(OF_ALTERNATIVE);
    let right: Vec<Statistics> = (0..RIGHT)
        .map(|_| {
            let drawn = Drawn::of(film, laws, &mut random);
            let shown = drawn.shown(film, |_, index| index, |_, _| false);
            let error = unit.errors(film.len(), &mut random);
            let statistics = judge.of(&sum(shown, &error));
            if errors.len() < OF_ALTERNATIVE {
                errors.push(error);
            }
            statistics
        })
        .collect();
    let law = Law::new(&right[..RIGHT / 2]);
    let held: Vec<f64> = right[RIGHT / 2..].iter().map(|one| law.farthest(one).1).collect();
    let found = judge.of(&recording.pictures);
    let (place, off) = law.farthest(&found);
    let farther = held.iter().filter(|other| **other >= off).count();
    let alternatives = judge.rivals.iter().enumerate().map(|(number, rival)| {
        let drawn = errors.iter().map(|error| {
            let drawn = Drawn::of(film, laws, &mut random);
            judge.likeness(number, &sum(rival.what.shown(film, &drawn), error))
        });
        let limit = drawn.fold(f64::NEG_INFINITY, f64::max);
        let above = right.iter().filter(|right| right.likeness[number] > limit).count();
        Told {
            what: rival.what.clone(),
            likeness: found.likeness[number],
            limit,
            power: count(above) / count(RIGHT),
            is_alike: rival.apart < ALIKE,
        }
    });
    let alternatives = alternatives.collect();
    Decision {
        right: (count(farther) + 1.0) / (count(held.len()) + 1.0),
        worst: (law.named(place, &found, &judge), off),
        contrast: found.contrast,
        contrast_range: law.range(0).map(f64::exp),
        lag_s: found.lag_s,
        lag_range_s: law.range(1),
        alternatives,
    }
}

fn sum(mut shown: Vec<Image>, error: &[Image]) -> Vec<Image> {
    for (shown, error) in shown.iter_mut().zip(error) {
        add(shown, error, 1.0);
    }
    shown
}

/// Location and scale of each statistic in right worlds.
struct Law {
    of: Vec<(f64, f64)>,
    beyond: Vec<(f32, f32)>,
}

impl Law {
    fn new(right: &[Statistics]) -> Self {
        let number = right.first().map_or(0, |one| one.beyond.len());
        let share = 1.0 / right.len() as f32;
        let beyond = (0..number).map(|index| {
            let values = || right.iter().map(|one| one.beyond[index]);
            let mean = share * values().sum::<f32>();
            let variance = share * values().map(|value| (value - mean).powi(2)).sum::<f32>();
            (mean, variance.sqrt().max(1e-6))
        });
        let mut law = Self {
            beyond: beyond.collect(),
            of: Vec::new(),
        };
        let all = OWN + right.first().map_or(0, |one| one.likeness.len());
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
        let far = all.map(|(value, (mean, sd))| sign * (value - mean) / sd);
        let far = far.enumerate().fold((0, f32::NEG_INFINITY), |far, one| if one.1 > far.1 { one } else { far });
        (far.0, f64::from(far.1))
    }

    /// Each statistic so that larger is farther from the scene; the first two may be off either way.
    fn value(&self, place: usize, statistics: &Statistics) -> f64 {
        match place {
            0 => statistics.contrast.max(0.01).ln(),
            1 => statistics.lag_s,
            2 => statistics.misfit,
            3 => self.block(statistics, 1.0).1,
            4 => self.block(statistics, -1.0).1,
            more => -statistics.likeness[more - OWN],
        }
    }

    fn farthest(&self, statistics: &Statistics) -> (usize, f64) {
        let off = self.of.iter().enumerate().map(|(place, (location, scale))| {
            let off = (self.value(place, statistics) - location) / scale;
            (place, if place < 2 { off.abs() } else { off })
        });
        off.fold((0, f64::NEG_INFINITY), |far, one| if one.1 > far.1 { one } else { far })
    }

    /// The range of all but .5 % of right worlds.
    fn range(&self, place: usize) -> [f64; 2] {
        const SDS: f64 = 2.807;
        let (location, scale) = self.of[place];
        [location - SDS * scale, location + SDS * scale]
    }

    fn named(&self, place: usize, statistics: &Statistics, judge: &Judge) -> Worst {
        let block = |sign| judge.block(self.block(statistics, sign).0);
        match place {
            0 => Worst::Contrast,
            1 => Worst::Lag,
            2 => Worst::Misfit,
            3 => {
                let (stretch, row, column) = block(1.0);
                Worst::Extra(stretch, row, column)
            }
            4 => {
                let (stretch, row, column) = block(-1.0);
                Worst::Missing(stretch, row, column)
            }
            more => Worst::Alternative(judge.rivals[more - OWN].what.clone()),
        }
    }
}
