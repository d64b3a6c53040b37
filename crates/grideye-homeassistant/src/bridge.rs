//! Publishes the collector's newest frames to the broker: polls twice a second, sends what is due, and queues nothing.
//!
//! A slow or absent broker costs the collector nothing: while it cannot publish, the bridge does not poll, and
//! afterwards it publishes whatever is newest then.

use crate::broker::Broker;
use crate::connection::{Client, Connection, Pauses};
use crate::discovery::{self, OFFLINE, ONLINE};
use crate::fault::Fault;
use crate::packet::{Heard, Message};
use crate::sensor::{Sensor, Telling};
use crate::status::Status;
use crate::topics::BRIDGE;
use grideye_collector::{Clock, Level, Log, LogEvent, NewestFrame, NewestFrames};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::{Instant, MissedTickBehavior, interval};

/// How often the newest frames are polled: agents send batches twice a second.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// Maximum sensors published; a warning reports that there are more.
pub(crate) const SENSORS_MAX: usize = 512;
/// Maximum sensors remembered from an earlier collector's messages on the broker.
const LEFT_MAX: usize = 2 * SENSORS_MAX;
/// Maximum bytes of a packet heard: a word, or one sensor's configuration.
pub(crate) const TOLD_BYTES_MAX: usize = 64 * 1024;
/// The same fault is logged again after this time.
const FAULT_SAID_EVERY: Duration = Duration::from_secs(600);

pub(crate) struct Bridge {
    broker: Broker,
    telling: Telling,
    newest: NewestFrames,
    clock: Arc<dyn Clock>,
    log: Log,
    status: Status,
    sensors: BTreeMap<(String, String), Sensor>,
    left: BTreeMap<String, Left>,
    said: Option<(Fault, Instant)>,
    is_overflow_said: bool,
}

/// A sensor that an earlier collector left on the broker.
struct Left {
    since: Duration,
    /// Whether the broker has it as available.
    is_online: bool,
}

struct Link {
    connection: Connection,
    /// All retained messages have arrived.
    is_caught_up: bool,
}

impl Bridge {
    pub(crate) fn new(
        broker: Broker,
        telling: Telling,
        (newest, clock): (NewestFrames, Arc<dyn Clock>),
        log: Log,
        status: Status,
    ) -> Self {
        Self {
            broker,
            telling,
            newest,
            clock,
            log,
            status,
            sensors: BTreeMap::new(),
            left: BTreeMap::new(),
            said: None,
            is_overflow_said: false,
        }
    }

    /// Connects and publishes, again and again. When the program ends, the broker publishes the last will.
    pub(crate) async fn run(mut self) {
        let mut pauses = Pauses::default();
        loop {
            let Err(fault) = self.connect_and_tell().await;
            self.status.lost(&fault);
            self.say(fault);
            pauses.pause().await;
        }
    }

    async fn connect_and_tell(&mut self) -> Result<std::convert::Infallible, Fault> {
        let topics = &self.telling.topics;
        let will = Message::retained(topics.bridge(), OFFLINE);
        let client_id = topics.client_id("");
        let client = Client {
            id: &client_id,
            will: Some(&will),
            is_kept: false,
            bytes_max: TOLD_BYTES_MAX,
        };
        let connection = Connection::open(&self.broker, client).await?;
        let mut link = Link {
            connection,
            is_caught_up: false,
        };
        self.begin(&mut link).await?;
        let mut looks = interval(LOOK_EVERY);
        looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                heard = link.connection.hear() => self.hear(heard?, &mut link).await?,
                _tick = looks.tick() => {
                    self.look(&mut link).await?;
                    link.connection.keep_alive().await?;
                }
            }
        }
    }

    /// Subscribes to retained messages and to removals of sensors, and publishes that the bridge is online.
    async fn begin(&mut self, link: &mut Link) -> Result<(), Fault> {
        self.status.connected();
        self.said = None;
        let connected = LogEvent::new(Level::Info, "mqtt_connected");
        self.log.say(&connected.with("broker", &self.broker));
        for sensor in self.sensors.values_mut() {
            sensor.say_again();
        }
        let topics = &self.telling.topics;
        let availability = topics.availability("+");
        let filters = [availability, topics.all_cameras(), topics.birth()];
        link.connection.subscribe(&filters, 0).await?;
        link.connection.ping().await?;
        let online = Message::retained(topics.bridge(), ONLINE);
        self.publish(link, [online]).await
    }

    async fn look(&mut self, link: &mut Link) -> Result<(), Fault> {
        let now = self.clock.monotonic();
        let newest = self.newest.look();
        for newest in &newest {
            let key = (newest.stream.device.clone(), newest.stream.sensor.clone());
            if !self.sensors.contains_key(&key) && self.sensors.len() >= SENSORS_MAX {
                self.say_overflow();
                continue;
            }
            let sensor = self.sensors.entry(key);
            let sensor = sensor.or_insert_with(|| Sensor::new(&newest.stream));
            let told = sensor.look(newest, &self.telling, now);
            if sensor.is_announced() {
                self.left.remove(&sensor.named.id);
            }
            self.publish(link, told).await?;
        }
        if link.is_caught_up {
            let told = self.look_after_left(&newest, now);
            self.publish(link, told).await?;
        }
        let announced = self.sensors.values().filter(|sensor| sensor.is_announced());
        self.status.announced(announced.count());
        Ok(())
    }

    /// Marks sensors of an earlier collector that have not been heard since as unavailable, and removes them in time.
    fn look_after_left(&mut self, newest: &[NewestFrame], now: Duration) -> Vec<Message> {
        let (topics, forget_after) = (&self.telling.topics, self.telling.forget_after);
        let age = |newest: &NewestFrame| {
            let key = (newest.stream.device.clone(), newest.stream.sensor.clone());
            let sensor = self.sensors.get(&key)?;
            Some((sensor.named.id.as_str(), newest.age))
        };
        let ages: BTreeMap<&str, Duration> = newest.iter().filter_map(age).collect();
        let mut told = Vec::new();
        self.left.retain(|id, left| {
            let age = ages.get(id.as_str()).copied();
            let age = age.unwrap_or(now.saturating_sub(left.since));
            if forget_after.is_some_and(|after| age > after) {
                told.extend(discovery::removal(topics, id));
                return false;
            }
            if std::mem::replace(&mut left.is_online, false) {
                told.push(Message::retained(topics.availability(id), OFFLINE));
            }
            true
        });
        told
    }

    async fn hear(&mut self, heard: Heard, link: &mut Link) -> Result<(), Fault> {
        match heard {
            Heard::Pong => link.is_caught_up = true,
            Heard::Subscribed(codes) if codes.iter().any(|code| *code >= 0x80) => {
                let refused = LogEvent::new(Level::Warning, "mqtt_may_not_read");
                self.log.say(&refused.with("broker", &self.broker).with(
                    "hint",
                    "the broker's access list must let this user read its own topics, or removed sensors come back",
                ));
            }
            Heard::Published(message, _) => {
                let told = self.answer(&message);
                self.publish(link, told).await?;
            }
            Heard::Subscribed(_) | Heard::Connected(_) | Heard::TooLong(..) => {}
        }
        Ok(())
    }

    /// The messages to publish in reply to another client's message.
    fn answer(&mut self, heard: &Message) -> Vec<Message> {
        let topics = &self.telling.topics;
        if heard.topic == topics.birth() {
            if heard.payload == ONLINE.as_bytes() && !heard.retain {
                self.sensors.values_mut().for_each(Sensor::say_again);
            }
            return Vec::new();
        }
        if let Some(id) = topics.available_of(&heard.topic) {
            let is_online = heard.payload == ONLINE.as_bytes();
            if id == BRIDGE && !is_online {
                // The last will of an earlier connection, whose end the broker noticed late.
                return vec![Message::retained(topics.bridge(), ONLINE)];
            }
            if heard.retain && id != BRIDGE && self.left.len() < LEFT_MAX {
                let since = self.clock.monotonic();
                let left = self.left.entry(id.to_owned());
                left.or_insert(Left { since, is_online }).is_online = is_online;
            }
            return Vec::new();
        }
        match topics.camera_of(&heard.topic) {
            Some(id) if heard.payload.is_empty() => self.remove(id),
            _ => Vec::new(),
        }
    }

    /// A sensor was removed by Home Assistant's button or `grideye mqtt forget`.
    fn remove(&mut self, id: &str) -> Vec<Message> {
        let mut sensors = self.sensors.values_mut();
        if let Some(sensor) = sensors.find(|sensor| sensor.is_announced() && sensor.named.id == id)
        {
            return sensor.remove(&self.telling);
        }
        match self.left.remove(id) {
            Some(_left) => discovery::removal(&self.telling.topics, id),
            None => Vec::new(),
        }
    }

    async fn publish(
        &self,
        link: &mut Link,
        told: impl IntoIterator<Item = Message>,
    ) -> Result<(), Fault> {
        for message in told {
            link.connection.publish(&message).await?;
            self.status.published();
        }
        Ok(())
    }

    /// Logs a fault once, and again if it changes or lasts long.
    fn say(&mut self, fault: Fault) {
        let said = self.said.as_ref();
        if said.is_some_and(|(said, at)| *said == fault && at.elapsed() < FAULT_SAID_EVERY) {
            return;
        }
        let event = LogEvent::new(Level::Warning, "mqtt_fault")
            .with("broker", &self.broker)
            .with("what", &fault.what)
            .with("hint", &fault.hint);
        self.log.say(&event);
        self.said = Some((fault, Instant::now()));
    }

    fn say_overflow(&mut self) {
        if !std::mem::replace(&mut self.is_overflow_said, true) {
            let event = LogEvent::new(Level::Warning, "mqtt_too_many_sensors");
            self.log.say(&event.with("told_at_most", SENSORS_MAX));
        }
    }
}
