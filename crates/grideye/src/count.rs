//! `grideye count`: how many people a recording shows, and how good a count is.

use crate::cli::Count;
use crate::exit::{Outcome, bad_input};
use crate::output::answer;
use crate::{files, progress, recordings};
use anyhow::{Result, anyhow};
use grideye_count::judge::{Confusion, Judged, Judgment, NEAR_CHANGE_S, VOTES};
use grideye_count::{Counter, Gate, Network};
use grideye_inputs::counting::{counter_by, counter_of, people, temperatures};
use grideye_inputs::shown;
use grideye_recording::{Record, StreamId};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;
use std::time::Duration;

/// More than the largest network takes.
const WEIGHTS_BYTES_MAX: u64 = 1 << 20;
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
    let weights = options.weights.as_deref();
    let bytes = weights.map(|path| files::short(path, WEIGHTS_BYTES_MAX));
    let bytes = bytes.transpose()?;
    let network = network(weights, bytes.as_deref())?;
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
            let judged = judged(records, &table(truth, records)?, &counts);
            text += &in_words(&Judgment::of(&judged));
        }
    }
    answer(options.json.as_ref(), || lines, || text)?;
    Ok(Outcome::Done)
}

fn network<'b>(path: Option<&Path>, bytes: Option<&'b [u8]>) -> Result<Network<'b>> {
    let (Some(path), Some(bytes)) = (path, bytes) else {
        return Ok(Network::default());
    };
    Network::new(bytes).map_err(|error| {
        let path = shown(path);
        bad_input(anyhow!(
            "{path}: {error}\nhint: tests/peers/counting/run --weights FILE writes such a file"
        ))
    })
}

/// The counts of one stream's frames.
struct Counted {
    frames: Vec<Frame>,
}

struct Frame {
    seq: u64,
    at_s: f64,
    count: Option<grideye_count::Count>,
    /// How many entered and left with this frame, if there is a line.
    crossed: Option<[u64; 2]>,
}

impl Counted {
    fn new(options: &Count, network: &Network<'_>, records: &[Record]) -> Result<Self> {
        let mut counter = match &options.profile {
            Some(path) => {
                let profile = files::load_profile(path, grideye_inputs::TOML_HINT)?;
                counter_by(&profile, path).map_err(bad_input)?
            }
            None if options.live => Counter::new(),
            None => counter_of(records),
        };
        let mut gate = options.line.map(Gate::new);
        let bar = progress::bar(u64::try_from(records.len()).unwrap_or(u64::MAX), "counting");
        let frames = bar
            .wrap_iter(records.iter().zip(times(records)))
            .map(|(record, at_s)| {
                let count =
                    temperatures(record).and_then(|frame| counter.see(network, at_s, &frame));
                let crossed = gate.as_mut().map(|gate| match &count {
                    Some(count) => gate.see(at_s, &count.excess),
                    None => [0, 0],
                });
                Frame {
                    seq: record.seq,
                    at_s,
                    count,
                    crossed,
                }
            });
        let frames: Vec<Frame> = frames.collect();
        bar.finish_and_clear();
        if frames.iter().all(|frame| frame.count.is_none()) {
            progress::say(
                "the recording ends before the empty room is known: nothing was counted\nhint: leave --live out",
            );
        }
        Ok(Self { frames })
    }

    fn people(&self) -> Vec<Option<u8>> {
        let people = |frame: &Frame| frame.count.map(|count| count.people);
        self.frames.iter().map(people).collect()
    }

    /// A line per change.
    fn changes(&self, stream: Option<&StreamId>) -> String {
        let name = stream.map_or(String::new(), |stream| {
            format!("{}/{}  ", stream.device, stream.sensor)
        });
        let (mut text, mut last, mut sums) = (String::new(), None, [0, 0]);
        for frame in &self.frames {
            let mut tell = |what: &str| {
                let _infallible = writeln!(text, "{name}{:9.1} s  {what}", frame.at_s);
            };
            let crossed = frame.crossed.unwrap_or_default();
            for ((crossed, sum), word) in
                crossed.into_iter().zip(&mut sums).zip(["entered", "left"])
            {
                if crossed > 0 {
                    *sum += crossed;
                    tell(&format!("{crossed} {word}"));
                }
            }
            if let Some(count) = frame.count.filter(|count| last != Some(count.people)) {
                last = Some(count.people);
                tell(
                    WORDS
                        .get(usize::from(count.people))
                        .copied()
                        .unwrap_or_default(),
                );
            }
        }
        if self.frames.iter().any(|frame| frame.crossed.is_some()) {
            let _infallible = writeln!(text, "{name}{} entered, {} left", sums[0], sums[1]);
        }
        text
    }

    /// A line per frame.
    fn json(&self, stream: Option<&StreamId>) -> String {
        let mut sums = [0, 0];
        let lines = self.frames.iter().map(|frame| {
            let mut line = json!({ "seq": frame.seq, "t_s": frame.at_s });
            if let Some(stream) = stream {
                line["device"] = stream.device.as_str().into();
                line["sensor"] = stream.sensor.as_str().into();
            }
            line["people"] = frame.count.map(|count| count.people).into();
            line["p"] = frame
                .count
                .map(|count| count.chances.map(rounded).to_vec())
                .into();
            let places = frame.count.map(|count| {
                let places = count.places.as_slice().iter();
                let places =
                    places.map(|place| json!([place.x, place.y, place.excess_c].map(rounded)));
                places.collect::<Value>()
            });
            line["places"] = places.into();
            if let Some(crossed) = frame.crossed {
                for ((crossed, sum), key) in
                    crossed.into_iter().zip(&mut sums).zip(["entered", "left"])
                {
                    *sum += crossed;
                    line[key] = (*sum).into();
                }
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

/// Seconds since the first record, by the device's clock.
fn times(records: &[Record]) -> impl Iterator<Item = f64> {
    let boot_ns = |record: &Record| record.stamp.t_boot_ns;
    let began_ns = records.first().map_or(0, boot_ns);
    let since = move |record| Duration::from_nanos(boot_ns(record).saturating_sub(began_ns));
    records
        .iter()
        .map(move |record| since(record).as_secs_f64())
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
fn judged(records: &[Record], truth: &[Option<u8>], counts: &[Option<u8>]) -> Vec<Judged> {
    let frames = times(records).zip(truth).zip(counts);
    let judged = frames.filter_map(|((at_s, truth), counted)| {
        Some(Judged {
            at_s,
            truth: (*truth)?,
            counted: *counted,
        })
    });
    judged.collect()
}

fn in_words(judgment: &Judgment) -> String {
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
    text += &row("all frames", &judgment.all);
    text += &row(
        &format!("more than {NEAR_CHANGE_S} s from a change of the truth"),
        &judgment.steady,
    );
    text += &row(&format!("majority of {VOTES} frames"), &judgment.majority);
    text += &format!(
        "\nlongest time wrong {:.1} s; {} frames without a count\n",
        judgment.longest_wrong_s, judgment.not_yet
    );
    text += "\nframes by true number (rows) and count (columns)\n";
    text += &format!("{:>10}{:>8}{:>8}{:>8}{:>8}\n", "", 0, 1, 2, "3+");
    for (truth, row) in ["0", "1", "2", "3+"].iter().zip(judgment.all.0) {
        let cells: String = row.iter().map(|frames| format!("{frames:>8}")).collect();
        text += &format!("{truth:>10}{cells}\n");
    }
    text
}
