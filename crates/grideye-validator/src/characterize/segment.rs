//! Runs of a hundred frames: what is slow in a recording is taken from these.

use crate::characterize::allan::{Allan, AllanPoint};
use crate::characterize::characterization::{CommonMode, Pattern};
use crate::characterize::cycle::CycleFinder;
use crate::characterize::flicker;
use crate::characterize::limits::SEGMENT_FRAMES;
use crate::characterize::pattern::PatternFinder;
use crate::characterize::presence::{Presence, PresenceFinder};
use crate::characterize::timing::Timing;
use crate::frames::faults::Faults;
use crate::frames::pixels::{Pixels, middle_mean};
use crate::numbers::{RunningVariance, count, median, trimmed_mean};
use grideye_frame::PIXELS;

/// Frames of one level of the slow wander: two cycles of five, which cancel in it.
const LEVEL_FRAMES: usize = 10;
/// Collects segments; a break in the sequence ends the one that was begun.
#[derive(Debug, Default)]
pub(crate) struct Segments {
    frames: Vec<Pixels>,
    /// What each pixel had in the first segment: levels are told from there.
    reference: Option<Pixels>,
    cycle: CycleFinder,
    /// Levels of the common mode.
    levels: RunningVariance,
    pattern: PatternFinder,
    presence: PresenceFinder,
    allan: Allan,
}

/// What came of all segments.
pub(crate) struct FromSegments {
    pub(crate) common_mode: Option<CommonMode>,
    pub(crate) pattern: Option<Pattern>,
    pub(crate) presence: Presence,
    pub(crate) allan: Vec<AllanPoint>,
}

impl Segments {
    pub(crate) fn push(&mut self, frame: &Pixels) {
        self.frames.push(*frame);
        if self.frames.len() == SEGMENT_FRAMES {
            let frames = std::mem::take(&mut self.frames);
            self.take(&frames);
            self.frames = frames;
            self.frames.clear();
        }
    }

    pub(crate) fn break_off(&mut self) {
        self.take_rest();
        self.allan.break_off();
    }

    pub(crate) fn finish(
        mut self,
        timing: &Timing,
        faults: &Faults,
        sigma_c: &Pixels,
    ) -> FromSegments {
        self.take_rest();
        let own_share = 1.0 - faults.duplicate_share();
        let pattern = self
            .presence
            .mean_c()
            .and_then(|mean_c| self.pattern.finish(mean_c));
        let allan = self.allan.finish(timing.period_s / own_share);
        let frame_noise = median(sigma_c).unwrap_or_default().powi(2) / count(PIXELS);
        let level_noise = frame_noise / count(LEVEL_FRAMES);
        let common_mode = pattern.is_some().then(|| CommonMode {
            sd_c: (self.levels.variance() - level_noise).max(0.0).sqrt(),
            flicker: flicker::flicker(&allan, frame_noise),
            cycle: self.cycle.finish(timing.rate_hz * own_share),
        });
        FromSegments {
            common_mode,
            pattern,
            presence: self.presence.finish(sigma_c),
            allan,
        }
    }

    fn take(&mut self, frames: &[Pixels]) {
        let base: Pixels = std::array::from_fn(|pixel| {
            let mut values: Vec<f64> = frames.iter().map(|frame| frame[pixel]).collect();
            trimmed_mean(&mut values, SEGMENT_FRAMES / 4)
        });
        let reference = *self.reference.get_or_insert(base);
        self.pattern.push(&base);
        let about_base: Vec<f64> = frames.iter().map(|frame| level(frame, &base)).collect();
        self.cycle.push(&about_base);
        self.average(frames, &reference);
        for mean in means(frames) {
            self.levels.push(level(&mean, &reference));
            self.presence.push(&mean, &reference);
        }
    }

    /// What is too short for a segment still has averages that follow on one another, and may show somebody.
    fn take_rest(&mut self) {
        let mut frames = std::mem::take(&mut self.frames);
        if let Some(reference) = self.reference {
            self.average(&frames, &reference);
            for mean in means(&frames) {
                self.presence.push(&mean, &reference);
            }
        }
        frames.clear();
        self.frames = frames;
    }

    fn average(&mut self, frames: &[Pixels], reference: &Pixels) {
        for frame in frames {
            self.allan.push(frame, level(frame, reference));
        }
    }
}

/// Means over ten frames; what is left at the end is in none.
fn means(frames: &[Pixels]) -> impl Iterator<Item = Pixels> {
    frames.chunks_exact(LEVEL_FRAMES).map(|tenth| {
        std::array::from_fn(|pixel| {
            tenth.iter().map(|frame| frame[pixel]).sum::<f64>() / count(LEVEL_FRAMES)
        })
    })
}

/// How far a frame as a whole is above another.
fn level(frame: &Pixels, reference: &Pixels) -> f64 {
    middle_mean(&std::array::from_fn(|pixel| {
        frame[pixel] - reference[pixel]
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: the first 100 frames and the 50 behind them are 149 differences, the 90 beyond the gap 89; of averages of
    /// two there are 75 and 45.
    #[test]
    fn frames_that_make_no_segment_count_for_the_allan_deviation() {
        let mut segments = Segments::default();
        let ramp = |place: u32| [20.0 + 0.01 * f64::from(place); PIXELS];
        (0..150).for_each(|place| segments.push(&ramp(place)));
        segments.break_off();
        (500..590).for_each(|place| segments.push(&ramp(place)));
        segments.take_rest();
        assert_eq!(segments.allan.pairs(0), 149 + 89);
        assert_eq!(segments.allan.pairs(1), 74 + 44);
        let points = segments.allan.finish(0.1);
        // The gap's step of 3.5 degrees is in none of them: a ramp of 0.01 a frame alone.
        assert!(
            (points[0].common_c * 2.0_f64.sqrt() - 0.01).abs() < 1e-9,
            "{points:?}"
        );
    }

    #[test]
    fn a_break_drops_the_segment_that_was_begun() {
        let mut segments = Segments::default();
        for _ in 0..5 {
            (1..SEGMENT_FRAMES).for_each(|_| segments.push(&[20.0; PIXELS]));
            segments.break_off();
        }
        assert!(segments.reference.is_none());
        (0..SEGMENT_FRAMES).for_each(|_| segments.push(&[20.0; PIXELS]));
        assert!(segments.reference.is_some());
        assert!(segments.frames.is_empty() && segments.frames.capacity() < 2 * SEGMENT_FRAMES);
    }
}
