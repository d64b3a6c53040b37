//! What sensors should achieve together, and how far they do.

use super::error::{CoverageError, check_count};
use super::limits;
use std::cmp::Ordering;

/// What the sensors must achieve together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wish {
    /// A person counts as detected from this contrast on; 3 is the usual limit of detection.
    pub sigma_min: f64,
    /// How many sensors must detect a person at each place.
    pub sensors_min: usize,
    /// Which sensors count as one detector.
    pub rule: Rule,
}

/// Which sensors count as one detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// Each sensor by itself.
    Alone,
    /// All sensors together: the squares of their contrasts add, because their noise is independent.
    Together,
}

impl Default for Wish {
    /// One sensor by itself, from 3 sigma on.
    fn default() -> Self {
        Self {
            sigma_min: 3.0,
            sensors_min: 1,
            rule: Rule::Alone,
        }
    }
}

/// What some sensors achieve at each of the same places.
#[derive(Debug, Clone)]
pub(crate) struct Tally<'a> {
    wish: &'a Wish,
    have: Vec<Have>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Have {
    detecting: usize,
    /// Sum of the squares of the contrasts, and the largest contrast.
    squares: f64,
    largest: f64,
}

/// What one more sensor adds: detections, and contrast in units of the threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gain {
    points: usize,
    contrast: f64,
}

impl Gain {
    pub(crate) fn is_nothing(&self) -> bool {
        self.points == 0 && self.contrast <= 0.0
    }

    /// By detections, then by contrast.
    pub(crate) fn cmp(&self, other: &Self) -> Ordering {
        let by_points = self.points.cmp(&other.points);
        by_points.then(self.contrast.total_cmp(&other.contrast))
    }
}

impl<'a> Tally<'a> {
    pub(crate) fn new(wish: &'a Wish, places: usize) -> Self {
        let have = vec![Have::default(); places];
        Self { wish, have }
    }

    pub(crate) fn add(&mut self, contrasts: impl Iterator<Item = f64>) {
        for (have, contrast) in self.have.iter_mut().zip(contrasts) {
            *have = have.with(contrast, self.wish);
        }
    }

    /// The sum over all places of the detecting sensors, up to [`Wish::sensors_min`] at each.
    pub(crate) fn points(&self) -> usize {
        self.have.iter().map(|have| have.points(self.wish)).sum()
    }

    /// What a sensor with these contrasts adds; contrasts above twice the threshold add no more.
    pub(crate) fn gain(&self, contrasts: impl Iterator<Item = f64>) -> Gain {
        let mut gain = Gain {
            points: 0,
            contrast: 0.0,
        };
        for (have, more) in self.have.iter().zip(contrasts) {
            let then = have.with(more, self.wish);
            gain.points += then.points(self.wish) - have.points(self.wish);
            let part = |have: &Have| (have.largest / self.wish.sigma_min).min(2.0);
            gain.contrast += part(&then) - part(have);
        }
        gain
    }
}

impl Have {
    fn with(self, contrast: f64, wish: &Wish) -> Self {
        Self {
            detecting: self.detecting + usize::from(contrast >= wish.sigma_min),
            squares: self.squares + contrast * contrast,
            largest: self.largest.max(contrast),
        }
    }

    fn points(self, wish: &Wish) -> usize {
        match wish.rule {
            Rule::Alone => self.detecting.min(wish.sensors_min),
            Rule::Together => usize::from(self.squares.sqrt() >= wish.sigma_min),
        }
    }
}

pub(crate) fn check(count: usize, wish: &Wish) -> Result<(), CoverageError> {
    let at_each_place = "the number of sensors at each place";
    let counts = [
        ("the number of poses to pick", count),
        (at_each_place, wish.sensors_min),
    ];
    for (what, found) in counts {
        let hint = "2 is a good start for one room";
        check_count(what, found, limits::PICKED_MAX, hint)?;
    }
    if !(wish.sigma_min.is_finite() && wish.sigma_min > 0.0) {
        let what = "the contrast to detect";
        let found = format!("{} sigma", wish.sigma_min);
        let hint = "3 sigma is the usual limit of detection";
        return Err(CoverageError::value(what, &found, "a number above 0", hint));
    }
    if wish.rule == Rule::Together && wish.sensors_min != 1 {
        let expected = "1, if the sensors detect together";
        let hint = "count sensors that detect alone, or let all detect together";
        return Err(CoverageError::value(
            at_each_place,
            &wish.sensors_min,
            expected,
            hint,
        ));
    }
    Ok(())
}
