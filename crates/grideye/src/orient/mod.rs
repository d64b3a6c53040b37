//! `grideye orient`: how a sensor is mounted, by a hand at the left and one at the top.

mod live;
mod mounting;
mod watch;

use crate::cli::Orient;
use crate::client::Client;
use crate::exit::{Outcome, bad_input};
use crate::output::outln;
use crate::{progress, recordings};
use anyhow::{Result, anyhow};
use grideye_frame::Celsius;
use live::{Live, Said};
use mounting::Mounting;
use serde_json::json;
use std::path::Path;
use std::time::{Duration, Instant};
use watch::{Hand, Picture, Step, Watch};

/// A hand that was at other sides in half of the frames tells nothing.
const CONFIDENCE_MIN: f64 = 0.5;

/// Watches, and says what was seen.
pub(crate) fn run(options: &Orient) -> Result<Outcome> {
    let (sensor, watch) = match &options.recording {
        Some(path) => recorded(path, options.sensor.as_deref())?,
        None => live(options)?,
    };
    let answer = answer(&watch);
    if options.json {
        outln!("{}", in_json(&sensor, &answer))?;
    } else {
        outln!("{}", in_words(&sensor, &answer))?;
    }
    Ok(match answer {
        Ok(_) => Outcome::Done,
        Err(_) => Outcome::NoAnswer,
    })
}

/// Both hands, and what they tell.
struct Answer {
    mounting: Mounting,
    left: Hand,
    top: Hand,
}

impl Answer {
    fn confidence(&self) -> f64 {
        self.left.confidence * self.top.confidence
    }
}

/// What was seen, or why that tells nothing.
fn answer(watch: &Watch) -> Result<Answer, String> {
    let unclear =
        "\nhint: nearer to the edge of the view, in the middle of that side, for two seconds";
    let Some((left, top)) = watch.hands() else {
        let unclear = if watch.is_unclear() { unclear } else { "" };
        let seen = match watch.step() {
            Step::Empty => "the view was never still for two seconds\nhint: begin with nobody in it".to_owned(),
            Step::Left => format!("no hand was seen at one side for a second{unclear}"),
            Step::Gone => "the first hand never left the view\nhint: take it out of the view before you show it at the top".to_owned(),
            Step::Top | Step::Done => format!("no second hand was seen at one side for a second{unclear}"),
        };
        return Err(seen);
    };
    let Some(mounting) = Mounting::from_seen(left.side, top.side) else {
        return Err(format!(
            "the hand at the left was seen at the {}, the one at the top at the {}: that is one line\nhint: once more, the second a quarter clockwise of the first",
            left.side, top.side
        ));
    };
    let answer = Answer {
        mounting,
        left,
        top,
    };
    if answer.confidence() < CONFIDENCE_MIN {
        return Err(format!(
            "the hands were at other sides too (confidence {:.2}){unclear}",
            answer.confidence()
        ));
    }
    Ok(answer)
}

fn in_words(sensor: &str, answer: &Result<Answer, String>) -> String {
    let answer = match answer {
        Ok(answer) => answer,
        Err(why) => return format!("{sensor}: cannot tell: {why}"),
    };
    let hand = |name: &str, hand: &Hand| {
        format!(
            "hand at the {name:<5} seen at the {:<7} column {:.1}, row {:.1}, {:+.1} K\n",
            format!("{},", hand.side),
            hand.column,
            hand.row,
            hand.contrast_k
        )
    };
    let scene = match answer.mounting.roll_deg() {
        Some(roll_deg) => format!("roll_deg = {roll_deg}"),
        None => {
            "none: a lens does not mirror. Was left shown as one sees it who looks at the sensor?"
                .to_owned()
        }
    };
    let keys = match answer.mounting.keys().as_str() {
        "" => "as it is".to_owned(),
        keys => format!("keys {keys}  (t turns, m mirrors)"),
    };
    format!(
        "{sensor}: mounted {} (confidence {:.2})\n{}{}scene     {scene}\npage      {keys}",
        answer.mounting,
        answer.confidence(),
        hand("left", &answer.left),
        hand("top", &answer.top),
    )
}

fn in_json(sensor: &str, answer: &Result<Answer, String>) -> serde_json::Value {
    match answer {
        Ok(answer) => json!({
            "sensor": sensor,
            "told": true,
            "roll_deg": answer.mounting.roll_deg(),
            "mirrored": answer.mounting.mirrored,
            "page": answer.mounting,
            "confidence": answer.confidence(),
            "left": answer.left,
            "top": answer.top,
        }),
        Err(why) => json!({ "sensor": sensor, "told": false, "why": why }),
    }
}

/// Asks for the hands, one after the other.
fn live(options: &Orient) -> Result<(String, Watch)> {
    let mut frames = Live::new(&Client::of(&options.collector)?, options.sensor.as_deref())?;
    let mut watch = Watch::new();
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
        if let Said::Frames(pictures) = frames.next()? {
            for picture in pictures {
                watch.push(&picture);
            }
        }
    }
    let sensor = frames.followed.ok_or_else(|| {
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

/// Looks at a recording of the same.
fn recorded(path: &Path, wanted: Option<&str>) -> Result<(String, Watch)> {
    let mut watch = Watch::new();
    let mut followed: Option<String> = None;
    for row in recordings::open(path)? {
        let row = row?;
        let name = format!("{}/{}", row.stream.device, row.stream.sensor);
        if wanted.is_some_and(|wanted| wanted != name && wanted != row.stream.sensor) {
            continue;
        }
        if followed.get_or_insert_with(|| name.clone()) != &name {
            return Err(bad_input(anyhow!(
                "{} holds several sensors\nhint: name one with --sensor DEVICE/SENSOR, such as {name}",
                path.display()
            )));
        }
        if let Some(raw) = row.record.reading.frame() {
            let frame = amg8833::word::frame(raw);
            let picture: Picture = frame.pixels.map(Celsius::get).map(f64::from);
            watch.push(&picture);
        }
    }
    let sensor = followed.ok_or_else(|| {
        bad_input(anyhow!(
            "{} holds no row of that sensor\nhint: its columns device and sensor name those that it holds",
            path.display()
        ))
    })?;
    Ok((sensor, watch))
}
