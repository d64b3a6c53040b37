//! Finds the best clock, orientation and offset, and compares them with what chance reaches.

use crate::align::clock::{Bounds, Clock};
use crate::align::series::{Sample, Series};
use crate::align::space::{self, Orientation, Pairs};
use crate::align::time_search::{best_clock, rough_likeness, standard_errors};
use crate::align::types::{AlignOptions, OffsetFound, OrientationFound, TimeAlignment, TimeFound};
use crate::constants::{
    BEYOND, ERRORS_TOLD, KIN_MIN, LIKENESS_MIN, OFFSET_LIKENESS_MIN, ORIENTATION_MARGIN, SAME_MIN,
    STILL_WEIGHT,
};
use crate::frames::types::Pixels;
use crate::numbers::mean_frame;
use std::time::Duration;

/// Frames used for alignment; a longer recording is thinned evenly.
pub const SAMPLE_MAX: usize = 2_048;
/// Alignment uses this much of a recording, from its first frame.
pub const SPAN_MAX: Duration = Duration::from_secs(600);
const OFFSET_SOUGHT_PX: f64 = 1.5;

pub(crate) struct Aligner {
    sample: Sample,
    series: Series,
    bounds: Bounds,
    /// Mean frame of the sample, less ambient.
    mean_c: Pixels,
}

impl Aligner {
    /// Drops frames that no clock within the bounds moves into the scene; `times_s` are unaligned.
    pub(crate) fn new(
        film: &grideye_scene::Film,
        end_s: f64,
        times_s: Vec<f64>,
        frames: Vec<Pixels>,
        options: &AlignOptions,
    ) -> Self {
        let first_s = times_s.first().copied().unwrap_or_default();
        let last_s = times_s.last().copied().unwrap_or_default();
        let bounds = options.bounds(first_s);
        // Twice as far as the search: a fit must pay for the frames around it.
        let reach_s = 2.0 * BEYOND * bounds.shift_max_s + 1.0;
        let beyond_s = reach_s + BEYOND * bounds.rate_max * (last_s - first_s);
        let series = Series::new(film, first_s - reach_s, end_s.min(last_s + beyond_s));
        let (times_s, frames): (Vec<f64>, Vec<Pixels>) = times_s
            .into_iter()
            .zip(frames)
            .filter(|(time_s, _)| (-beyond_s..=end_s + beyond_s).contains(time_s))
            .unzip();
        let mean = mean_frame(&frames);
        let above = |pixel: usize| {
            mean.get(pixel)
                .map_or(0.0, |mean| mean - film.simulator().ambient_c())
        };
        Self {
            sample: Sample::new(times_s, frames),
            series,
            bounds,
            mean_c: std::array::from_fn(above),
        }
    }

    pub(crate) fn turned_back(self, orientation: Orientation) -> Self {
        let back = orientation.inverse();
        Self {
            sample: self.sample.map(|frame| back.apply(frame)),
            mean_c: back.apply(&self.mean_c),
            ..self
        }
    }

    /// The best clock within the bounds, with rate 0 if not distinguishable from 0, and the finding; the recording's own clock
    /// if the fit does not beat chance.
    pub(crate) fn time(&self, asked: TimeAlignment) -> (Clock, TimeFound) {
        let (sample, series, bounds) = (&self.sample, &self.series, &self.bounds);
        let before = sample.fit(series, |time_s| time_s);
        let (mut clock, mut fit) = best_clock(sample, series, &bounds.wider());
        let errors = standard_errors(sample, series, clock, &fit);
        let (shift_error_s, rate_error) = errors.unwrap_or_default();
        let (excess_s, rate_excess) = (bounds.excess_s(&clock), bounds.rate_excess(&clock));
        let at_bound =
            excess_s > ERRORS_TOLD * shift_error_s || rate_excess > ERRORS_TOLD * rate_error;
        let told = errors.is_some() && clock.rate.abs() > ERRORS_TOLD * rate_error;
        if excess_s > 0.0 || rate_excess > 0.0 || !told {
            let rate_max = if told { bounds.rate_max } else { 0.0 };
            let bounds = Bounds {
                rate_max,
                ..*bounds
            };
            (clock, fit) = best_clock(sample, series, &bounds);
        }
        let (chance, decoys) = chance(sample, series, bounds);
        let by_chance = chance.unwrap_or(0.0).max(LIKENESS_MIN);
        let applied = !at_bound && fit.likeness > by_chance;
        let found = TimeFound {
            asked,
            shift_s: clock.shift_s,
            shift_error_s: errors.map(|errors| errors.0),
            rate: clock.rate,
            rate_error: errors.map(|errors| errors.1),
            likeness_before: before.likeness,
            likeness: fit.likeness,
            chance,
            decoys,
            applied,
            at_bound,
        };
        (if applied { clock } else { Clock::own() }, found)
    }

    /// The orientation, from what moves and, with less weight, from what stands still.
    pub(crate) fn orientation(&self) -> Option<OrientationFound> {
        let sample = self.sample.thinned(DECOY_FRAMES);
        let still = self.sample.mean_claim(&self.series, |time_s| time_s);
        let own = sample.of_scene(&self.series);
        let likeness = |sample: &Sample, mean: &Pixels, orientation: Orientation| {
            let series = self.series.map(|frame| orientation.apply(frame));
            let moving = rough_likeness(sample, &series, &self.bounds);
            moving + STILL_WEIGHT * space::still_likeness(mean, &orientation.apply(&still))
        };
        let most = 1.0 + STILL_WEIGHT;
        best_orientation(
            |orientation| likeness(&sample, &self.mean_c, orientation),
            |orientation| likeness(&own, &still, orientation) > SAME_MIN * most,
            most,
        )
    }

    pub(crate) fn offset(&self, clock: &Clock) -> Option<OffsetFound> {
        let sample = self.sample.thinned(OFFSET_FRAMES);
        let pairs = Pairs::moving(&sample, &self.series, |time_s| clock.scene_s(time_s));
        let (right_down_px, likeness) = pairs.best_offset(OFFSET_SOUGHT_PX);
        (likeness[0] > OFFSET_LIKENESS_MIN).then_some(OffsetFound {
            right_down_px,
            likeness,
            applied: false,
        })
    }
}

pub(crate) fn still_orientation(real: &Pixels, claim: &Pixels) -> Option<OrientationFound> {
    let seen = |image: &Pixels, orientation: Orientation| {
        space::still_likeness(image, &orientation.apply(claim))
    };
    best_orientation(
        |orientation| seen(real, orientation),
        |orientation| seen(claim, orientation) > SAME_MIN,
        1.0,
    )
}

/// The orientation with most likeness; any other than upright must win by a margin.
fn best_orientation(
    likeness: impl Fn(Orientation) -> f64,
    same: impl Fn(Orientation) -> bool,
    most: f64,
) -> Option<OrientationFound> {
    let upright = likeness(Orientation::Upright) / most;
    let (best, orientation) = Orientation::ALL
        .into_iter()
        .skip(1)
        .filter(|&orientation| !same(orientation))
        .map(|orientation| (likeness(orientation) / most, orientation))
        .max_by(|left, right| left.0.total_cmp(&right.0))?;
    let is_other = best > upright + ORIENTATION_MARGIN && best > LIKENESS_MIN;
    Some(OrientationFound {
        orientation: if is_other {
            orientation
        } else {
            Orientation::Upright
        },
        likeness: if is_other { best } else { upright },
        upright,
        applied: false,
    })
}

const OFFSET_FRAMES: usize = 256;

const DECOY_FRAMES: usize = 64;

/// Best likeness of the decoys (the scene turned, mirrored, run backwards), aligned the same way, and their number.
fn chance(sample: &Sample, series: &Series, bounds: &Bounds) -> (Option<f64>, usize) {
    let sample = sample.thinned(DECOY_FRAMES);
    let own = sample.of_scene(series);
    let (mut best, mut decoys) = (None, 0);
    for orientation in Orientation::ALL {
        let turned = series.map(|frame| orientation.apply(frame));
        for (series, is_backwards) in [(turned.reversed(), true), (turned, false)] {
            let is_scene = orientation == Orientation::Upright && !is_backwards;
            if is_scene || rough_likeness(&own, &series, bounds) > KIN_MIN {
                continue;
            }
            decoys += 1;
            let likeness = rough_likeness(&sample, &series, bounds);
            best = Some(best.map_or(likeness, |best: f64| best.max(likeness)));
        }
    }
    (best, decoys)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(upright: f64, half: f64, most: f64) -> Option<OrientationFound> {
        best_orientation(
            |orientation| match orientation {
                Orientation::Upright => upright,
                Orientation::Half => half,
                _ => 0.0,
            },
            Orientation::is_mirrored,
            most,
        )
    }

    #[test]
    fn another_orientation_must_win_by_a_margin_and_resemble_the_scene() {
        let expect = |(upright, half): (f64, f64), orientation, likeness| {
            let found = found(upright, half, 1.0).unwrap();
            assert_eq!((found.orientation, found.likeness), (orientation, likeness));
            assert_eq!((found.upright, found.applied), (upright, false));
        };
        expect((0.5, 0.7), Orientation::Half, 0.7);
        expect((0.5, 0.55), Orientation::Upright, 0.5);
        expect((0.0, 0.25), Orientation::Upright, 0.0);
        expect((0.8, 0.7), Orientation::Upright, 0.8);
        // Shares of the largest possible likeness.
        let shares = found(0.5, 1.0, 2.0).unwrap();
        assert_eq!((shares.upright, shares.likeness), (0.25, 0.5));
    }

    #[test]
    fn an_orientation_that_looks_like_the_scene_does_not_count() {
        assert_eq!(best_orientation(|_| 0.9, |_| true, 1.0), None);
        let found = best_orientation(
            |orientation| if orientation.is_mirrored() { 0.9 } else { 0.1 },
            Orientation::is_mirrored,
            1.0,
        );
        assert_eq!(found.unwrap().orientation, Orientation::Upright);
    }
}
