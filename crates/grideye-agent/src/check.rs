//! The self-test: whether a sensor is there and measures, and what to do if not.

use crate::advice;
use crate::bus::{Delay, OpenBus, Sensor, Sink, Worker, reason, settings};
use crate::clock::Clock;
use crate::config::SensorConfig;
use crate::log::Log;
use amg8833::{Address, Amg8833, FrameRate, word};
use embedded_hal::i2c::ErrorType;
use grideye_frame::{COLUMNS, Celsius, NoData, Reading, RecordedFrame};
use grideye_recording::Record;
use serde::Serialize;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// How long to read frames for the rate, in nominal periods: 2 s at 10 Hz.
pub const FRAMES: u32 = 20;
/// The same at 1 Hz.
pub const FRAMES_AT_1_HZ: u32 = 4;
/// Plausible chip temperatures, °C: the datasheet's absolute maximum ratings and some degrees more.
const OPERATING_C: std::ops::Range<f32> = -30.0..90.0;
/// Attempts to set the sensor up, because one lost byte does not make a broken sensor.
pub const SET_UP_ATTEMPTS: u32 = 3;

/// The result of checking one sensor. [`fmt::Display`] writes it for people, `Serialize` for programs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The sensor's name: `i2c-1:0x69`.
    pub sensor: String,
    /// Whether it measures as it should.
    pub ok: bool,
    /// Its measurements, if any.
    #[serde(flatten)]
    pub measured: Option<Measured>,
    /// The problem and its remedy, if there is one.
    #[serde(flatten)]
    pub trouble: Option<Trouble>,
    /// Faults on the way, by kind.
    pub errors: BTreeMap<String, u64>,
}

/// The sensor's measurements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// The chip's own temperature in °C, some degrees above the room's.
    pub thermistor_c: f32,
    /// The 64 pixels of the last frame in °C, in register order.
    pub pixels_c: Vec<f32>,
    /// Frames read.
    pub frames: usize,
    /// Frames measured meanwhile but not read.
    pub missing: usize,
    /// The sensor's own rate in frames per second, found from the times of its updates.
    pub rate_hz: f64,
    /// Uncertainty of `rate_hz`, ±.
    pub rate_error_hz: f64,
    /// The configured rate.
    pub nominal_hz: u8,
}

/// A problem and its remedy.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Trouble {
    /// The problem.
    pub error: String,
    /// The remedy.
    pub hint: String,
}

/// Checks one sensor for about two seconds (four at 1 Hz). If nothing answers, also tries the chip's other address
/// through `elsewhere`, an opener of the same bus.
pub fn check<O: OpenBus>(
    mut opener: O,
    elsewhere: Option<O>,
    sensor: &str,
    config: &SensorConfig,
    clock: &Arc<dyn Clock>,
) -> Report {
    let mut report = Report {
        sensor: sensor.to_owned(),
        ok: false,
        measured: None,
        trouble: None,
        errors: BTreeMap::new(),
    };
    if let Err((reason, trouble)) = answers(&mut opener, config, clock.as_ref()) {
        let other = config.address.other();
        // An empty address looks like this; virtio's adapter reports a short transfer.
        let is_nobody = matches!(reason, NoData::Nack | NoData::ShortTransfer);
        let elsewhere = elsewhere.filter(|_| is_nobody);
        let is_there = elsewhere.is_some_and(|opener| is_sensor(opener, other));
        report.trouble = Some(if is_there {
            at_the_other(&trouble, other)
        } else {
            trouble
        });
        return report;
    }
    let (watched, period) = watch(opener, sensor, config, clock);
    let records = watched.records.into_inner();
    report.errors = watched.errors.into_inner();
    report.trouble = trouble_with(&records, &report.errors);
    report.measured = measured(&records, period, config);
    report.ok = report.trouble.is_none() && report.measured.is_some();
    report
}
fn answers<O: OpenBus>(
    opener: &mut O,
    config: &SensorConfig,
    clock: &dyn Clock,
) -> Result<(), (NoData, Trouble)> {
    let opened = opener.open();
    let mut bus = opened.map_err(|error| {
        let text = error.to_string();
        let (what, hint) = text.split_once("\nhint: ").unwrap_or((&text, ""));
        (error.reason(), trouble(what.to_owned(), hint))
    })?;
    let mut outcome = Ok(());
    for _ in 0..SET_UP_ATTEMPTS {
        let mut driver = Amg8833::new(&mut bus, config.address);
        let set_up = driver.init(&mut Delay(clock), &settings(config));
        let Err(error) = set_up.and_then(|()| driver.configuration()) else {
            return Ok(());
        };
        let (reason, said) = (reason(opener, &error), said(opener, &error));
        let first_line = said.lines().next().unwrap_or_default();
        let address = config.address;
        let what = format!("the sensor at {address} does not answer: {reason} ({first_line})");
        outcome = Err((reason, trouble(what, advice::sensor_hint(reason))));
    }
    outcome
}

/// Whether an AMG8833 answers at this address, as far as reading can tell: clocks and gyroscopes use 0x68 too.
fn is_sensor<O: OpenBus>(mut opener: O, address: Address) -> bool {
    let Ok(mut bus) = opener.open() else {
        return false;
    };
    let mut driver = Amg8833::new(&mut bus, address);
    let is_set_up = driver.configuration().is_ok();
    let thermistor = driver.read_thermistor().map(word::thermistor_celsius);
    is_set_up && thermistor.is_ok_and(|celsius| OPERATING_C.contains(&celsius.get()))
}

fn at_the_other(trouble: &Trouble, found: Address) -> Trouble {
    let hint = format!(
        "say `address = {found}` in the configuration (`--address {found}` here), or change the board's AD_SELECT"
    );
    self::trouble(format!("{}; one does at {found}", trouble.error), &hint)
}

fn said<O: OpenBus>(opener: &O, error: &amg8833::Error<<O::Bus as ErrorType>::Error>) -> String {
    match error {
        amg8833::Error::Bus(error) => opener.describe(error),
        amg8833::Error::ShortRead {
            expected, found, ..
        } => format!("expected {expected} bytes, found {found}"),
        amg8833::Error::UndefinedPowerMode(error) => error.to_string(),
    }
}

struct Watched {
    records: RefCell<Vec<Record>>,
    errors: RefCell<BTreeMap<String, u64>>,
    clock: Arc<dyn Clock>,
    until: Duration,
}

impl Sink for Watched {
    fn record(&self, _: usize, record: Record) {
        self.records.borrow_mut().push(record);
    }

    fn fault(&self, _: usize, kind: &'static str) {
        *self.errors.borrow_mut().entry(kind.to_owned()).or_default() += 1;
    }

    fn is_stopping(&self) -> bool {
        self.clock.boot() >= self.until
    }
}

/// Reads frames as `run` does, until a working sensor must have delivered them.
fn watch<O: OpenBus>(
    opener: O,
    sensor: &str,
    config: &SensorConfig,
    clock: &Arc<dyn Clock>,
) -> (Watched, Option<(Duration, Duration)>) {
    let frames = match config.rate {
        FrameRate::One => FRAMES_AT_1_HZ,
        FrameRate::Ten => FRAMES,
    };
    let now = clock.boot();
    let time = config.rate.settling_time() + config.rate.period() * (frames + frames / 2);
    let watched = Watched {
        records: RefCell::default(),
        errors: RefCell::default(),
        clock: Arc::clone(clock),
        until: now + Duration::from_secs(1) + time,
    };
    let sensor = Sensor::new(sensor.to_owned(), *config, now, Some(u64::from(frames)));
    let mut worker = Worker::new(opener, vec![sensor], Arc::clone(clock), Log::silent());
    worker.run(&watched);
    let period = worker
        .watched
        .with(|sensors| sensors.first().and_then(|sensor| sensor.sampler.period()));
    (watched, period)
}

fn trouble_with(records: &[Record], errors: &BTreeMap<String, u64>) -> Option<Trouble> {
    let missing = records.iter().rev().find_map(|row| match row.reading {
        Reading::NoData(reason) if reason != NoData::HostStalled => Some(reason),
        _ => None,
    });
    let mut of_faults = errors.keys().filter_map(|kind| kind.parse().ok());
    let has_frames = records.iter().any(|row| row.reading.frame().is_some());
    let (error, reason) = if has_frames {
        ("frames are missing", missing?)
    } else {
        let reason = missing.or_else(|| of_faults.next());
        ("no frame came", reason.unwrap_or(NoData::NotReady))
    };
    let hint = advice::sensor_hint(reason);
    Some(trouble(format!("{error}: {reason}"), hint))
}

fn measured(
    records: &[Record],
    period: Option<(Duration, Duration)>,
    config: &SensorConfig,
) -> Option<Measured> {
    let frames = records.iter().filter_map(|row| row.reading.frame());
    let frames: Vec<&RecordedFrame> = frames.collect();
    let frame = frames.last()?;
    let (period, error) = period?;
    let rate_hz = 1.0 / period.as_secs_f64();
    Some(Measured {
        // The driver reads one with every frame.
        thermistor_c: word::thermistor_celsius(frame.thermistor?).get(),
        pixels_c: word::pixels(&frame.pixels).map(Celsius::get).to_vec(),
        frames: frames.len(),
        missing: records.len() - frames.len(),
        rate_hz,
        rate_error_hz: rate_hz * error.as_secs_f64() / period.as_secs_f64(),
        nominal_hz: config.rate.fps(),
    })
}

fn trouble(error: String, hint: &str) -> Trouble {
    let hint = hint.to_owned();
    Trouble { error, hint }
}

impl fmt::Display for Report {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let outcome = if self.ok { "ok" } else { "failed" };
        writeln!(formatter, "{}: {outcome}", self.sensor)?;
        if let Some(measured) = &self.measured {
            measured.fmt(formatter)?;
        }
        if !self.errors.is_empty() {
            write!(formatter, "faults on the way:")?;
            for (kind, count) in &self.errors {
                write!(formatter, " {kind} {count}")?;
            }
            writeln!(formatter)?;
        }
        let Some(Trouble { error, hint }) = &self.trouble else {
            return Ok(());
        };
        writeln!(formatter, "error: {error}\nhint: {hint}")
    }
}

impl fmt::Display for Measured {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for row in self.pixels_c.chunks(COLUMNS) {
            for pixel in row {
                write!(formatter, "{pixel:8.2}")?;
            }
            writeln!(formatter)?;
        }
        writeln!(
            formatter,
            "pixels in °C, pixel 1 first; thermistor {:.4} °C",
            self.thermistor_c
        )?;
        writeln!(
            formatter,
            "rate {:.2} ± {:.2} Hz ({} nominal); {} frames read, {} missing",
            self.rate_hz, self.rate_error_hz, self.nominal_hz, self.frames, self.missing
        )
    }
}
