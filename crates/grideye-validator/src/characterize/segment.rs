//! What can be seen only in frames without a gap between them, a hundred at a time. A frame that only repeats the one
//! before is not among them: frames here are those of the sensor.

use super::Degrees;
use super::allan::{Allan, AllanPoint};
use super::cycle::CycleFinder;
use super::faults::Faults;
use super::found::{CommonMode, Pattern};
use super::number::{Spread, float, mean_between, median, middle_mean};
use super::pattern::PatternFinder;
use super::timing::Timing;
use super::wander;
use grideye_frame::PIXELS;

/// Frames of a segment: ten seconds at full rate.
pub(crate) const SEGMENT_FRAMES: usize = 100;
/// Frames of one level of the slow wander: two cycles of five, which cancel in it.
const LEVEL_FRAMES: usize = 10;
/// Collects segments; a break in the sequence drops the one that was begun.
#[derive(Debug, Default)]
pub(crate) struct Segments {
    frames: Vec<Degrees>,
    /// What each pixel had in the first segment: levels are told from there.
    reference: Option<Degrees>,
    cycle: CycleFinder,
    /// Levels of the common mode.
    levels: Spread,
    pattern: PatternFinder,
    allan: Allan,
}

/// What came of all segments.
pub(crate) struct FromSegments {
    pub(crate) common_mode: Option<CommonMode>,
    pub(crate) pattern: Option<Pattern>,
    pub(crate) allan: Vec<AllanPoint>,
}

impl Segments {
    pub(crate) fn push(&mut self, frame: &Degrees) {
        self.frames.push(*frame);
        if self.frames.len() == SEGMENT_FRAMES {
            let frames = std::mem::take(&mut self.frames);
            self.take(&frames);
            self.frames = frames;
            self.frames.clear();
        }
    }

    pub(crate) fn break_off(&mut self) {
        self.frames.clear();
        self.allan.break_off();
    }

    pub(crate) fn finish(
        self,
        timing: &Timing,
        faults: &Faults,
        sigma_c: &Degrees,
    ) -> FromSegments {
        let own_share = 1.0 - faults.duplicate_share();
        let pattern = self.pattern.finish();
        let allan = self.allan.finish(timing.period_s / own_share);
        let frame_noise = median(sigma_c).powi(2) / float(PIXELS);
        let level_noise = frame_noise / float(LEVEL_FRAMES);
        let common_mode = pattern.is_some().then(|| CommonMode {
            sd_c: (self.levels.variance() - level_noise).max(0.0).sqrt(),
            flicker: wander::flicker(&allan, frame_noise),
            cycle: self.cycle.finish(timing.rate_hz * own_share),
        });
        FromSegments {
            common_mode,
            pattern,
            allan,
        }
    }

    fn take(&mut self, frames: &[Degrees]) {
        let base: Degrees = std::array::from_fn(|pixel| {
            let mut values: Vec<f64> = frames.iter().map(|frame| frame[pixel]).collect();
            mean_between(&mut values, SEGMENT_FRAMES / 4)
        });
        let reference = *self.reference.get_or_insert(base);
        self.pattern.push(&base);
        let about_base: Vec<f64> = frames.iter().map(|frame| level(frame, &base)).collect();
        self.cycle.push(&about_base);
        for frame in frames {
            self.allan.push(frame, level(frame, &reference));
        }
        for tenth in frames.chunks_exact(LEVEL_FRAMES) {
            let mean: Degrees = std::array::from_fn(|pixel| {
                tenth.iter().map(|frame| frame[pixel]).sum::<f64>() / float(LEVEL_FRAMES)
            });
            self.levels.push(level(&mean, &reference));
        }
    }
}

/// How far a frame as a whole is above another.
fn level(frame: &Degrees, reference: &Degrees) -> f64 {
    middle_mean(&std::array::from_fn(|pixel| {
        frame[pixel] - reference[pixel]
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

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
