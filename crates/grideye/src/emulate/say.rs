//! What `grideye emulate` says of itself: one line when it is ready, one of what went over the buses.

use super::parts::Prepared;
use crate::cli::Emulate;
use crate::exit::Outcome;
use crate::output::outln;
use crate::progress;
use anyhow::Result;
use grideye_rig::{Counts, Planned};
use serde_json::{Value, json};

pub(super) struct Voice {
    json: bool,
    quiet: bool,
    /// Standard output is the program's, if there is one.
    has_program: bool,
    shown: String,
    /// The sensors, for programs and for people.
    sensors: Vec<Value>,
    places: String,
}

#[derive(Default)]
pub(super) struct Reached {
    /// fuse, preload, socket, usbip or usbip-tcp.
    pub(super) ways: Vec<&'static str>,
    /// Device files, the socket's path, or the address.
    pub(super) at: Vec<String>,
    /// The same for people.
    pub(super) text: Vec<String>,
}

impl Reached {
    /// One more way, if it has one place.
    pub(super) fn add(&mut self, way: &'static str, at: impl ToString, text: String) {
        self.ways.push(way);
        self.at.push(at.to_string());
        self.text.push(text);
    }
}

impl Voice {
    pub(super) fn new(options: &Emulate, prepared: &Prepared) -> Self {
        let planned = || prepared.parts.iter().map(|part| &part.planned);
        let places = planned().map(|Planned { name, place }| format!("{name} at {place}"));
        Self {
            json: options.json,
            quiet: options.quiet,
            has_program: !options.program.is_empty(),
            shown: prepared.shown.clone(),
            sensors: planned().map(sensor).collect(),
            places: places.collect::<Vec<_>>().join(", "),
        }
    }

    pub(super) fn ready(&self, reached: &Reached) -> Result<()> {
        if self.json {
            return self.print_json(&json!({
                "event": "ready",
                "ways": reached.ways,
                "at": reached.at,
                "shows": self.shown,
                "sensors": self.sensors,
            }));
        }
        if !self.quiet {
            let reached = reached.text.join(" and ");
            progress::say(&format!(
                "{reached}: {}, showing {}",
                self.places, self.shown
            ));
        }
        if !self.has_program {
            for place in &reached.at {
                outln!("{place}")?;
            }
        }
        Ok(())
    }

    pub(super) fn note(&self, text: &str) {
        if !self.quiet && !self.json {
            progress::say(text);
        }
    }

    pub(super) fn end(&self, counts: &Counts, outcome: Outcome) -> Result<()> {
        if self.json {
            let code = match outcome {
                Outcome::Passed(code) => Some(code),
                _ => None,
            };
            return self.print_json(&json!({
                "event": "end",
                "counts": counts,
                "program_exit_code": code,
            }));
        }
        self.note(&counts.to_string());
        Ok(())
    }

    fn print_json(&self, value: &Value) -> Result<()> {
        if self.has_program {
            progress::say(&value.to_string());
        } else {
            outln!("{value}")?;
        }
        Ok(())
    }
}

fn sensor(planned: &Planned) -> Value {
    let Planned { name, place } = planned;
    let mut sensor = json!({ "name": name, "bus": place.bus, "address": place.address.bits() });
    if let Some(branch) = place.branch {
        sensor["multiplexer"] = branch.mux.into();
        sensor["channel"] = branch.channel.into();
    }
    sensor
}
