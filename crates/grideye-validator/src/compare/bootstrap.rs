//! The frames of a comparison, handed to those that draw units.

use crate::compare::pairs::pairs;
use crate::compare::prepared::ComparedFrames;
use crate::compare::settings::Settings;
use crate::expected::claim::{Claim, Recorded, Sides, Statistics};
use crate::expected::units::{Expected, UnitSpecification};
use crate::frames::{Protocol, RealFrame, SimulatedFrame};
use crate::metrics::foreground::RoomSource;
use crate::numbers::{count, evenly, mean_square};
use crate::verdict::types::Prior;
use std::time::Duration;

/// What the verdict is read from, and what drawn units would have scored.
pub(crate) struct Bootstrap {
    pub(crate) claim: Claim,
    pub(crate) found: Statistics,
    pub(crate) expected: Expected,
    /// When the frames were recorded that `found` speaks of.
    pub(crate) times: Vec<Duration>,
}

/// Frames a side that units are drawn for; more are thinned evenly.
const DRAWN_FRAMES_MAX: usize = 100;
/// Under the static protocol each of them meets as many simulated ones.
const DRAWN_STATIC_MAX: usize = 10;

/// Standard deviation of what is not known of a unit's pattern, row by row, °C.
pub(crate) fn pattern_c(settings: &Settings, prior: &Prior, pixels: usize) -> Vec<f64> {
    let any = || vec![settings.thresholds.pattern_spread_c; pixels];
    prior.pattern_c.clone().unwrap_or_else(any)
}

impl Bootstrap {
    pub(crate) fn new(
        view: &ComparedFrames,
        real: &[RealFrame],
        simulated: &[SimulatedFrame],
        settings: &Settings,
        prior: &Prior,
    ) -> Self {
        let is_static = settings.protocol == Protocol::Static;
        let chosen = evenly(real.len(), DRAWN_FRAMES_MAX);
        let claims = if is_static {
            evenly(simulated.len(), DRAWN_STATIC_MAX)
        } else {
            chosen.clone()
        };
        let pattern_c = pattern_c(settings, prior, view.pixels());
        let unit = UnitSpecification {
            noise_c: view.sigma_c,
            pattern_c,
            step_c: settings.step_c,
            frames: chosen.len(),
            learned_from: (prior.room.from == RoomSource::Recording).then_some(prior.room.frames),
            seed: settings.seed,
        };
        let (noise, pattern) = (view.sigma_c.powi(2), mean_square(&unit.pattern_c));
        let claim = Claim::new(Sides {
            simulated: claims.iter().map(|&index| &simulated[index]).collect(),
            nobody: claims
                .iter()
                .filter_map(|&index| prior.nobody.get(index).map(Vec::as_slice))
                .collect(),
            pairs: pairs(settings.protocol, chosen.len(), claims.len()),
            warmth: view.warmth,
            ambient_c: settings.ambient_c,
            is_static,
            columns: view.preparation.shape.columns,
            pattern: &prior.pattern_added_c,
            still_weight: if pattern > 0.0 {
                noise / (noise + count(chosen.len()) * pattern)
            } else {
                1.0
            },
        });
        let frames: Vec<Vec<f64>> = chosen
            .iter()
            .map(|&index| real[index].celsius.clone())
            .collect();
        let found = claim.of_all(Recorded {
            frames: &frames,
            room: prior.room.celsius.as_deref(),
        });
        Self {
            expected: Expected::new(&claim, &unit),
            times: chosen.iter().map(|&index| real[index].time).collect(),
            claim,
            found,
        }
    }
}
