//! Takes frames that others publish: whole posts, or 64 temperatures alone.
//!
//! At least once: the session stays when the connection ends, so the broker keeps messages of quality of service 1, and each
//! is acknowledged after its frames are on disk. A numbered frame that comes twice is stored once.

use crate::broker::Broker;
use crate::connection::{Client, Connection, Pauses};
use crate::fault::Fault;
use crate::packet::{Heard, Message};
use crate::status::Status;
use crate::topics::{Published, Topics};
use futures_util::future::join_all;
use grideye_collector::{Clock, Ingest, Inside, Level, Log, LogEvent};
use grideye_frame::word::pixel_word;
use grideye_frame::{Celsius, PIXELS, PixelWord, Reading, RecordedFrame};
use grideye_recording::wire::{Batch, FRAME_BYTES_MAX, FRAMES_MAX, SensorBatch};
use grideye_recording::{ClockState, Record, Stamp, check_name};
use std::collections::HashMap;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::{Instant, MissedTickBehavior, interval};

/// Maximum bytes of a message, as of a post.
const MESSAGE_BYTES_MAX: usize = FRAMES_MAX * FRAME_BYTES_MAX + 64 * 1024;
/// Maximum messages stored at once.
const AT_ONCE_MAX: usize = 256;
/// Maximum sensors numbered here.
const UNNUMBERED_MAX: usize = 512;
/// The same refusal of a topic is logged again after this time; of more topics none is logged.
const SAID_EVERY: Duration = Duration::from_secs(600);
const SAID_MAX: usize = 512;
/// Of a refusal that has no hint of its own.
const HINT: &str = "publish to PREFIX/DEVICE/frames what is posted to /v1/frames, or 64 temperatures to PREFIX/DEVICE/SENSOR/pixels";
const PINGS_EVERY: Duration = Duration::from_secs(1);

pub(crate) struct Intake {
    broker: Broker,
    topics: Topics,
    ingest: Ingest,
    clock: Arc<dyn Clock>,
    log: Log,
    status: Status,
    unnumbered: Unnumbered,
    said: HashMap<String, Instant>,
}

/// Sensors whose frames came without a number.
struct Unnumbered {
    boot: String,
    next: HashMap<(String, String), u64>,
}

impl Unnumbered {
    /// A frame with the next number of its sensor, stamped on arrival: what was lost before does not show.
    fn batch(
        &mut self,
        device: &str,
        sensor: &str,
        pixels: [PixelWord; PIXELS],
        clock: &dyn Clock,
    ) -> Result<Option<Batch>, String> {
        let key = (device.to_owned(), sensor.to_owned());
        if !self.next.contains_key(&key) && self.next.len() >= UNNUMBERED_MAX {
            return Err(format!(
                "pixels of more than {UNNUMBERED_MAX} sensors\nhint: publish posts, which have numbers"
            ));
        }
        let next = self.next.entry(key).or_default();
        let record = Record {
            seq: *next,
            stamp: Stamp {
                t_boot_ns: u64::try_from(clock.monotonic().as_nanos()).unwrap_or(u64::MAX),
                t_utc_ns: clock.utc_ns(),
                clock: ClockState::Unsynced,
            },
            reading: Reading::Frame(RecordedFrame {
                thermistor: None,
                pixels,
            }),
        };
        *next += 1;
        Ok(Some(Batch {
            device: device.to_owned(),
            boot: self.boot.clone(),
            t_sent_boot_ns: None,
            sensors: vec![SensorBatch {
                sensor: sensor.to_owned(),
                account: None,
                frames: vec![record],
            }],
        }))
    }
}

/// 64 temperatures in °C as a JSON array, with or without its brackets, to the nearest step of the sensor.
fn pixels(payload: &[u8]) -> Result<[PixelWord; PIXELS], String> {
    const HINT: &str = "hint: 64 temperatures in °C, pixel 1 first, such as 21.25,21.5, and so on; or publish a post";
    let text = String::from_utf8_lossy(payload);
    let text = text.trim().trim_start_matches('[').trim_end_matches(']');
    let celsius: Vec<f32> = serde_json::from_str(&format!("[{text}]"))
        .map_err(|error| format!("these are no pixels: {error}\n{HINT}"))?;
    let words = celsius.iter().zip(1..).map(|(celsius, pixel)| {
        let word = pixel_word(Celsius::new(*celsius));
        word.map_err(|error| format!("pixel {pixel}: {error}\n{HINT}"))
    });
    let words: Vec<PixelWord> = words.collect::<Result<_, _>>()?;
    let count = words.len();
    words
        .try_into()
        .map_err(|_other| format!("expected 64 pixels, found {count}\n{HINT}"))
}

impl Intake {
    pub(crate) fn new(
        broker: Broker,
        topics: Topics,
        inside: &Inside,
        log: Log,
        status: Status,
    ) -> Self {
        let started_ms = inside.clock.utc_ns() / 1_000_000;
        Self {
            broker,
            topics,
            ingest: inside.ingest.clone(),
            clock: Arc::clone(&inside.clock),
            log,
            status,
            unnumbered: Unnumbered {
                boot: format!("unnumbered-{started_ms:x}"),
                next: HashMap::new(),
            },
            said: HashMap::new(),
        }
    }

    /// Connects and takes, again and again. The bridge, which uses the same broker, logs why it cannot connect.
    pub(crate) async fn run(mut self) {
        let mut pauses = Pauses::default();
        loop {
            let Err(fault) = self.connect_and_take().await;
            self.status.lost(&fault);
            pauses.pause().await;
        }
    }

    async fn connect_and_take(&mut self) -> Result<Infallible, Fault> {
        let client_id = self.topics.client_id("frames");
        let client = Client {
            id: &client_id,
            will: None,
            is_kept: true,
            bytes_max: MESSAGE_BYTES_MAX,
        };
        let mut connection = Connection::open(&self.broker, client).await?;
        self.status.connected();
        connection.subscribe(&self.topics.all_frames(), 1).await?;
        let mut pings = interval(PINGS_EVERY);
        pings.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                heard = connection.hear() => {
                    let mut heard = vec![heard?];
                    while heard.len() < AT_ONCE_MAX {
                        let Some(more) = connection.arrived()? else { break };
                        heard.push(more);
                    }
                    self.take(heard, &mut connection).await?;
                }
                _tick = pings.tick() => connection.keep_alive().await?,
            }
        }
    }

    /// Stores what was heard together, and acknowledges it in its order (mqtt-v3.1.1, §4.6).
    async fn take(&mut self, heard: Vec<Heard>, connection: &mut Connection) -> Result<(), Fault> {
        let mut messages = Vec::with_capacity(heard.len());
        for heard in heard {
            match heard {
                Heard::Published(message, id) => {
                    let read = self.read(&message);
                    messages.push((message.topic, id, read));
                }
                Heard::TooLong(topic, bytes, id) => {
                    let what = format!(
                        "a message may have {MESSAGE_BYTES_MAX} bytes, not {bytes}\nhint: publish fewer frames at once"
                    );
                    messages.push((topic, id, Err(what)));
                }
                Heard::Subscribed(codes) if codes.iter().any(|code| *code >= 0x80) => {
                    let refused = LogEvent::new(Level::Warning, "mqtt_may_not_read");
                    self.log.say(&refused.with("broker", &self.broker).with(
                        "hint",
                        "the broker's access list must let this user read the topics of frames, or none are taken",
                    ));
                }
                Heard::Subscribed(_) | Heard::Connected(_) | Heard::Pong => {}
            }
        }
        let ingest = &self.ingest;
        let stored = join_all(messages.iter_mut().map(|(_, _, read)| {
            let batch = read.as_mut().ok().and_then(Option::take);
            async move { Some(ingest.store(batch?).await) }
        }));
        for ((topic, id, read), stored) in messages.iter().zip(stored.await) {
            match (read, stored) {
                (Err(what), _) => self.refuse(topic, what),
                (Ok(_), None) => {}
                (Ok(_), Some(Ok(()))) => self.status.took(),
                // It comes again with the next connection, and so does what follows it.
                (Ok(_), Some(Err(refusal))) if refusal.may_pass() => {
                    self.say(topic, "mqtt_frames_wait", &refusal.to_string());
                    return Err(Fault::not_stored(&refusal));
                }
                (Ok(_), Some(Err(refusal))) => self.refuse(topic, &refusal.to_string()),
            }
            if let Some(id) = id {
                connection.acknowledge(*id).await?;
            }
        }
        Ok(())
    }

    /// The frames of a message; `None` of an empty one, which clears what the broker retained.
    fn read(&mut self, message: &Message) -> Result<Option<Batch>, String> {
        let published = self.topics.published(&message.topic);
        let published = published.ok_or("this topic names no device")?;
        if message.payload.is_empty() {
            return Ok(None);
        }
        let (device, sensor) = match published {
            Published::Post(device) => {
                let batch =
                    Batch::from_json(&message.payload).map_err(|error| error.to_string())?;
                // Brokers give rights by topic.
                if batch.device != device {
                    return Err(format!(
                        "a post of the device {} came under the topic of {device}\nhint: the topic and the post name the same device",
                        batch.device
                    ));
                }
                return Ok(Some(batch));
            }
            Published::Pixels(device, sensor) => (device, sensor),
        };
        for name in [device, sensor] {
            check_name(name).map_err(|error| error.to_string())?;
        }
        if message.retain {
            return Err("a retained frame is an old one, and has no number\nhint: publish pixels without the retain flag".to_owned());
        }
        let pixels = pixels(&message.payload)?;
        self.unnumbered.batch(device, sensor, pixels, &*self.clock)
    }

    fn refuse(&mut self, topic: &str, what: &str) {
        self.status.refused();
        self.say(topic, "mqtt_frames_refused", what);
    }

    fn say(&mut self, topic: &str, event: &'static str, what: &str) {
        let now = Instant::now();
        self.said.retain(|_topic, at| now - *at < SAID_EVERY);
        if self.said.len() >= SAID_MAX || self.said.contains_key(topic) {
            return;
        }
        self.said.insert(topic.to_owned(), now);
        let (what, hint) = what.split_once("\nhint: ").unwrap_or((what, HINT));
        let event = LogEvent::new(Level::Warning, event).with("topic", topic);
        self.log.say(&event.with("what", what).with("hint", hint));
    }
}
