//! `grideye count`: how many people a recording shows, and how good a count is.

use crate::cli::{Count, CountLive};
use crate::exit::{Outcome, bad_input};
use crate::output::answer;
use crate::{progress, recordings};
use anyhow::{Result, anyhow};
use grideye_collector::Counting;
use grideye_count::Network;
use grideye_count::evaluation::{Confusion, Evaluation, Labeled, NEAR_CHANGE_S, VOTES};
use grideye_import::ImportError;
use grideye_inputs::counting::{FrameCount, count, counter, network, people, times, weights};
use grideye_inputs::{InputError, shown};
use grideye_recording::{Record, Row, StreamId};
use serde_json::json;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

const WORDS: [&str; 4] = ["nobody", "1 person", "2 people", "3 people or more"];

pub(crate) fn run(options: &Count) -> Result<Outcome> {
    let path = &options.recording;
    let mut streams = recordings::load_streams(path)?;
    let sensor = options.sensor.as_deref();
    streams.retain(|stream, _| sensor.is_none_or(|sensor| stream.is_of(sensor)));
    let mut records = streams.values().flatten();
    if !records.any(|record| record.reading.frame().is_some()) {
        return Err(bad_input(anyhow!(
            "{} holds no frame to count in\nhint: all of its rows say that a frame is missing, or it has none of that sensor",
            shown(path)
        )));
    }
    if options.truth.is_some() && streams.len() > 1 {
        return Err(bad_input(anyhow!(
            "{} holds {} streams, and one is judged at a time\nhint: name a sensor with --sensor",
            shown(path),
            streams.len()
        )));
    }
    recordings::say_doubt(path, streams.values().flatten());
    let bytes = options.weights.as_deref().map(weights).transpose();
    let bytes = bytes.map_err(bad_input)?;
    let network = network(bytes.as_deref());
    let (mut text, mut lines) = (String::new(), String::new());
    for (stream, records) in &streams {
        let counts = match &options.counts {
            Some(counts) => table(counts, records)?,
            None => {
                let name = (streams.len() > 1).then_some(stream);
                let counted = Counted::new(options, &network, records)?;
                text += &counted.changes(name);
                if options.json.is_some() {
                    lines += &counted.json(name);
                }
                counted.people()
            }
        };
        if let Some(truth) = &options.truth {
            let labeled = labeled(records, &table(truth, records)?, &counts);
            text += &in_words(&Evaluation::of(&labeled));
        }
    }
    answer(options.json.as_ref(), || lines, || text)?;
    Ok(Outcome::Done)
}

/// Adds to rows that were read how many people each frame shows, behind their `labels`.
pub(crate) fn add_people(
    rows: &mut [Result<Row, ImportError>],
    labels: usize,
) -> Result<(), InputError> {
    let mut streams: BTreeMap<StreamId, Vec<&mut Row>> = BTreeMap::new();
    for row in rows.iter_mut().flatten() {
        streams.entry(row.stream.clone()).or_default().push(row);
    }
    for rows in streams.into_values() {
        let records: Vec<Record> = rows.iter().map(|row| row.record).collect();
        let counter = counter(&records, None, false)?;
        let frames = count(&records, Network::default(), counter, None);
        for (row, frame) in rows.into_iter().zip(frames) {
            let people = frame.count.map(|count| count.people.to_string());
            row.labels.resize(labels, String::new());
            row.labels.push(people.unwrap_or_default());
        }
    }
    Ok(())
}

/// How a collector counts, if it does.
pub(crate) fn live(options: &CountLive, is_needed: bool) -> Result<Option<Counting>> {
    if options.count.is_none() && options.line.is_none() && !is_needed {
        return Ok(None);
    }
    let path = options.count.as_ref().and_then(Option::as_deref);
    let bytes = path.map(weights).transpose().map_err(bad_input)?;
    // Once in the life of the program.
    let network = network(bytes.map(|bytes| &*bytes.leak()));
    let line = options.line;
    Ok(Some(Counting { network, line }))
}

/// The counts of one stream's frames.
struct Counted(Vec<FrameCount>);

impl Counted {
    fn new(options: &Count, network: &Network<'_>, records: &[Record]) -> Result<Self> {
        let counter = counter(records, options.profile.as_deref(), options.live);
        let counter = counter.map_err(bad_input)?;
        let bar = progress::bar(u64::try_from(records.len()).unwrap_or(u64::MAX), "counting");
        let frames = bar.wrap_iter(count(records, *network, counter, options.line));
        let frames: Vec<FrameCount> = frames.collect();
        bar.finish_and_clear();
        if frames.iter().all(|frame| frame.count.is_none()) {
            progress::say(
                "the recording ends before the empty room is known: nothing was counted\nhint: leave --live out",
            );
        }
        Ok(Self(frames))
    }

    fn people(&self) -> Vec<Option<u8>> {
        let people = |frame: &FrameCount| frame.count.map(|count| count.people);
        self.0.iter().map(people).collect()
    }

    /// A line per change.
    fn changes(&self, stream: Option<&StreamId>) -> String {
        let name = stream.map_or(String::new(), |stream| {
            format!("{}/{}  ", stream.device, stream.sensor)
        });
        let (mut text, mut people, mut before) = (String::new(), None, [0, 0]);
        for frame in &self.0 {
            let mut tell = |what: &str| {
                let _infallible = writeln!(text, "{name}{:9.1} s  {what}", frame.at_s);
            };
            let crossed = frame.crossed.unwrap_or_default();
            for ((now, before), word) in crossed.iter().zip(before).zip(["entered", "left"]) {
                if *now > before {
                    tell(&format!("{} {word}", now - before));
                }
            }
            before = crossed;
            if let Some(count) = frame.count.filter(|count| people != Some(count.people)) {
                people = Some(count.people);
                tell(
                    WORDS
                        .get(usize::from(count.people))
                        .copied()
                        .unwrap_or_default(),
                );
            }
        }
        let mut seconds = [0.0; WORDS.len()];
        for pair in self.0.windows(2) {
            if let Some(count) = &pair[0].count {
                seconds[usize::from(count.people)] += pair[1].at_s - pair[0].at_s;
            }
        }
        let parts = WORDS.iter().zip(seconds);
        let parts = parts.filter(|(_, seconds)| *seconds > 0.0);
        let parts = parts.map(|(words, seconds)| format!("{words} for {seconds:.0} s"));
        let parts: Vec<String> = parts.collect();
        if !parts.is_empty() {
            let _infallible = writeln!(text, "{name}{}", parts.join(", "));
        }
        if let Some([entered, left]) = self.0.last().and_then(|last| last.crossed) {
            let _infallible = writeln!(text, "{name}{entered} entered, {left} left");
        }
        text
    }

    /// A line per frame.
    fn json(&self, stream: Option<&StreamId>) -> String {
        let lines = self.0.iter().map(|frame| {
            let count = frame.count.as_ref();
            let places = count.map(|count| {
                let places = count.places.as_slice().iter();
                let places = places.map(|place| [place.x, place.y, place.excess_c].map(rounded));
                places.collect::<Vec<_>>()
            });
            let mut line = json!({
                "seq": frame.seq,
                "t_s": frame.at_s,
                "people": count.map(|count| count.people),
                "p": count.map(|count| count.chances.map(rounded)),
                "places": places,
            });
            if let Some(stream) = stream {
                line["device"] = stream.device.as_str().into();
                line["sensor"] = stream.sensor.as_str().into();
            }
            if let Some([entered, left]) = frame.crossed {
                line["entered"] = entered.into();
                line["left"] = left.into();
            }
            format!("{line}\n")
        });
        lines.collect()
    }
}

/// Four decimals are more than the network knows.
fn rounded(value: f32) -> f64 {
    (f64::from(value) * 1e4).round() / 1e4
}

/// The numbers of people that `FILE[:COLUMN]` has for the records.
fn table(named: &str, records: &[Record]) -> Result<Vec<Option<u8>>> {
    let (path, column) = match named.rsplit_once(':') {
        Some((path, column)) if !Path::new(named).exists() => (path, Some(column)),
        _ => (named, None),
    };
    let path = Path::new(path);
    let people = people(path, column).map_err(bad_input)?;
    people.of(records, path).map_err(bad_input)
}

/// Frames with a true number.
fn labeled(records: &[Record], truth: &[Option<u8>], counts: &[Option<u8>]) -> Vec<Labeled> {
    let frames = times(records).zip(truth).zip(counts);
    let labeled = frames.filter_map(|((at_s, truth), counted)| {
        Some(Labeled {
            at_s,
            truth: (*truth)?,
            counted: *counted,
        })
    });
    labeled.collect()
}

fn in_words(evaluation: &Evaluation) -> String {
    let percent = |share: Option<f64>| {
        share.map_or("-".to_owned(), |share| format!("{:.1} %", 100.0 * share))
    };
    let row = |name: &str, of: &Confusion| {
        let [false_alarm, missed] = of.presence_errors().map(percent);
        let balanced = percent(of.balanced_accuracy());
        format!("{name:<44}{balanced:>10}{false_alarm:>24}{missed:>25}\n")
    };
    let mut text = format!(
        "\n{:<44}{:>10}{:>24}{:>25}\n",
        "", "balanced", "empty called occupied", "occupied called empty"
    );
    text += &row("all frames", &evaluation.all);
    text += &row(
        &format!("more than {NEAR_CHANGE_S} s from a change of the truth"),
        &evaluation.steady,
    );
    text += &row(&format!("majority of {VOTES} frames"), &evaluation.majority);
    text += &format!(
        "\nlongest time wrong {:.1} s; {} frames without a count\n",
        evaluation.longest_wrong_s, evaluation.not_yet
    );
    text += "\nframes by true number (rows) and count (columns)\n";
    text += &format!("{:>10}{:>8}{:>8}{:>8}{:>8}\n", "", 0, 1, 2, "3+");
    for (truth, row) in ["0", "1", "2", "3+"].iter().zip(evaluation.all.0) {
        let cells: String = row.iter().map(|frames| format!("{frames:>8}")).collect();
        text += &format!("{truth:>10}{cells}\n");
    }
    text
}
