//! Keys and their values.

use super::layout::{is_header, line_end, line_start, newline};
use super::{Step, check_path, said};
use crate::editor::fault::Fault;
use serde_json::Value;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Gives the key at the path a value.
pub(super) fn set(
    text: &str,
    document: &DeTable<'_>,
    path: &[Step],
    to: &Value,
) -> Result<String, Fault> {
    check_path(path)?;
    if let Some(found) = value_at(document, path) {
        let mut splices = Vec::new();
        replace(text, found, to, &mut splices)?;
        return Ok(spliced(text, splices));
    }
    match path {
        [Step::Key(key)] => at_the_top(text, document, key, to),
        [parents @ .., Step::Key(key)] => {
            let table = value_at(document, parents).ok_or_else(|| nothing_at(path))?;
            below(text, table, key, to)
        }
        _ => Err(nothing_at(path)),
    }
}

/// Takes the key at the path away. A remark behind it stays, on a line of its own.
pub(super) fn unset(text: &str, document: &DeTable<'_>, path: &[Step]) -> Result<String, Fault> {
    check_path(path)?;
    let (Some(found), Some(key)) = (value_at(document, path), key_at(document, path)) else {
        return Err(nothing_at(path));
    };
    let (from, to) = (line_start(text, key.start), found.span().end);
    let is_alone = text
        .get(from..key.start)
        .is_some_and(|before| before.trim().is_empty());
    if !is_alone {
        return Err(unwritable(&said(path)));
    }
    let end = line_end(text, to);
    let rest = text.get(to..end).unwrap_or_default().trim_start();
    match rest.starts_with('#') {
        true => Ok(spliced(text, vec![(from..end, rest.to_owned())])),
        false if rest.is_empty() => Ok(spliced(text, vec![(from..end, String::new())])),
        false => Err(unwritable(&said(path))),
    }
}

/// What stands at a path.
pub(super) fn value_at<'a, 'i>(
    document: &'a DeTable<'i>,
    path: &[Step],
) -> Option<&'a Spanned<DeValue<'i>>> {
    let (first, rest) = path.split_first()?;
    let Step::Key(key) = first else { return None };
    let first = document.get(key.as_str())?;
    rest.iter().try_fold(first, |value, step| match step {
        Step::Key(key) => value.get_ref().as_table()?.get(key.as_str()),
        Step::Index(index) => value.get_ref().as_array()?.get(*index),
    })
}

/// Where the key itself stands.
fn key_at(document: &DeTable<'_>, path: &[Step]) -> Option<Range<usize>> {
    let (last, parents) = path.split_last()?;
    let Step::Key(key) = last else { return None };
    let table = match parents {
        [] => document,
        _ => value_at(document, parents)?.get_ref().as_table()?,
    };
    let mut keys = table.keys();
    keys.find(|known| known.get_ref().as_ref() == key.as_str())
        .map(Spanned::span)
}

type Splice = (Range<usize>, String);

/// Splices for what differs: of a list as long as before, only its parts that differ.
fn replace(
    text: &str,
    found: &Spanned<DeValue<'_>>,
    to: &Value,
    splices: &mut Vec<Splice>,
) -> Result<(), Fault> {
    if let (DeValue::Array(known), Value::Array(wanted)) = (found.get_ref(), to) {
        if known.len() == wanted.len() {
            let mut pairs = known.iter().zip(wanted);
            return pairs.try_for_each(|(one, other)| replace(text, one, other, splices));
        }
    }
    if found.get_ref().is_table() {
        return Err(Fault::unfit(
            "a whole table is not given a value; name a key of it",
        ));
    }
    if !is_same(text.get(found.span()).unwrap_or_default(), to) {
        splices.push((found.span(), written(to)?));
    }
    Ok(())
}

/// Whether a number is written as somebody wants it to be: `2700` and `2_700.0` are one.
fn is_same(written: &str, wanted: &Value) -> bool {
    let number = written.replace('_', "").parse::<f64>().ok();
    match (number, wanted.as_f64()) {
        (Some(is), Some(wanted)) => (is - wanted).abs() <= f64::EPSILON * wanted.abs(),
        _ => false,
    }
}

fn spliced(text: &str, mut splices: Vec<Splice>) -> String {
    splices.sort_by_key(|(range, _)| range.start);
    let mut made = text.to_owned();
    for (range, value) in splices.into_iter().rev() {
        made.replace_range(range, &value);
    }
    made
}

/// A key of no table: before the first header.
fn at_the_top(text: &str, document: &DeTable<'_>, key: &str, to: &Value) -> Result<String, Fault> {
    let plain = plain_ends(text, document).max();
    let line = format!("{key} = {}{}", written(to)?, newline(text));
    let (at, line) = match plain {
        Some(end) => (line_end(text, end), line),
        None => {
            let headers = document.values().flat_map(|value| match value.get_ref() {
                DeValue::Array(list) => list.iter().map(Spanned::span).collect(),
                _ => vec![value.span()],
            });
            let starts = headers
                .map(|span| span.start)
                .filter(|at| is_header(text, *at));
            let at = starts.min().map_or(text.len(), |at| line_start(text, at));
            (at, format!("{line}{}", newline(text)))
        }
    };
    Ok(spliced(text, vec![(at..at, line)]))
}

/// A key of a table that has it not: behind its last plain one.
fn below(text: &str, table: &Spanned<DeValue<'_>>, key: &str, to: &Value) -> Result<String, Fault> {
    let Some(entries) = table.get_ref().as_table() else {
        return Err(Fault::unfit(&format!(
            "`{key}` would stand in a value that is no table"
        )));
    };
    let at = table.span().start;
    let last = plain_ends(text, entries).max();
    if is_header(text, at) {
        let behind = line_end(text, last.unwrap_or(at));
        let line = format!("{key} = {}{}", written(to)?, newline(text));
        // The last line of a text may have no end.
        let is_open = text
            .get(..behind)
            .is_some_and(|before| !before.ends_with('\n'));
        let line = if is_open {
            format!("{}{line}", newline(text))
        } else {
            line
        };
        return Ok(spliced(text, vec![(behind..behind, line)]));
    }
    let is_inline = text.get(at..).is_some_and(|rest| rest.starts_with('{'));
    match last {
        Some(last) if is_inline => {
            let pair = format!(", {key} = {}", written(to)?);
            Ok(spliced(text, vec![(last..last, pair)]))
        }
        _ => Err(unwritable(key)),
    }
}

/// Where the values end that stand directly in a table.
fn plain_ends<'a>(text: &'a str, table: &'a DeTable<'_>) -> impl Iterator<Item = usize> + 'a {
    let is_plain = move |value: &&Spanned<DeValue<'_>>| match value.get_ref() {
        DeValue::Table(_) => text
            .get(value.span().start..)
            .is_some_and(|rest| rest.starts_with('{')),
        DeValue::Array(list) => !list
            .iter()
            .any(|one| is_header(text, one.span().start) && one.get_ref().is_table()),
        _ => true,
    };
    table
        .values()
        .filter(is_plain)
        .map(|value| value.span().end)
}

/// A value as TOML writes it; whole numbers without a point, as the files of this repository have them.
pub(super) fn written(value: &Value) -> Result<String, Fault> {
    match value {
        Value::Bool(is) => Ok(is.to_string()),
        Value::Number(number) => Ok(match (number.as_i64(), number.as_f64()) {
            (Some(whole), _) => whole.to_string(),
            (None, Some(decimal)) => decimal.to_string(),
            (None, None) => number.to_string(),
        }),
        Value::String(text) => Ok(toml::Value::String(text.clone()).to_string()),
        Value::Array(list) => {
            let list: Vec<String> = list.iter().map(written).collect::<Result<_, _>>()?;
            Ok(format!("[{}]", list.join(", ")))
        }
        Value::Null | Value::Object(_) => Err(Fault::unfit(
            "a value is a number, a text, true, false, or a list of these",
        )),
    }
}

fn nothing_at(path: &[Step]) -> Fault {
    Fault::unfit(&format!("the scene has no {}", said(path)))
}

fn unwritable(key: &str) -> Fault {
    Fault::unfit(&format!(
        "`{key}` stands in a table without a header of its own, where it is changed in the text only"
    ))
}
