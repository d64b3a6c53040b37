//! One sensor of a bus: how the driver reads it, what the log reports, and where its records go.

use super::open::OpenBus;
use crate::advice;
use crate::clock::{Clock, Stamper};
use crate::config::SensorConfig;
use crate::log::Log;
use crate::sampler::{Checked, Event, OUT_OF_STEP, Sampler};
use amg8833::{
    Amg8833, Error, InterruptControl, InterruptLevels, InterruptMode, MovingAverage, Settings,
    Status,
};
use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::{ErrorType, I2c};
use grideye_frame::{NoData, RawFrame, Reading, RecordedFrame};
use grideye_recording::Record;
use std::collections::BTreeSet;
use std::fmt;
use std::time::Duration;

/// A released line reads as all ones.
const ONES: u8 = u8::MAX;

/// The settings to write. Every pixel is beyond the interrupt levels, so that each measurement sets the interrupt flag; no
/// reset sensor has these levels, so they reveal a silent reset.
pub(crate) fn settings(config: &SensorConfig) -> Settings {
    Settings {
        frame_rate: config.rate,
        moving_average: if config.moving_average {
            MovingAverage::Twice
        } else {
            MovingAverage::Off
        },
        interrupt: InterruptControl {
            pin_active: false,
            mode: InterruptMode::Absolute,
        },
        levels: InterruptLevels::ALWAYS,
    }
}
pub(crate) struct Delay<'a>(pub(crate) &'a dyn Clock);

impl DelayNs for Delay<'_> {
    fn delay_ns(&mut self, ns: u32) {
        self.0
            .sleep_until(self.0.boot() + Duration::from_nanos(u64::from(ns)));
    }
}

/// Compares the settings; reads the interrupt flag and clears it, so that only a new measurement sets it again.
pub(super) fn look_over<B: I2c>(
    driver: &mut Amg8833<B>,
    settings: &Settings,
) -> Result<Checked, Error<B::Error>> {
    match driver.configuration() {
        Ok(found) if found.deviation(settings).is_none() => {}
        // A line stuck high is not a sensor with wrong settings.
        Err(Error::UndefinedPowerMode(mode)) if mode.found == ONES => {
            return Err(Error::UndefinedPowerMode(mode));
        }
        Ok(_) | Err(Error::UndefinedPowerMode(_)) => return Ok(Checked::OtherSettings),
        Err(error) => return Err(error),
    }
    let has_measured = driver.status()?.interrupt;
    let mut is_cleared = false;
    // A measurement may set it again in between, but not twice in a row.
    for _ in 0..2 {
        if !is_cleared {
            driver.clear_flags(Status::ALL)?;
            is_cleared = !driver.status()?.interrupt;
        }
    }
    Ok(Checked::AsConfigured {
        has_measured,
        is_cleared,
    })
}
pub(crate) fn reason<O: OpenBus>(
    opener: &O,
    error: &Error<<O::Bus as ErrorType>::Error>,
) -> NoData {
    match error {
        Error::Bus(error) => opener.classify(error),
        Error::ShortRead { .. } => NoData::ShortTransfer,
        Error::UndefinedPowerMode(mode) if mode.found == ONES => NoData::StuckHigh,
        Error::UndefinedPowerMode(_) => NoData::WrongConfiguration,
    }
}

/// After this many faults without a good frame, the log reports that no frame comes, with a hint.
const FAULTS_BEFORE_SAID: u32 = 3;

/// Receives what a bus thread reads. Sensors are numbered from 0, in the order of their bus's configuration.
pub trait Sink {
    /// A frame, or the reason why there is none.
    fn record(&self, sensor: usize, record: Record);
    /// A fault, by the name it is counted under.
    fn fault(&self, sensor: usize, kind: &'static str);
    /// Whether to stop. Called before every task, and five times a second while there is none.
    fn is_stopping(&self) -> bool;
}
pub(crate) struct Sensor {
    id: String,
    pub(super) settings: Settings,
    pub(super) config: SensorConfig,
    pub(crate) sampler: Sampler,
    stamper: Stamper,
    is_failing: bool,
    /// Whether the log has reported missing frames or, before the first frame, that none comes.
    is_missing: bool,
    faults: u32,
    /// Faults that cost no frame and have been logged once.
    said: BTreeSet<&'static str>,
}

impl Sensor {
    pub(crate) fn new(
        id: String,
        config: SensorConfig,
        now: Duration,
        frames_limit: Option<u64>,
    ) -> Self {
        Self {
            id,
            settings: settings(&config),
            config,
            sampler: Sampler::new(config.rate.period(), now, frames_limit),
            stamper: Stamper::default(),
            is_failing: false,
            is_missing: false,
            faults: 0,
            said: BTreeSet::new(),
        }
    }

    /// Passes on all waiting events. `index` is the sensor's place on the bus.
    pub(crate) fn hand_on(&mut self, index: usize, sink: &impl Sink, clock: &dyn Clock, log: &Log) {
        while let Some(event) = self.sampler.next_event() {
            match event {
                Event::Fault(kind) => {
                    sink.fault(index, kind);
                    self.say_failing(kind, log);
                }
                Event::Record { seq, at, reading } => {
                    let stamp = self.stamper.stamp(at, clock);
                    let record = Record {
                        seq,
                        stamp,
                        reading: reading.map(RecordedFrame::from),
                    };
                    sink.record(index, record);
                    self.say_what_became(seq, &reading, log);
                }
            }
        }
    }

    fn say_failing(&mut self, kind: &'static str, log: &Log) {
        let costs_frames = kind == OUT_OF_STEP || kind.parse::<NoData>().is_ok();
        if !costs_frames {
            if self.said.insert(kind) {
                log.warning(format!("{}: {kind}, logged once, then counted", self.id));
            }
            return;
        }
        if !self.is_failing {
            self.is_failing = true;
            log.warning(format!("{}: {kind}", self.id));
        }
        self.faults = self.faults.saturating_add(1);
        // Before the first frame, missing ones have no number and thus no record, so report the faults instead.
        match kind.parse() {
            Ok(reason) if self.faults == FAULTS_BEFORE_SAID => {
                self.say_missing(format_args!("no frame comes"), reason, log);
            }
            _ => {}
        }
    }

    fn say_missing(&mut self, what: fmt::Arguments<'_>, reason: NoData, log: &Log) {
        if !self.is_missing {
            self.is_missing = true;
            let hint = advice::sensor_hint(reason);
            log.error(format!("{}: {what}: {reason}\nhint: {hint}", self.id));
        }
    }

    fn say_what_became(&mut self, seq: u64, reading: &Reading<RawFrame>, log: &Log) {
        match reading {
            Reading::NoData(reason) => {
                self.say_missing(
                    format_args!("frames are missing from {seq} on"),
                    *reason,
                    log,
                );
                self.is_failing = true;
            }
            Reading::Frame(_) if self.is_failing => {
                self.is_failing = false;
                self.is_missing = false;
                self.faults = 0;
                log.info(format!("{}: reading again from frame {seq} on", self.id));
            }
            Reading::Frame(_) => {}
        }
    }
}
