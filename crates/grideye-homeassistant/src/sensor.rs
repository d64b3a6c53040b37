//! The state of one sensor on the broker, and its next messages.

use crate::discovery::{self, ABSENT, Named, OFFLINE, ONLINE, PRESENT};
use crate::packet::Message;
use crate::presence::{Presence, Rule};
use crate::topics::{self, Topics};
use grideye_collector::NewestFrame;
use grideye_frame::word;
use grideye_frame::{Celsius, PIXELS, RecordedFrame};
use grideye_recording::StreamId;
use serde_json::json;
use std::time::Duration;

/// What to publish, and how often.
#[derive(Debug, Clone)]
pub struct Telling {
    /// The topics to publish to.
    pub topics: Topics,
    /// Minimum time between states; a change of presence is published at once.
    pub state_every: Duration,
    /// `None` for no images.
    pub images: Option<Images>,
    /// A sensor with an older newest frame is unavailable.
    pub silent_after: Duration,
    /// A sensor with an older newest frame is removed; `None` for never.
    pub forget_after: Option<Duration>,
    /// When somebody is present.
    pub presence: Rule,
}

/// Images of the frames.
#[derive(Debug, Clone, Copy)]
pub struct Images {
    /// Minimum time between images.
    pub every: Duration,
    /// Draws a frame's degrees Celsius and its number as an image file for browsers; `None` for no image this time.
    pub draw: fn(&[f32; PIXELS], u64) -> Option<Vec<u8>>,
}

impl Telling {
    /// Home Assistant drops a value after this time without a new one.
    fn expires(&self) -> Duration {
        self.silent_after + 2 * self.state_every
    }
}

/// One sensor, from its first frame on.
#[derive(Debug)]
pub(crate) struct Sensor {
    pub(crate) named: Named,
    standing: Standing,
    /// The availability last published on this connection.
    is_available: Option<bool>,
    presence: Presence,
    /// The frame that presence was last judged by.
    seen: Option<FrameId>,
    state: Option<Told>,
    image: Option<Told>,
}

/// Whether the broker has the sensor's configurations.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Standing {
    /// No new frame has come since the program started or the sensor was removed.
    Unheard,
    /// To be announced, because it sends or the broker may have lost the configurations.
    Heard,
    Announced,
    /// Removed by a person during this boot of the agent.
    Removed(String),
}

/// A boot of the agent, and a frame's number in it.
type FrameId = (String, u64);

/// The last message of a kind.
#[derive(Debug)]
struct Told {
    at: Duration,
    frame: FrameId,
}

impl Sensor {
    pub(crate) fn new(stream: &StreamId) -> Self {
        Self {
            named: Named {
                id: topics::id(&stream.device, &stream.sensor),
                device: stream.device.clone(),
                sensor: stream.sensor.clone(),
            },
            standing: Standing::Unheard,
            is_available: None,
            presence: Presence::default(),
            seen: None,
            state: None,
            image: None,
        }
    }

    pub(crate) fn is_announced(&self) -> bool {
        self.standing == Standing::Announced
    }

    /// After a new connection, or a restart of the broker or Home Assistant, everything is published again.
    pub(crate) fn say_again(&mut self) {
        if self.standing == Standing::Announced {
            self.standing = Standing::Heard;
        }
        self.is_available = None;
        self.state = None;
        self.image = None;
    }

    /// A person deleted the configuration: deletes the rest too, until the agent restarts.
    pub(crate) fn remove(&mut self, telling: &Telling) -> Vec<Message> {
        let boot = self.seen.as_ref().map(|(boot, _)| boot.clone());
        self.standing = Standing::Removed(boot.unwrap_or_default());
        self.is_available = None;
        discovery::removal(&telling.topics, &self.named.id)
    }

    pub(crate) fn look(
        &mut self,
        newest: &NewestFrame,
        telling: &Telling,
        now: Duration,
    ) -> Vec<Message> {
        if matches!(&self.standing, Standing::Removed(boot) if *boot == newest.stream.boot) {
            return Vec::new();
        }
        let is_fresh = newest.age <= telling.silent_after;
        if is_fresh && self.standing != Standing::Announced {
            self.standing = Standing::Heard;
        }
        if self.standing == Standing::Unheard {
            return Vec::new();
        }
        if telling.forget_after.is_some_and(|after| newest.age > after) {
            self.standing = Standing::Unheard;
            self.is_available = None;
            return discovery::removal(&telling.topics, &self.named.id);
        }
        let mut told = Vec::new();
        if self.standing == Standing::Heard {
            let expires = telling.expires();
            told = discovery::configurations(&telling.topics, &self.named, expires);
            self.standing = Standing::Announced;
        }
        told.extend(self.availability(telling, is_fresh));
        if is_fresh {
            told.extend(self.frame(newest, telling, now));
        }
        told
    }

    fn availability(&mut self, telling: &Telling, is_fresh: bool) -> Option<Message> {
        if self.is_available.replace(is_fresh) == Some(is_fresh) {
            return None;
        }
        let topic = telling.topics.availability(&self.named.id);
        let word = if is_fresh { ONLINE } else { OFFLINE };
        Some(Message::retained(topic, word))
    }

    fn frame(&mut self, newest: &NewestFrame, telling: &Telling, now: Duration) -> Vec<Message> {
        let Some(raw) = newest.record.reading.frame() else {
            return Vec::new();
        };
        let pixels = word::pixels(&raw.pixels);
        let seq = newest.record.seq;
        let id = (newest.stream.boot.clone(), seq);
        let was_there = self.presence.is_there();
        if self.seen.as_ref() != Some(&id) {
            self.presence.see(&pixels, &telling.presence, now);
            self.seen = Some(id.clone());
        }
        let is_there = self.presence.is_there();
        let mut told = Vec::new();
        let is_news = is_there != was_there;
        if is_new(self.state.as_ref(), &id)
            && (is_news || is_time(self.state.as_ref(), telling.state_every, now))
        {
            let topic = telling.topics.state(&self.named.id);
            told.push(Message::passing(topic, state(raw, is_there, seq)));
            let frame = id.clone();
            self.state = Some(Told { at: now, frame });
        }
        let last = self.image.as_ref();
        let is_due = |images: &Images| is_new(last, &id) && is_time(last, images.every, now);
        if let Some(images) = telling.images.filter(is_due) {
            let topic = telling.topics.image(&self.named.id);
            let picture = (images.draw)(&pixels.map(Celsius::get), seq);
            told.extend(picture.map(|picture| Message::passing(topic, picture)));
            self.image = Some(Told { at: now, frame: id });
        }
        told
    }
}

/// An old frame is not published again.
fn is_new(told: Option<&Told>, frame: &FrameId) -> bool {
    told.is_none_or(|told| told.frame != *frame)
}

fn is_time(told: Option<&Told>, every: Duration, now: Duration) -> bool {
    told.is_none_or(|told| now.saturating_sub(told.at) + LOOK_SLACK >= every)
}

/// The state's JSON. Sensor steps are exact, the mean is rounded to a hundredth.
fn state(raw: &RecordedFrame, is_there: bool, seq: u64) -> String {
    let pixels = word::pixels(&raw.pixels).map(|pixel| f64::from(pixel.get()));
    let thermistor = raw.thermistor.map(word::thermistor_celsius);
    let mean = pixels.iter().sum::<f64>() / 64.0;
    json!({
        "min": pixels.iter().copied().fold(f64::INFINITY, f64::min),
        "max": pixels.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        "mean": (mean * 100.0).round() / 100.0,
        "thermistor": thermistor.map(Celsius::get),
        "presence": if is_there { PRESENT } else { ABSENT },
        "seq": seq,
    })
    .to_string()
}

/// Half a poll interval: a poll that is slightly early does not wait for the next.
const LOOK_SLACK: Duration = Duration::from_millis(250);

#[cfg(test)]
mod tests;
