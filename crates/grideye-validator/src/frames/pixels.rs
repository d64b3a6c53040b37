//! The 64 pixels of one frame in degrees, and the sensor's step.

use crate::numbers::trimmed_mean;
use grideye_frame::{COLUMNS, PIXELS, PixelWord, ROWS, RawFrame};

/// Temperatures of one frame, °C.
pub(crate) type Pixels = [f64; PIXELS];

/// The variance that rounding to the sensor's step of 0.25 °C adds: a twelfth of its square (Sheppard).
pub(crate) const STEP_VARIANCE: f64 = 0.25 * 0.25 / 12.0;

/// The step of the sensor in degrees, as the driver decodes it.
#[must_use]
pub fn sensor_step_c() -> f64 {
    let decoded = |word| f64::from(amg8833::word::pixel_celsius(PixelWord(word)).get());
    decoded(1) - decoded(0)
}

/// The pixels of a frame as it was read.
pub(crate) fn decoded(raw: &RawFrame) -> Pixels {
    amg8833::word::frame(raw)
        .pixels
        .map(|pixel| f64::from(pixel.get()))
}

/// The mean of the middle three quarters of the pixels: a person, on a tenth of them, hardly moves it, and unlike the
/// median it is not bound to the sensor's steps.
pub(crate) fn middle_mean(pixels: &Pixels) -> f64 {
    trimmed_mean(&mut pixels.to_vec(), PIXELS / 8)
}

/// The mean of every two by two pixels.
pub(crate) fn two_by_two(pixels: &Pixels) -> Vec<f64> {
    let corners =
        (0..ROWS - 1).flat_map(|row| (0..COLUMNS - 1).map(move |column| row * COLUMNS + column));
    corners
        .map(|at| {
            (pixels[at] + pixels[at + 1] + pixels[at + COLUMNS] + pixels[at + COLUMNS + 1]) / 4.0
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_person_does_not_move_the_middle() {
        let mut pixels = [20.0; PIXELS];
        pixels[10..17].fill(25.0);
        assert_eq!(middle_mean(&pixels), 20.0);
    }
}
