//! The pictures of a scene and of its alternatives: means over worlds, ready for products with recordings.

use crate::constants::{ALIKE_SDS, CLEAR_C, PRIOR, QUARTER_M};
use crate::decision::alternative::{Alternative, PEOPLE_MOST};
use crate::decision::displaced::Displaced;
use crate::decision::template::{NoiseModel, Template, centered, mean};
use crate::decision::view::{Image, View, add, each_less};
use crate::decision::world::{World, later};
use crate::linear::{self, Matrix, cholesky};
use crate::numbers::{count, median, single};
use grideye_frame::PIXELS;
use grideye_scene::Laws;

/// Worlds whose mean is the picture of a scene or an alternative.
pub(super) const FOR_MEAN: usize = 24;

/// Normal equations of the subjects' contrasts.
pub(super) struct Equations {
    pub(super) products: Matrix,
    /// Cholesky factor of the products and the prior; empty if they are not positive.
    lower: Matrix,
}

/// An alternative as a template: the scene less this difference, which is as warm as one subject or as all.
pub(crate) struct Hypothesis {
    pub(crate) what: Alternative,
    /// By delay: the difference of the subjects, and its products.
    pub(super) difference: Vec<(Template, Products)>,
    /// The difference of the rooms, if there is one, and by delay its products with each subject.
    pub(super) rooms: Option<(Vec<Vec<f64>>, Template)>,
    /// Whether it differs from the scene by less than noise, or than a person [`QUARTER_M`] aside: a symmetric scene is the
    /// scene, however well it is known. One more person is not if any unit may hide them.
    pub(crate) is_alike: bool,
}

/// `W` of a difference, less what places may explain, with all of it, with each subject, and with the difference of the
/// rooms.
pub(super) struct Products {
    pub(super) whole: f64,
    pub(super) subjects: Vec<f64>,
    pub(super) rooms: f64,
}

impl Equations {
    fn new(products: Matrix) -> Self {
        let mut known = products.clone();
        for (place, row) in known.iter_mut().enumerate() {
            row[place] += PRIOR;
        }
        Self {
            lower: cholesky(&known).unwrap_or_default(),
            products,
        }
    }

    pub(super) fn solve(&self, products: &[f64]) -> Vec<f64> {
        if self.lower.is_empty() {
            return vec![1.0; products.len()];
        }
        let products: Vec<f64> = products.iter().map(|product| product + PRIOR).collect();
        linear::solve(&self.lower, &products)
    }
}

/// Makes the templates of scene and alternatives: means over worlds.
pub(super) struct Builder<'a> {
    noise: &'a NoiseModel,
    worlds: &'a [World],
    lags_s: &'a [f64],
    /// All subjects.
    pub(super) shown: Vec<Image>,
    /// By delay and subject.
    pub(super) pictures: Vec<Vec<Vec<Image>>>,
    /// By subject and delay.
    pub(super) subjects: Vec<Vec<Template>>,
    pub(super) equations: Vec<Equations>,
    /// Standard deviations by which another place, time or orientation differs from the scene at least.
    alike: f64,
    pub(super) displaced: Option<Displaced>,
}

impl<'a> Builder<'a> {
    pub(super) fn new(
        view: &mut View,
        noise: &'a NoiseModel,
        worlds: &'a [World],
        lags_s: &'a [f64],
    ) -> Self {
        let mut builder = Self {
            noise,
            worlds,
            lags_s,
            shown: Vec::new(),
            pictures: vec![Vec::new(); lags_s.len()],
            subjects: Vec::new(),
            equations: Vec::new(),
            alike: ALIKE_SDS,
            displaced: None,
        };
        builder.shown = vec![[0.0; PIXELS]; view.len()];
        for subject in 0..view.people.len().max(1) {
            let alone = builder.mean(view, |view, world| {
                let is_other = |person, _| person != subject;
                world.drawn.without_hidden(view, is_other)
            });
            for (shown, alone) in builder.shown.iter_mut().zip(&alone) {
                add(shown, alone, 1.0);
            }
            let delayed = lags_s
                .iter()
                .map(|lag_s| later(&alone, &view.times_s, *lag_s));
            let mut templates = Vec::with_capacity(lags_s.len());
            for (pictures, delayed) in builder.pictures.iter_mut().zip(delayed) {
                templates.push(noise.template(&delayed));
                pictures.push(delayed);
            }
            builder.subjects.push(templates);
        }
        for lag in 0..lags_s.len() {
            let with = |template: &Template| -> Vec<f64> {
                builder.pictures[lag]
                    .iter()
                    .map(|pictures| template.product(pictures))
                    .collect()
            };
            let products = builder
                .subjects
                .iter()
                .map(|subject| with(&subject[lag]))
                .collect();
            builder.equations.push(Equations::new(products));
        }
        builder
    }

    /// What worlds show beyond the room, in the mean.
    fn mean(&self, view: &mut View, shown: impl Fn(&mut View, &World) -> Vec<Image>) -> Vec<Image> {
        let mut sum = vec![[0.0; PIXELS]; view.len()];
        for world in self.worlds {
            for (sum, shown) in sum.iter_mut().zip(&shown(view, world)) {
                add(sum, shown, single(1.0 / count(FOR_MEAN)));
            }
        }
        sum
    }

    /// The part of a difference that another contrast would explain.
    fn by_contrast(&self, subject: Option<usize>, difference: &Template) -> f64 {
        let pictures = &self.pictures[self.lags_s.len() / 2];
        let subjects = subject.map_or(0..pictures.len(), |subject| subject..subject + 1);
        let products = &self.equations[self.lags_s.len() / 2].products;
        let with: f64 = subjects
            .clone()
            .map(|subject| difference.product(&pictures[subject]))
            .sum();
        let square: f64 = subjects
            .clone()
            .flat_map(|one| subjects.clone().map(move |other| products[one][other]))
            .sum();
        with * with / square.max(1e-9)
    }

    /// Looks at people a quarter of a meter aside: how far from the scene they are, and what places within their laws explain.
    pub(super) fn move_people(&mut self, view: &mut View, laws: &Laws) {
        let mut least = f64::INFINITY;
        let mut by_meter = Vec::new();
        for person in 0..view.people.len().min(PEOPLE_MOST) {
            let ways = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
            let [right, left, up, down] = ways.map(|way| {
                let by_m = way.map(|part| QUARTER_M * part);
                let other = self.mean(view, |view, world| {
                    world.drawn.clone().moved(person, by_m).shown(view)
                });
                each_less(&self.shown, &other)
            });
            let middle = median(&[&right, &left, &up, &down].map(|apart| {
                let template = self.noise.template(apart);
                (template.square - self.by_contrast(Some(person), &template)).max(0.0)
            }));
            // In the median over the directions, of the person for whom it is least.
            let middle = middle.unwrap_or(0.0).sqrt();
            if middle > 0.0 {
                least = least.min(middle);
            }
            let meter = |before: &[Image], after: &[Image]| -> Vec<Image> {
                let apart = each_less(before, after).into_iter();
                let meters = single(2.0 * QUARTER_M);
                apart
                    .map(|image| image.map(|celsius| celsius / meters))
                    .collect()
            };
            by_meter.push([meter(&left, &right), meter(&down, &up)]);
        }
        if least.is_finite() {
            self.alike = least.max(ALIKE_SDS);
        }
        self.displaced = Some(Displaced::new(view, laws, by_meter, self.noise));
    }

    pub(super) fn hypothesis(&mut self, view: &mut View, what: Alternative) -> Hypothesis {
        let other = self.mean(view, |view, world| what.shown(view, world));
        let rooms_apart = what.rooms_apart(view);
        // Without what the rooms differ by, which is no warmer if the subjects are.
        let apart = each_less(&each_less(&self.shown, &other), &rooms_apart);
        let seen = match &self.displaced {
            Some(displaced) if what.comes_or_goes() => displaced.unexplained(&apart, self.noise),
            _ => apart.clone(),
        };
        let rooms_template = self.noise.template(&rooms_apart);
        let products = |template: &Template, pictures: &[Vec<Image>]| -> Vec<f64> {
            pictures
                .iter()
                .map(|pictures| template.product(pictures))
                .collect()
        };
        let difference: Vec<(Template, Products)> = self
            .lags_s
            .iter()
            .zip(&self.pictures)
            .map(|(lag_s, pictures)| {
                let delayed = |pictures: &[Image]| later(pictures, &view.times_s, *lag_s);
                let template = self.noise.template(&delayed(&seen));
                let all = Products {
                    whole: template.product(&delayed(&apart)),
                    subjects: products(&template, pictures),
                    rooms: rooms_template.product(&delayed(&apart)),
                };
                (template, all)
            })
            .collect();
        let middle = &difference[self.lags_s.len() / 2];
        // However well places are known.
        let own_square = self.noise.template(&apart).square;
        let square = rooms_template.square + 2.0 * middle.1.rooms + own_square;
        let is_alike = match &what {
            Alternative::More(_) => still_c(&apart) < CLEAR_C,
            moved if moved.keeps_people() => {
                square - self.by_contrast(moved.person(), &middle.0) < self.alike * self.alike
            }
            _ => square < ALIKE_SDS * ALIKE_SDS,
        };
        Hypothesis {
            is_alike,
            rooms: (rooms_template.square > 0.0).then(|| {
                let with = self.pictures.iter();
                let with = with.map(|pictures| products(&rooms_template, pictures));
                (with.collect(), rooms_template)
            }),
            difference,
            what,
        }
    }
}

/// Root of the sum of squares of the mean picture less its mean.
fn still_c(pictures: &[Image]) -> f64 {
    let mean = mean(&centered(pictures));
    mean.iter()
        .map(|celsius| celsius * celsius)
        .sum::<f64>()
        .sqrt()
}
