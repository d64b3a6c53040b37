//! `grideye orient`: how a sensor is mounted, by a hand at the left and one at the top.

use crate::cli::Orient;
use crate::client::Client;
use crate::exit::{Outcome, bad_input};
use crate::output::outln;
use crate::{progress, recordings};
use anyhow::{Context as _, Result, anyhow};
use grideye_frame::Celsius;
use grideye_validator::orient::{self, Picture, Step, Watch};
use serde_json::Value;
use std::collections::BTreeSet;
use std::io::{BufRead, Read as _};
use std::path::Path;
use std::time::{Duration, Instant};

/// Longest event line: a sensor's batch has a few kilobytes.
const LINE_BYTES_MAX: u64 = 16 << 20;

pub(crate) fn run(options: &Orient) -> Result<Outcome> {
    let (sensor, watch) = match &options.recording {
        Some(path) => recorded(path, options.sensor.as_deref())?,
        None => live(options)?,
    };
    let found = watch.found();
    if options.json {
        outln!("{}", orient::json(&sensor, &found))?;
    } else {
        outln!("{}", orient::text(&sensor, &found))?;
    }
    Ok(Outcome::told(found.is_ok()))
}

fn live(options: &Orient) -> Result<(String, Watch)> {
    let mut frames = Live {
        lines: Box::new(Client::of(&options.collector)?.live()?),
        wanted: options.sensor.as_deref(),
        known: BTreeSet::new(),
    };
    let mut watch = Watch::default();
    let (mut asked, mut since, mut is_told) = (None, Instant::now(), false);
    while watch.step() != Step::Done && since.elapsed() < Duration::from_secs(options.seconds) {
        if asked != Some(watch.step()) {
            (asked, since, is_told) = (Some(watch.step()), Instant::now(), false);
            progress::say(ask(watch.step()));
        }
        if watch.is_unclear() && !is_told {
            is_told = true;
            progress::say("nearer to the edge of the view, in the middle of that side");
        }
        frames
            .next()?
            .iter()
            .for_each(|picture| watch.push(picture));
    }
    let sensor = frames.known.pop_first().ok_or_else(|| {
        anyhow!(
            "no such sensor delivered\nhint: look at the collector's page; is an agent running?"
        )
    })?;
    Ok((sensor, watch))
}

const fn ask(step: Step) -> &'static str {
    match step {
        Step::Empty => "keep out of the sensor's view for two seconds",
        Step::Left => {
            "now hold a hand at the LEFT of its view, as one sees it who looks where the sensor looks"
        }
        Step::Gone => "seen; take it out of the view",
        Step::Top => "now hold a hand at the TOP of its view",
        Step::Done => "seen",
    }
}

fn recorded(path: &Path, wanted: Option<&str>) -> Result<(String, Watch)> {
    let mut watch = Watch::default();
    let mut followed: Option<String> = None;
    let shown = path.display();
    for row in recordings::open(path)? {
        let row = row?;
        if !wanted.is_none_or(|wanted| row.stream.is_of(wanted)) {
            continue;
        }
        let name = format!("{}/{}", row.stream.device, row.stream.sensor);
        if followed.get_or_insert_with(|| name.clone()) != &name {
            return Err(bad_input(anyhow!(
                "{shown} holds several sensors\nhint: name one with --sensor DEVICE/SENSOR, such as {name}"
            )));
        }
        if let Some(raw) = row.record.reading.frame() {
            let pixels = grideye_frame::word::pixels(&raw.pixels);
            watch.push(&pixels.map(Celsius::get).map(f64::from));
        }
    }
    let sensor = followed.ok_or_else(|| {
        bad_input(anyhow!(
            "{shown} holds no row of that sensor\nhint: its columns device and sensor name those that it holds"
        ))
    })?;
    Ok((sensor, watch))
}

struct Live<'a> {
    lines: Box<dyn BufRead>,
    wanted: Option<&'a str>,
    /// The requested sensors that deliver frames, as `DEVICE/SENSOR`.
    known: BTreeSet<String>,
}

impl Live<'_> {
    /// Waits for the next event: new frames of the sensor, the oldest first, or none.
    fn next(&mut self) -> Result<Vec<Picture>> {
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
        if !["frames", "snapshot"].contains(&name.as_str()) {
            return Ok(Vec::new());
        }
        let event: Value = serde_json::from_str(&text)
            .context("the collector says something else than a collector does")?;
        let pictures = self.take(&event)?;
        // The snapshot lists the sensors; its frames may be old.
        Ok(if name == "frames" {
            pictures
        } else {
            Vec::new()
        })
    }

    fn line(&mut self) -> Result<String> {
        let mut line = String::new();
        let mut limited = self.lines.by_ref().take(LINE_BYTES_MAX);
        let read = limited.read_line(&mut line);
        if read.context("the connection to the collector broke off")? == 0 {
            return Err(anyhow!(
                "the collector ended the connection\nhint: is it still running? `grideye collect` says why it stops"
            ));
        }
        Ok(line.trim_end().to_owned())
    }

    fn take(&mut self, event: &Value) -> Result<Vec<Picture>> {
        let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
        let mut pictures = Vec::new();
        for told in list(&event["sensors"]) {
            let [device, sensor] = ["device", "sensor"].map(|key| told[key].as_str().unwrap_or(""));
            let name = format!("{device}/{sensor}");
            if self
                .wanted
                .is_none_or(|wanted| wanted == name || wanted == sensor)
            {
                self.known.insert(name);
                // A missing frame has no pixels.
                let celsius = list(&told["frames"]).into_iter().filter_map(|mut frame| {
                    serde_json::from_value(frame["pixels_celsius"].take()).ok()
                });
                pictures.extend(celsius.filter_map(|all: Vec<f64>| Picture::try_from(all).ok()));
            }
        }
        if self.known.len() > 1 {
            let names: Vec<&str> = self.known.iter().map(String::as_str).collect();
            return Err(bad_input(anyhow!(
                "there are several sensors: {}\nhint: name one with --sensor DEVICE/SENSOR",
                names.join(", ")
            )));
        }
        Ok(pictures)
    }
}
