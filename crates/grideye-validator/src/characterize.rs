//! The sensor itself, measured from a recording: its rate, steps, noise, common mode, pattern, faults and thermistor.
//!
//! ```text
//!  records ──▶ Characterizer ──┬─ times     rate, jitter, stalls, bursts, gaps, jumps of the clock
//!   of one      (memory does   ├─ words     steps, torn frames, duplicates, glitches
//!   stream       not grow)     ├─ pairs     noise of each pixel, people walking through left out
//!                              ├─ segments  common mode, its five-frame cycle, pattern, Allan deviation, whether somebody is there
//!                              └─▶ Characterization ──▶ text · page · JSON · a sensor profile for simulator and emulator
//! ```
//!
//! Nothing has to be told of the scene. Noise is taken from the differences of consecutive frames, as a Gaussian fitted
//! to the middle of their distribution: a person who walks through adds to its tails, which are cut off. What all
//! pixels do together is the mean of the middle three quarters of them, which a person does not reach.
//!
//! ```
//! use grideye_frame::{PixelWord, RawFrame, Reading, ThermistorWord};
//! use grideye_recording::{ClockState, Record, Stamp};
//! use grideye_validator::characterize::characterize;
//!
//! let record = |seq: u64| Record {
//!     seq,
//!     stamp: Stamp { t_boot_ns: seq * 100_000_000, t_utc_ns: 0, clock: ClockState::Unsynced },
//!     reading: Reading::Frame(RawFrame {
//!         thermistor: ThermistorWord(400),
//!         pixels: std::array::from_fn(|pixel| PixelWord(if (seq as usize + pixel) % 3 == 0 { 80 } else { 82 })),
//!     }),
//! };
//! let found = characterize((0..200).map(record))?;
//! assert_eq!(found.steps.pixel_c, Some(0.5));
//! assert!((found.timing.rate_hz - 10.0).abs() < 1e-9);
//! println!("{}", found.text());
//! # Ok::<(), grideye_validator::characterize::CharacterizeError>(())
//! ```

mod allan;
mod cycle;
mod faults;
mod found;
mod histogram;
mod number;
mod page;
mod pattern;
mod presence;
mod segment;
mod show;
mod steps;
mod thermistor;
mod timing;
mod wander;

pub use allan::AllanPoint;
pub use cycle::Cycle;
pub(crate) use faults::{FaultFinder, Standing};
pub use faults::{Faults, TORN_RUN_MIN};
pub use found::{Characterization, CommonMode, NoiseMap, Pattern, Thermistor};
pub use presence::{Presence, Spot};
pub use show::Line;
pub use steps::Steps;
pub use timing::{JUMPS_LISTED_MAX, Jump, Timing};
pub use wander::Flicker;

use grideye_frame::{NoData, PIXELS, Reading};
use grideye_recording::Record;
use histogram::Histogram;
pub(crate) use number::{mean_between, median, middle_mean, two_by_two};
use segment::Segments;
use std::collections::BTreeMap;
use steps::StepFinder;
use thermistor::ThermistorSums;
use timing::Times;

/// The fewest frames from which anything is said.
pub const FRAMES_MIN: u64 = 50;
/// Bins of the histograms of differences are this wide, °C: fine against the sensor's step of 0.25.
const DIFFERENCE_BIN_C: f64 = 1.0 / 64.0;

/// Temperatures of one frame, °C.
type Degrees = [f64; PIXELS];

/// Why a recording could not be characterised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CharacterizeError {
    /// Too few frames to say anything.
    #[error(
        "the recording has {found} frames, expected at least {needed}\nhint: five seconds tell little; record a minute or more of a room where little moves"
    )]
    TooFewFrames {
        /// Frames that were read; missing ones do not count.
        found: u64,
        /// The fewest, [`FRAMES_MIN`].
        needed: u64,
    },
    /// Sequence numbers do not rise: records of several streams, or not in their order.
    #[error(
        "sequence number {found} follows {previous}\nhint: hand in the records of one device, sensor and boot, in the recording's order"
    )]
    NotAscending {
        /// The sequence number before.
        previous: u64,
        /// The one that should be above it.
        found: u64,
    },
}

/// Measures the sensor from the records of one stream, in their order.
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

/// The same, record by record. Needs about 2 MB, however long the recording is.
#[derive(Debug)]
pub struct Characterizer {
    last_seq: Option<u64>,
    /// The frame just before, if no other was between.
    before: Option<Degrees>,
    frames: u64,
    missing: BTreeMap<NoData, u64>,
    skipped: u64,
    gaps: u64,
    times: Times,
    steps: StepFinder,
    faults: FaultFinder,
    noise: Vec<Histogram>,
    segments: Segments,
    thermistor: ThermistorSums,
}

impl Default for Characterizer {
    fn default() -> Self {
        Self::new()
    }
}

impl Characterizer {
    /// One that has seen nothing.
    #[must_use]
    pub fn new() -> Self {
        Self {
            last_seq: None,
            before: None,
            frames: 0,
            missing: BTreeMap::new(),
            skipped: 0,
            gaps: 0,
            times: Times::default(),
            steps: StepFinder::default(),
            faults: FaultFinder::default(),
            noise: vec![Histogram::new(DIFFERENCE_BIN_C); PIXELS],
            segments: Segments::default(),
            thermistor: ThermistorSums::default(),
        }
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
        let frame = amg8833::word::frame(raw);
        self.steps.push(&frame);
        self.thermistor
            .push(&frame, record.stamp.t_boot_ns, self.before.is_some());
        let pixels = frame.pixels.map(|pixel| f64::from(pixel.get()));
        let (pixels, standing) = self.faults.push(&pixels, self.before.as_ref());
        if let (Some(before), Standing::Own) = (&self.before, standing) {
            push_differences(&mut self.noise, before, &pixels);
        }
        if standing != Standing::Duplicate {
            self.segments.push(&pixels);
        }
        self.before = Some(pixels);
        Ok(())
    }

    /// What was found.
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
        let sigma_c = noise_map(&self.noise);
        let faults = self.faults.finish();
        let segments = self.segments.finish(&timing, &faults, &sigma_c);
        let thermistor = self.thermistor.finish(timing.jumps);
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

    /// Whether this is the frame right after the one before; counts those between.
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

/// What each pixel did beside what all did together.
fn push_differences(noise: &mut [Histogram], before: &Degrees, after: &Degrees) {
    let difference: Degrees = std::array::from_fn(|pixel| after[pixel] - before[pixel]);
    let together = number::middle_mean(&difference);
    for (histogram, difference) in noise.iter_mut().zip(difference) {
        histogram.push(difference - together);
    }
}

/// The noise of one frame from that of differences of two, less the share that leaves with the common mode.
fn noise_map(noise: &[Histogram]) -> Degrees {
    let of_pixels = number::float(PIXELS);
    let scale = (of_pixels / (of_pixels - 1.0) / 2.0).sqrt();
    std::array::from_fn(|pixel| noise[pixel].gaussian_sigma().unwrap_or(0.0) * scale)
}
