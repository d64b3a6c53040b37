//! JSON: a value per line, an array of them, or an object of arrays.

use crate::cell::{Cell, Field, RawRow};
use crate::error::ImportError;
use crate::source::Held;
use grideye_frame::PIXELS;
use serde_json::Value;

/// Whether a text is JSON with more in it than rows of numbers, which the reader of texts reads too.
pub(crate) fn is_json(beginning: &str) -> bool {
    let text = beginning.trim_start();
    let inner = text.strip_prefix('[').unwrap_or(text).trim_start();
    let list = inner
        .strip_prefix('[')
        .and_then(|list| list.split(']').next());
    let is_list = list.is_some_and(|list| list.contains(',') && text.starts_with('['));
    inner.starts_with('{') || is_list
}

/// The rows of a text; `None` if it is none of JSON from the first value on.
pub(crate) fn rows(text: &str) -> Option<Held> {
    let mut elements = Elements { text, at: 0 };
    let mut container = "JSON";
    let first = text.trim_start();
    if first.starts_with('[') && holds_rows(first) {
        elements.at = text.len() - first.len() + 1;
        container = "a JSON array";
    }
    let (mut names, mut rows, mut broken) = (Vec::new(), Vec::new(), None);
    let mut number = 0;
    while let Some((at, element)) = elements.next() {
        number += 1;
        let value = element.and_then(|element| serde_json::from_str::<Value>(element).ok());
        let Some(value) = value else {
            if rows.is_empty() {
                return None;
            }
            let line = text[..at].matches('\n').count() + 1;
            broken = Some(ImportError::broken(
                format!("line {line}, value {number}"),
                "a value that is cut, or no JSON",
            ));
            break;
        };
        match columns(&value) {
            Some(columns) => {
                container = "a JSON object of arrays";
                columns.for_each(|row| push(&mut names, &mut rows, &row));
            }
            None => push(&mut names, &mut rows, &value),
        }
    }
    Some(Held {
        container: container.to_owned(),
        names,
        rows: rows.into_iter(),
        broken,
    })
}

fn push(names: &mut Vec<String>, rows: &mut Vec<RawRow>, value: &Value) {
    let mut named = Vec::new();
    flatten(String::new(), value, &mut named);
    if names.is_empty() {
        *names = named.iter().map(|(name, _)| name.clone()).collect();
    }
    let number = u64::try_from(rows.len()).unwrap_or(u64::MAX) + 1;
    let field = |name: &String| {
        let found = named.iter().find(|(found, _)| found == name);
        found.map_or(Field::One(Cell::Empty), |(_, field)| field.clone())
    };
    rows.push(RawRow {
        number,
        fields: names.iter().map(field).collect(),
        is_whole: true,
    });
}

/// Whether the elements of an array are rows: objects, or arrays of frames.
fn holds_rows(array: &str) -> bool {
    let inner = array[1..].trim_start();
    let mut elements = Elements { text: inner, at: 0 };
    let Some((_, Some(first))) = elements.next() else {
        return inner.starts_with('{');
    };
    match serde_json::from_str(first) {
        Ok(Value::Array(values)) => leaves(&Value::Array(values)) >= PIXELS,
        Ok(Value::Object(_)) => true,
        _ => false,
    }
}

fn leaves(value: &Value) -> usize {
    match value {
        Value::Array(values) => values.iter().map(leaves).sum(),
        _ => 1,
    }
}

/// The rows of an object whose arrays hold one value for each of them, or that has an array of objects.
fn columns(value: &Value) -> Option<Box<dyn Iterator<Item = Value> + '_>> {
    let object = value.as_object()?;
    let of_rows = |value: &Value| {
        value
            .as_array()
            .is_some_and(|rows| rows.iter().all(Value::is_object) && !rows.is_empty())
    };
    if let Some(Value::Array(rows)) = object.values().find(|value| of_rows(value)) {
        return Some(Box::new(rows.iter().cloned()));
    }
    let of_frames = |value: &&Value| {
        let Some(first) = value.as_array().and_then(|frames| frames.first()) else {
            return false;
        };
        first.is_array() && leaves(first) >= PIXELS
    };
    let count = object.values().find(of_frames)?.as_array()?.len();
    let rows = (0..count).map(move |row| {
        let each = object.iter().filter_map(move |(name, values)| {
            let values = values.as_array().filter(|values| values.len() == count)?;
            Some((name.clone(), values.get(row)?.clone()))
        });
        Value::Object(each.collect())
    });
    Some(Box::new(rows))
}

fn flatten(name: String, value: &Value, into: &mut Vec<(String, Field)>) {
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                let name = match name.as_str() {
                    "" => key.clone(),
                    outer => format!("{outer}.{key}"),
                };
                flatten(name, value, into);
            }
        }
        Value::Array(_) => {
            let mut cells = Vec::new();
            gather(value, &mut cells);
            into.push((name, Field::Many(cells)));
        }
        _ => into.push((name, Field::One(cell(value)))),
    }
}

fn gather(value: &Value, cells: &mut Vec<Cell>) {
    match value {
        Value::Array(values) => values.iter().for_each(|value| gather(value, cells)),
        _ => cells.push(cell(value)),
    }
}

fn cell(value: &Value) -> Cell {
    match value {
        Value::Null => Cell::Empty,
        Value::String(text) => Cell::of_text(text),
        Value::Number(number) => match number.as_i64() {
            Some(integer) => Cell::Integer(integer),
            None => Cell::Number(number.as_f64().unwrap_or(f64::NAN)),
        },
        other => Cell::Text(other.to_string()),
    }
}

/// The values of a text one after another, with commas, blanks and newlines between them.
struct Elements<'t> {
    text: &'t str,
    at: usize,
}

impl<'t> Elements<'t> {
    /// The place and the text of the next value; `None` for the text if it is cut.
    fn next(&mut self) -> Option<(usize, Option<&'t str>)> {
        let bytes = self.text.as_bytes();
        let is_between = |byte: &u8| byte.is_ascii_whitespace() || *byte == b',';
        while bytes.get(self.at).is_some_and(is_between) {
            self.at += 1;
        }
        let from = self.at;
        if matches!(bytes.get(from)?, b']') {
            return None;
        }
        let (mut depth, mut quoted, mut escaped) = (0_i32, false, false);
        for (place, byte) in bytes.iter().enumerate().skip(from) {
            match byte {
                _ if escaped => escaped = false,
                b'\\' if quoted => escaped = true,
                b'"' => quoted = !quoted,
                b'[' | b'{' if !quoted => depth += 1,
                b']' | b'}' if !quoted => depth -= 1,
                _ => {}
            }
            if depth <= 0 && !quoted && (matches!(byte, b']' | b'}') || is_between(byte)) {
                self.at = place + 1;
                return Some((from, self.text.get(from..=place)));
            }
        }
        self.at = bytes.len();
        Some((from, None))
    }
}
