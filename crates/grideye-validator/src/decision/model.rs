//! A scene and its alternatives as templates, and the statistics of a recording beside them.

use crate::decision::alternative::Alternative;
use crate::decision::constants::{
    ALIKE, CLEAR_C, DELAYS, PEOPLE_MOST, PRIOR, QUARTER_M, STRETCH_S, STRETCHES_MOST,
};
use crate::decision::displacement::Displacement;
use crate::decision::film::Film;
use crate::decision::image::{Image, add_all, all_less, later, less};
use crate::decision::simulated::Simulated;
use crate::decision::template::{Template, Weights, centered, mean};
use crate::decision::unit::Unit;
use crate::linear::{self, Matrix, cholesky};
use crate::numbers::{count, median, single};
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use grideye_scene::Laws;
use std::ops::Range;

/// Blocks of 2 x 2 pixels, in a row and in all.
const ACROSS: usize = COLUMNS - 1;
pub(crate) const BLOCKS: usize = (ROWS - 1) * ACROSS;

/// What recordings are compared with.
pub(crate) struct Model {
    weights: Weights,
    times_s: Vec<f64>,
    room: Vec<Image>,
    delays_s: Vec<f64>,
    /// The subjects, by delay.
    delayed: Vec<Subjects>,
    pub(crate) differences: Vec<Difference>,
    displacement: Option<Displacement>,
    stretches: Vec<Range<usize>>,
    own_share: [f64; PIXELS],
}

/// What each person adds, or all objects, and the normal equations of their contrasts.
struct Subjects {
    pictures: Vec<Vec<Image>>,
    templates: Vec<Template>,
    products: Matrix,
    /// Cholesky factor of the products and the prior; empty if they are not positive.
    lower: Matrix,
}

/// The scene less an alternative.
pub(crate) struct Difference {
    pub(crate) from: Alternative,
    template: Template,
    /// Whether it is less than noise, or than a person [`QUARTER_M`] aside: a symmetric scene is the scene, however well it is
    /// known. One more person is not if any unit may hide them.
    pub(crate) is_alike: bool,
}

/// How well the scene explains a recording.
pub(crate) struct Fit {
    delay: usize,
    contrasts: Vec<f64>,
    /// The one contrast of all that fits best.
    contrast: f64,
    explained: f64,
    /// What the scene leaves unexplained; and the same with the delay undone.
    left: Vec<Image>,
    undelayed: Vec<Image>,
}

/// What a recording says of the scene.
#[derive(Debug, Clone)]
pub(crate) struct Statistics {
    /// For each person, or the objects.
    pub(crate) contrasts: Vec<f64>,
    pub(crate) delay_s: f64,
    /// What the scene leaves unexplained, in units of the recording's own noise, logarithm.
    pub(crate) misfit: f64,
    /// How much more it resembles the scene than each alternative: 1 as the scene, 0 as the alternative, less what noise
    /// may add.
    pub(crate) likeness: Vec<f64>,
    /// Warmth beyond the scene of each stretch and block, °C times the root of the pictures.
    pub(crate) beyond: Vec<f32>,
}

impl Subjects {
    fn new(pictures: &[Vec<Image>], weights: &Weights) -> Self {
        let templates = pictures.iter().map(|film| weights.template(film));
        let templates: Vec<Template> = templates.collect();
        let row =
            |template: &Template| pictures.iter().map(|film| template.product(film)).collect();
        let products: Matrix = templates.iter().map(row).collect();
        let mut known = products.clone();
        for (place, row) in known.iter_mut().enumerate() {
            row[place] += PRIOR;
        }
        Self {
            pictures: pictures.iter().map(|film| centered(film)).collect(),
            templates,
            products,
            lower: cholesky(&known).unwrap_or_default(),
        }
    }

    /// The products of a film with each of them, and the contrasts that explain it best.
    fn contrasts(&self, beyond_room: &[Image]) -> (Vec<f64>, Vec<f64>) {
        let templates = self.templates.iter();
        let products: Vec<f64> = templates.map(|one| one.product(beyond_room)).collect();
        let contrasts = match self.lower.is_empty() {
            true => vec![1.0; products.len()],
            false => {
                let with_prior: Vec<f64> = products.iter().map(|one| one + PRIOR).collect();
                linear::solve(&self.lower, &with_prior)
            }
        };
        (products, contrasts)
    }

    /// The part of a difference that another contrast of this person would explain, or of all.
    fn of_contrast(&self, person: Option<usize>, difference: &Template) -> f64 {
        let of = person.map_or(0..self.pictures.len(), |person| person..person + 1);
        let with = self.pictures[of.clone()].iter();
        let with: f64 = with.map(|film| difference.product(film)).sum();
        let rows = self.products[of.clone()].iter();
        let square: f64 = rows.flat_map(|row| &row[of.clone()]).sum();
        with * with / square.max(1e-9)
    }
}

impl Model {
    pub(crate) fn new(film: &mut Film, laws: &Laws, unit: &Unit) -> Self {
        let weights = Weights::new(unit);
        let mean = Simulated::mean(film, laws);
        let subjects = match &film.objects {
            Some(objects) => std::slice::from_ref(objects),
            None => mean.people.as_slice(),
        };
        let delays = match film.has_movement() && laws.lag_sd_s > 0.0 {
            true => DELAYS,
            false => 0,
        };
        let delays = -delays..=delays;
        let delays_s: Vec<f64> = delays.map(|by| laws.lag_sd_s * f64::from(by)).collect();
        let delayed = delays_s.iter().map(|delay_s| {
            let subjects = subjects.iter().cloned();
            let delayed = subjects.map(|subject| later(subject, &film.times_s, *delay_s));
            Subjects::new(&delayed.collect::<Vec<_>>(), &weights)
        });
        let mut model = Self {
            delayed: delayed.collect(),
            delays_s,
            times_s: film.times_s.clone(),
            room: film.room.clone(),
            differences: Vec::new(),
            displacement: None,
            stretches: film.stretches(STRETCH_S, STRETCHES_MOST),
            own_share: weights.own_share(film.len()),
            weights,
        };
        let near = model.move_people(film, laws);
        for from in Alternative::of(film, laws) {
            let apart = all_less(&mean.shows, &from.shown(film, &mean));
            let difference = model.difference(from, &apart, near);
            model.differences.push(difference);
        }
        model
    }

    fn difference(&self, from: Alternative, apart: &[Image], near: f64) -> Difference {
        let whole = self.weights.template(apart);
        let is_alike = match &from {
            Alternative::More(_) => still_c(apart) < CLEAR_C,
            moved if moved.keeps_people() => {
                let subjects = &self.delayed[self.delays_s.len() / 2];
                let by_contrast = subjects.of_contrast(moved.person(), &whole);
                whole.square - by_contrast < near * near
            }
            _ => whole.square < ALIKE * ALIKE,
        };
        let template = match &self.displacement {
            Some(displacement) if from.comes_or_goes() => {
                let seen = displacement.unexplained(apart, &self.weights);
                let mut template = self.weights.template(&seen);
                template.square = template.product(apart);
                template
            }
            _ => whole,
        };
        Difference {
            from,
            template,
            is_alike,
        }
    }

    /// Looks at people a quarter of a meter aside, for what places within their laws explain. Returns how many standard
    /// deviations of noise that is from the scene: in the median over the directions, of the person for whom it is least.
    fn move_people(&mut self, film: &mut Film, laws: &Laws) -> f64 {
        const WAYS: [[f64; 2]; 4] = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
        let mut least = f64::INFINITY;
        let mut by_meter = Vec::new();
        for (number, person) in film.people.iter_mut().enumerate().take(PEOPLE_MOST) {
            let [right, left, up, down] = WAYS.map(|way| {
                let by_m = way.map(|part| QUARTER_M * part);
                let moved = (0..self.times_s.len()).map(|index| person.aside(index, by_m));
                let moved: Vec<Image> = moved.collect();
                all_less(&person.adds, &moved)
            });
            let apart = [&right, &left, &up, &down].map(|apart| {
                let template = self.weights.template(apart);
                let subjects = &self.delayed[self.delays_s.len() / 2];
                template.square - subjects.of_contrast(Some(number), &template)
            });
            let apart = median(&apart).unwrap_or(0.0).max(0.0).sqrt();
            if apart > 0.0 {
                least = least.min(apart);
            }
            let meter = |before: &[Image], after: &[Image]| -> Vec<Image> {
                let both = all_less(before, after).into_iter();
                both.map(|both| both.map(|celsius| celsius / single(2.0 * QUARTER_M)))
                    .collect()
            };
            by_meter.push([meter(&left, &right), meter(&down, &up)]);
        }
        self.displacement = Some(Displacement::new(film, laws, by_meter, &self.weights));
        match least.is_finite() {
            true => least.max(ALIKE),
            false => ALIKE,
        }
    }

    pub(crate) fn fit(&self, recording: &[Image]) -> Fit {
        let beyond_room = all_less(recording, &self.room);
        let mut best: Option<(f64, usize, Vec<f64>, Vec<f64>)> = None;
        for (delay, subjects) in self.delayed.iter().enumerate() {
            let (products, contrasts) = subjects.contrasts(&beyond_room);
            let explained = linear::dot(&products, &contrasts);
            if best.as_ref().is_none_or(|best| explained > best.0) {
                best = Some((explained, delay, products, contrasts));
            }
        }
        let (explained, delay, products, contrasts) = best.unwrap_or_default();
        let subjects = &self.delayed[delay];
        let square: f64 = subjects.products.iter().flatten().sum();
        let mut left = centered(&beyond_room);
        for (contrast, pictures) in contrasts.iter().zip(&subjects.pictures) {
            add_all(&mut left, pictures, -single(*contrast));
        }
        Fit {
            undelayed: later(left.clone(), &self.times_s, -self.delays_s[delay]),
            contrast: (products.iter().sum::<f64>() + PRIOR) / (square + PRIOR),
            delay,
            contrasts,
            explained,
            left,
        }
    }

    /// 1, and the projection of what the scene leaves unexplained on the difference, in its own length.
    pub(crate) fn likeness(&self, number: usize, fit: &Fit) -> f64 {
        /// Noise adds more in one of a hundred recordings.
        const NOISE_SDS: f64 = 2.326;
        let Difference { from, template, .. } = &self.differences[number];
        let person = from.person();
        let contrast = person.map_or(fit.contrast, |person| fit.contrasts[person]);
        if contrast <= 0.0 || template.square <= 0.0 {
            return f64::from(f32::MIN);
        }
        let noise = NOISE_SDS / template.square.sqrt();
        1.0 + (template.product(&fit.undelayed) / template.square - noise) / contrast
    }

    pub(crate) fn statistics(&self, recording: &[Image]) -> Statistics {
        let fit = self.fit(recording);
        let (left, noise) = (
            self.weights.square(&fit.left),
            self.weights.steps(recording),
        );
        let likeness = (0..self.differences.len()).map(|number| self.likeness(number, &fit));
        Statistics {
            delay_s: self.delay_s(recording, &fit),
            misfit: left.max(1e-9).ln() - noise.max(1e-9).ln(),
            likeness: likeness.collect(),
            beyond: self.beyond(&fit.left),
            contrasts: fit.contrasts,
        }
    }

    /// Whether a recording shows nothing but the room and noise.
    pub(crate) fn is_empty(&self, recording: &[Image]) -> bool {
        /// In standard deviations, what subjects show at least.
        const SEEN_SDS: f64 = 3.0;
        /// Of what changes, beyond that of noise: its estimate may be off by as much.
        const MOVING: f64 = 0.1;
        /// Of the mean picture, in standard deviations of chi squared.
        const STILL_SDS: f64 = 3.0;
        let [moving, still] = self.weights.squares(&all_less(recording, &self.room));
        let degrees = count(PIXELS - 1);
        let frames = count(recording.len().saturating_sub(1).max(1));
        let is_seen = self.fit(recording).explained > SEEN_SDS * SEEN_SDS;
        !is_seen
            && moving < (1.0 + MOVING) * frames * degrees
            && still < degrees + STILL_SDS * (2.0 * degrees).sqrt()
    }

    /// The best delay, by a parabola through the best of those tried and its neighbors.
    fn delay_s(&self, recording: &[Image], best: &Fit) -> f64 {
        let middle_s = self.delays_s[best.delay];
        if best.delay == 0 || best.delay + 1 >= self.delays_s.len() {
            return middle_s;
        }
        let beyond_room = all_less(recording, &self.room);
        let [before, after] = [best.delay - 1, best.delay + 1].map(|delay| {
            let (products, contrasts) = self.delayed[delay].contrasts(&beyond_room);
            linear::dot(&products, &contrasts)
        });
        let curve = before - 2.0 * best.explained + after;
        let step_s = self.delays_s[best.delay + 1] - middle_s;
        match curve < 0.0 {
            true => middle_s + step_s * (0.5 * (before - after) / curve).clamp(-0.5, 0.5),
            false => middle_s,
        }
    }

    /// What is warmer or colder than the scene, in each stretch and block; last that of the whole recording.
    fn beyond(&self, left: &[Image]) -> Vec<f32> {
        let left = match &self.displacement {
            Some(displacement) => displacement.unexplained(left, &self.weights),
            None => left.to_vec(),
        };
        let whole = mean(&left);
        let own: Image = std::array::from_fn(|pixel| single(self.own_share[pixel] * whole[pixel]));
        let mut all = Vec::with_capacity(BLOCKS * (self.stretches.len() + 1));
        for stretch in &self.stretches {
            let mean = mean(&left[stretch.clone()]).map(single);
            push_blocks(&mut all, &less(&mean, &own), stretch.len());
        }
        // What stays all the time is beyond the scene if unit and room alone do not make it: rooms are warmer on one side.
        push_blocks(&mut all, &level(&whole), left.len());
        all
    }

    /// The stretch and the upper left pixel of a block, row and column.
    pub(crate) fn block(&self, index: usize) -> (Range<usize>, usize, usize) {
        let block = index % BLOCKS;
        let (row, column) = (block / ACROSS, block % ACROSS);
        let stretch = self.stretches.get(index / BLOCKS).cloned();
        (stretch.unwrap_or(0..self.times_s.len()), row, column)
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
        let products = along.map(|(pixel, value)| at(pixel)[axis] * value);
        products.sum::<f64>() / square
    });
    std::array::from_fn(|pixel| {
        let [x, y] = at(pixel);
        single(image[pixel] - slope[0] * x - slope[1] * y)
    })
}

/// Root of the sum of squares of the mean picture less its mean.
fn still_c(film: &[Image]) -> f64 {
    let mean = mean(&centered(film));
    let squares = mean.iter().map(|celsius| celsius * celsius);
    squares.sum::<f64>().sqrt()
}
