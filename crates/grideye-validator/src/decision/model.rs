//! Statistics of a recording beside a scene and its alternatives.

use crate::constants::{PRIOR, STRETCH_S};
use crate::decision::alternative::Alternative;
use crate::decision::builder::{Builder, Equations, FOR_MEAN, Hypothesis};
use crate::decision::displaced::Displaced;
use crate::decision::template::{NoiseModel, Template, centered};
use crate::decision::unit::Unit;
use crate::decision::view::{Image, View, add, less};
use crate::decision::world::{Drawn, World};
use crate::numbers::{count, single};
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use grideye_scene::Laws;
use rand_chacha::ChaCha8Rng;
use std::ops::Range;

/// Delays that are tried each way, in standard deviations.
const LAGS: i32 = 3;
/// Of a long recording there are as many stretches as these.
const STRETCHES_MOST: f64 = 300.0;
/// Blocks of 2 x 2 pixels, in a row and in all.
const ACROSS: usize = COLUMNS - 1;
pub(crate) const BLOCKS: usize = (ROWS - 1) * ACROSS;

/// The scene and its alternatives as templates, which recordings are held against: all less the scene's room.
pub(crate) struct Model {
    pub(crate) noise: NoiseModel,
    /// `W` of what all subjects show: of what changes, and of the mean picture.
    pub(crate) squares: [f64; 2],
    /// What each person adds, or the objects, by delay.
    subjects: Vec<Vec<Template>>,
    /// By delay: how they lie to each other and to the room.
    equations: Vec<Equations>,
    pub(crate) hypotheses: Vec<Hypothesis>,
    pub(crate) lags_s: Vec<f64>,
    stretches: Vec<Range<usize>>,
    /// What each subject adds, by delay and subject.
    pictures: Vec<Vec<Vec<Image>>>,
    displaced: Option<Displaced>,
    own_share: [f64; PIXELS],
}

/// How well the scene explains a recording.
#[derive(Debug, Clone, Default)]
struct Fit {
    lag: usize,
    contrasts: Vec<f64>,
    /// The one contrast of all that fits best.
    contrast: f64,
    explained: f64,
}

/// What a recording says of the scene.
#[derive(Debug, Clone)]
pub(crate) struct Statistics {
    /// For each person, or the objects.
    pub(crate) contrasts: Vec<f64>,
    pub(crate) lag_s: f64,
    /// What the scene leaves unexplained, in units of the recording's own noise, logarithm.
    pub(crate) misfit: f64,
    /// How much more it resembles the scene than each alternative: 1 as the scene, 0 as the alternative, less what noise
    /// may add.
    pub(crate) likeness: Vec<f64>,
    /// Warmth beyond the scene of each stretch and block, °C times the root of the pictures.
    pub(crate) blocks: Vec<f32>,
}

impl Model {
    pub(crate) fn new(view: &mut View, laws: &Laws, unit: &Unit, random: &mut ChaCha8Rng) -> Self {
        let noise = NoiseModel::new(unit);
        // The same draws for all, with the scene's own contrast.
        let mut worlds = Vec::with_capacity(FOR_MEAN);
        for _ in 0..FOR_MEAN / 2 {
            let two = Drawn::two_for_mean(view, laws, random);
            worlds.extend(two.map(|drawn| World::new(drawn, view)));
        }
        let step_s = laws.lag_sd_s;
        let lags = if view.has_movement() && step_s > 0.0 {
            LAGS
        } else {
            0
        };
        let lags_s: Vec<f64> = (-lags..=lags).map(|lag| step_s * f64::from(lag)).collect();
        let mut builder = Builder::new(view, &noise, &worlds, &lags_s);
        builder.move_people(view, laws);
        let hypotheses = Alternative::of(view, laws)
            .into_iter()
            .map(|what| builder.hypothesis(view, what))
            .collect();
        let stretches = view.stretches(STRETCH_S, STRETCHES_MOST);
        let centered_all =
            |all: Vec<Vec<Image>>| all.iter().map(|pictures| centered(pictures)).collect();
        Self {
            squares: noise.squares(&builder.shown),
            pictures: builder.pictures.into_iter().map(centered_all).collect(),
            displaced: builder.displaced,
            own_share: noise.own_share(view.len()),
            subjects: builder.subjects,
            equations: builder.equations,
            noise,
            hypotheses,
            lags_s,
            stretches,
        }
    }

    fn fit(&self, recording: &[Image]) -> Fit {
        let fits = (0..self.lags_s.len()).map(|lag| self.fit_at(recording, lag));
        let best = fits.max_by(|a, b| a.explained.total_cmp(&b.explained));
        best.unwrap_or_default()
    }

    fn fit_at(&self, recording: &[Image], lag: usize) -> Fit {
        let equations = &self.equations[lag];
        let products: Vec<f64> = self
            .subjects
            .iter()
            .map(|subject| subject[lag].product(recording))
            .collect();
        let contrasts = equations.solve(&products);
        let explained = contrasts.iter().zip(&products);
        let all: f64 = products.iter().sum();
        let square: f64 = equations.products.iter().flatten().sum();
        Fit {
            lag,
            contrast: (all + PRIOR) / (square + PRIOR),
            explained: explained
                .map(|(contrast, product)| contrast * product)
                .sum(),
            contrasts,
        }
    }

    /// 1, and the projection of what the scene leaves unexplained on the difference, in its own length.
    fn likeness_at(hypothesis: &Hypothesis, recording: &[Image], fit: &Fit) -> f64 {
        /// Noise adds more in one of a hundred recordings.
        const NOISE_SDS: f64 = 2.326;
        let (difference, products) = &hypothesis.difference[fit.lag];
        let subject = hypothesis.what.person();
        let s = subject.map_or(fit.contrast, |subject| fit.contrasts[subject]);
        let rooms = hypothesis.rooms.as_ref();
        let own_square = rooms.map_or(0.0, |(_, template)| template.square);
        let square = own_square + s * (2.0 * products.rooms + s * products.whole);
        if s <= 0.0 || square <= 0.0 {
            return f64::from(f32::MIN);
        }
        let shown = |with: &[f64]| -> f64 {
            let subjects = fit.contrasts.iter().zip(with);
            subjects.map(|(contrast, product)| contrast * product).sum()
        };
        let mut left = s * (difference.product(recording) - shown(&products.subjects));
        if let Some((subjects, template)) = rooms {
            left += template.product(recording) - shown(&subjects[fit.lag]);
        }
        1.0 + left / square - NOISE_SDS / square.sqrt()
    }

    /// How much more a recording resembles the scene than one alternative.
    pub(crate) fn likeness(&self, hypothesis: usize, recording: &[Image]) -> f64 {
        Self::likeness_at(
            &self.hypotheses[hypothesis],
            recording,
            &self.fit(recording),
        )
    }

    pub(crate) fn of(&self, recording: &[Image]) -> Statistics {
        let fit = self.fit(recording);
        let left = self.noise.square(recording) - fit.explained;
        let noise = self.noise.steps(recording);
        let likeness = self.hypotheses.iter();
        let likeness = likeness.map(|one| Self::likeness_at(one, recording, &fit));
        Statistics {
            lag_s: self.lag_s(recording, &fit),
            misfit: left.max(1e-9).ln() - noise.max(1e-9).ln(),
            likeness: likeness.collect(),
            blocks: self.blocks(recording, &fit),
            contrasts: fit.contrasts,
        }
    }

    /// The best delay, by a parabola through the best of those tried and its neighbors.
    fn lag_s(&self, recording: &[Image], best: &Fit) -> f64 {
        let middle_s = self.lags_s[best.lag];
        if best.lag == 0 || best.lag + 1 >= self.lags_s.len() {
            return middle_s;
        }
        let [before, after] =
            [best.lag - 1, best.lag + 1].map(|lag| self.fit_at(recording, lag).explained);
        let curve = before - 2.0 * best.explained + after;
        let step_s = self.lags_s[best.lag + 1] - middle_s;
        match curve < 0.0 {
            true => middle_s + step_s * (0.5 * (before - after) / curve).clamp(-0.5, 0.5),
            false => middle_s,
        }
    }

    fn blocks(&self, recording: &[Image], fit: &Fit) -> Vec<f32> {
        let mut left = centered(recording);
        for (contrast, pictures) in fit.contrasts.iter().zip(&self.pictures[fit.lag]) {
            for (left, adds) in left.iter_mut().zip(pictures) {
                add(left, adds, -single(*contrast));
            }
        }
        if let Some(displaced) = &self.displaced {
            left = displaced.unexplained(&left, &self.noise);
        }
        let left = means(&left, &self.stretches);
        let mut mean = [0.0_f64; PIXELS];
        let number = count(recording.len().max(1));
        for (left, stretch) in left.iter().zip(&self.stretches) {
            let share = count(stretch.len()) / number;
            for (mean, left) in mean.iter_mut().zip(left) {
                *mean += share * f64::from(*left);
            }
        }
        let own: Image = std::array::from_fn(|pixel| single(self.own_share[pixel] * mean[pixel]));
        let mut all = Vec::with_capacity(BLOCKS * (left.len() + 1));
        for (left, stretch) in left.iter().zip(&self.stretches) {
            push_blocks(&mut all, &less(left, &own), stretch.len());
        }
        // What stays all the time is beyond the scene if unit and room alone do not make it: rooms are warmer on one side.
        push_blocks(&mut all, &level(&mean), recording.len());
        all
    }

    /// The stretch and the upper left pixel of a block, row and column.
    pub(crate) fn block(&self, index: usize) -> (Range<usize>, usize, usize) {
        let block = index % BLOCKS;
        let (row, column) = (block / ACROSS, block % ACROSS);
        let all = 0..self.stretches.last().map_or(0, |last| last.end);
        let stretch = self.stretches.get(index / BLOCKS).cloned().unwrap_or(all);
        (stretch, row, column)
    }
}

/// Means of blocks of 2 x 2 pixels, °C, times the root of the pictures that they are the mean of.
fn push_blocks(all: &mut Vec<f32>, image: &Image, pictures: usize) {
    let share = single(0.25 * count(pictures).sqrt());
    for row in 0..ROWS - 1 {
        for column in 0..ACROSS {
            let first = row * COLUMNS + column;
            let below = first + COLUMNS;
            all.push(share * (image[first] + image[first + 1] + image[below] + image[below + 1]));
        }
    }
}

/// An image less its slope.
fn level(image: &[f64; PIXELS]) -> Image {
    let middle = |index: usize| count(index) - 0.5 * count(COLUMNS - 1);
    let at = |pixel: usize| [middle(pixel % COLUMNS), middle(pixel / COLUMNS)];
    let square: f64 = (0..PIXELS).map(|pixel| at(pixel)[0].powi(2)).sum();
    let slope = [0, 1].map(|axis| {
        let along = image.iter().enumerate();
        along
            .map(|(pixel, value)| at(pixel)[axis] * value)
            .sum::<f64>()
            / square
    });
    std::array::from_fn(|pixel| {
        let [x, y] = at(pixel);
        single(image[pixel] - slope[0] * x - slope[1] * y)
    })
}

fn means(pictures: &[Image], stretches: &[Range<usize>]) -> Vec<Image> {
    let mean = |stretch: &Range<usize>| {
        let mut sum = [0.0; PIXELS];
        let share = single(1.0 / count(stretch.len().max(1)));
        pictures[stretch.clone()]
            .iter()
            .for_each(|image| add(&mut sum, image, share));
        sum
    };
    stretches.iter().map(mean).collect()
}
