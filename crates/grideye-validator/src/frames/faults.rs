//! Finds torn frames, duplicates and glitches by comparing each frame with the one before.

use crate::constants::{GLITCH_OFF_MIN_C, GLITCH_PIXELS_MAX, TORN_BY_CHANCE_MAX, TORN_RUN_MIN};
use crate::frames::types::Pixels;
use crate::numbers::{count, long_count, median};
use grideye_frame::PIXELS;
use serde::Serialize;
use std::ops::Range;

/// Faults between the sensor and the recording.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Faults {
    /// Frames compared with the one directly before.
    pub compared: u64,
    /// Those with [`TORN_RUN_MIN`] or more consecutive pixels equal to the frame before, but not all 64.
    pub torn: u64,
    /// Expected share of such frames by chance, from the share of single equal pixels.
    pub torn_by_chance: f64,
    /// Frames equal to the one before in every pixel.
    pub duplicates: u64,
    /// Longest run of duplicates.
    pub duplicates_in_a_row_max: u64,
    /// Single pixels of exactly 0.0 °C in frames otherwise far from it.
    pub glitch_pixels: u64,
    /// Frames with such a pixel.
    pub glitch_frames: u64,
}

impl Faults {
    /// Torn frames as a share of those compared, 0 to 1.
    #[must_use]
    pub fn torn_share(&self) -> f64 {
        self.share(self.torn)
    }

    /// Duplicates as a share of those compared, 0 to 1.
    #[must_use]
    pub fn duplicate_share(&self) -> f64 {
        self.share(self.duplicates)
    }

    /// Frames neither torn nor duplicate.
    pub(crate) const fn own(&self) -> u64 {
        self.compared - self.torn - self.duplicates
    }

    fn share(&self, count: u64) -> f64 {
        if self.compared == 0 {
            return 0.0;
        }
        long_count(count) / long_count(self.compared)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Standing {
    /// No frame before it.
    First,
    /// A measurement of its own.
    Own,
    /// Partly the frame before: so many consecutive pixels.
    Torn(usize),
    /// Entirely the frame before.
    Duplicate,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct FaultFinder {
    found: Faults,
    duplicates_in_a_row: u64,
    /// By the longest run of pixels equal to the frame before: frames, and equal pixels in them.
    by_run: [(u64, u64); PIXELS + 1],
}

impl Default for FaultFinder {
    fn default() -> Self {
        Self {
            found: Faults::default(),
            duplicates_in_a_row: 0,
            by_run: [(0, 0); PIXELS + 1],
        }
    }
}

impl FaultFinder {
    /// Compares a frame with the one directly before; returns it with glitches mended.
    pub(crate) fn push(&mut self, frame: &Pixels, before: Option<&Pixels>) -> (Pixels, Standing) {
        let frame = self.mended(frame, before);
        let Some(before) = before else {
            self.duplicates_in_a_row = 0;
            return (frame, Standing::First);
        };
        let found = &mut self.found;
        found.compared += 1;
        let run = longest_equal_run(&frame, before);
        let equal = frame.iter().zip(before).filter(|(now, then)| now == then);
        let (frames, equal_pixels) = &mut self.by_run[run];
        *frames += 1;
        *equal_pixels += u64::try_from(equal.count()).unwrap_or(0);
        if run == PIXELS {
            found.duplicates += 1;
            self.duplicates_in_a_row += 1;
            let longest = &mut found.duplicates_in_a_row_max;
            *longest = (*longest).max(self.duplicates_in_a_row);
            return (frame, Standing::Duplicate);
        }
        self.duplicates_in_a_row = 0;
        if run >= TORN_RUN_MIN {
            found.torn += 1;
            return (frame, Standing::Torn(run));
        }
        (frame, Standing::Own)
    }

    pub(crate) fn finish(self) -> Faults {
        Faults {
            torn_by_chance: self.by_chance(TORN_RUN_MIN),
            ..self.found
        }
    }

    /// The shortest run of equal pixels, from [`TORN_RUN_MIN`] on, that makes a frame torn: of frames with such a run, chance
    /// makes at most [`TORN_BY_CHANCE_MAX`], since a unit with little noise often repeats a pixel's step.
    pub(crate) fn torn_from(&self) -> Option<usize> {
        let compared = long_count(self.found.compared);
        (TORN_RUN_MIN..PIXELS).find(|run| {
            let found = long_count(self.frames(*run..PIXELS));
            self.by_chance(*run) * compared <= TORN_BY_CHANCE_MAX * found
        })
    }

    fn frames(&self, runs: Range<usize>) -> u64 {
        self.by_run[runs].iter().map(|(frames, _)| frames).sum()
    }

    /// Chance of such a run in a frame if pixels are equal as often as in frames without one.
    fn by_chance(&self, run: usize) -> f64 {
        let equal = self.by_run[..run].iter().map(|(_, equal)| equal).sum();
        by_chance(run, equal, self.frames(0..run))
    }

    /// The frame with glitched pixels replaced by those of the frame before, or else by the median.
    fn mended(&mut self, frame: &Pixels, before: Option<&Pixels>) -> Pixels {
        let zeros = frame.iter().filter(|celsius| **celsius == 0.0).count();
        let middle = median(frame).unwrap_or_default();
        if zeros == 0 || zeros > GLITCH_PIXELS_MAX || middle.abs() < GLITCH_OFF_MIN_C {
            return *frame;
        }
        self.found.glitch_frames += 1;
        self.found.glitch_pixels += u64::try_from(zeros).unwrap_or(0);
        std::array::from_fn(|pixel| match frame[pixel] {
            0.0 => before.map_or(middle, |before| before[pixel]),
            celsius => celsius,
        })
    }
}

fn longest_equal_run(frame: &Pixels, before: &Pixels) -> usize {
    let (mut run, mut longest) = (0, 0);
    for (now, then) in frame.iter().zip(before) {
        run = if now == then { run + 1 } else { 0 };
        longest = longest.max(run);
    }
    longest
}

/// Chance of a run of so many in a frame if pixels are equal independently at the observed rate.
fn by_chance(length: usize, equal_pixels: u64, frames: u64) -> f64 {
    if frames == 0 {
        return 0.0;
    }
    let equal = long_count(equal_pixels) / (long_count(frames) * count(PIXELS));
    let run = (0..length).fold(1.0, |product, _| product * equal);
    // A run starts at the first pixel or after a different one.
    let starts_later = 1.0 - run * (1.0 - equal);
    let none = (0..PIXELS - length).fold(1.0 - run, |product, _| product * starts_later);
    1.0 - none
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(from: f64) -> Pixels {
        let mut celsius = from - 0.25;
        std::array::from_fn(|_| {
            celsius += 0.25;
            celsius
        })
    }

    #[test]
    fn runs_duplicates_and_own_frames_are_told_apart() {
        let mut finder = FaultFinder::default();
        let first = ramp(20.0);
        let second = ramp(20.5);
        assert_eq!(finder.push(&first, None).1, Standing::First);
        assert_eq!(finder.push(&second, Some(&first)).1, Standing::Own);
        let mut seven = ramp(21.0);
        seven[10..17].copy_from_slice(&second[10..17]);
        assert_eq!(finder.push(&seven, Some(&second)).1, Standing::Own);
        let mut eight = ramp(21.5);
        eight[56..].copy_from_slice(&seven[56..]);
        assert_eq!(finder.push(&eight, Some(&seven)).1, Standing::Torn(8));
        assert_eq!(finder.push(&eight, Some(&eight)).1, Standing::Duplicate);
        assert_eq!(finder.push(&eight, Some(&eight)).1, Standing::Duplicate);
        let faults = finder.finish();
        assert_eq!((faults.compared, faults.torn, faults.duplicates), (5, 1, 2));
        assert_eq!(faults.duplicates_in_a_row_max, 2);
        assert_eq!((faults.torn_share(), faults.duplicate_share()), (0.2, 0.4));
    }

    #[test]
    fn glitches_are_counted_and_mended() {
        let mut finder = FaultFinder::default();
        let before = [21.0; PIXELS];
        let mut frame = [22.0; PIXELS];
        frame[5] = 0.0;
        assert_eq!(finder.push(&frame, Some(&before)).0[5], 21.0);
        assert_eq!(finder.push(&frame, None).0[5], 22.0);
        let near_zero = [0.0; PIXELS];
        assert_eq!(finder.push(&near_zero, None).0, near_zero);
        let mut half_dead = [22.0; PIXELS];
        half_dead[..9].fill(0.0);
        assert_eq!(finder.push(&half_dead, None).0, half_dead);
        let mut cold_room = [3.5; PIXELS];
        cold_room[1] = 0.0;
        assert_eq!(finder.push(&cold_room, None).0, cold_room);
        let faults = finder.finish();
        assert_eq!((faults.glitch_frames, faults.glitch_pixels), (2, 2));
    }

    /// By the recurrence for 64 coin tosses without a run of eight heads.
    #[test]
    fn chance_is_that_of_tossed_coins() {
        let mut without = vec![1.0_f64];
        for length in 1..=64_usize {
            let ways: f64 = if length < 8 {
                2.0_f64.powi(i32::try_from(length).unwrap())
            } else {
                without[length - 8..].iter().take(8).sum()
            };
            without.push(ways);
        }
        let exact = 1.0 - without[64] / 2.0_f64.powi(64);
        let found = by_chance(8, 32 * 100, 100);
        assert!((found - exact).abs() < 0.003, "{found} for {exact}");
        assert!(by_chance(8, 64 * 20, 100) < 0.0002);
    }

    /// With noise of half a step two frames have four of ten pixels in common, and of 100 pairs a few share a run of eight.
    #[test]
    fn little_noise_makes_no_frame_torn() {
        for (sd_c, tears) in [(0.14, 0), (0.16, 0), (0.16, 9), (0.24, 9), (0.24, 0)] {
            let mut draw = crate::numbers::normal_draws(11);
            let mut finder = FaultFinder::default();
            let mut before = [20.0; PIXELS];
            let (mut torn, mut whole) = (Vec::new(), Vec::new());
            for index in 0..400 {
                let mut frame: Pixels =
                    std::array::from_fn(|_| 0.25 * (4.0 * (20.0 + sd_c * draw())).round());
                let is_torn = index % 40 == 39 && index / 40 < tears;
                if is_torn {
                    frame[..32].copy_from_slice(&before[..32]);
                }
                let standing = finder.push(&frame, Some(&before)).1;
                if let Standing::Torn(run) = standing {
                    if is_torn { &mut torn } else { &mut whole }.push(run);
                }
                before = frame;
            }
            let from = finder.torn_from().unwrap_or(PIXELS);
            let by_chance = whole.iter().filter(|run| **run >= from).count();
            assert!(by_chance <= 2, "{sd_c}, {tears}: {by_chance} from {from}");
            assert_eq!(torn.iter().filter(|run| **run >= from).count(), tears);
        }
    }
}
