//! The state of one sensor on the broker, and its next messages.

use crate::discovery::{self, ABSENT, Named, OFFLINE, ONLINE, PRESENT};
use crate::packet::Message;
use crate::topics::{self, ENTERED, LEFT, Topics};
use grideye_collector::{NewestFrame, People};
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
    /// Minimum time between states; a change of the number of people is published at once.
    pub state_every: Duration,
    /// `None` for no images.
    pub images: Option<Images>,
    /// A sensor with an older newest frame is unavailable.
    pub silent_after: Duration,
    /// A sensor with an older newest frame is removed; `None` for never.
    pub forget_after: Option<Duration>,
    /// Whether the collector counts who crosses a line.
    pub has_line: bool,
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
    /// The boot that was last seen.
    boot: Option<String>,
    /// How many people there were, and who had crossed the line.
    people: Counted,
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
            boot: None,
            people: Counted::default(),
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
        self.standing = Standing::Removed(self.boot.clone().unwrap_or_default());
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
            told =
                discovery::configurations(&telling.topics, &self.named, expires, telling.has_line);
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
        self.boot = Some(newest.stream.boot.clone());
        let people = newest
            .people
            .as_ref()
            .map_or_else(Counted::default, Counted::of);
        let is_news = std::mem::replace(&mut self.people, people) != people;
        let mut told = Vec::new();
        if is_new(self.state.as_ref(), &id)
            && (is_news || is_time(self.state.as_ref(), telling.state_every, now))
        {
            let topic = telling.topics.state(&self.named.id);
            told.push(Message::passing(topic, state(raw, people, seq)));
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

/// What is told of the people in view.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Counted {
    /// `None` while the empty room is not known yet.
    people: Option<u8>,
    crossed: Option<[u64; 2]>,
}

impl Counted {
    fn of(people: &People) -> Self {
        Self {
            people: people.count.map(|count| count.people),
            crossed: people.crossed,
        }
    }
}

/// The state's JSON. Sensor steps are exact, the mean is rounded to a hundredth.
fn state(raw: &RecordedFrame, counted: Counted, seq: u64) -> String {
    let pixels = word::pixels(&raw.pixels).map(|pixel| f64::from(pixel.get()));
    let thermistor = raw.thermistor.map(word::thermistor_celsius);
    let mean = pixels.iter().sum::<f64>() / 64.0;
    json!({
        "min": pixels.iter().copied().fold(f64::INFINITY, f64::min),
        "max": pixels.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        "mean": (mean * 100.0).round() / 100.0,
        "thermistor": thermistor.map(Celsius::get),
        "people": counted.people,
        "presence": counted.people.map(|people| if people > 0 { PRESENT } else { ABSENT }),
        (ENTERED): counted.crossed.map(|[entered, _]| entered),
        (LEFT): counted.crossed.map(|[_, left]| left),
        "seq": seq,
    })
    .to_string()
}

/// Half a poll interval: a poll that is slightly early does not wait for the next.
const LOOK_SLACK: Duration = Duration::from_millis(250);

#[cfg(test)]
mod tests;
