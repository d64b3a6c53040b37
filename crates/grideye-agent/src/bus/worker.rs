//! The thread of one bus: opens it, performs its samplers' tasks, and passes the records on.

use super::open::OpenBus;
use super::sensor::{Delay, Sensor, Sink, look_over, reason};
use super::watchdog::Watched;
use crate::clock::Clock;
use crate::config::{BusConfig, SensorConfig};
use crate::log::Log;
use crate::sampler::{Due, Sampler, Span, Task};
use amg8833::{Amg8833, Error, timing};
use grideye_frame::NoData;
use std::sync::Arc;
use std::time::Duration;

/// Longest single sleep, and so the longest a stop waits for the thread.
const SLEEP_MAX: Duration = Duration::from_millis(200);
/// First pause before an attempt to reopen the bus; it doubles up to [`REOPEN_PAUSE_MAX`].
const REOPEN_PAUSE: Duration = Duration::from_millis(500);
const REOPEN_PAUSE_MAX: Duration = Duration::from_secs(10);

/// Reopen the bus after this many failed operations in a row, all its sensors together.
const FAULTS_BEFORE_REOPEN: u32 = 30;

/// Reads one bus's sensors on the calling thread, without a watchdog, until the sink stops it.
pub fn read_bus(
    opener: impl OpenBus,
    config: &BusConfig,
    clock: Arc<dyn Clock>,
    log: Log,
    sink: &impl Sink,
) {
    Worker::of_bus(opener, (config, None), clock, log).run(sink);
}
pub(crate) struct Worker<O: OpenBus> {
    pub(crate) opener: O,
    pub(crate) watched: Arc<Watched>,
    pub(crate) clock: Arc<dyn Clock>,
    pub(crate) log: Log,
    bus: Option<O::Bus>,
    reopen_at: Duration,
    reopen_pause: Duration,
    /// Last logged reason why the bus did not open.
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
        let scl_hz_max = opener.scl_hz_max();
        let quickest = scl_hz_max.map_or(Duration::ZERO, timing::read_time);
        for sensor in &mut sensors {
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

    /// For all sensors of a bus, each with this limit of frames read, if any.
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

    /// The sensor to serve next. A set-up occupies the bus for about 60 ms, less than one frame of the others.
    fn next_due(&self) -> Option<(usize, Due)> {
        self.watched.with(|sensors| {
            let dues = sensors.iter().enumerate();
            let dues = dues.filter_map(|(index, sensor)| Some((index, sensor.sampler.due()?)));
            dues.min_by_key(|(_, due)| due.at)
        })
    }

    /// Sleeps until `at`, counting frames missed meanwhile; false if the agent is stopping.
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
                    for sensor in sensors {
                        sensor.sampler.catch_up(now);
                    }
                });
                self.hand_on(sink);
            }
        }
    }

    /// Opens the bus if it is closed and due. Returns whether it is open; if not, all samplers have been told.
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
                // A bus may be missing first and forbidden then: log each new reason, not each attempt.
                let why = error.to_string();
                if self.said.as_ref() != Some(&why) {
                    self.log.error(&why);
                    self.said = Some(why);
                }
                self.reopen_later(now, error.reason());
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
        // Leave the sensors unlocked for the watchdog: the transfer may never return.
        self.watched.begin();
        let before = clock.boot();
        let (reason, tell) = match task {
            Task::SetUp => {
                let outcome = driver.init(&mut Delay(clock), &settings);
                answer(outcome.map_err(failed), Sampler::set_up)
            }
            Task::CheckSettings => {
                let outcome = look_over(&mut driver, &settings);
                answer(outcome.map_err(failed), Sampler::settings_checked)
            }
            Task::ReadFrame => answer(driver.read_frame().map_err(failed), Sampler::frame_read),
        };
        let after = clock.boot();
        if self.watched.end() {
            let name = self.opener.name();
            self.log
                .warning(format!("{name}: the stuck transfer has ended"));
        }
        self.watched.with(|sensors| {
            if let Some(sensor) = sensors.get_mut(index) {
                tell(&mut sensor.sampler, Span { before, after });
            }
        });
        self.judge_bus(reason);
    }

    /// Closes a bus that is gone or fails every operation, so that it is reopened.
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
            let name = self.opener.name();
            self.log.warning(format!(
                "{name}: closed after {reason}; it will be reopened"
            ));
            self.reopen_later(self.clock.boot(), reason);
        }
    }

    fn reopen_later(&mut self, now: Duration, reason: NoData) {
        self.reopen_at = now + self.reopen_pause;
        self.reopen_pause = (2 * self.reopen_pause).min(REOPEN_PAUSE_MAX);
        self.tell_bus_lost(now, reason);
    }

    fn hand_on(&self, sink: &impl Sink) {
        self.watched.hand_on(sink, self.clock.as_ref(), &self.log);
    }
}

type Tell = Box<dyn FnOnce(&mut Sampler, Span)>;

/// Why a task failed, and the call that gives its outcome to the sampler.
fn answer<T: 'static>(
    outcome: Result<T, NoData>,
    tell: fn(&mut Sampler, Span, Result<T, NoData>),
) -> (Option<NoData>, Tell) {
    let reason = outcome.as_ref().err().copied();
    (reason, Box::new(move |to, span| tell(to, span, outcome)))
}
