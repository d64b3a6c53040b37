//! What a line between frames, or what a logger wrote before one, says: names and values.

use super::split::number;
use crate::moment::{self, Moment, Order};

/// A name, or nothing, and a value.
pub(crate) type Fact = (String, String);

/// What a time stamp is called that stands alone.
pub(super) const TIME: &str = "time";
/// What words are called that say who or what wrote a line.
pub(super) const TAG: &str = "tag";
/// What ESP-IDF writes into its lines: milliseconds since the start.
const TICKS: &str = "ticks_ms";
/// What the kernel writes before its messages: seconds since the start.
const UPTIME: &str = "uptime_s";
/// All of these are times.
pub(super) const STAMPS: [&str; 3] = [TIME, TICKS, UPTIME];
/// The longest time stamp.
const STAMP_CHARS_MAX: usize = 40;
/// Units of time, which belong to a name's meaning.
const TIME_UNITS: [&str; 4] = ["s", "ms", "us", "ns"];
/// The severities of loggers.
const LEVELS: [&str; 16] = [
    "D", "I", "W", "E", "V", "C", "DEBUG", "INFO", "WARN", "WARNING", "ERROR", "CRITICAL",
    "NOTICE", "TRACE", "VERBOSE", "LOG",
];

/// The facts of a line.
pub(crate) fn stated(text: &str) -> Vec<Fact> {
    let mut facts = Vec::new();
    let mut rest = text
        .trim_matches(|edge: char| "-=*#|>~_ \t".contains(edge))
        .to_owned();
    if let Some((before, stamp, after)) = stamp_in(&rest) {
        facts.push((TIME.to_owned(), stamp.to_owned()));
        rest = format!("{before} \t {after}");
    } else if let Some((ticks, after)) = ticks(&rest) {
        let name = if ticks.contains('.') { UPTIME } else { TICKS };
        facts.push((name.to_owned(), ticks.to_owned()));
        rest = after.to_owned();
    }
    let mut words = Vec::new();
    for part in parts(&rest) {
        match (part_of(part), counted(part)) {
            (Some(fact), _) => facts.push(fact),
            (None, counted) if !counted.is_empty() => facts.extend(counted),
            _ => words.extend(part.split_whitespace()),
        }
    }
    let is_letter = |letter: char| letter.is_alphanumeric();
    words.retain(|word| {
        word.contains(is_letter)
            && !LEVELS.contains(&word.trim_matches(|edge: char| !is_letter(edge)))
    });
    if !words.is_empty() {
        let tag = words.join(" ");
        let tag = tag.trim_matches(|edge: char| ":-<>|,; ".contains(edge));
        facts.push((TAG.to_owned(), tag.to_owned()));
    }
    facts
}

/// `I (12345) tag: …` of ESP-IDF, `[ 12345][I]…` of Arduino's core for it, `[   12.345678] …` of Linux.
fn ticks(text: &str) -> Option<(&str, &str)> {
    let esp = text
        .strip_prefix(['V', 'D', 'I', 'W', 'E'])
        .and_then(|rest| rest.strip_prefix(" (")?.split_once(')'));
    let (ticks, after) = esp.or_else(|| text.strip_prefix('[')?.split_once(']'))?;
    let ticks = ticks.trim();
    (!ticks.is_empty()
        && ticks
            .bytes()
            .all(|byte| byte.is_ascii_digit() || byte == b'.'))
    .then_some((ticks, after))
}

/// The first time stamp in a text, as long as it goes, with what stands before and after it.
fn stamp_in(text: &str) -> Option<(&str, &str, &str)> {
    let begins =
        |at: &usize| *at == 0 || text[..*at].ends_with([' ', '[', '(', '<', '|', '\t', '=', '"']);
    let starts = text.char_indices().map(|(at, _)| at).filter(begins);
    for start in
        starts.filter(|at| text[*at..].starts_with(|first: char| first.is_ascii_alphanumeric()))
    {
        let rest = &text[start..];
        let ends = rest
            .char_indices()
            .map(|(at, _)| at)
            .chain([rest.len()])
            .take(STAMP_CHARS_MAX);
        let is_end = |end: &usize| {
            rest.get(*end..).is_some_and(|after| {
                after.is_empty()
                    || after.starts_with([' ', ']', ')', '>', '|', ',', ';', '\t', '"'])
            })
        };
        let is_stamp = |end: &usize| {
            let stamp = &rest[..*end];
            stamp.matches([':', '-', '/', '.']).count() >= 2
                && matches!(
                    moment::parse(stamp, Some(Order::DayFirst)),
                    Some(Moment::Utc(_) | Moment::Local(_) | Moment::Day(_) | Moment::Clock(_))
                )
        };
        if let Some(end) = ends.filter(is_end).filter(is_stamp).last() {
            let stamp = &rest[..end];
            return Some((
                &text[..start],
                stamp,
                rest[end..].trim_start_matches([']', ')', '>', '"']),
            ));
        }
    }
    None
}

/// The parts of a text that say one thing each.
fn parts(text: &str) -> Vec<&str> {
    let is_pair = |word: &&str| word.contains('=');
    let mut parts = Vec::new();
    for part in text
        .split([',', ';', '|', '\t'])
        .flat_map(|part| part.split("  "))
    {
        let part = part.trim();
        if part.split_whitespace().filter(is_pair).count() > 1 {
            parts.extend(part.split_whitespace());
        } else if !part.is_empty() {
            parts.push(part);
        }
    }
    parts
}

/// `Time: 12.5 s`, `people=2`, `Frame 12`, `12` or `(12)`.
fn part_of(part: &str) -> Option<Fact> {
    let edges = |edge: char| "[]()<>{}:-# \t\"'".contains(edge);
    let bare = part.trim_matches(edges);
    if part.starts_with('[') && number(bare).is_none() && !bare.contains('=') {
        return None;
    }
    let named = bare
        .split_once('=')
        .or_else(|| bare.split_once(": "))
        .or_else(|| bare.split_once(':'));
    let (name, value) = match named {
        Some((name, value)) if name.contains(char::is_alphabetic) => {
            (name.trim(), value.trim().trim_matches(['"', '\'']))
        }
        Some(_) => return None,
        None => ("", number(bare)?),
    };
    let (value, unit) = match value.split_once(' ') {
        Some((number_, unit)) if number(number_).is_some() => (number_, unit),
        _ => (value, ""),
    };
    let name = if TIME_UNITS.contains(&unit) {
        format!("{name}_{unit}")
    } else {
        name.to_owned()
    };
    Some((name, number(value).unwrap_or(value).to_owned()))
}

/// `Frame 12 @ 4300 ms`: words, each followed by a number.
fn counted(part: &str) -> Vec<Fact> {
    let (mut facts, mut name) = (Vec::<Fact>::new(), Vec::new());
    for word in part
        .split(|letter: char| letter.is_whitespace() || "#@()<>{}:".contains(letter))
        .filter(|word| !word.is_empty())
    {
        match (number(word), facts.last_mut()) {
            (Some(value), _) => facts.push((std::mem::take(&mut name).join(" "), value.to_owned())),
            (None, Some((name_before, _))) if name.is_empty() && TIME_UNITS.contains(&word) => {
                *name_before = format!("{name_before}_{word}");
            }
            (None, _) => name.push(word),
        }
    }
    let is_bracketed = part.starts_with('[');
    facts.retain(|(name, _)| {
        !is_bracketed
            && name
                .chars()
                .all(|letter| letter.is_alphanumeric() || " _".contains(letter))
    });
    facts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_people_print_beside_a_frame_is_told() {
        for (text, expected) in [
            ("people: 0", vec![("people", "0")]),
            ("Time: 12.5 s", vec![("Time_s", "12.5")]),
            ("--- frame 12 ---", vec![("frame", "12")]),
            ("Frame #7", vec![("Frame", "7")]),
            (
                "Frame 12 @ 4300 ms:",
                vec![("Frame", "12"), ("_ms", "4300")],
            ),
            ("12", vec![("", "12")]),
            ("1521008322.84", vec![("", "1521008322.84")]),
            ("t=120 people=2", vec![("t", "120"), ("people", "2")]),
            ("label: standing", vec![("label", "standing")]),
            (
                "2021-07-01 18:14:07.25",
                vec![("time", "2021-07-01 18:14:07.25")],
            ),
            ("16:00:00.000 -> ", vec![("time", "16:00:00.000")]),
            (
                "[16:00:00.000][D][grid:042]: ",
                vec![("time", "16:00:00.000"), ("tag", "[D][grid:042]")],
            ),
            (
                "I (12345) amg: ",
                vec![("ticks_ms", "12345"), ("tag", "amg")],
            ),
            (
                "2025-11-24 16:00:00,000 - grid - INFO - ",
                vec![("time", "2025-11-24 16:00:00,000"), ("tag", "grid")],
            ),
            ("hall/thermal", vec![("tag", "hall/thermal")]),
            (
                "Thermistor Temperature: 25.06 C",
                vec![("Thermistor Temperature", "25.06")],
            ),
            ("L:", vec![("tag", "L")]),
            ("Row 3: ", vec![("Row", "3")]),
            ("------------", vec![]),
        ] {
            let found = stated(text);
            let found: Vec<(&str, &str)> = found
                .iter()
                .map(|(name, value)| (name.as_str(), value.as_str()))
                .collect();
            assert_eq!(found, expected, "{text}");
        }
    }
}
