//! What a recording tells of its sensor, and the profile that is made of it.

use crate::characterize::allan::AllanPoint;
use crate::characterize::cycle::Cycle;
use crate::characterize::flicker::Flicker;
use crate::characterize::presence::Presence;
use crate::characterize::steps::Steps;
use crate::characterize::timing::Timing;
use crate::frames::faults::Faults;
use crate::frames::pixels::STEP_VARIANCE;
use crate::numbers::{long_count, median};
use grideye_frame::{NoData, PIXELS, TICK};
use grideye_scene::profile::{self, Profile};
use std::collections::BTreeMap;

/// What the sensor's frame rate is, when its clock is right, frames a second.
pub(super) const NOMINAL_HZ: f64 = 1.0 / TICK.as_secs_f64();
/// Digits behind the point in a profile made of measurements: a tenth of a thousandth is far below what is known.
const PROFILE_STEP: f64 = 1e4;
/// The clock is given in steps of so many parts per million.
const PROFILE_PPM_STEP: f64 = 100.0;

/// What a recording says of the sensor that made it, and of how it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Characterization {
    /// Frames that were read.
    pub frames: u64,
    /// Frames that are recorded as missing, by reason.
    pub missing: BTreeMap<NoData, u64>,
    /// Sequence numbers that are left out.
    pub skipped: u64,
    /// Places at which they are.
    pub gaps: u64,
    /// When frames came.
    pub timing: Timing,
    /// The steps in which values come.
    pub steps: Steps,
    /// The noise of each pixel.
    pub noise: NoiseMap,
    /// What all pixels do together; `None` without a hundred frames in a row.
    pub common_mode: Option<CommonMode>,
    /// What does not change; `None` without a hundred frames in a row.
    pub pattern: Option<Pattern>,
    /// Whether somebody was there.
    pub presence: Presence,
    /// Allan deviations, as long as the recording reaches.
    pub allan: Vec<AllanPoint>,
    /// What went wrong between sensor and recording.
    pub faults: Faults,
    /// The chip's thermometer.
    pub thermistor: Thermistor,
}

/// The noise of each pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseMap {
    /// Standard deviation from frame to frame as read, °C: with the 0.072 °C of the sensor's rounding, without what all
    /// pixels do together, and without what moves in the scene.
    pub sigma_c: [f64; PIXELS],
}

/// What all pixels do together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommonMode {
    /// Standard deviation of means over ten frames, °C: the slow part. What the room does is in it.
    pub sd_c: f64,
    /// The wander of a profile that flickers alike; `None` if the recording is too short, or nothing wanders.
    pub flicker: Option<Flicker>,
    /// The cold frame in five, if there is one.
    pub cycle: Option<Cycle>,
}

/// What does not change from frame to frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pattern {
    /// The mean of each pixel, °C: with whoever was there.
    pub mean_c: [f64; PIXELS],
    /// The smooth part, of second order in place, °C above the middle pixel: taken for the scene's.
    pub surface_c: [f64; PIXELS],
    /// What each pixel has beyond it, °C: taken for the sensor's.
    pub offset_c: [f64; PIXELS],
    /// Standard deviation of that, °C.
    pub sd_c: f64,
}

/// The chip's thermometer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thermistor {
    /// Its mean, °C.
    pub mean_c: f64,
    /// The mean of the middle pixel of each frame, °C.
    pub scene_c: f64,
    /// How far the thermistor is above the scene, °C.
    pub offset_c: f64,
    /// Standard deviation from frame to frame, with its own rounding, °C.
    pub sigma_c: f64,
    /// Its trend; `None` below a minute, and where the clock jumped.
    pub drift_c_per_hour: Option<f64>,
}

impl NoiseMap {
    /// The noise of the middle pixel, °C.
    #[must_use]
    pub fn median_c(&self) -> f64 {
        median(&self.sigma_c).unwrap_or_default()
    }

    /// The least and the most noisy pixel, °C.
    #[must_use]
    pub fn range_c(&self) -> (f64, f64) {
        self.sigma_c
            .iter()
            .fold((f64::INFINITY, 0.0), |(least, most), sigma| {
                (least.min(*sigma), f64::max(most, *sigma))
            })
    }
}

impl Characterization {
    /// The frame rate by the sensor's own clock, frames a second, where it can be told: by its five-frame cycle; or else
    /// as the rate of the recording, if that has each of the sensor's frames once (nothing torn, twice, or left out).
    #[must_use]
    pub fn sensor_hz(&self) -> Option<f64> {
        let cycle = self.common_mode.and_then(|common| common.cycle);
        if let Some(cycle) = cycle {
            return cycle.sensor_hz;
        }
        let in_step = self.faults.duplicates == 0
            && self.faults.torn_share() <= 3.0 * self.faults.torn_by_chance
            && self.timing.stalls == 0;
        let rate_hz = self.timing.rate_hz;
        (in_step && (rate_hz / NOMINAL_HZ - 1.0).abs() < 0.1).then_some(rate_hz)
    }

    /// The sensor as a profile that simulator and emulator load.
    ///
    /// Its pattern is what is not smooth in the background, which holds in any room. `Background::put_into` puts the whole
    /// background of an empty room in its place.
    ///
    /// The sensor's own rounding is taken out of the pixels' sigmas, since whoever uses the profile rounds again; not out
    /// of the thermistor's, whose noise is smaller than its step, where rounding adds no such share. Numbers are
    /// rounded to 0.0001 °C and 100 ppm. Warm-up cannot be told from a recording that does not say when power came on.
    #[must_use]
    pub fn profile(&self, name: &str) -> Profile {
        let common = self.common_mode.as_ref();
        let flicker = common.and_then(|common| common.flicker);
        let cycle_depth_c = common
            .and_then(|common| common.cycle)
            .map_or(0.0, |cycle| cycle.depth_c);
        let offset_c = self
            .pattern
            .map_or([0.0; PIXELS], |pattern| pattern.offset_c.map(rounded));
        Profile {
            name: name.to_owned(),
            noise_sigma_c: self.noise.sigma_c.map(unrounded),
            common_mode: profile::CommonMode {
                sd_c: flicker.map_or(0.0, |flicker| rounded(flicker.sd_c)),
                correlation_s: flicker.map_or(0.0, |flicker| rounded(flicker.correlation_s)),
                octaves: flicker.map_or(1, |flicker| flicker.octaves),
                cycle_depth_c: rounded(cycle_depth_c),
            },
            fixed_pattern: profile::FixedPattern {
                offset_c,
                spread_c: 0.0,
            },
            thermistor: profile::Thermistor {
                offset_c: rounded(self.thermistor.offset_c),
                sigma_c: rounded(self.thermistor.sigma_c),
                lag_s: 0.0,
            },
            glitch_probability: rounded(self.glitch_share()),
            clock: profile::ClockError {
                error_ppm: self.sensor_hz().map_or(0, clock_error_ppm),
                drift_ppm_per_hour: 0,
            },
            ..Profile::default()
        }
    }

    /// Frames with a glitch as a share of all frames, 0 to 1.
    #[must_use]
    pub fn glitch_share(&self) -> f64 {
        long_count(self.faults.glitch_frames) / long_count(self.frames)
    }
}

/// The noise before the sensor rounded it, to the digits of a profile.
fn unrounded(sigma_c: f64) -> f64 {
    rounded((sigma_c * sigma_c - STEP_VARIANCE).max(0.0).sqrt())
}

/// To the digits of a profile; never minus zero.
fn rounded(value: f64) -> f64 {
    (value * PROFILE_STEP).round() / PROFILE_STEP + 0.0
}

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "the rate of a sensor is within 20 % of the nominal: 200,000 parts per million"
)]
fn clock_error_ppm(sensor_hz: f64) -> i32 {
    let ppm = (sensor_hz / NOMINAL_HZ - 1.0) * 1e6;
    ((ppm / PROFILE_PPM_STEP).round() * PROFILE_PPM_STEP) as i32
}
