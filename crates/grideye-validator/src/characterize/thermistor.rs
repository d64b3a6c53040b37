use super::DIFFERENCE_BIN_C;
use super::found::Thermistor;
use super::histogram::Histogram;
use super::number::{Spread, median};
use grideye_frame::Frame;

/// Below this no trend is given, seconds: a few steps of the thermistor are no drift.
const TREND_SPAN_MIN_S: f64 = 60.0;
const NANOSECONDS_PER_SECOND: f64 = 1e9;
const SECONDS_PER_HOUR: f64 = 3600.0;

/// The thermistor against the scene and against time, without keeping either.
#[derive(Debug)]
pub(crate) struct ThermistorSums {
    celsius: Spread,
    above_scene: Spread,
    scene: Spread,
    differences: Histogram,
    last_c: f64,
    begin_ns: Option<u64>,
    span_s: f64,
    time: Spread,
    /// Sum of products of time and temperature about their running means.
    together: f64,
}

impl Default for ThermistorSums {
    fn default() -> Self {
        Self {
            celsius: Spread::default(),
            above_scene: Spread::default(),
            scene: Spread::default(),
            differences: Histogram::new(DIFFERENCE_BIN_C),
            last_c: 0.0,
            begin_ns: None,
            span_s: 0.0,
            time: Spread::default(),
            together: 0.0,
        }
    }
}

impl ThermistorSums {
    pub(crate) fn push(&mut self, frame: &Frame, t_boot_ns: u64, follows: bool) {
        let celsius = f64::from(frame.thermistor.get());
        let pixels: Vec<f64> = frame
            .pixels
            .iter()
            .map(|pixel| f64::from(pixel.get()))
            .collect();
        let scene_c = median(&pixels);
        if follows {
            self.differences.push(celsius - self.last_c);
        }
        self.last_c = celsius;
        let begin_ns = *self.begin_ns.get_or_insert(t_boot_ns);
        let t_s =
            super::number::long_float(t_boot_ns.saturating_sub(begin_ns)) / NANOSECONDS_PER_SECOND;
        self.span_s = self.span_s.max(t_s);
        let off = celsius - self.celsius.mean();
        self.time.push(t_s);
        self.celsius.push(celsius);
        self.together += off * (t_s - self.time.mean());
        self.scene.push(scene_c);
        self.above_scene.push(celsius - scene_c);
    }

    /// `jumps` of the clock leave it unknown how much time there was for a trend.
    pub(crate) fn finish(self, jumps: u64) -> Thermistor {
        let squares =
            self.time.variance() * super::number::long_float(self.time.count().saturating_sub(1));
        let trend = (self.span_s >= TREND_SPAN_MIN_S && squares > 0.0 && jumps == 0)
            .then(|| self.together / squares * SECONDS_PER_HOUR);
        Thermistor {
            mean_c: self.celsius.mean(),
            scene_c: self.scene.mean(),
            offset_c: self.above_scene.mean(),
            sigma_c: self.differences.gaussian_sigma().unwrap_or(0.0) / 2.0_f64.sqrt(),
            drift_c_per_hour: trend,
        }
    }
}
