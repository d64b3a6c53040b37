//! What chance reaches with the same freedom.

use crate::align::bounds::Bounds;
use crate::align::film::{Film, Sample};
use crate::align::line_search::{best_line, rough_likeness};
use crate::align::pace_search::best_law;
use crate::align::space::Orientation;
use crate::align::types::TimeAlignment;
use crate::align::warp_search::best_warp;

/// Frames that decoys are aligned on.
pub(crate) const FRAMES: usize = 64;
/// From this likeness to the scene on a decoy is the scene.
const KIN_MIN: f64 = 0.7;

/// The best of the decoys.
pub(crate) struct Chance {
    /// Likeness of the best; `None` if there was no decoy.
    pub(crate) best: Option<f64>,
    pub(crate) decoys: usize,
}

/// Aligns the recording with films that are not the scene but move like it.
pub(crate) fn chance(
    sample: &Sample,
    film: &Film,
    bounds: &Bounds,
    asked: TimeAlignment,
) -> Chance {
    let sample = sample.thinned(FRAMES);
    let own = sample.of_scene(film);
    let mut found = Chance {
        best: None,
        decoys: 0,
    };
    for orientation in Orientation::ALL {
        let turned = film.map(|frame| orientation.apply(frame));
        for (film, is_backwards) in [(turned.reversed(), true), (turned, false)] {
            let is_scene = orientation == Orientation::Upright && !is_backwards;
            if is_scene || rough_likeness(&own, &film, bounds) > KIN_MIN {
                continue;
            }
            found.decoys += 1;
            let likeness = aligned(&sample, &film, bounds, asked);
            found.best = Some(found.best.map_or(likeness, |best| best.max(likeness)));
        }
    }
    found
}

fn aligned(sample: &Sample, film: &Film, bounds: &Bounds, asked: TimeAlignment) -> f64 {
    match asked {
        TimeAlignment::Law => best_law(sample, film, bounds).1.likeness,
        TimeAlignment::Warp => {
            let (line, fit) = best_line(sample, film, bounds);
            let warp = best_warp(sample, film, line, &fit, bounds.shift_max_s);
            let warped = sample.fit(film, |time_s| line.scene_s(time_s) + warp.by_s(time_s));
            fit.likeness.max(warped.likeness)
        }
        TimeAlignment::None | TimeAlignment::Shift | TimeAlignment::Rate => {
            rough_likeness(sample, film, bounds)
        }
    }
}
