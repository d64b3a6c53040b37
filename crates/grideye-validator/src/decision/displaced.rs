//! People off their places for a while: what a statistic about who is there must not take for somebody who comes or goes.

use crate::decision::template::{NoiseModel, centered};
use crate::decision::view::{Image, View, add};
use crate::linear::{self, Matrix, cholesky, zeros};
use crate::numbers::single;
use grideye_frame::PIXELS;
use grideye_scene::Laws;
use std::ops::Range;

/// Time for which a wander counts as constant, in its correlation times; of a long recording it is longer.
const WINDOW: f64 = 2.0;
const WINDOWS_MOST: f64 = 40.0;

/// What people add off their places within their laws, to first order.
pub(super) struct Displaced {
    /// What one meter adds to each picture, by person and axis.
    by_meter: Vec<[Vec<Image>; 2]>,
    unknowns: Vec<Unknown>,
    /// Cholesky factor of the unknowns' information: 1 before a recording is seen, plus what a recording tells.
    lower: Matrix,
}

struct Unknown {
    person: usize,
    axis: usize,
    sd_m: f32,
    during: Range<usize>,
}

impl Displaced {
    pub(super) fn new(
        view: &View,
        laws: &Laws,
        by_meter: Vec<[Vec<Image>; 2]>,
        noise: &NoiseModel,
    ) -> Self {
        let center = |axes: [Vec<Image>; 2]| axes.map(|film| centered(&film));
        let mut displaced = Self {
            unknowns: unknowns(view, laws, by_meter.len()),
            by_meter: by_meter.into_iter().map(center).collect(),
            lower: Matrix::new(),
        };
        let size = displaced.unknowns.len();
        let mut told = zeros(size);
        for (row, unknown) in displaced.unknowns.iter().enumerate() {
            let mut alone = vec![[0.0; PIXELS]; view.len()];
            displaced.add(&mut alone, unknown, 1.0);
            told[row] = displaced.products(&alone, noise);
            told[row][row] += 1.0;
        }
        displaced.lower = cholesky(&told).unwrap_or_default();
        displaced
    }

    /// A film less what people off their places would explain of it: `Σ⁻¹ film` in units of noise and pattern, where `Σ` has
    /// noise, pattern and places (Woodbury).
    pub(super) fn unexplained(&self, film: &[Image], noise: &NoiseModel) -> Vec<Image> {
        let mut left = film.to_vec();
        if !self.lower.is_empty() {
            let explained = linear::solve(&self.lower, &self.products(film, noise));
            for (unknown, by) in self.unknowns.iter().zip(explained) {
                self.add(&mut left, unknown, -single(by));
            }
        }
        left
    }

    fn add(&self, film: &mut [Image], unknown: &Unknown, times: f32) {
        let by_meter = &self.by_meter[unknown.person][unknown.axis];
        for index in unknown.during.clone() {
            add(&mut film[index], &by_meter[index], times * unknown.sd_m);
        }
    }

    /// `W` of a film with each unknown.
    fn products(&self, film: &[Image], noise: &NoiseModel) -> Vec<f64> {
        let template = noise.template(film);
        let product = |unknown: &Unknown| {
            let by_meter = &self.by_meter[unknown.person][unknown.axis];
            f64::from(unknown.sd_m) * template.product_during(unknown.during.clone(), by_meter)
        };
        self.unknowns.iter().map(product).collect()
    }
}

/// A constant offset of each person along each axis, and the wander of those who move, window by window.
fn unknowns(view: &View, laws: &Laws, people: usize) -> Vec<Unknown> {
    let mut all = Vec::new();
    for (person, (walker, law)) in view
        .people
        .iter()
        .zip(&laws.agents)
        .enumerate()
        .take(people)
    {
        let moves = walker.moves && law.wander_sd_m > 0.0;
        let windows = if moves {
            view.stretches(WINDOW * law.wander_over_s, WINDOWS_MOST)
        } else {
            Vec::new()
        };
        for axis in 0..2 {
            let mut push = |sd_m: f64, during: Range<usize>| {
                all.push(Unknown {
                    person,
                    axis,
                    sd_m: single(sd_m),
                    during,
                });
            };
            push(law.place_sd_m, 0..view.len());
            windows
                .iter()
                .for_each(|during| push(law.wander_sd_m, during.clone()));
        }
    }
    all
}
