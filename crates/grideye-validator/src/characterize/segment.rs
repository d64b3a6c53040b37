//! Segments of a hundred frames, from which slow changes, the fixed pattern and presence are measured.

use crate::characterize::allan::{Allan, AllanPoint};
use crate::characterize::common_mode::{CommonMode, CycleFinder, SEGMENT_FRAMES, flicker};
use crate::characterize::presence::{Presence, PresenceFinder};
use crate::characterize::timing::Timing;
use crate::frames::faults::Faults;
use crate::frames::noise::PixelHistograms;
use crate::frames::types::{Pixels, middle_mean};
use crate::metrics::surface::{BENT, surface};
use crate::numbers::{RunningVariance, count, median, trimmed_mean};
use grideye_frame::PIXELS;

/// What does not change from frame to frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pattern {
    /// Mean of each pixel, °C, including anyone who was there.
    pub mean_c: [f64; PIXELS],
    /// The smooth part (second order), °C above the median pixel; attributed to the scene.
    pub surface_c: [f64; PIXELS],
    /// What each pixel has beyond it, °C; attributed to the sensor.
    pub offset_c: [f64; PIXELS],
    /// Standard deviation of `offset_c`, °C.
    pub sd_c: f64,
}

/// Frames per level of the slow wander: two five-frame cycles, which cancel.
const LEVEL_FRAMES: usize = 10;
/// Collects segments; a break in the sequence ends the current one.
#[derive(Debug, Default)]
pub(crate) struct Segments {
    frames: Vec<Pixels>,
    /// Each pixel's level in the first segment; later levels count from it.
    reference: Option<Pixels>,
    cycle: CycleFinder,
    levels: RunningVariance,
    pattern: PatternFinder,
    presence: PresenceFinder,
    allan: Allan,
}

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
            flicker: flicker(&allan, frame_noise),
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

    /// Uses what is too short for a segment in the Allan deviations and for presence.
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
            self.allan.push(level(frame, reference));
        }
    }
}

/// Means over ten frames; a shorter rest is dropped.
fn means(frames: &[Pixels]) -> impl Iterator<Item = Pixels> {
    frames.chunks_exact(LEVEL_FRAMES).map(|tenth| {
        std::array::from_fn(|pixel| {
            tenth.iter().map(|frame| frame[pixel]).sum::<f64>() / count(LEVEL_FRAMES)
        })
    })
}

/// How far a frame as a whole lies above another.
fn level(frame: &Pixels, reference: &Pixels) -> f64 {
    middle_mean(&std::array::from_fn(|pixel| {
        frame[pixel] - reference[pixel]
    }))
}

/// Finds each pixel's usual level against the others, from one value per segment.
#[derive(Debug, Default)]
pub(crate) struct PatternFinder(PixelHistograms);

impl PatternFinder {
    pub(crate) fn push(&mut self, base: &Pixels) {
        let middle = median(base).unwrap_or_default();
        self.0.push(&base.map(|level| level - middle));
    }

    /// Takes the median over the segments, so that a person in some of them does not show.
    pub(crate) fn finish(self, mean_c: Pixels) -> Option<Pattern> {
        let PixelHistograms(pixels) = self.0;
        if pixels.first().is_none_or(|pixel| pixel.total == 0) {
            return None;
        }
        let levels: Pixels =
            std::array::from_fn(|pixel| pixels[pixel].quantile(0.5).unwrap_or(0.0));
        let surface_c = smooth(&levels);
        let offset_c: Pixels = std::array::from_fn(|pixel| levels[pixel] - surface_c[pixel]);
        let squares: f64 = offset_c.iter().map(|offset| offset * offset).sum();
        Some(Pattern {
            mean_c,
            surface_c,
            offset_c,
            sd_c: (squares / count(PIXELS - SURFACES)).sqrt(),
        })
    }
}

/// Terms of the surface attributed to the scene.
const SURFACES: usize = 6;

/// The nearest surface of 1, x, y, xy, x² and y².
pub(crate) fn smooth(levels: &Pixels) -> Pixels {
    let all: [usize; PIXELS] = std::array::from_fn(|pixel| pixel);
    surface::<SURFACES>(levels, &all, BENT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::assert_near;

    /// By hand: 149 differences, then 89 after the gap; of averages of two, 74 and 44.
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
        // The gap's step of 3.5 degrees is in none of them, only the ramp of 0.01 per frame.
        assert_near(points[0].common_c * 2.0_f64.sqrt(), 0.01, 1e-9);
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

    #[test]
    fn a_smooth_scene_is_no_pattern() {
        let scene: Pixels = std::array::from_fn(|pixel| {
            let (x, y) = (count(pixel % 8), count(pixel / 8));
            0.3 + 0.1 * x - 0.05 * y + 0.01 * x * y - 0.02 * x * x + 0.015 * y * y
        });
        for (scene, smooth) in scene.iter().zip(smooth(&scene)) {
            assert_near(smooth, *scene, 1e-12);
        }
    }

    #[test]
    fn one_odd_pixel_is_found_beside_a_person() {
        let mut finder = PatternFinder::default();
        for segment in 0..11 {
            let mut base = [21.0; PIXELS];
            base[27] += 0.5;
            if segment < 4 {
                base[40..46].fill(24.0);
            }
            finder.push(&base);
        }
        let pattern = finder.finish([21.0; PIXELS]).unwrap();
        assert_near(pattern.offset_c[27], 0.5, 0.06);
        assert_near(pattern.offset_c[42], 0.0, 0.06);
        // One of 64 by 0.5: sqrt(0.25 / 58).
        assert_near(pattern.sd_c, 0.0657, 0.01);
    }
}
