//! The thread of one bus: opens it, does what its sensors' samplers want done, and hands the records on.

use crate::bus::OpenBus;
use crate::check;
use crate::clock::{Clock, Stamper};
use crate::config::{BusConfig, SensorConfig};
use crate::log::Log;
use crate::sampler::{Due, Event, OUT_OF_STEP, Sampler, Span, Task};
use crate::watch::Watched;
use amg8833::{Amg8833, Error, Settings, timing};
use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::I2c;
use grideye_frame::{NoData, RawFrame, Reading};
use grideye_recording::Record;
use std::collections::BTreeSet;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// The longest sleep at a stretch: how long a stop may have to wait for the thread.
pub(crate) const SLEEP_MAX: Duration = Duration::from_millis(200);
/// The pause before a bus that cannot be opened is tried again; doubles up to [`REOPEN_PAUSE_MAX`].
pub(crate) const REOPEN_PAUSE: Duration = Duration::from_millis(500);
/// The longest pause between two attempts to open a bus.
pub(crate) const REOPEN_PAUSE_MAX: Duration = Duration::from_secs(10);
/// Faults of a sensor without a good frame between them after which the log says, with what to do, that no frame comes.
const FAULTS_BEFORE_SAID: u32 = 3;
/// Failed operations in a row, of all sensors of the bus, after which the bus is opened anew.
pub(crate) const FAULTS_BEFORE_REOPEN: u32 = 30;

/// What a released line reads as.
const ONES: u8 = u8::MAX;

/// Where a bus thread hands on what it has, and whether it shall go on. Sensors are numbered as in their bus'
/// configuration, from 0.
pub trait Sink {
    /// A frame, or the reason why there is none.
    fn record(&self, sensor: usize, record: Record);
    /// A fault, by the name under which it is counted.
    fn fault(&self, sensor: usize, kind: &'static str);
    /// Whether to end. Asked before every task, and five times a second while there is none.
    fn is_stopping(&self) -> bool;
}

/// Reads the sensors of one bus on this thread, without a watchdog, until the sink says that it is enough.
pub fn read_bus(
    opener: impl OpenBus,
    config: &BusConfig,
    clock: Arc<dyn Clock>,
    log: Log,
    sink: &impl Sink,
) {
    Worker::of_bus(opener, (config, None), clock, log).run(sink);
}

/// One sensor as its bus thread sees it.
pub(crate) struct Sensor {
    id: String,
    settings: Settings,
    config: SensorConfig,
    pub(crate) sampler: Sampler,
    stamper: Stamper,
    /// Whether the log has said that something fails.
    is_failing: bool,
    /// Whether the log has said that frames are missing, or, before the first one, that none comes.
    is_missing: bool,
    /// Faults since the last good frame.
    faults: u32,
    /// What cost no frame and has been said once.
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
}

/// The registers' settings for a sensor, as the configuration asks for them. The interrupt levels are ones that no
/// pixel passes and that a reset sensor does not have, so that a silent reset is found by reading them back.
pub(crate) fn settings(config: &SensorConfig) -> Settings {
    Settings {
        frame_rate: config.rate,
        moving_average: if config.moving_average {
            amg8833::MovingAverage::Twice
        } else {
            amg8833::MovingAverage::Off
        },
        ..Settings::default()
    }
}

/// One bus and its sensors.
pub(crate) struct Worker<O: OpenBus> {
    pub(crate) opener: O,
    pub(crate) watched: Arc<Watched>,
    pub(crate) clock: Arc<dyn Clock>,
    pub(crate) log: Log,
    bus: Option<O::Bus>,
    reopen_at: Duration,
    reopen_pause: Duration,
    /// Why the bus did not open when the log last said it.
    said: Option<String>,
    faults_in_a_row: u32,
}

impl<O: OpenBus> Worker<O> {
    pub(crate) fn new(
        opener: O,
        mut sensors: Vec<Sensor>,
        clock: Arc<dyn Clock>,
        log: Log,
    ) -> Self {
        for sensor in &mut sensors {
            let quickest = opener
                .scl_hz_max()
                .map_or(Duration::ZERO, timing::read_time);
            sensor.sampler.set_transfer_min(quickest);
        }
        Self {
            opener,
            watched: Arc::new(Watched::new(sensors)),
            clock,
            log,
            bus: None,
            reopen_at: Duration::ZERO,
            reopen_pause: REOPEN_PAUSE,
            said: None,
            faults_in_a_row: 0,
        }
    }

    /// For all sensors of a bus, each up to so many frames read if there is a limit.
    pub(crate) fn of_bus(
        opener: O,
        (config, frames_limit): (&BusConfig, Option<u64>),
        clock: Arc<dyn Clock>,
        log: Log,
    ) -> Self {
        let now = clock.boot();
        let sensor = |sensor: &SensorConfig| {
            Sensor::new(config.sensor_id(sensor), *sensor, now, frames_limit)
        };
        let sensors = config.sensors.iter().map(sensor).collect();
        Self::new(opener, sensors, clock, log)
    }

    /// Runs until told to stop or until every sensor has reached its limit of frames.
    pub(crate) fn run(&mut self, sink: &impl Sink) {
        while let Some((index, due)) = self.next_due() {
            if !self.wait(due.at, sink) {
                return;
            }
            if self.open() {
                self.perform(index, due.task);
            }
            self.hand_on(sink);
        }
    }

    /// The sensor whose turn is next. A set-up takes the bus for some 60 ms, less than a frame of the others.
    fn next_due(&self) -> Option<(usize, Due)> {
        self.watched.with(|sensors| {
            let dues = sensors.iter().enumerate();
            let dues = dues.filter_map(|(index, sensor)| Some((index, sensor.sampler.due()?)));
            dues.min_by_key(|(_, due)| due.at)
        })
    }

    /// Sleeps until `at`, and counts what is missed meanwhile; false if the agent is stopping.
    fn wait(&mut self, at: Duration, sink: &impl Sink) -> bool {
        loop {
            if sink.is_stopping() {
                return false;
            }
            let now = self.clock.boot();
            if now >= at {
                return true;
            }
            self.clock.sleep_until(at.min(now + SLEEP_MAX));
            if self.bus.is_none() {
                let now = self.clock.boot();
                self.watched.with(|sensors| {
                    sensors
                        .iter_mut()
                        .for_each(|sensor| sensor.sampler.catch_up(now));
                });
                self.hand_on(sink);
            }
        }
    }

    /// Whether the bus is open, after opening it if it was not and is due. If not, every sensor has been told.
    fn open(&mut self) -> bool {
        if self.bus.is_some() {
            return true;
        }
        let now = self.clock.boot();
        if now < self.reopen_at {
            self.tell_bus_lost(now, NoData::Unplugged);
            return false;
        }
        match self.opener.open() {
            Ok(bus) => {
                self.bus = Some(bus);
                self.faults_in_a_row = 0;
                self.said = None;
                self.log.info(format!("{}: opened", self.opener.name()));
                true
            }
            Err(error) => {
                // A bus may be missing first and forbidden then: each reason is said, but none at each attempt.
                let why = error.to_string();
                if self.said.as_ref() != Some(&why) {
                    self.log.error(&why);
                    self.said = Some(why);
                }
                self.reopen_at = now + self.reopen_pause;
                self.reopen_pause = (2 * self.reopen_pause).min(REOPEN_PAUSE_MAX);
                self.tell_bus_lost(now, error.reason());
                false
            }
        }
    }

    fn tell_bus_lost(&mut self, now: Duration, reason: NoData) {
        let retry_at = self.reopen_at;
        self.watched.with(|sensors| {
            for sensor in sensors {
                sensor.sampler.bus_lost(now, reason, retry_at);
            }
        });
    }

    fn perform(&mut self, index: usize, task: Task) {
        let place = self.watched.with(|sensors| {
            let sensor = sensors.get(index)?;
            Some((sensor.config.address, sensor.settings))
        });
        let (Some(bus), Some((address, settings))) = (&mut self.bus, place) else {
            return;
        };
        let mut driver = Amg8833::new(bus, address);
        let clock = self.clock.as_ref();
        let failed = |error: Error<_>| reason(&self.opener, &error);
        // The sensors stay free for the watchdog while the bus is at work, and may never come back.
        self.watched.begin();
        let (span, outcome) = match task {
            Task::SetUp => timed(clock, || {
                Outcome::SetUp(driver.init(&mut Delay(clock), &settings).map_err(failed))
            }),
            Task::CheckSettings => timed(clock, || {
                Outcome::Settings(has_its_settings(&mut driver, &settings).map_err(failed))
            }),
            Task::ReadFrame => timed(clock, || {
                Outcome::Frame(Box::new(driver.read_frame().map_err(failed)))
            }),
        };
        let reason = outcome.reason();
        if self.watched.end() {
            let name = self.opener.name();
            self.log
                .warning(format!("{name}: the transfer that hung has ended"));
        }
        self.watched.with(|sensors| {
            if let Some(sensor) = sensors.get_mut(index) {
                outcome.tell(&mut sensor.sampler, span);
            }
        });
        self.judge_bus(reason);
    }

    /// Closes a bus that is gone, or that fails whatever is asked of it, so that it is opened anew.
    fn judge_bus(&mut self, reason: Option<NoData>) {
        let Some(reason) = reason else {
            self.faults_in_a_row = 0;
            self.reopen_pause = REOPEN_PAUSE;
            return;
        };
        self.faults_in_a_row += 1;
        if reason == NoData::Unplugged || self.faults_in_a_row >= FAULTS_BEFORE_REOPEN {
            self.bus = None;
            self.faults_in_a_row = 0;
            let now = self.clock.boot();
            self.reopen_at = now + self.reopen_pause;
            self.reopen_pause = (2 * self.reopen_pause).min(REOPEN_PAUSE_MAX);
            self.log.warning(format!(
                "{}: closed after {reason}, to be opened again",
                self.opener.name()
            ));
            self.tell_bus_lost(now, reason);
        }
    }

    fn hand_on(&self, sink: &impl Sink) {
        self.watched.hand_on(sink, self.clock.as_ref(), &self.log);
    }
}

impl Sensor {
    /// Hands on what there is of it. `index` is its place on the bus.
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
                        reading,
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
                log.warning(format!("{}: {kind}, said once and counted", self.id));
            }
            return;
        }
        if !self.is_failing {
            self.is_failing = true;
            log.warning(format!("{}: {kind}", self.id));
        }
        self.faults = self.faults.saturating_add(1);
        // Before the first frame there is no number for the ones that are missing, so the faults have to speak.
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
            let hint = check::hint(reason);
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

/// Waits of the driver on the agent's clock.
pub(crate) struct Delay<'a>(pub(crate) &'a dyn Clock);

impl DelayNs for Delay<'_> {
    fn delay_ns(&mut self, ns: u32) {
        self.0
            .sleep_until(self.0.boot() + Duration::from_nanos(u64::from(ns)));
    }
}

/// What came of a task.
enum Outcome {
    SetUp(Result<(), NoData>),
    Settings(Result<bool, NoData>),
    Frame(Box<Result<RawFrame, NoData>>),
}

impl Outcome {
    fn reason(&self) -> Option<NoData> {
        match self {
            Self::SetUp(outcome) => outcome.err(),
            Self::Settings(outcome) => outcome.err(),
            Self::Frame(outcome) => outcome.err(),
        }
    }

    fn tell(self, sampler: &mut Sampler, span: Span) {
        match self {
            Self::SetUp(outcome) => sampler.set_up(span, outcome),
            Self::Settings(outcome) => sampler.settings_checked(span, outcome),
            Self::Frame(outcome) => sampler.frame_read(span, *outcome),
        }
    }
}

fn has_its_settings<B: I2c>(
    driver: &mut Amg8833<B>,
    settings: &Settings,
) -> Result<bool, Error<B::Error>> {
    match driver.configuration() {
        Ok(found) => Ok(found.deviation(settings).is_none()),
        // A line that is stuck high is no sensor with wrong settings.
        Err(Error::UndefinedPowerMode(mode)) if mode.found != ONES => Ok(false),
        Err(error) => Err(error),
    }
}

/// What an error of the driver means for the frame.
pub(crate) fn reason<O: OpenBus>(
    opener: &O,
    error: &Error<<O::Bus as embedded_hal::i2c::ErrorType>::Error>,
) -> NoData {
    match error {
        Error::Bus(error) => opener.classify(error),
        Error::ShortRead { .. } => NoData::ShortTransfer,
        Error::UndefinedPowerMode(mode) if mode.found == ONES => NoData::StuckHigh,
        Error::UndefinedPowerMode(_) => NoData::WrongConfiguration,
    }
}

fn timed<T>(clock: &dyn Clock, operation: impl FnOnce() -> T) -> (Span, T) {
    let before = clock.boot();
    let outcome = operation();
    (
        Span {
            before,
            after: clock.boot(),
        },
        outcome,
    )
}
