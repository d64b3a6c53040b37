//! Detects a person in front of a sensor with a simple threshold.
//!
//! Somebody is present once enough pixels are warm enough above the frame's median, and absent after fewer were, with
//! one sensor step of hysteresis, for the hold time. The rule cannot tell who is warm or since when: a radiator, a
//! kettle, a patch of sun or a cat count too, and whoever fills more than half of the frame becomes the background.

use grideye_frame::word;
use grideye_frame::{Celsius, PIXELS};
use std::time::Duration;

/// When somebody is present.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rule {
    /// Minimum number of warm pixels, at least 1.
    pub pixels: usize,
    /// Degrees above the frame's median that make a pixel warm.
    pub above_c: f64,
    /// Somebody is absent after fewer pixels were warm for this long.
    pub hold: Duration,
}

/// The current state, and when enough pixels were last warm.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Presence {
    is_there: bool,
    last_warm_at: Duration,
}

impl Presence {
    pub(crate) fn is_there(&self) -> bool {
        self.is_there
    }

    /// Judges a frame; `now` never goes back.
    pub(crate) fn see(&mut self, pixels: &[Celsius; PIXELS], rule: &Rule, now: Duration) -> bool {
        let step_c = f64::from(word::PIXEL_STEP.get());
        let least_c = rule.above_c - if self.is_there { step_c } else { 0.0 };
        if warm_pixels(pixels, least_c) >= rule.pixels {
            self.is_there = true;
            self.last_warm_at = now;
        } else if now.saturating_sub(self.last_warm_at) >= rule.hold {
            self.is_there = false;
        }
        self.is_there
    }
}

/// Pixels at least `above_c` warmer than the median of all.
fn warm_pixels(pixels: &[Celsius; PIXELS], above_c: f64) -> usize {
    let mut sorted = pixels.map(|pixel| f64::from(pixel.get()));
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    let median_c = (sorted[middle - 1] + sorted[middle]) / 2.0;
    let is_warm = |celsius: &&f64| **celsius - median_c >= above_c;
    sorted.iter().filter(is_warm).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;
    use std::path::Path;

    const RULE: Rule = Rule {
        pixels: 2,
        above_c: 1.5,
        hold: Duration::from_secs(5),
    };

    fn frame(warm: usize, celsius: f32) -> [Celsius; PIXELS] {
        let mut pixels = [Celsius::new(20.0); PIXELS];
        pixels[..warm].fill(Celsius::new(celsius));
        pixels
    }

    fn at(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    #[test]
    fn enough_pixels_that_are_warm_enough_are_somebody() {
        for (warm, celsius, is_there) in [
            (0, 20.0, false),
            (1, 30.0, false),
            (2, 21.25, false),
            (2, 21.5, true),
            (31, 24.0, true),
            // More than half of the frame is the background.
            (33, 24.0, false),
        ] {
            let mut presence = Presence::default();
            let seen = presence.see(&frame(warm, celsius), &RULE, at(100));
            assert_eq!(seen, is_there, "{warm} pixels of {celsius} °C");
        }
    }

    #[test]
    fn somebody_stays_for_the_hold_and_while_a_step_less_is_seen() {
        let mut presence = Presence::default();
        assert!(presence.see(&frame(2, 21.5), &RULE, at(10)));
        // One step less suffices to stay, but not to arrive.
        assert!(presence.see(&frame(2, 21.25), &RULE, at(20)));
        assert!(presence.see(&frame(2, 21.0), &RULE, at(24)));
        assert!(!presence.see(&frame(2, 21.0), &RULE, at(25)));
        assert!(!presence.see(&frame(2, 21.25), &RULE, at(26)));
    }

    /// Frames that the rule calls occupied, among those people labeled as empty and as occupied.
    fn counted(name: &str) -> [(usize, usize); 2] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../recordings/linaige");
        let file = File::open(folder.join(name)).unwrap();
        let rows = grideye_import::open(file, name, &grideye_import::Options::default()).unwrap();
        let mut counted = [(0, 0); 2];
        for row in rows {
            let row = row.unwrap();
            let raw = row.record.reading.frame().copied().unwrap();
            let seen = Presence::default().see(&word::pixels(&raw.pixels), &RULE, at(0));
            let (found, of) = &mut counted[usize::from(row.labels[0] != "0")];
            *found += usize::from(seen);
            *of += 1;
        }
        counted
    }

    /// The figures of the README: each frame alone, without the hold time.
    #[test]
    fn what_the_rule_makes_of_labeled_frames_of_a_real_sensor_is_what_is_documented() {
        let room_b = counted("Session2_2021-07-01_RoomB_v2.csv");
        let room_a = counted("Session3_2021-07-06_RoomA_v2.csv");
        assert_eq!(room_b, [(0, 243), (1338, 1605)]);
        assert_eq!(room_a, [(1, 1122), (324, 550)]);
    }
}
