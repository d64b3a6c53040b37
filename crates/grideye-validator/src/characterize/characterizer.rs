//! Takes the records of one stream and measures the sensor.

use crate::characterize::characterization::{Characterization, NoiseMap};
use crate::characterize::histogram::Histogram;
use crate::characterize::limits::{DIFFERENCE_BIN_C, FRAMES_MIN};
use crate::characterize::segment::Segments;
use crate::characterize::steps::StepFinder;
use crate::characterize::thermistor::ThermistorSums;
use crate::characterize::timing::Times;
use crate::frames::faults::{FaultFinder, Standing};
use crate::frames::pixels::{Pixels, middle_mean};
use crate::numbers::count;
use grideye_frame::{NoData, PIXELS, Reading};
use grideye_recording::Record;
use std::collections::BTreeMap;

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
    before: Option<Pixels>,
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
fn push_differences(noise: &mut [Histogram], before: &Pixels, after: &Pixels) {
    let difference: Pixels = std::array::from_fn(|pixel| after[pixel] - before[pixel]);
    let together = middle_mean(&difference);
    for (histogram, difference) in noise.iter_mut().zip(difference) {
        histogram.push(difference - together);
    }
}

/// The noise of one frame from that of differences of two, less the share that leaves with the common mode.
fn noise_map(noise: &[Histogram]) -> Pixels {
    let of_pixels = count(PIXELS);
    let scale = (of_pixels / (of_pixels - 1.0) / 2.0).sqrt();
    std::array::from_fn(|pixel| noise[pixel].gaussian_sigma().unwrap_or(0.0) * scale)
}
