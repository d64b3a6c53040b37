//! The steps in which temperatures come.

use crate::numbers::greatest_common_divisor;
use amg8833::word::{PIXEL_STEP, THERMISTOR_STEP};
use grideye_frame::Frame;

/// The steps in which values come: what all of them are multiples of, from the first one on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// Of the pixels, °C; `None` if every pixel always had one and the same value. A word has 0.25.
    pub pixel_c: Option<f64>,
    /// Of the thermistor, °C; `None` if it never changed. A word has 0.0625.
    pub thermistor_c: Option<f64>,
}

/// Collects the greatest common divisors of the differences to the first value.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StepFinder {
    pixel: Divisor,
    thermistor: Divisor,
}

impl StepFinder {
    pub(crate) fn push(&mut self, frame: &Frame) {
        for pixel in frame.pixels {
            self.pixel.push(pixel.get() / PIXEL_STEP.get());
        }
        self.thermistor
            .push(frame.thermistor.get() / THERMISTOR_STEP.get());
    }

    pub(crate) fn finish(self) -> Steps {
        Steps {
            pixel_c: self.pixel.times(f64::from(PIXEL_STEP.get())),
            thermistor_c: self.thermistor.times(f64::from(THERMISTOR_STEP.get())),
        }
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct Divisor {
    first: Option<i32>,
    divisor: u32,
}

impl Divisor {
    #[expect(
        clippy::as_conversions,
        clippy::cast_possible_truncation,
        reason = "a decoded word is a whole number of its steps, of twelve bits"
    )]
    fn push(&mut self, steps: f32) {
        let steps = steps as i32;
        let first = *self.first.get_or_insert(steps);
        self.divisor = greatest_common_divisor(self.divisor, steps.abs_diff(first));
    }

    fn times(self, step_c: f64) -> Option<f64> {
        (self.divisor > 0).then(|| f64::from(self.divisor) * step_c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use grideye_frame::Celsius;

    #[test]
    fn steps_are_what_all_values_have_in_common() {
        let mut finder = StepFinder::default();
        for celsius in [20.25, 21.0, 19.5] {
            let mut frame = Frame::uniform(Celsius::new(celsius));
            frame.thermistor = Celsius::new(25.0);
            finder.push(&frame);
        }
        let steps = finder.finish();
        assert_eq!(steps.pixel_c, Some(0.75));
        assert_eq!(steps.thermistor_c, None);
    }
}
