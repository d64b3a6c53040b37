//! From a recording and the worlds of its scene to what it can and cannot be.

use crate::decision::alternative::Alternative;
use crate::decision::film::{Film, Image};
use crate::decision::law::Laws;
use crate::decision::template::{Hiding, Template, centered};
use crate::decision::world::{Drawn, Unit, add};
use crate::numbers::{count, percentile};
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What a recording says about its scene.
#[derive(Debug, Clone)]
pub(crate) struct Decision {
    /// Share of right worlds that are as far from the scene as the recording, or farther.
    pub(crate) right: f64,
    /// What is farthest off, and by how many standard deviations of right worlds.
    pub(crate) worst: (Worst, f64),
    /// The recording's contrast over the scene's, and the range of 99 % of right worlds.
    pub(crate) contrast: f64,
    pub(crate) contrast_range: [f64; 2],
    pub(crate) lag_s: f64,
    pub(crate) alternatives: Vec<Told>,
}

/// Whether an alternative can be told from the scene.
#[derive(Debug, Clone)]
pub(crate) struct Told {
    pub(crate) what: Alternative,
    /// 1 for the scene, 0 for the alternative.
    pub(crate) likeness: f64,
    /// What 99 % of the alternative's worlds stay below.
    pub(crate) limit: f64,
    /// Share of right worlds above that limit.
    pub(crate) power: f64,
    /// Whether the two differ by less than noise.
    pub(crate) is_alike: bool,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Worst {
    Contrast,
    Misfit,
    Extra,
    Missing,
    Alternative(Alternative),
}

/// Right worlds: half set location and scale of each statistic, half its rank.
const RIGHT: usize = 400;
const OF_ALTERNATIVE: usize = 100;
const FOR_MEAN: usize = 24;
const LAG_STEP_S: f64 = 0.1;
/// `W` of a difference below which noise hides it: two standard deviations.
const ALIKE: f64 = 4.0;
/// Warmth that the scene lacks or claims too much is sought in stretches of this length, seconds.
const STRETCH_S: f64 = 1.0;

struct Judge {
    hiding: Hiding,
    /// By lag: the scene, and for each alternative the difference, its half sum's product with it.
    scene: Vec<Template>,
    alternatives: Vec<(Alternative, Vec<(Template, f64)>)>,
    lags_s: Vec<f64>,
    stretches: Vec<std::ops::Range<usize>>,
    scene_stretches: Vec<Vec<Image>>,
    own_share: [f64; PIXELS],
}

struct Statistics {
    lag: usize,
    contrast: f64,
    misfit: f64,
    extra: f64,
    missing: f64,
    likeness: Vec<f64>,
}

pub(crate) fn decide(
    film: &mut Film,
    recording: &[Image],
    laws: &Laws,
    unit: &Unit,
    lag_max_s: f64,
) -> Decision {
    let mut random = ChaCha8Rng::seed_from_u64(0x0064_6563_6964_6500);
    let judge = Judge::new(film, laws, unit, lag_max_s, &mut random);
    let right: Vec<Statistics> = (0..RIGHT)
        .map(|_| {
            let drawn = Drawn::of(film, laws, &mut random);
            let shown = drawn.shown(film, |_, index| index);
            judge.of(&unit.records(&shown, &mut random))
        })
        .collect();
    let (known, held) = right.split_at(RIGHT / 2);
    let laws_of: Vec<(f64, f64)> = (0..judge.number())
        .map(|place| {
            let values = sorted(known.iter().map(|statistics| statistics.badness(place)));
            let at = |percent| -> f64 { percentile(&values, percent).unwrap_or(0.0) };
            (at(50), (0.5 * (at(84) - at(16))).max(1e-6))
        })
        .collect();
    let far = |statistics: &Statistics| {
        let sds = (0..judge.number()).map(|place| {
            let (location, scale) = laws_of[place];
            let off = (statistics.badness(place) - location) / scale;
            if place == 0 { off.abs() } else { off }
        });
        sds.enumerate().fold((0, f64::NEG_INFINITY), |far, one| if one.1 > far.1 { one } else { far })
    };
    let found = judge.of(recording);
    let (place, off) = far(&found);
    let farther = held.iter().filter(|statistics| far(statistics).1 >= off).count();
    let contrasts = sorted(right.iter().map(|statistics| statistics.contrast));
    let alternatives = judge.alternatives.iter().enumerate().map(|(number, (what, by_lag))| {
        let drawn = sorted((0..OF_ALTERNATIVE).map(|_| {
            let drawn = Drawn::of(film, laws, &mut random);
            let shown = what.shown(film, &drawn);
            judge.likeness(number, &unit.records(&shown, &mut random))
        }));
        let limit = percentile(&drawn, 99).unwrap_or(0.0);
        let above = held.iter().filter(|statistics| statistics.likeness[number] > limit).count();
        Told {
            what: what.clone(),
            likeness: found.likeness[number],
            limit,
            power: count(above) / count(held.len()),
            is_alike: by_lag.iter().all(|(difference, _)| difference.square < ALIKE),
        }
    });
    let alternatives = alternatives.collect();
    Decision {
        right: (count(farther) + 1.0) / (count(held.len()) + 1.0),
        worst: (judge.named(place), off),
        contrast: found.contrast,
        contrast_range: [1, 99].map(|percent| percentile(&contrasts, percent).unwrap_or(1.0)),
        lag_s: judge.lags_s[found.lag],
        alternatives,
    }
}

impl Judge {
    fn new(film: &mut Film, laws: &Laws, unit: &Unit, lag_max_s: f64, random: &mut ChaCha8Rng) -> Self {
        let hiding = Hiding::new(unit.noise_c, &unit.pattern_c);
        let all = Alternative::of(film, lag_max_s);
        // The same draws for all, with the scene's own contrast.
        let drawn: Vec<Drawn> = (0..FOR_MEAN)
            .map(|_| Drawn::of(film, laws, random).as_warm_as_claimed())
            .collect();
        let mean = |shown: &mut dyn FnMut(&Drawn) -> Vec<Image>| {
            let mut sum = vec![[0.0; PIXELS]; drawn.first().map_or(0, |first| shown(first).len())];
            for drawn in &drawn {
                for (sum, image) in sum.iter_mut().zip(shown(drawn)) {
                    add(sum, &image, 1.0 / FOR_MEAN as f32);
                }
            }
            sum
        };
        let scene = mean(&mut |drawn| drawn.shown(film, |_, index| index));
        let steps = (lag_max_s / LAG_STEP_S).floor() as i32;
        let moves = film.people.iter().any(|walker| walker.moves);
        let steps = if moves { steps } else { 0 };
        let lags_s: Vec<f64> = (-steps..=steps).map(|step| LAG_STEP_S * f64::from(step)).collect();
        let scenes: Vec<Vec<Image>> = lags_s.iter().map(|lag_s| later(&scene, &film.times_s, *lag_s)).collect();
        let alternatives = all.into_iter().filter_map(|what| {
            let picture = mean(&mut |drawn| what.shown(film, drawn));
            let by_lag: Vec<(Template, f64)> = lags_s
                .iter()
                .zip(&scenes)
                .map(|(lag_s, scene)| {
                    let other = later(&picture, &film.times_s, *lag_s);
                    let pair = || scene.iter().zip(&other);
                    let difference: Vec<Image> =
                        pair().map(|(a, b)| std::array::from_fn(|pixel| a[pixel] - b[pixel])).collect();
                    let middle: Vec<Image> =
                        pair().map(|(a, b)| std::array::from_fn(|pixel| 0.5 * (a[pixel] + b[pixel]))).collect();
                    let template = hiding.template(&difference);
                    let middle = template.product(&middle);
                    (template, middle)
                })
                .collect();
            let differs = by_lag.iter().any(|(template, _)| template.square > 1e-3);
            differs.then_some((what, by_lag))
        });
        let alternatives = alternatives.collect();
        let stretches = stretches(&film.times_s);
        Self {
            scene: scenes.iter().map(|scene| hiding.template(scene)).collect(),
            scene_stretches: scenes.iter().map(|scene| means(&centered(scene), &stretches)).collect(),
            own_share: hiding.own_share(film.len()),
            hiding,
            alternatives,
            lags_s,
            stretches,
        }
    }

    fn number(&self) -> usize {
        4 + self.alternatives.len()
    }

    fn named(&self, place: usize) -> Worst {
        match place {
            0 => Worst::Contrast,
            1 => Worst::Misfit,
            2 => Worst::Extra,
            3 => Worst::Missing,
            more => Worst::Alternative(self.alternatives[more - 4].0.clone()),
        }
    }

    fn lag(&self, recording: &[Image]) -> (usize, f64) {
        let products = self.scene.iter().map(|scene| scene.product(recording));
        let fits = products.zip(&self.scene).map(|(product, scene)| (product, product / scene.square.max(1e-9).sqrt()));
        let best = fits.enumerate().fold((0, 0.0, f64::NEG_INFINITY), |best, (lag, (product, fit))| {
            if fit > best.2 { (lag, product, fit) } else { best }
        });
        (best.0, best.1 / self.scene[best.0].square.max(1e-9))
    }

    fn likeness(&self, alternative: usize, recording: &[Image]) -> f64 {
        self.likeness_at(alternative, recording, self.lag(recording).0)
    }

    fn likeness_at(&self, alternative: usize, recording: &[Image], lag: usize) -> f64 {
        let (difference, middle) = &self.alternatives[alternative].1[lag];
        (difference.product(recording) - middle) / difference.square.max(1e-9) + 0.5
    }

    fn of(&self, recording: &[Image]) -> Statistics {
        let (lag, contrast) = self.lag(recording);
        let scene = &self.scene[lag];
        let all = self.hiding.square(recording);
        let left = all - contrast * contrast * scene.square;
        let (extra, missing) = self.left_over(recording, lag, contrast);
        Statistics {
            lag,
            contrast,
            misfit: left.max(1e-9).ln(),
            extra,
            missing,
            likeness: (0..self.alternatives.len())
                .map(|number| self.likeness_at(number, recording, lag))
                .collect(),
        }
    }

    /// The warmest and the coldest 2 x 2 pixels of any stretch, beyond scene and pattern, °C times the root of frames.
    fn left_over(&self, recording: &[Image], lag: usize, contrast: f64) -> (f64, f64) {
        let mut left = means(&centered(recording), &self.stretches);
        let mut mean = [0.0_f64; PIXELS];
        let frames = count(recording.len().max(1));
        for ((left, scene), stretch) in left.iter_mut().zip(&self.scene_stretches[lag]).zip(&self.stretches) {
            for pixel in 0..PIXELS {
                left[pixel] -= contrast as f32 * scene[pixel];
                mean[pixel] += f64::from(left[pixel]) * count(stretch.len()) / frames;
            }
        }
        let mut most = (0.0_f64, 0.0_f64);
        for (left, stretch) in left.iter().zip(&self.stretches) {
            let root = count(stretch.len()).sqrt();
            let at = |row: usize, column: usize| {
                let pixel = row * COLUMNS + column;
                f64::from(left[pixel]) - self.own_share[pixel] * mean[pixel]
            };
            for row in 0..ROWS - 1 {
                for column in 0..COLUMNS - 1 {
                    let sum = at(row, column) + at(row, column + 1) + at(row + 1, column) + at(row + 1, column + 1);
                    let value = 0.25 * root * sum;
                    most = (most.0.max(value), most.1.max(-value));
                }
            }
        }
        most
    }
}

impl Statistics {
    /// Each statistic so that larger is farther from the scene; the first may be off either way.
    fn badness(&self, place: usize) -> f64 {
        match place {
            0 => self.contrast.max(0.01).ln(),
            1 => self.misfit,
            2 => self.extra,
            3 => self.missing,
            more => -self.likeness[more - 4],
        }
    }
}

fn stretches(times_s: &[f64]) -> Vec<std::ops::Range<usize>> {
    let mut all = Vec::new();
    let mut first = 0;
    for index in 1..=times_s.len() {
        if index == times_s.len() || times_s[index] - times_s[first] >= STRETCH_S {
            all.push(first..index);
            first = index;
        }
    }
    all
}

fn means(frames: &[Image], stretches: &[std::ops::Range<usize>]) -> Vec<Image> {
    let mean = |stretch: &std::ops::Range<usize>| {
        let mut sum = [0.0; PIXELS];
        let share = 1.0 / stretch.len().max(1) as f32;
        frames[stretch.clone()].iter().for_each(|frame| add(&mut sum, frame, share));
        sum
    };
    stretches.iter().map(mean).collect()
}

/// A picture shown later.
fn later(picture: &[Image], times_s: &[f64], lag_s: f64) -> Vec<Image> {
    let last = picture.len().saturating_sub(1);
    let at = |time_s: &f64| {
        let time_s = time_s - lag_s;
        let after = times_s.partition_point(|other| *other < time_s).min(last);
        let before = after.saturating_sub(1);
        let (low, high) = (times_s[before], times_s[after]);
        let share = match high > low {
            true => ((time_s - low) / (high - low)).clamp(0.0, 1.0) as f32,
            false => 1.0,
        };
        let mut image = [0.0; PIXELS];
        add(&mut image, &picture[before], 1.0 - share);
        add(&mut image, &picture[after], share);
        image
    };
    times_s.iter().map(at).collect()
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}
