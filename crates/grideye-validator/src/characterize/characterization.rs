//! Measures the sensor from the records of one stream, and turns the result into a profile.

use crate::characterize::allan::AllanPoint;
use crate::characterize::common_mode::CommonMode;
use crate::characterize::presence::{Presence, stays_warm};
use crate::characterize::segment::{Pattern, Segments};
use crate::characterize::thermistor::{StepFinder, Steps, Thermistor, ThermistorSums};
use crate::characterize::timing::{Times, Timing};
use crate::frames::faults::{FaultFinder, Faults, Standing};
use crate::frames::noise::{PixelHistograms, apart};
use crate::frames::types::{Pixels, STEP_VARIANCE, decoded};
use crate::numbers::{long_count, median, whole};
use grideye_frame::{NoData, PIXELS, Reading, TICK};
use grideye_recording::Record;
use grideye_scene::profile::{self, Profile};
use std::collections::BTreeMap;

/// Fewest frames for a characterization.
pub const FRAMES_MIN: u64 = 50;
/// The sensor's nominal frame rate, Hz.
pub(super) const NOMINAL_HZ: f64 = 1.0 / TICK.as_secs_f64();
/// One over the resolution of a profile's values: 0.0001 is far below what is known.
const PROFILE_STEP: f64 = 1e4;
/// Resolution of the clock error, ppm.
const PROFILE_PPM_STEP: f64 = 100.0;

/// What a recording shows of its sensor, and of how it was read.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Characterization {
    /// Frames read.
    pub frames: u64,
    /// Frames recorded as missing, by reason.
    pub missing: BTreeMap<NoData, u64>,
    /// Sequence numbers that are not in the recording.
    pub skipped: u64,
    /// Places where sequence numbers are left out.
    pub gaps: u64,
    pub timing: Timing,
    pub steps: Steps,
    pub noise: NoiseMap,
    /// The common mode of all pixels; `None` without a hundred frames in a row.
    pub common_mode: Option<CommonMode>,
    /// The fixed pattern; `None` without a hundred frames in a row.
    pub pattern: Option<Pattern>,
    pub presence: Presence,
    /// Allan deviations of the common mode, as far as the recording's length allows.
    pub allan: Vec<AllanPoint>,
    /// Torn frames, duplicates and glitches.
    pub faults: Faults,
    /// `None` if the recording has no thermistor.
    pub thermistor: Option<Thermistor>,
}

/// The noise of each pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseMap {
    /// Standard deviation from frame to frame as read, °C, without the common mode and motion.
    pub sigma_c: [f64; PIXELS],
}

impl NoiseMap {
    /// Median over the pixels, °C.
    #[must_use]
    pub fn median_c(&self) -> f64 {
        median(&self.sigma_c).unwrap_or_default()
    }

    /// The least and the largest, °C.
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
    /// Whether anyone was there, if the room without people looks like this (64 values, °C): what is warm in it is no person.
    #[must_use]
    pub fn presence_in(&self, room_c: &[f64]) -> Presence {
        match (self.presence, &self.pattern) {
            (Presence::Still(_), Some(pattern)) => {
                stays_warm(&pattern.mean_c, Some(room_c)).map_or(Presence::Nobody, Presence::Still)
            }
            (presence, _) => presence,
        }
    }

    /// The sensor's true frame rate, Hz: from its five-frame cycle, or from a recording that read each frame exactly
    /// once.
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

    /// The sensor as a profile for simulator and emulator, to 0.0001 °C and 100 ppm, without warm-up.
    ///
    /// Rounding is removed from the pixels' sigmas but not from the thermistor's, whose noise is smaller than its step.
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
            thermistor: self
                .thermistor
                .map_or_else(profile::Thermistor::default, |found| profile::Thermistor {
                    offset_c: rounded(found.offset_c),
                    sigma_c: rounded(found.sigma_c),
                    lag_s: 0.0,
                }),
            glitch_probability: rounded(self.glitch_share()),
            clock: profile::ClockError {
                error_ppm: self.sensor_hz().map_or(0, clock_error_ppm),
                drift_ppm_per_hour: 0,
            },
            ..Profile::default()
        }
    }

    /// Share of frames with a glitch, 0 to 1.
    #[must_use]
    pub fn glitch_share(&self) -> f64 {
        long_count(self.faults.glitch_frames) / long_count(self.frames)
    }
}

/// The noise before rounding to the sensor's step, to a profile's resolution.
fn unrounded(sigma_c: f64) -> f64 {
    rounded((sigma_c * sigma_c - STEP_VARIANCE).max(0.0).sqrt())
}

/// To a profile's resolution; never minus zero.
fn rounded(value: f64) -> f64 {
    (value * PROFILE_STEP).round() / PROFILE_STEP + 0.0
}

fn clock_error_ppm(sensor_hz: f64) -> i32 {
    let ppm = (sensor_hz / NOMINAL_HZ - 1.0) * 1e6;
    whole((ppm / PROFILE_PPM_STEP).round() * PROFILE_PPM_STEP)
}

/// Why a recording could not be characterized.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages say what each is")]
pub enum CharacterizeError {
    #[error(
        "the recording has {found} frames, expected at least {needed}\nhint: record a minute or more of a room where little moves; five seconds show little"
    )]
    TooFewFrames { found: u64, needed: u64 },
    #[error(
        "sequence number {found} follows {previous}\nhint: pass the records of one device, sensor and boot, in the recording's order"
    )]
    NotAscending { previous: u64, found: u64 },
}

/// Measures the sensor from the records of one stream, in order.
///
/// # Errors
/// [`CharacterizeError`].
pub fn characterize(
    records: impl IntoIterator<Item = Record>,
) -> Result<Characterization, CharacterizeError> {
    let mut characterizer = Characterizer::new();
    for record in records {
        characterizer.push(&record)?;
    }
    characterizer.finish()
}

/// [`characterize`] record by record, in about 2 MB of memory for any length.
#[derive(Debug, Default)]
pub struct Characterizer {
    last_seq: Option<u64>,
    /// The frame directly before, if there is one.
    before: Option<Pixels>,
    frames: u64,
    missing: BTreeMap<NoData, u64>,
    skipped: u64,
    gaps: u64,
    times: Times,
    steps: StepFinder,
    faults: FaultFinder,
    /// Of each pixel's change beyond the common mode.
    noise: PixelHistograms,
    segments: Segments,
    thermistor: ThermistorSums,
}

impl Characterizer {
    /// A characterizer without records.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes the next record.
    ///
    /// # Errors
    /// [`CharacterizeError::NotAscending`].
    pub fn push(&mut self, record: &Record) -> Result<(), CharacterizeError> {
        let follows = self.follows(record.seq)?;
        let raw = match &record.reading {
            Reading::Frame(raw) => raw,
            Reading::NoData(reason) => {
                *self.missing.entry(*reason).or_default() += 1;
                self.break_off();
                return Ok(());
            }
        };
        if !follows {
            self.break_off();
        }
        if self.times.push(record.seq, &record.stamp, follows) {
            self.segments.break_off();
        }
        self.frames += 1;
        let pixels = decoded(raw);
        self.steps.push(raw);
        let thermistor = raw.thermistor.map(grideye_frame::word::thermistor_celsius);
        let follows = self.before.is_some();
        self.thermistor.push(thermistor, &pixels, follows);
        let (pixels, standing) = self.faults.push(&pixels, self.before.as_ref());
        if let (Some(before), Standing::Own) = (&self.before, standing) {
            self.noise.push(&apart(&pixels, before));
        }
        if standing != Standing::Duplicate {
            self.segments.push(&pixels);
        }
        self.before = Some(pixels);
        Ok(())
    }

    /// The result.
    ///
    /// # Errors
    /// [`CharacterizeError::TooFewFrames`].
    pub fn finish(self) -> Result<Characterization, CharacterizeError> {
        if self.frames < FRAMES_MIN {
            return Err(CharacterizeError::TooFewFrames {
                found: self.frames,
                needed: FRAMES_MIN,
            });
        }
        let timing = self.times.finish();
        let sigma_c = self.noise.noise_c();
        let faults = self.faults.finish();
        let segments = self.segments.finish(&timing, &faults, &sigma_c);
        let thermistor = self.thermistor.finish();
        Ok(Characterization {
            frames: self.frames,
            missing: self.missing,
            skipped: self.skipped,
            gaps: self.gaps,
            timing,
            steps: self.steps.finish(),
            noise: NoiseMap { sigma_c },
            common_mode: segments.common_mode,
            pattern: segments.pattern,
            presence: segments.presence,
            allan: segments.allan,
            faults,
            thermistor,
        })
    }

    /// Whether the frame directly follows the one before; counts the numbers between.
    fn follows(&mut self, seq: u64) -> Result<bool, CharacterizeError> {
        let Some(previous) = self.last_seq.replace(seq) else {
            return Ok(false);
        };
        if seq <= previous {
            return Err(CharacterizeError::NotAscending {
                previous,
                found: seq,
            });
        }
        let between = seq - previous - 1;
        self.skipped += between;
        self.gaps += u64::from(between > 0);
        Ok(between == 0 && self.before.is_some())
    }

    fn break_off(&mut self) {
        self.before = None;
        self.segments.break_off();
    }
}
