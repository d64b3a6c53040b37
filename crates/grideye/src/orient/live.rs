//! The live frames of one sensor of a running collector.

use super::watch::Picture;
use crate::client::Client;
use crate::exit::bad_input;
use anyhow::{Context as _, Result, anyhow};
use serde::Deserialize;
use std::collections::BTreeSet;
use std::io::{BufRead, Read as _};

/// The longest line of an event that is read: a batch of a sensor has some kilobytes.
const LINE_BYTES_MAX: u64 = 16 << 20;

/// What a collector says at one time.
pub(super) enum Said {
    /// Frames of the sensor, the oldest first.
    Frames(Vec<Picture>),
    /// That it is there, or something about another sensor.
    Nothing,
}

/// Follows one sensor.
pub(super) struct Live {
    lines: Box<dyn BufRead>,
    wanted: Option<String>,
    /// The sensor that is followed, as `DEVICE/SENSOR`.
    pub(super) followed: Option<String>,
    known: BTreeSet<String>,
}

#[derive(Deserialize)]
struct Event {
    sensors: Vec<OfSensor>,
}

#[derive(Deserialize)]
struct OfSensor {
    device: String,
    sensor: String,
    #[serde(default)]
    frames: Vec<OfFrame>,
}

#[derive(Deserialize)]
struct OfFrame {
    /// None of a frame that is missing.
    pixels_celsius: Option<Vec<f64>>,
}

impl Live {
    pub(super) fn new(client: &Client, wanted: Option<&str>) -> Result<Self> {
        Ok(Self {
            lines: Box::new(client.live()?),
            wanted: wanted.map(str::to_owned),
            followed: None,
            known: BTreeSet::new(),
        })
    }

    /// Waits for the next event.
    ///
    /// # Errors
    /// If the collector ends, or several sensors deliver and none was named.
    pub(super) fn next(&mut self) -> Result<Said> {
        let (mut name, mut text) = (String::new(), String::new());
        loop {
            let line = self.line()?;
            if let Some(rest) = line.strip_prefix("event:") {
                rest.trim().clone_into(&mut name);
            } else if let Some(rest) = line.strip_prefix("data:") {
                text.push_str(rest);
            } else if line.is_empty() {
                break;
            }
        }
        // The snapshot's frames may be old; it tells which sensors there are.
        let is_fresh = match name.as_str() {
            "frames" => true,
            "snapshot" => false,
            _ => return Ok(Said::Nothing),
        };
        let event: Event = serde_json::from_str(&text)
            .context("the collector says something else than a collector does")?;
        self.take(event, is_fresh)
    }

    fn line(&mut self) -> Result<String> {
        let mut line = String::new();
        let mut limited = self.lines.by_ref().take(LINE_BYTES_MAX);
        let read = limited.read_line(&mut line);
        let bytes = read.context("the connection to the collector broke off")?;
        if bytes == 0 {
            return Err(anyhow!(
                "the collector ended the connection\nhint: is it still running? `grideye collect` says why it stops"
            ));
        }
        Ok(line.trim_end().to_owned())
    }

    fn take(&mut self, event: Event, is_fresh: bool) -> Result<Said> {
        let mut pictures = Vec::new();
        for sensor in event.sensors {
            let name = format!("{}/{}", sensor.device, sensor.sensor);
            let is_wanted = match &self.wanted {
                Some(wanted) => *wanted == name || *wanted == sensor.sensor,
                None => true,
            };
            if !is_wanted {
                continue;
            }
            self.known.insert(name.clone());
            self.followed.get_or_insert(name);
            if is_fresh {
                let frames = sensor.frames.into_iter();
                pictures.extend(
                    frames.filter_map(|frame| {
                        Picture::try_from(frame.pixels_celsius?.as_slice()).ok()
                    }),
                );
            }
        }
        if self.known.len() > 1 {
            let names: Vec<&str> = self.known.iter().map(String::as_str).collect();
            return Err(bad_input(anyhow!(
                "there are several sensors: {}\nhint: name one with --sensor DEVICE/SENSOR",
                names.join(", ")
            )));
        }
        Ok(if pictures.is_empty() {
            Said::Nothing
        } else {
            Said::Frames(pictures)
        })
    }
}
