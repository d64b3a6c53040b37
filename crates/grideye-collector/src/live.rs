//! The present state of every sensor, and the events that tell the live page of it.

mod by_sensor;
mod faults;
mod newest;
mod recent;
mod senders;
mod view;

pub(crate) use faults::RECENT_WITHIN;
pub use newest::{NewestFrame, NewestFrames};
pub use recent::RecentFrames;
pub(crate) use view::stream_json;

use crate::clock::Clock;
use crate::limits::Limits;
use crate::live::by_sensor::BySensor;
use crate::live::faults::Faults;
use crate::live::senders::Senders;
use crate::store::{Appended, Elsewhere, StoredRecord, StreamSummary};
use grideye_recording::wire::{Batch, SensorBatch};
use grideye_recording::{ClockState, Record};
use serde_json::{Value, json};
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::broadcast;

/// One server-sent event.
#[derive(Debug, Clone)]
pub(crate) struct Event {
    pub(crate) name: &'static str,
    pub(crate) data: Arc<str>,
}

impl Event {
    pub(crate) fn new(name: &'static str, data: &Value) -> Self {
        Self {
            name,
            data: data.to_string().into(),
        }
    }
}

/// What is known of the sensors now, and who wants to hear of it.
pub(crate) struct Live {
    sensors: Mutex<BySensor<Sensor>>,
    senders: Mutex<Senders>,
    recent: RecentFrames,
    events: broadcast::Sender<Event>,
    clock: Arc<dyn Clock>,
    limits: Limits,
}

/// One sensor as it is shown.
struct Sensor {
    stream: StreamSummary,
    /// The record that is newest by the time it was measured.
    newest: Option<Measured>,
    /// The newest record that has pixels.
    newest_frame: Option<Measured>,
    /// The device's boot clock at record 0 of the run, if that came while this collector ran.
    began_boot_ns: Option<u64>,
    /// Boot times of the frames within the rate's window, in nanoseconds.
    recent_boot_ns: VecDeque<u64>,
    faults: Faults,
}

/// A record, held or lent, and when it was measured. A batch lends its records: the newest alone is kept.
#[derive(Debug, Clone, Copy)]
struct Measured<R = Record> {
    record: R,
    /// On the collector's monotonic clock; below 0 when it was before that began.
    measured_ns: i128,
    basis: AgeBasis,
}

/// By what the age of a frame is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum AgeBasis {
    /// The device's boot clock when the frame was read and when it was sent.
    BootClock,
    /// The wall clocks of the device, which was set, and of the collector.
    WallClock,
    /// Only the time since it arrived: it is at least so old.
    Arrival,
}

/// Frames within the window of the rate that are remembered for each sensor.
const RECENT_MAX: usize = 128;

impl Live {
    /// Starts from what the store holds, so that a restart of the collector does not empty the page.
    pub(crate) fn new(
        clock: Arc<dyn Clock>,
        limits: &Limits,
        streams: Vec<StreamSummary>,
        newest: Vec<StoredRecord>,
    ) -> Self {
        let (events, _) = broadcast::channel(limits.live_lag_max.max(1));
        let live = Self {
            sensors: Mutex::default(),
            senders: Mutex::default(),
            recent: RecentFrames::new(limits),
            events,
            clock,
            limits: limits.clone(),
        };
        let mut streams: BTreeMap<_, _> = streams
            .into_iter()
            .map(|stream| (stream.id.clone(), stream))
            .collect();
        for stored in newest.into_iter().take(limits.sensors_max) {
            if let Some(stream) = streams.remove(&*stored.stream) {
                live.restore(stream, &stored);
            }
        }
        live
    }

    fn restore(&self, stream: StreamSummary, stored: &StoredRecord) {
        let since_arrival = i128::from(self.clock.utc_ns()) - i128::from(stored.t_arrival_ns);
        let arrived_ns = self.now_ns() - since_arrival.max(0);
        let mut sensor = Sensor::new(stream);
        sensor.faults = Faults::before(sensor.stream.account.as_ref());
        let measured = Measured::new(&stored.record, None, arrived_ns, stored.t_arrival_ns);
        sensor.show(&[measured], &self.limits);
        let id = Arc::clone(&sensor.stream.id);
        self.sensors().insert(&id.device, &id.sensor, sensor);
    }

    /// Whether the batch's sensors are known, or there is room for them.
    pub(crate) fn has_room_for(&self, batch: &Batch) -> bool {
        let sensors = self.sensors();
        let new = batch
            .sensors
            .iter()
            .filter(|part| sensors.get(&batch.device, &part.sensor).is_none())
            .count();
        sensors.len() + new <= self.limits.sensors_max
    }

    /// Takes in what the store has just kept, and tells those who listen.
    pub(crate) fn take(&self, batch: &Batch, appended: Appended, t_arrival_ns: i64) {
        let now = self.clock.monotonic();
        let now_ns = nanoseconds(now);
        // A batch without a count is somebody's who posts by hand, and one of a run that has ended is the next one's.
        let account = batch.sensors.iter().find_map(|part| part.account.as_ref());
        let is_going_on = account.is_some_and(|account| !account.ended);
        let rivals = self.hear(&batch.device, &batch.boot, is_going_on, now);
        let mut changed = Vec::new();
        let mut sensors = self.sensors();
        for (part, kept) in batch.sensors.iter().zip(appended.sensors) {
            let stream = kept.stream;
            let (device, name, most) = (&batch.device, &part.sensor, self.limits.sensors_max);
            let new = || Sensor::new(stream.clone());
            let Some(sensor) = sensors.get_or_make(device, name, most, new) else {
                continue;
            };
            // The clock of a run that has ended need not be the sender's, so its frames could pass as new.
            let is_backlog = part.account.as_ref().is_some_and(|account| account.ended);
            let arrived = fresh_records(part, &kept.fresh)
                .filter(|_| !is_backlog)
                .map(|record| Measured::new(record, batch.t_sent_boot_ns, now_ns, t_arrival_ns));
            let id = Arc::clone(&stream.id);
            let shown = sensor.take(stream, arrived, &self.limits);
            sensor.faults.count(sensor.stream.account.as_ref(), now);
            self.recent.take(&id, records_of(&shown));
            if self.events.receiver_count() > 0 {
                let skipped = shown.len().saturating_sub(self.limits.live_frames_max);
                let event = sensor.event(&shown[skipped..], now_ns, self.limits.rate_window);
                changed.push(with_rivals(event, &rivals));
            }
        }
        drop(sensors);
        if !changed.is_empty() {
            self.tell(Event::new("frames", &json!({ "sensors": changed })));
        }
    }

    /// Takes in what another collector has kept in the same store, and tells those who listen.
    pub(crate) fn take_elsewhere(&self, news: Elsewhere) {
        let now = self.clock.monotonic();
        let now_ns = nanoseconds(now);
        let id = Arc::clone(&news.stream.id);
        let account = news.stream.account.as_ref();
        let is_going_on = account.is_some_and(|account| !account.ended);
        let rivals = self.hear(&id.device, &id.boot, is_going_on, now);
        let mut sensors = self.sensors();
        let new = || Sensor::new(news.stream.clone());
        let most = self.limits.sensors_max;
        let Some(sensor) = sensors.get_or_make(&id.device, &id.sensor, most, new) else {
            return;
        };
        let sent = news.t_sent_boot_ns;
        let arrived = news
            .records
            .iter()
            .map(|stored| Measured::new(&stored.record, sent, now_ns, stored.t_arrival_ns));
        let shown = sensor.take(news.stream, arrived, &self.limits);
        sensor.faults.count(sensor.stream.account.as_ref(), now);
        self.recent.take(&sensor.stream.id, records_of(&shown));
        if self.events.receiver_count() == 0 {
            return;
        }
        let event = sensor.event(&shown, now_ns, self.limits.rate_window);
        drop(sensors);
        let event = with_rivals(event, &rivals);
        self.tell(Event::new("frames", &json!({ "sensors": [event] })));
    }

    /// Notes that a run has sent, if it is one that goes on. The runs that take turns as this device.
    fn hear(&self, device: &str, boot: &str, is_going_on: bool, now: Duration) -> Vec<String> {
        let mut senders = self.senders();
        if is_going_on {
            senders.heard(device, boot, now, self.limits.sensors_max);
        }
        owned(&senders.rivals(device, now))
    }

    /// The devices that several agents send as, and the runs of these: `[{"device": …, "boots": […]}]`.
    pub(crate) fn rivals_json(&self) -> Value {
        let senders = self.senders();
        let rivals = senders.all_rivals(self.clock.monotonic());
        let rivals = rivals.iter();
        rivals
            .map(|(device, boots)| json!({ "device": device, "boots": boots }))
            .collect()
    }

    /// The newest frames of the sensors that are asked for.
    pub(crate) fn recent(&self) -> &RecentFrames {
        &self.recent
    }

    /// Sends an event to all who listen.
    pub(crate) fn tell(&self, event: Event) {
        // No listener is no fault.
        let _ = self.events.send(event);
    }

    pub(crate) fn listen(&self) -> broadcast::Receiver<Event> {
        self.events.subscribe()
    }

    /// Every sensor with its newest frame, in the shape of a `frames` event.
    pub(crate) fn snapshot(&self) -> Value {
        let now_ns = self.now_ns();
        let sensors = self.sensors();
        let shown: Vec<Value> = sensors
            .values()
            .map(|sensor| {
                let event = sensor.event(&sensor.last_shown(), now_ns, self.limits.rate_window);
                self.told_of_rivals(sensor, event)
            })
            .collect();
        json!({ "sensors": shown })
    }

    /// Every sensor with its newest frame, raw words included.
    pub(crate) fn sensors_json(&self) -> Value {
        let now_ns = self.now_ns();
        let sensors = self.sensors();
        let states: Vec<Value> = sensors
            .values()
            .map(|sensor| {
                self.told_of_rivals(sensor, sensor.state(now_ns, self.limits.rate_window))
            })
            .collect();
        json!({ "sensors": states })
    }

    /// Sensors of which the present state is held.
    pub(crate) fn sensors_count(&self) -> usize {
        self.sensors().len()
    }

    fn told_of_rivals(&self, sensor: &Sensor, shown: Value) -> Value {
        let senders = self.senders();
        let rivals = senders.rivals(&sensor.stream.id.device, self.clock.monotonic());
        with_rivals(shown, &owned(&rivals))
    }

    fn senders(&self) -> MutexGuard<'_, Senders> {
        self.senders.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn sensors(&self) -> MutexGuard<'_, BySensor<Sensor>> {
        self.sensors.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn now_ns(&self) -> i128 {
        nanoseconds(self.clock.monotonic())
    }
}

/// A sensor as it is shown, with the runs that take turns as its device, `null` where there is one alone.
fn with_rivals(mut shown: Value, rivals: &[String]) -> Value {
    shown["rivals"] = if rivals.is_empty() {
        Value::Null
    } else {
        rivals.into()
    };
    shown
}

fn owned(boots: &[&str]) -> Vec<String> {
    boots.iter().copied().map(str::to_owned).collect()
}

fn records_of<'r>(shown: &[Measured<&'r Record>]) -> impl Iterator<Item = &'r Record> {
    shown.iter().map(|measured| measured.record)
}

fn fresh_records<'a>(
    part: &'a SensorBatch,
    fresh: &'a [u64],
) -> impl Iterator<Item = &'a Record> + 'a {
    let frames = part.frames.iter();
    frames.filter(|record| fresh.binary_search(&record.seq).is_ok())
}

impl Sensor {
    fn new(stream: StreamSummary) -> Self {
        Self {
            stream,
            newest: None,
            newest_frame: None,
            began_boot_ns: None,
            recent_boot_ns: VecDeque::new(),
            faults: Faults::default(),
        }
    }

    /// Shows what is newer than what is shown, and answers what that was. A backlog is kept, not shown.
    fn take<'r>(
        &mut self,
        stream: StreamSummary,
        arrived: impl Iterator<Item = Measured<&'r Record>>,
        limits: &Limits,
    ) -> Vec<Measured<&'r Record>> {
        let mut shown = Vec::with_capacity(arrived.size_hint().1.unwrap_or(0));
        for measured in arrived {
            let own = self.newest.as_ref().map(Measured::lent);
            let newest = shown.last().copied().or(own);
            if self.stream.id == stream.id {
                if newest.is_some_and(|newest| newest.record.seq >= measured.record.seq) {
                    continue;
                }
            } else if newest.is_some_and(|newest| newest.measured_ns >= measured.measured_ns) {
                continue;
            } else {
                *self = Self::new(stream.clone());
            }
            shown.push(measured);
        }
        self.show(&shown, limits);
        if self.stream.id == stream.id {
            self.stream = stream;
        }
        shown
    }

    /// Shows records that are each newer than the one before.
    fn show(&mut self, shown: &[Measured<&Record>], limits: &Limits) {
        let Some(newest) = shown.last() else { return };
        let has_pixels = |measured: &&Measured<&Record>| measured.record.reading.frame().is_some();
        let boot_ns = |measured: &Measured<&Record>| measured.record.stamp.t_boot_ns;
        if let Some(first) = shown.iter().find(|measured| measured.record.seq == 0) {
            self.began_boot_ns = Some(boot_ns(first));
        }
        self.newest = Some(newest.held());
        if let Some(frame) = shown.iter().rfind(has_pixels) {
            self.newest_frame = Some(frame.held());
        }
        let frames = shown.iter().filter(has_pixels);
        self.recent_boot_ns.extend(frames.map(boot_ns));
        let window_ns = u64::try_from(limits.rate_window.as_nanos()).unwrap_or(u64::MAX);
        let oldest_ns = boot_ns(newest).saturating_sub(window_ns);
        while self.recent_boot_ns.len() > RECENT_MAX
            || self
                .recent_boot_ns
                .front()
                .is_some_and(|first| *first < oldest_ns)
        {
            self.recent_boot_ns.pop_front();
        }
    }

    /// The newest frame, and after it the newest record if that one has no pixels.
    fn last_shown(&self) -> Vec<Measured<&Record>> {
        let newest = self.newest.as_ref();
        let missing = newest.filter(|newest| newest.record.reading.frame().is_none());
        let shown = self.newest_frame.as_ref().into_iter().chain(missing);
        shown.map(Measured::lent).collect()
    }

    /// Frames a second by the device's own clock; `None` when the sensor has been silent for the rate's window.
    fn rate_hz(&self, now_ns: i128, window: Duration) -> Option<f64> {
        let newest = self.newest_frame.as_ref()?;
        if now_ns - newest.measured_ns > nanoseconds(window) {
            return None;
        }
        let (first, last) = (self.recent_boot_ns.front()?, self.recent_boot_ns.back()?);
        let span = Duration::from_nanos(last.checked_sub(*first)?);
        let intervals = u32::try_from(self.recent_boot_ns.len() - 1).ok()?;
        (!span.is_zero()).then(|| f64::from(intervals) / span.as_secs_f64())
    }
}

impl Measured {
    fn lent(&self) -> Measured<&Record> {
        Measured {
            record: &self.record,
            measured_ns: self.measured_ns,
            basis: self.basis,
        }
    }
}

impl<'r> Measured<&'r Record> {
    fn held(&self) -> Measured {
        Measured {
            record: *self.record,
            measured_ns: self.measured_ns,
            basis: self.basis,
        }
    }

    /// Finds out when a record was measured that arrived at `arrived_ns` on the monotonic clock.
    fn new(
        record: &'r Record,
        t_sent_boot_ns: Option<u64>,
        arrived_ns: i128,
        t_arrival_ns: i64,
    ) -> Self {
        let by_boot_clock = t_sent_boot_ns
            .and_then(|sent| sent.checked_sub(record.stamp.t_boot_ns))
            .map(|age| (i128::from(age), AgeBasis::BootClock));
        let by_wall_clock = || {
            let age = i128::from(t_arrival_ns) - i128::from(record.stamp.t_utc_ns);
            let believed = record.stamp.clock != ClockState::Unsynced && age >= 0;
            believed.then_some((age, AgeBasis::WallClock))
        };
        let (age_ns, basis) = by_boot_clock
            .or_else(by_wall_clock)
            .unwrap_or((0, AgeBasis::Arrival));
        Self {
            record,
            measured_ns: arrived_ns - age_ns,
            basis,
        }
    }
}

fn nanoseconds(duration: Duration) -> i128 {
    i128::try_from(duration.as_nanos()).unwrap_or(i128::MAX)
}
