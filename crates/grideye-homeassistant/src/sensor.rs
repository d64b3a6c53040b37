//! What the broker knows of one sensor, and what it is told next.

use crate::discovery::{self, ABSENT, Named, OFFLINE, ONLINE, PRESENT};
use crate::packet::Message;
use crate::presence::{Presence, Rule};
use crate::topics::{self, Topics};
use amg8833::word;
use grideye_collector::NewestFrame;
use grideye_frame::{Celsius, Frame, PIXELS};
use grideye_recording::StreamId;
use serde_json::json;
use std::time::Duration;

/// What is told, and how often.
#[derive(Debug, Clone)]
pub struct Telling {
    /// Where it is told.
    pub topics: Topics,
    /// Temperatures no oftener than this; presence as soon as it changes.
    pub state_every: Duration,
    /// `None` for no pictures.
    pub images: Option<Images>,
    /// A sensor whose newest frame is older is not available.
    pub silent_after: Duration,
    /// A sensor whose newest frame is older is removed; `None` for never.
    pub forget_after: Option<Duration>,
    /// When somebody is there.
    pub presence: Rule,
}

/// Pictures of the frames.
#[derive(Debug, Clone, Copy)]
pub struct Images {
    /// No oftener than this.
    pub every: Duration,
    /// The picture of a frame's degrees Celsius and its number, as a file that a browser shows; `None` where there is none
    /// this time.
    pub draw: fn(&[f32; PIXELS], u64) -> Option<Vec<u8>>,
}

impl Telling {
    /// After so long without a new value Home Assistant shows none.
    fn expires(&self) -> Duration {
        self.silent_after + 2 * self.state_every
    }
}

/// One sensor, from its first frame on.
#[derive(Debug)]
pub(crate) struct Sensor {
    pub(crate) named: Named,
    standing: Standing,
    /// What was said of its availability on this connection.
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
    /// No frame has come that was new, since the program started or the sensor was forgotten.
    Unheard,
    /// To be announced, because it sends or the broker may have lost what it kept.
    Heard,
    Announced,
    /// Somebody removed it while this run of the agent went on.
    Removed(String),
}

/// A run of the agent and a frame's number in it.
type FrameId = (String, u64);

/// What was last told of something.
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

    /// Another connection, a broker or a Home Assistant that has just started: everything is said once more.
    pub(crate) fn say_again(&mut self) {
        if self.standing == Standing::Announced {
            self.standing = Standing::Heard;
        }
        self.is_available = None;
        self.state = None;
        self.image = None;
    }

    /// Somebody took the configuration away; what else is kept of it goes too, until the agent is started again.
    pub(crate) fn remove(&mut self, telling: &Telling) -> Vec<Message> {
        let boot = self.seen.as_ref().map(|(boot, _)| boot.clone());
        self.standing = Standing::Removed(boot.unwrap_or_default());
        self.is_available = None;
        discovery::removal(&telling.topics, &self.named.id)
    }

    /// What there is to say now.
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
        let frame = word::frame(raw);
        let seq = newest.record.seq;
        let id = (newest.stream.boot.clone(), seq);
        let was_there = self.presence.is_there();
        if self.seen.as_ref() != Some(&id) {
            self.presence.see(&frame, &telling.presence, now);
            self.seen = Some(id.clone());
        }
        let is_there = self.presence.is_there();
        let mut told = Vec::new();
        let is_news = is_there != was_there;
        if is_new(self.state.as_ref(), &id)
            && (is_news || is_time(self.state.as_ref(), telling.state_every, now))
        {
            let topic = telling.topics.state(&self.named.id);
            told.push(Message::passing(topic, state(&frame, is_there, seq)));
            let frame = id.clone();
            self.state = Some(Told { at: now, frame });
        }
        let last = self.image.as_ref();
        let is_due = |images: &Images| is_new(last, &id) && is_time(last, images.every, now);
        if let Some(images) = telling.images.filter(is_due) {
            let topic = telling.topics.image(&self.named.id);
            let picture = (images.draw)(&frame.pixels.map(Celsius::get), seq);
            told.extend(picture.map(|picture| Message::passing(topic, picture)));
            self.image = Some(Told { at: now, frame: id });
        }
        told
    }
}

/// An old frame is not told again.
fn is_new(told: Option<&Told>, frame: &FrameId) -> bool {
    told.is_none_or(|told| told.frame != *frame)
}

fn is_time(told: Option<&Told>, every: Duration, now: Duration) -> bool {
    told.is_none_or(|told| now.saturating_sub(told.at) + LOOK_SLACK >= every)
}

/// The state's JSON. Steps of the sensor are written exactly, the mean to a hundredth.
fn state(frame: &Frame, is_there: bool, seq: u64) -> String {
    let pixels = frame.pixels.map(|pixel| f64::from(pixel.get()));
    let mean = pixels.iter().sum::<f64>() / 64.0;
    json!({
        "min": pixels.iter().copied().fold(f64::INFINITY, f64::min),
        "max": pixels.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        "mean": (mean * 100.0).round() / 100.0,
        "thermistor": frame.thermistor.get(),
        "presence": if is_there { PRESENT } else { ABSENT },
        "seq": seq,
    })
    .to_string()
}

/// Half a look: one that comes a little early is not put off by a whole one.
const LOOK_SLACK: Duration = Duration::from_millis(250);

#[cfg(test)]
mod tests;
