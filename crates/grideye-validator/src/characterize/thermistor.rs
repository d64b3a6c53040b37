//! The thermistor compared with the pixels, and the temperature steps of both.

use crate::frames::noise::Histogram;
use crate::numbers::{CommonStep, RunningVariance, median};
use grideye_frame::word::{PIXEL_STEP, THERMISTOR_STEP, pixel_steps, thermistor_steps};
use grideye_frame::{Celsius, PIXELS, RecordedFrame};
use serde::Serialize;

/// The sensor's thermistor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Thermistor {
    pub mean_c: f64,
    /// Mean over the frames of the median pixel, °C.
    pub scene_c: f64,
    pub offset_c: f64,
    /// Standard deviation from frame to frame, including rounding, °C.
    pub sigma_c: f64,
}

#[derive(Debug, Default)]
pub(crate) struct ThermistorSums {
    celsius: RunningVariance,
    above_scene: RunningVariance,
    scene: RunningVariance,
    differences: Histogram,
    /// Of the frame directly before.
    last_c: Option<f64>,
}

impl ThermistorSums {
    pub(crate) fn push(
        &mut self,
        thermistor: Option<Celsius>,
        pixels: &[f64; PIXELS],
        follows: bool,
    ) {
        let celsius = thermistor.map(|celsius| f64::from(celsius.get()));
        let last_c = core::mem::replace(&mut self.last_c, celsius).filter(|_| follows);
        let Some(celsius) = celsius else {
            return;
        };
        let scene_c = median(pixels).unwrap_or_default();
        if let Some(last_c) = last_c {
            self.differences.push(celsius - last_c);
        }
        self.celsius.push(celsius);
        self.scene.push(scene_c);
        self.above_scene.push(celsius - scene_c);
    }

    pub(crate) fn finish(self) -> Option<Thermistor> {
        if self.celsius.count == 0 {
            return None;
        }
        Some(Thermistor {
            mean_c: self.celsius.mean,
            scene_c: self.scene.mean,
            offset_c: self.above_scene.mean,
            sigma_c: self.differences.gaussian_sigma().unwrap_or(0.0) / 2.0_f64.sqrt(),
        })
    }
}

/// Smallest steps between values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// Of the pixels, °C; a word has 0.25. `None` if all pixels had one value throughout.
    pub pixel_c: Option<f64>,
    /// Of the thermistor, °C; a word has 0.0625. `None` if it never changed.
    pub thermistor_c: Option<f64>,
}

/// Collects the greatest common divisors of the differences to the first value.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StepFinder {
    pixel: CommonStep,
    thermistor: CommonStep,
}

impl StepFinder {
    pub(crate) fn push(&mut self, raw: &RecordedFrame) {
        for word in raw.pixels {
            self.pixel.push(pixel_steps(word));
        }
        if let Some(thermistor) = raw.thermistor {
            self.thermistor.push(thermistor_steps(thermistor));
        }
    }

    pub(crate) fn finish(self) -> Steps {
        let celsius = |CommonStep { step, .. }, unit: Celsius| {
            (step > 0).then(|| f64::from(step) * f64::from(unit.get()))
        };
        Steps {
            pixel_c: celsius(self.pixel, PIXEL_STEP),
            thermistor_c: celsius(self.thermistor, THERMISTOR_STEP),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::assert_near;
    use grideye_frame::{PixelWord, ThermistorWord};

    /// One pixel is far from the scene, which the median ignores.
    fn scene(scene_c: f64) -> [f64; PIXELS] {
        let mut pixels = [scene_c; PIXELS];
        pixels[5] = 80.0;
        pixels
    }

    #[test]
    fn the_offset_is_over_the_median_pixel() {
        let mut sums = ThermistorSums::default();
        for (thermistor_c, scene_c) in [(25.0, 20.0), (26.0, 21.0), (27.0, 20.0)] {
            sums.push(Some(Celsius::new(thermistor_c)), &scene(scene_c), true);
        }
        let found = sums.finish().unwrap();
        assert_near(found.mean_c, 26.0, 1e-12);
        assert_near(found.scene_c, 61.0 / 3.0, 1e-12);
        assert_near(found.offset_c, 17.0 / 3.0, 1e-12);
    }

    /// Steps of an eighth of a degree, corrected for the fit's cut; a difference has the noise of two values.
    #[test]
    fn noise_is_that_of_frames_that_follow_one_another() {
        let sigma = |follows: bool| {
            let mut sums = ThermistorSums::default();
            for index in 0..21_u8 {
                let thermistor = Some(Celsius::new(25.0 + 0.125 * f32::from(index % 2)));
                let follows = follows && index > 0;
                sums.push(thermistor, &scene(20.0), follows);
            }
            sums.finish().unwrap().sigma_c
        };
        let expected = 0.125 / 0.973_337_f64.sqrt() / 2.0_f64.sqrt();
        assert_near(sigma(true), expected, 1e-9);
        assert_eq!(sigma(false), 0.0);
    }

    #[test]
    fn frames_without_a_thermistor_do_not_count() {
        let mut sums = ThermistorSums::default();
        for celsius in [None, Some(25.0), None, Some(27.0)] {
            sums.push(celsius.map(Celsius::new), &scene(20.0), true);
        }
        let found = sums.finish().unwrap();
        assert_eq!((found.mean_c, found.offset_c), (26.0, 6.0));
        assert_eq!(found.sigma_c, 0.0, "no two of them follow one another");
        assert_eq!(ThermistorSums::default().finish(), None);
    }

    #[test]
    fn steps_are_what_all_values_have_in_common() {
        let mut finder = StepFinder::default();
        // 20.25, 21 and 19.5 °C.
        for word in [81, 84, 78] {
            finder.push(&RecordedFrame {
                thermistor: Some(ThermistorWord(400)),
                pixels: [PixelWord(word); PIXELS],
            });
        }
        let steps = finder.finish();
        assert_eq!(steps.pixel_c, Some(0.75));
        assert_eq!(steps.thermistor_c, None);
    }
}
