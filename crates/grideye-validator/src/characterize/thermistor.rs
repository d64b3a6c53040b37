//! The thermistor compared with the pixels, and the temperature steps of both.

use crate::constants::TREND_SPAN_MIN_S;
use crate::frames::noise::Histogram;
use crate::numbers::{CommonStep, RunningVariance, long_count, median};
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
    /// Its trend; `None` for less than a minute, or if the clock jumped.
    pub drift_c_per_hour: Option<f64>,
}

const NANOSECONDS_PER_SECOND: f64 = 1e9;
const SECONDS_PER_HOUR: f64 = 3600.0;

#[derive(Debug, Default)]
pub(crate) struct ThermistorSums {
    celsius: RunningVariance,
    above_scene: RunningVariance,
    scene: RunningVariance,
    differences: Histogram,
    /// Of the frame directly before.
    last_c: Option<f64>,
    begin_ns: Option<u64>,
    span_s: f64,
    time: RunningVariance,
    /// Sum of products of time and temperature around their running means.
    together: f64,
}

impl ThermistorSums {
    pub(crate) fn push(
        &mut self,
        thermistor: Option<Celsius>,
        pixels: &[f64; PIXELS],
        t_boot_ns: u64,
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
        let begin_ns = *self.begin_ns.get_or_insert(t_boot_ns);
        let t_s = long_count(t_boot_ns.saturating_sub(begin_ns)) / NANOSECONDS_PER_SECOND;
        self.span_s = self.span_s.max(t_s);
        let off = celsius - self.celsius.mean;
        self.time.push(t_s);
        self.celsius.push(celsius);
        self.together += off * (t_s - self.time.mean);
        self.scene.push(scene_c);
        self.above_scene.push(celsius - scene_c);
    }

    /// With `jumps` of the clock the time is uncertain, so there is no trend.
    pub(crate) fn finish(self, jumps: u64) -> Option<Thermistor> {
        if self.celsius.count == 0 {
            return None;
        }
        let squares = self.time.variance() * long_count(self.time.count.saturating_sub(1));
        let trend = (self.span_s >= TREND_SPAN_MIN_S && squares > 0.0 && jumps == 0)
            .then(|| self.together / squares * SECONDS_PER_HOUR);
        Some(Thermistor {
            mean_c: self.celsius.mean,
            scene_c: self.scene.mean,
            offset_c: self.above_scene.mean,
            sigma_c: self.differences.gaussian_sigma().unwrap_or(0.0) / 2.0_f64.sqrt(),
            drift_c_per_hour: trend,
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

    const SECOND_NS: u64 = 1_000_000_000;

    /// One pixel is far from the scene, which the median ignores.
    fn scene(scene_c: f64) -> [f64; PIXELS] {
        let mut pixels = [scene_c; PIXELS];
        pixels[5] = 80.0;
        pixels
    }

    fn pushed(at_ns: [u64; 3]) -> ThermistorSums {
        let mut sums = ThermistorSums::default();
        let values = [(25.0, 20.0), (26.0, 21.0), (27.0, 20.0)];
        for (at_ns, (thermistor_c, scene_c)) in at_ns.into_iter().zip(values) {
            let thermistor = Some(Celsius::new(thermistor_c));
            sums.push(thermistor, &scene(scene_c), at_ns, true);
        }
        sums
    }

    /// By hand: products around the means sum to 60, squares of time to 5,600 / 3.
    #[test]
    fn means_offset_and_trend_are_those_of_least_squares() {
        let at_ns = [7, 27, 67].map(|at_s| at_s * SECOND_NS);
        let found = pushed(at_ns).finish(0).unwrap();
        assert_near(found.mean_c, 26.0, 1e-12);
        assert_near(found.scene_c, 61.0 / 3.0, 1e-12);
        assert_near(found.offset_c, 17.0 / 3.0, 1e-12);
        let trend = found.drift_c_per_hour.unwrap();
        assert_near(trend, 60.0 * 3.0 / 5_600.0 * 3_600.0, 1e-9);
        let jumped = pushed(at_ns).finish(1).unwrap();
        assert_eq!(jumped.drift_c_per_hour, None, "a jump");
    }

    #[test]
    fn a_minute_has_a_trend_and_less_has_none() {
        for (last_ns, has_trend) in [(60 * SECOND_NS, true), (60 * SECOND_NS - 1, false)] {
            let found = pushed([0, 20 * SECOND_NS, last_ns]).finish(0).unwrap();
            assert_eq!(found.drift_c_per_hour.is_some(), has_trend, "{last_ns}");
        }
    }

    /// Steps of an eighth of a degree, corrected for the fit's cut; a difference has the noise of two values.
    #[test]
    fn noise_is_that_of_frames_that_follow_one_another() {
        let sigma = |follows: bool| {
            let mut sums = ThermistorSums::default();
            for index in 0..21_u8 {
                let thermistor = Some(Celsius::new(25.0 + 0.125 * f32::from(index % 2)));
                let follows = follows && index > 0;
                sums.push(thermistor, &scene(20.0), u64::from(index), follows);
            }
            sums.finish(0).unwrap().sigma_c
        };
        let expected = 0.125 / 0.973_337_f64.sqrt() / 2.0_f64.sqrt();
        assert_near(sigma(true), expected, 1e-9);
        assert_eq!(sigma(false), 0.0);
    }

    #[test]
    fn frames_without_a_thermistor_do_not_count() {
        let mut sums = ThermistorSums::default();
        for (at_ns, celsius) in [(0, None), (1, Some(25.0)), (2, None), (3, Some(27.0))] {
            sums.push(celsius.map(Celsius::new), &scene(20.0), at_ns, true);
        }
        let found = sums.finish(0).unwrap();
        assert_eq!((found.mean_c, found.offset_c), (26.0, 6.0));
        assert_eq!(found.sigma_c, 0.0, "no two of them follow one another");
        assert_eq!(ThermistorSums::default().finish(0), None);
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
