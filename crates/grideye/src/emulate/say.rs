//! What `grideye emulate` says of itself: one line when it is ready, one of what went over the buses.

use super::parts::Prepared;
use crate::cli::Emulate;
use crate::exit::Outcome;
use crate::output::outln;
use crate::progress;
use anyhow::Result;
use grideye_rig::{Counts, Part};
use serde::Serialize;

/// Says things as the options want it.
pub(super) struct Voice {
    json: bool,
    quiet: bool,
    /// Standard output is the program's, if there is one.
    has_program: bool,
    shown: String,
    sensors: Vec<Sensor>,
}

/// A sensor in the ready line.
#[derive(Debug, Clone, Serialize)]
struct Sensor {
    name: String,
    bus: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    multiplexer: Option<u8>,
    #[serde(skip_serializing_if = "Option::is_none")]
    channel: Option<usize>,
    address: u8,
    #[serde(skip)]
    place: String,
}

/// How the sensors are reached.
#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct Reached {
    /// fuse, preload, socket, usbip or usbip-tcp.
    pub(super) ways: Vec<&'static str>,
    /// Device files, the socket's path, or the address.
    pub(super) at: Vec<String>,
    /// The same for people.
    #[serde(skip)]
    pub(super) text: Vec<String>,
}

impl Voice {
    /// A voice for this run.
    pub(super) fn new(options: &Emulate, prepared: &Prepared) -> Self {
        Self {
            json: options.json,
            quiet: options.quiet,
            has_program: !options.program.is_empty(),
            shown: prepared.shown.clone(),
            sensors: prepared.parts.iter().map(sensor).collect(),
        }
    }

    /// Everything can be reached from here on.
    pub(super) fn ready(&self, reached: &Reached) -> Result<()> {
        if self.json {
            return self.print_json(&serde_json::json!({
                "event": "ready",
                "ways": reached.ways,
                "at": reached.at,
                "shows": self.shown,
                "sensors": self.sensors,
            }));
        }
        if !self.quiet {
            let sensors: Vec<String> = self
                .sensors
                .iter()
                .map(|sensor| format!("{} at {}", sensor.name, sensor.place))
                .collect();
            progress::say(&format!(
                "{}: {}, showing {}",
                reached.text.join(" and "),
                sensors.join(", "),
                self.shown
            ));
        }
        if !self.has_program {
            for place in &reached.at {
                outln!("{place}")?;
            }
        }
        Ok(())
    }

    /// Something that deserves a look.
    pub(super) fn note(&self, text: &str) {
        if !self.quiet && !self.json {
            progress::say(text);
        }
    }

    /// Everything is over.
    pub(super) fn end(&self, counts: &Counts, outcome: Outcome) -> Result<()> {
        if self.json {
            let code = match outcome {
                Outcome::Passed(code) => Some(code),
                _ => None,
            };
            return self.print_json(&serde_json::json!({
                "event": "end",
                "counts": counts,
                "program_exit_code": code,
            }));
        }
        self.note(&counts.to_string());
        Ok(())
    }

    fn print_json(&self, value: &serde_json::Value) -> Result<()> {
        if self.has_program {
            progress::say(&value.to_string());
        } else {
            outln!("{value}")?;
        }
        Ok(())
    }
}

fn sensor(part: &Part) -> Sensor {
    let place = part.planned.place;
    Sensor {
        name: part.planned.name.clone(),
        bus: place.bus,
        multiplexer: place.branch.map(|branch| branch.mux.bits()),
        channel: place.branch.map(|branch| branch.channel),
        address: place.address.bits(),
        place: place.to_string(),
    }
}
