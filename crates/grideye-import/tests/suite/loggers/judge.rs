//! What a reader made of a file, beside what is in it.

use super::truth::{Event, Label, Times, Truth};
use super::variant::Written;
use crate::support::said;
use grideye_import::{Import, ImportError};
use grideye_recording::{Row, StreamId};

/// Frames follow each other at this rate where a file has no times.
const RATE_NS: i64 = 100_000_000;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Outcome {
    Right,
    /// An error that names an option.
    Asked(String),
    /// Another error.
    Refused(String),
    /// The frames are right; labels, times, a stream or what was said of the loss is not there.
    Lossy(String),
    /// Something else than what is in the file.
    Wrong(String),
}

type Fault = Result<(), Outcome>;

fn lossy(what: impl Into<String>) -> Fault {
    Err(Outcome::Lossy(what.into()))
}

fn wrong(what: impl Into<String>) -> Fault {
    Err(Outcome::Wrong(what.into()))
}

/// What is read with such columns said, or none.
pub(crate) fn outcome(written: &Written, columns: &str) -> Outcome {
    match said(written.bytes.clone(), written.name, columns) {
        Err(error) => refusal(&error),
        Ok(import) => read(import, &written.truth).err().unwrap_or(Outcome::Right),
    }
}

fn refusal(error: &ImportError) -> Outcome {
    let text = error.to_string();
    let hint = text.split_once("hint: ").map_or("", |(_, hint)| hint);
    match hint.contains("--columns") || hint.contains("--rate") {
        true => Outcome::Asked(text),
        false => Outcome::Refused(text),
    }
}

/// What was read of one stream.
type Group = (StreamId, Vec<Row>);

fn read(mut import: Import, truth: &Truth) -> Fault {
    let (mut groups, mut broke) = (Vec::<Group>::new(), None);
    for row in import.by_ref() {
        match row {
            Ok(row) => match groups.iter_mut().find(|(stream, _)| *stream == row.stream) {
                Some((_, rows)) => rows.push(row),
                None => groups.push((row.stream.clone(), vec![row])),
            },
            Err(error) if error.is_break() => broke = Some(error.to_string()),
            Err(error) => return Err(refusal(&error)),
        }
    }
    let tally = import.tally();
    let count = tally.map_or(0, |tally| {
        tally.damaged + tally.skipped + tally.empty + tally.cut
    });
    let said = Said {
        loss: count > 0 || broke.is_some(),
        broke,
        text: format!(
            "{}\n{}",
            import.account(),
            tally.map(|tally| tally.to_string()).unwrap_or_default()
        ),
    };
    if let [events] = &truth.streams[..] {
        let [(stream, rows)] = &groups[..] else {
            return wrong(format!("one stream was read as {}", groups.len()));
        };
        return frames(rows, events, truth, &said)
            .and_then(|()| labels(stream, &import, rows, events, truth));
    }
    streams(&groups, truth, &said)
}

/// What the reader said beside the rows.
struct Said {
    loss: bool,
    broke: Option<String>,
    text: String,
}

fn streams(groups: &[Group], truth: &Truth, said: &Said) -> Fault {
    let fits = |rows: &Vec<Row>, events: &Vec<Event>| pixels(rows, events, truth, said).is_ok();
    if groups.len() != truth.streams.len() {
        let is_one_of_them = groups
            .iter()
            .all(|(_, rows)| truth.streams.iter().any(|events| fits(rows, events)));
        let what = format!(
            "{} streams were read as {}",
            truth.streams.len(),
            groups.len()
        );
        return if is_one_of_them {
            lossy(what)
        } else {
            wrong(what)
        };
    }
    for events in &truth.streams {
        let fitting = groups.iter().find(|(_, rows)| fits(rows, events));
        let Some((_, rows)) = fitting else {
            return wrong("no stream has the frames of one of the sensors");
        };
        frames(rows, events, truth, said)?;
    }
    Ok(())
}

fn frames(rows: &[Row], events: &[Event], truth: &Truth, said: &Said) -> Fault {
    pixels(rows, events, truth, said)?;
    missing(rows, events, truth, said)?;
    times(rows, events, truth, said)?;
    thermistor(rows, events, truth)
}

fn with_frames(rows: &[Row]) -> Vec<&Row> {
    let has_frame = |row: &&Row| row.record.reading.frame().is_some();
    rows.iter().filter(has_frame).collect()
}

fn whole(events: &[Event]) -> Vec<&super::scene::Shot> {
    let shots = events.iter().filter_map(|event| match event {
        Event::Whole(shot) => Some(&**shot),
        Event::Torn | Event::Gone => None,
    });
    shots.collect()
}

/// Twelve bits of two's complement (AMG88 spec §4-11-11).
fn steps(word: u16) -> i16 {
    let value = i16::try_from(word & 0x0FFF).unwrap();
    if value >= 0x800 {
        value - 0x1000
    } else {
        value
    }
}

fn pixels(rows: &[Row], events: &[Event], truth: &Truth, said: &Said) -> Fault {
    let (rows, shots) = (with_frames(rows), whole(events));
    let mut farthest = 0;
    for (row, shot) in rows.iter().zip(&shots) {
        let frame = row.record.reading.frame().unwrap();
        for (word, steps_there) in frame.pixels.iter().zip(shot.steps) {
            farthest = farthest.max((steps(word.0) - steps_there).abs());
        }
    }
    let counts = format!("{} frames of {}", rows.len(), shots.len());
    if farthest > truth.tolerance {
        return wrong(format!(
            "{counts}, pixels off by up to {} °C",
            f64::from(farthest) / 4.0
        ));
    }
    match (&said.broke, rows.len() == shots.len()) {
        (_, true) => Ok(()),
        (Some(broke), false) => lossy(format!("{counts}, then {broke}")),
        (None, false) => wrong(counts),
    }
}

/// Frames that are lost are missing, those alone, and where they were.
fn missing(rows: &[Row], events: &[Event], truth: &Truth, said: &Said) -> Fault {
    // For each frame, and for the end: how many are missing before it.
    let (mut found, mut next) = (vec![0_u64], None);
    for row in rows {
        let seq = row.record.seq;
        let jumped = next.map_or(0, |next| seq.saturating_sub(next));
        next = Some(seq + 1);
        *found.last_mut().unwrap() += jumped;
        match row.record.reading.frame() {
            Some(_) => found.push(0),
            None => *found.last_mut().unwrap() += 1,
        }
    }
    let mut lost = vec![(0_u64, 0_u64)];
    for event in events {
        let last = lost.last_mut().unwrap();
        match event {
            Event::Whole(_) => lost.push((0, 0)),
            Event::Torn => *last = (last.0 + 1, last.1 + 1),
            Event::Gone => *last = (last.0 + u64::from(truth.is_numbered), last.1 + 1),
        }
    }
    let end = lost.len() - 1;
    for (place, (found, (least, most))) in found.iter().zip(&lost).enumerate() {
        if found > most {
            return wrong(format!(
                "{found} missing before frame {place}, but {most} were lost"
            ));
        }
        let is_edge = place == 0 || place == end;
        let begins_late = place == 0 && rows.first().is_some_and(|row| row.record.seq > 0);
        let is_said = *found > 0 || begins_late || (is_edge && said.loss);
        if *least > 0 && !is_said {
            return lossy(format!("what was lost before frame {place} is not said"));
        }
        if truth.is_numbered && !is_edge && found != most {
            return wrong(format!(
                "{found} missing before frame {place}, and {most} were lost"
            ));
        }
    }
    Ok(())
}

fn times(rows: &[Row], events: &[Event], truth: &Truth, said: &Said) -> Fault {
    let (rows, shots) = (with_frames(rows), whole(events));
    let (Some(first), Some(shot)) = (rows.first(), shots.first()) else {
        return wrong("no frames");
    };
    let since = |row: &Row, from: &Row| {
        i64::try_from(row.record.stamp.t_boot_ns).unwrap()
            - i64::try_from(from.record.stamp.t_boot_ns).unwrap()
    };
    let off = |pairs: &dyn Fn(usize) -> i64| (0..rows.len()).map(pairs).max().unwrap_or(0);
    let off_relative = off(&|at| (since(rows[at], first) - (shots[at].t_ns - shot.t_ns)).abs());
    let off_absolute = off(&|at| (rows[at].record.stamp.t_utc_ns - shots[at].utc_ns).abs());
    let seq = |row: &Row| i64::try_from(row.record.seq).unwrap();
    let is_rate = rows
        .iter()
        .all(|row| since(row, first) == (seq(row) - seq(first)) * RATE_NS);
    let has_utc = rows.iter().any(|row| row.record.stamp.t_utc_ns != 0);
    let seconds = |ns: i64| format!("{} ms", ns / 1_000_000);
    let spacing = |most: i64| match off_relative <= most {
        true => Ok(()),
        false if is_rate => lossy("the times are not read"),
        false => wrong(format!("times off by up to {}", seconds(off_relative))),
    };
    match truth.times {
        Times::Rate if is_rate && !has_utc => Ok(()),
        Times::Rate => wrong("times that the file does not have"),
        Times::Relative(most) if has_utc && off_absolute > most => {
            spacing(most)?;
            wrong("a day that the file does not have")
        }
        Times::Relative(most) => spacing(most),
        Times::Absolute(most) if has_utc && off_absolute > most => wrong(format!(
            "times since 1970 off by up to {}",
            seconds(off_absolute)
        )),
        Times::Absolute(most) => {
            spacing(most)?;
            if has_utc {
                Ok(())
            } else {
                lossy("the day is not read")
            }
        }
        Times::Said | Times::Equal => {
            let is_said = ["rate", "equal", "same", "repeat"]
                .iter()
                .any(|word| said.text.contains(word));
            let is_dated = has_utc && matches!(truth.times, Times::Said);
            if is_dated && off_absolute > 1_100_000_000 || off_relative > 1_100_000_000 && !is_rate
            {
                return wrong(format!("times off by up to {}", seconds(off_relative)));
            }
            if is_said {
                Ok(())
            } else {
                lossy("stamps that repeat are not said")
            }
        }
    }
}

fn thermistor(rows: &[Row], events: &[Event], truth: &Truth) -> Fault {
    for (row, shot) in with_frames(rows).iter().zip(whole(events)) {
        let found = row.record.reading.frame().unwrap().thermistor;
        let celsius = found.map(|word| {
            let steps = f64::from(word.0 & 0x07FF) / 16.0;
            if word.0 & 0x0800 == 0 { steps } else { -steps }
        });
        match (celsius, truth.thermistor) {
            (None, None) => {}
            (None, Some(_)) => return lossy("the thermistor is not read"),
            (Some(found), None) => return wrong(format!("a thermistor of {found} °C")),
            (Some(found), Some(most)) => {
                let there = shot.thermistor_c();
                if (found - there).abs() > most {
                    return wrong(format!("a thermistor of {found} °C, not {there} °C"));
                }
            }
        }
    }
    Ok(())
}

fn labels(
    stream: &StreamId,
    import: &Import,
    rows: &[Row],
    events: &[Event],
    truth: &Truth,
) -> Fault {
    for label in &truth.labels {
        let called = label.name.clone().unwrap_or_default();
        let names: Vec<usize> = (0..import.labels().len())
            .filter(|at| has_values(*at, rows, events, label))
            .collect();
        let is_named = |at: &usize| {
            import.labels()[*at]
                .to_lowercase()
                .contains(&called.to_lowercase())
        };
        if names.iter().any(is_named) || names_stream(stream, label) {
            continue;
        }
        let found = format!("labels {:?}", import.labels());
        if !names.is_empty() {
            return lossy(format!("the label {called} lost its name: {found}"));
        }
        let values = import
            .labels()
            .iter()
            .position(|name| name.to_lowercase().contains(&called.to_lowercase()));
        return match values.filter(|_| !called.is_empty()) {
            Some(at) => {
                let found = rows.iter().map(|row| row.labels[at].as_str());
                wrong(format!(
                    "the label {called} has {:?}, not {:?}",
                    found.take(8).collect::<Vec<_>>(),
                    label.values.iter().take(8).collect::<Vec<_>>()
                ))
            }
            None => lossy(format!("the label {called:?} is not read: {found}")),
        };
    }
    Ok(())
}

fn has_values(at: usize, rows: &[Row], events: &[Event], label: &Label) -> bool {
    let mut pairs = with_frames(rows).into_iter().zip(whole(events));
    pairs.all(|(row, shot)| is_same(&row.labels[at], &label.values[shot.index]))
}

/// Whether one text is the other, the same number, or has it as a word.
fn is_same(found: &str, there: &str) -> bool {
    let numbers = (found.trim().parse::<f64>(), there.trim().parse::<f64>());
    if let (Ok(found), Ok(there)) = numbers {
        return (found - there).abs() < 1e-9;
    }
    let is_word = |character: char| character.is_alphanumeric() || "._-".contains(character);
    found.trim() == there.trim()
        || found.eq_ignore_ascii_case(there)
        || (!there.is_empty()
            && found
                .split(|character| !is_word(character))
                .any(|word| word == there))
}

/// Whether the one value of a label became the stream's name.
fn names_stream(stream: &StreamId, label: &Label) -> bool {
    let plain =
        |text: &str| -> String { text.chars().filter(char::is_ascii_alphanumeric).collect() };
    let value = plain(&label.values[0]);
    let is_constant = label.values.iter().all(|other| plain(other) == value);
    let parts = [&stream.device, &stream.sensor, &stream.boot];
    is_constant && !value.is_empty() && parts.iter().any(|part| plain(part).contains(&value))
}
