//! The current state of every sensor, and the events that update the live page.

use crate::clock::Clock;
use crate::limits::Limits;
use crate::live::by_sensor::BySensor;
use crate::live::people::{Counted, Counting, People};
use crate::live::recent::RecentFrames;
use crate::live::senders::Senders;
use crate::live::sensor::{Measured, Sensor, nanoseconds};
use crate::lock::lock;
use crate::store::{Appended, Elsewhere, StoredRecord, StreamSummary};
use grideye_recording::wire::{Batch, SensorBatch};
use grideye_recording::{Record, StreamId};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::sync::broadcast;

pub(crate) struct Live {
    sensors: Mutex<BySensor<Sensor>>,
    senders: Mutex<Senders>,
    recent: RecentFrames,
    events: broadcast::Sender<Event>,
    clock: Arc<dyn Clock>,
    limits: Limits,
    counting: Option<Counting>,
}

impl Live {
    /// Starts from the store's state, so that a restart of the collector does not empty the page.
    pub(crate) fn new(
        clock: Arc<dyn Clock>,
        limits: &Limits,
        counting: Option<Counting>,
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
            counting,
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
        sensor.faults.count(sensor.stream.account.as_ref(), None);
        let measured = Measured::new(&stored.record, None, arrived_ns, stored.t_arrival_ns);
        sensor.show(&[measured], &self.limits);
        let id = Arc::clone(&sensor.stream.id);
        lock(&self.sensors).insert(&id.device, &id.sensor, sensor);
    }

    /// Whether the batch is of the boot that each of its sensors shows.
    pub(crate) fn shows_boot_of(&self, batch: &Batch) -> bool {
        let sensors = lock(&self.sensors);
        let mut parts = batch.sensors.iter();
        parts.all(|part| {
            let shown = sensors.get(&batch.device, &part.sensor);
            shown.is_some_and(|sensor| sensor.stream.id.boot == batch.boot)
        })
    }

    /// Takes in the records just stored, and sends them to listeners.
    pub(crate) fn take(&self, batch: &Batch, appended: Appended, t_arrival_ns: i64) {
        let now = self.clock.monotonic();
        let now_ns = nanoseconds(now);
        // A batch without an account was posted by hand, and one of an ended boot is sent by the next boot.
        let account = batch.sensors.iter().find_map(|part| part.account.as_ref());
        let is_going_on = account.is_some_and(|account| !account.ended);
        let rivals = self.hear(&batch.device, &batch.boot, is_going_on, now);
        let mut changed = Vec::new();
        let mut sensors = lock(&self.sensors);
        for (part, kept) in batch.sensors.iter().zip(appended.sensors) {
            // The clock of an ended boot may differ from the sender's, so its frames could look new.
            let is_backlog = part.account.as_ref().is_some_and(|account| account.ended);
            let arrived = fresh_records(part, &kept.fresh)
                .filter(|_| !is_backlog)
                .map(|record| Measured::new(record, batch.t_sent_boot_ns, now_ns, t_arrival_ns));
            changed.extend(self.show(&mut sensors, kept.stream, arrived, now, &rivals));
        }
        drop(sensors);
        if !changed.is_empty() {
            self.tell(Event::new("frames", &json!({ "sensors": changed })));
        }
    }

    /// Takes in records that another collector stored in the same store, and sends them to listeners.
    pub(crate) fn take_elsewhere(&self, news: Elsewhere) {
        let now = self.clock.monotonic();
        let now_ns = nanoseconds(now);
        let id = Arc::clone(&news.stream.id);
        let account = news.stream.account.as_ref();
        let is_going_on = account.is_some_and(|account| !account.ended);
        let rivals = self.hear(&id.device, &id.boot, is_going_on, now);
        let sent = news.t_sent_boot_ns;
        let arrived = news
            .records
            .iter()
            .map(|stored| Measured::new(&stored.record, sent, now_ns, stored.t_arrival_ns));
        let event = self.show(&mut lock(&self.sensors), news.stream, arrived, now, &rivals);
        if let Some(event) = event {
            self.tell(Event::new("frames", &json!({ "sensors": [event] })));
        }
    }

    /// Shows records of a stream; returns the event for the page if anybody listens.
    fn show<'r>(
        &self,
        sensors: &mut BySensor<Sensor>,
        stream: StreamSummary,
        arrived: impl Iterator<Item = Measured<&'r Record>>,
        now: Duration,
        rivals: &[String],
    ) -> Option<Value> {
        let (id, most) = (Arc::clone(&stream.id), self.limits.sensors_max);
        let new = || Sensor::new(stream.clone());
        let heard = |sensor: &Sensor| sensor.newest.map(|newest| newest.measured_ns);
        sensors.make_room(&id.device, &id.sensor, most, heard);
        let sensor = sensors.get_or_make(&id.device, &id.sensor, most, new)?;
        let shown = sensor.take(stream, arrived, &self.limits);
        sensor
            .faults
            .count(sensor.stream.account.as_ref(), Some(now));
        if let Some(counting) = &self.counting {
            let counted = sensor.counted.get_or_insert_with(|| Counted::new(counting));
            counted.see(counting, records_of(&shown));
        }
        self.recent.take(&sensor.stream.id, records_of(&shown));
        if self.events.receiver_count() == 0 {
            return None;
        }
        let skipped = shown.len().saturating_sub(self.limits.live_frames_max);
        let event = sensor.event(&shown[skipped..], nanoseconds(now), self.limits.rate_window);
        Some(with_rivals(event, rivals))
    }

    /// Notes that a boot has sent, unless it has ended. Returns the boots that alternate under this device name.
    fn hear(&self, device: &str, boot: &str, is_going_on: bool, now: Duration) -> Vec<String> {
        let mut senders = lock(&self.senders);
        if is_going_on {
            senders.heard(device, boot, now, self.limits.sensors_max);
        }
        let rivals = senders.rivals(device, now).into_iter();
        rivals.map(str::to_owned).collect()
    }

    /// The device names that several agents use, with their boots: `[{"device": …, "boots": […]}]`.
    pub(crate) fn rivals_json(&self) -> Value {
        let senders = lock(&self.senders);
        let rivals = senders.all_rivals(self.clock.monotonic());
        let rivals = rivals.iter();
        rivals
            .map(|(device, boots)| json!({ "device": device, "boots": boots }))
            .collect()
    }

    pub(crate) fn recent(&self) -> &RecentFrames {
        &self.recent
    }

    pub(crate) fn tell(&self, event: Event) {
        // It is fine if nobody listens.
        let _ = self.events.send(event);
    }

    pub(crate) fn listen(&self) -> broadcast::Receiver<Event> {
        self.events.subscribe()
    }

    /// Every sensor with its newest frame, in the form of a `frames` event.
    pub(crate) fn snapshot(&self) -> Value {
        self.each_sensor(|sensor, now_ns| {
            sensor.event(&sensor.last_shown(), now_ns, self.limits.rate_window)
        })
    }

    /// Every sensor with its newest frame, including raw words.
    pub(crate) fn sensors_json(&self) -> Value {
        self.each_sensor(|sensor, now_ns| sensor.state(now_ns, self.limits.rate_window))
    }

    fn each_sensor(&self, show: impl Fn(&Sensor, i128) -> Value) -> Value {
        let now_ns = self.now_ns();
        let sensors = lock(&self.sensors);
        let shown = sensors.values().map(|sensor| {
            let senders = lock(&self.senders);
            let rivals = senders.rivals(&sensor.stream.id.device, self.clock.monotonic());
            with_rivals(show(sensor, now_ns), &rivals)
        });
        json!({ "sensors": shown.collect::<Vec<_>>() })
    }

    pub(crate) fn sensors_count(&self) -> usize {
        lock(&self.sensors).len()
    }

    fn now_ns(&self) -> i128 {
        nanoseconds(self.clock.monotonic())
    }
}

/// Adds the boots that alternate under the device's name; `null` if there is only one.
fn with_rivals<R: Clone + Into<Value>>(mut shown: Value, rivals: &[R]) -> Value {
    shown["rivals"] = if rivals.is_empty() {
        Value::Null
    } else {
        rivals.into()
    };
    shown
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

/// The newest frame of every sensor with its age; after a restart, from the store.
#[derive(Clone)]
pub struct NewestFrames(Arc<Live>);

/// A sensor's newest frame.
#[derive(Debug, Clone, PartialEq)]
pub struct NewestFrame {
    /// Device, sensor and boot.
    pub stream: StreamId,
    /// The record, which has pixels.
    pub record: Record,
    /// Time since it was measured, by clocks that do not jump; a lower bound if only the arrival is known.
    pub age: Duration,
    /// `None` if the collector does not count people, or has seen no frame of the sensor since its start.
    pub people: Option<People>,
}

impl NewestFrames {
    pub(crate) fn new(live: Arc<Live>) -> Self {
        Self(live)
    }

    /// The newest frame of each sensor that ever sent one, by device and sensor.
    #[must_use]
    pub fn look(&self) -> Vec<NewestFrame> {
        let now_ns = self.0.now_ns();
        let sensors = lock(&self.0.sensors);
        let newest = sensors.values().filter_map(|sensor| {
            let measured = sensor.newest_frame?;
            let age_ns = (now_ns - measured.measured_ns).max(0);
            Some(NewestFrame {
                stream: StreamId::clone(&sensor.stream.id),
                record: measured.record,
                age: Duration::from_nanos(u64::try_from(age_ns).unwrap_or(u64::MAX)),
                people: sensor.counted.as_ref().map(Counted::people),
            })
        });
        newest.collect()
    }
}
