//! JSON: a value per line, an array of them, or an object of arrays.

use crate::allowance::{Allowance, HELD_VALUE_BYTES, ROW_VALUES_MAX, too_wide};
use crate::cell::{Cell, Field, RawRow, short};
use crate::error::ImportError;
use crate::moment::{self, Moment, Order};
use crate::source::Made;
use crate::text::{list, stated};
use grideye_frame::PIXELS;
use serde_json::Value;
use std::collections::HashMap;

/// Lines by which it is told whether each holds an object.
const SAMPLE_LINES: usize = 64;

/// Whether a text is JSON with more in it than rows of numbers, which the reader of texts reads too.
pub(crate) fn is_json(beginning: &str) -> bool {
    let text = beginning.trim_start();
    let inner = text.strip_prefix('[').unwrap_or(text).trim_start();
    let list = inner
        .strip_prefix('[')
        .and_then(|list| list.split(']').next());
    let is_list = list.is_some_and(|list| list.contains(',') && text.starts_with('['));
    inner.starts_with('{') || is_list || is_in_lines(text)
}

/// The rows of a text; `None` if it is none of JSON from the first value on.
pub(crate) fn rows(text: &str, allowance: &Allowance) -> Result<Option<Made>, ImportError> {
    let mut table = Table {
        allowance: allowance.clone(),
        ..Table::default()
    };
    if is_in_lines(text) {
        for (line, number) in text.lines().zip(1_u64..) {
            match split(line) {
                Some((lead, value)) => table.push(number, lead, &value)?,
                None => table.skipped += u64::from(!line.trim().is_empty()),
            }
        }
        return table.made("JSON in lines", None).map(Some);
    }
    let mut elements = Elements { text, at: 0 };
    let mut container = "JSON";
    let first = text.trim_start();
    if first.starts_with('[') && holds_rows(first) {
        elements.at = text.len() - first.len() + 1;
        container = "a JSON array";
    }
    let mut broken = None;
    let mut number = 0;
    while let Some((at, element)) = elements.next() {
        number += 1;
        let value = element.and_then(parsed);
        let Some(value) = value else {
            if table.rows.is_empty() {
                return Ok(None);
            }
            let line = text[..at].matches('\n').count() + 1;
            broken = Some(ImportError::broken(
                format!("line {line}, value {number}"),
                "a value that is cut, or no JSON",
            ));
            break;
        };
        match columns(&value).or_else(|| keyed(&value)) {
            Some(mut rows) => {
                container = "a JSON object of arrays";
                rows.try_for_each(|row| table.push(0, "", &row))?;
            }
            None => table.push(0, "", &value)?,
        }
    }
    table.made(container, broken).map(Some)
}

/// Whether most lines are objects behind what a logger wrote.
fn is_in_lines(text: &str) -> bool {
    if text.trim_start().starts_with('{') {
        return false;
    }
    let lines = || {
        text.lines()
            .filter(|line| !line.trim().is_empty())
            .take(SAMPLE_LINES)
    };
    let objects = lines().filter(|line| {
        !line.trim_start().starts_with(['{', '['])
            || line.trim_start().starts_with('[') && line.contains('{')
    });
    lines().count() < objects.filter(|line| split(line).is_some()).count() * 2
}

/// What stands before the object in a line, and the object.
fn split(line: &str) -> Option<(&str, Value)> {
    let Some(at) = line.find('{') else {
        return Some(("", pairs(line)?));
    };
    let (lead, object) = line.split_at(at);
    let end = object.rfind('}')? + 1;
    Some((lead, parsed(&object[..end])?))
}

/// A line of at least 64 names with their numbers, `p0:19.75` or `p0=19.75`: Arduino's plotter, and the protocol of InfluxDB,
/// which has the time behind them.
fn pairs(line: &str) -> Option<Value> {
    if line.matches([':', '=']).count() < PIXELS {
        return None;
    }
    let (mut row, mut count) = (serde_json::Map::new(), 0);
    for token in line.split([',', ';', '\t', ' ']) {
        let Some((name, value)) = token.split_once([':', '=']) else {
            if moment::Decimal::parse(token).is_some() {
                row.insert("time".to_owned(), Value::String(token.to_owned()));
            }
            continue;
        };
        count += usize::from(value.parse::<f64>().is_ok());
        row.insert(
            name.to_owned(),
            Value::String(value.trim_matches('"').to_owned()),
        );
    }
    (count >= PIXELS).then_some(Value::Object(row))
}

/// A value of JSON, or of Python, which prints other quotation marks and constants.
fn parsed(text: &str) -> Option<Value> {
    let python = || {
        text.replace('\'', "\"")
            .replace("None", "null")
            .replace("True", "true")
            .replace("False", "false")
    };
    let value: Option<Value> = serde_json::from_str(text)
        .ok()
        .or_else(|| serde_json::from_str(&python()).ok());
    value.map(|value| bare(value, TEXTS_MAX))
}

/// What Firestore, DynamoDB and MongoDB wrap each value in.
const WRAPPERS: [&str; 19] = [
    "doubleValue",
    "integerValue",
    "stringValue",
    "timestampValue",
    "booleanValue",
    "arrayValue",
    "mapValue",
    "values",
    "N",
    "S",
    "L",
    "M",
    "BOOL",
    "$numberDouble",
    "$numberInt",
    "$numberLong",
    "$numberDecimal",
    "$date",
    "$oid",
];

/// As often a text in JSON may hold JSON again.
const TEXTS_MAX: usize = 2;

/// A value without its wrappers, and with the JSON that a text in it holds.
fn bare(value: Value, texts: usize) -> Value {
    match value {
        Value::Object(mut object) => {
            let only = object.keys().next().filter(|_| object.len() == 1).cloned();
            match only
                .filter(|key| WRAPPERS.contains(&key.as_str()))
                .and_then(|key| object.remove(&key))
            {
                Some(inner) => bare(inner, texts),
                None => Value::Object(
                    object
                        .into_iter()
                        .map(|(key, value)| (key, bare(value, texts)))
                        .collect(),
                ),
            }
        }
        Value::Array(values) => {
            let values = values.into_iter().map(|value| bare(value, texts));
            Value::Array(values.collect())
        }
        Value::String(text) if texts > 0 && text.trim_start().starts_with('{') => {
            match serde_json::from_str(&text) {
                Ok(inner) => bare(inner, texts - 1),
                Err(_) => Value::String(text),
            }
        }
        other => other,
    }
}

/// Rows of objects, of which each may have other keys.
#[derive(Default)]
struct Table {
    names: Vec<String>,
    places: HashMap<String, usize>,
    rows: Vec<RawRow>,
    skipped: u64,
    allowance: Allowance,
}

impl Table {
    fn push(&mut self, number: u64, lead: &str, value: &Value) -> Result<(), ImportError> {
        let mut named = Vec::new();
        if !lead.trim().is_empty() {
            named.extend(
                stated(lead)
                    .into_iter()
                    .map(|(name, text)| (name, Field::One(Cell::of_text(&text)))),
            );
        }
        flatten(String::new(), value, &mut named);
        let mut fields = vec![Field::One(Cell::Empty); self.names.len()];
        for (name, field) in named {
            let place = *self.places.entry(name).or_insert_with_key(|name| {
                self.names.push(name.clone());
                self.names.len() - 1
            });
            if place >= ROW_VALUES_MAX {
                return Err(too_wide(place + 1, "in the objects together"));
            }
            fields.resize(fields.len().max(place + 1), Field::One(Cell::Empty));
            fields[place] = field;
        }
        let number = if number > 0 {
            number
        } else {
            u64::try_from(self.rows.len()).unwrap_or(u64::MAX) + 1
        };
        let row = RawRow {
            number,
            fields,
            is_whole: true,
            is_torn: false,
        };
        let place = || format!("value {number}");
        if row.width() > ROW_VALUES_MAX {
            return Err(too_wide(row.width(), &format!("in {}", place())));
        }
        let values = row.width() + 1;
        self.allowance
            .take_values(values, HELD_VALUE_BYTES, place)?;
        self.allowance.take_values(row.text_bytes(), 1, place)?;
        self.rows.push(row);
        Ok(())
    }

    /// Each row with all columns; a list that lacks is one of nothing.
    fn made(mut self, container: &str, broken: Option<ImportError>) -> Result<Made, ImportError> {
        let mut shapes = vec![Field::One(Cell::Empty); self.names.len()];
        for row in &self.rows {
            for (shape, field) in shapes.iter_mut().zip(&row.fields) {
                if let (Field::One(_), Field::Many(cells)) = (&*shape, field) {
                    *shape = Field::Many(vec![Cell::Empty; cells.len()]);
                }
            }
        }
        let width: usize = shapes.iter().map(|shape| shape.cells().len()).sum();
        let values = width.saturating_mul(self.rows.len());
        let place = || format!("{} objects with all columns", self.rows.len());
        self.allowance
            .take_values(values, HELD_VALUE_BYTES, place)?;
        for row in &mut self.rows {
            row.fields.resize(shapes.len(), Field::One(Cell::Empty));
            for (field, shape) in row.fields.iter_mut().zip(&shapes) {
                if *field == Field::One(Cell::Empty) {
                    field.clone_from(shape);
                }
            }
        }
        // A list alone has no name.
        let names = if self.names == [String::new()] {
            Vec::new()
        } else {
            self.names
        };
        let rows = self.rows.into_iter().map(Ok);
        Ok(Made {
            container: container.to_owned(),
            names,
            rows: Box::new(rows.chain(broken.map(Err))),
            skipped: self.skipped,
        })
    }
}

/// Rows, each made when it is asked for: what stands beside them is in all of them.
type Rows<'v> = Box<dyn Iterator<Item = Value> + 'v>;

/// The rows of an object whose keys tell them apart, as Firebase exports them: times, or any others in their order.
fn keyed(value: &Value) -> Option<Rows<'_>> {
    let mut object = value.as_object()?;
    // Firebase exports the path before the keys.
    while let (1, Some(Value::Object(inner))) = (object.len(), object.values().next()) {
        object = inner;
    }
    let is_row = |value: &Value| match value {
        Value::Object(_) | Value::Array(_) => leaves(value) >= PIXELS,
        Value::String(text) => list(text).is_some_and(|cells| cells.len() >= PIXELS),
        _ => false,
    };
    if !object.values().all(is_row) {
        return None;
    }
    let mut rows: Vec<(&String, &Value)> = object.iter().collect();
    // `frame_2` comes before `frame_10`.
    let number = |key: &str| {
        let stem = key.trim_end_matches(|last: char| last.is_ascii_digit());
        Some((stem.to_owned(), key[stem.len()..].parse::<u64>().ok()?))
    };
    if rows.iter().all(|(key, _)| number(key).is_some()) {
        rows.sort_by_key(|(key, _)| number(key));
    }
    let is_time = |key: &str| {
        matches!(
            moment::parse(key, Some(Order::DayFirst)),
            Some(Moment::Utc(_) | Moment::Local(_) | Moment::Clock(_) | Moment::Number(_))
        )
    };
    let name = if rows.iter().all(|(key, _)| is_time(key)) {
        "time"
    } else {
        "key"
    };
    let row = move |(key, value): (&String, &Value)| {
        let mut row = serde_json::Map::new();
        row.insert(name.to_owned(), Value::String(key.clone()));
        match value {
            Value::Object(object) => row.extend(object.clone()),
            other => {
                row.insert("frame".to_owned(), other.clone());
            }
        }
        Value::Object(row)
    };
    Some(Box::new(rows.into_iter().map(row)))
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
        Value::Object(object) => object.values().map(leaves).sum(),
        _ => 1,
    }
}

/// The rows of an object whose arrays hold one value for each of them, or that has an array of objects.
fn columns(value: &Value) -> Option<Rows<'_>> {
    let object = value.as_object()?;
    if let Some(rows) = split_by_pandas(object).or_else(|| columns_by_pandas(object)) {
        return Some(rows);
    }
    let of_rows = |value: &Value| {
        value
            .as_array()
            .is_some_and(|rows| rows.iter().all(Value::is_object) && !rows.is_empty())
    };
    if let Some(Value::Array(rows)) = object.values().find(|value| of_rows(value)) {
        // What stands beside the rows holds for each of them.
        let beside = object
            .iter()
            .filter(|(_, value)| !value.is_array() && !value.is_object());
        let beside: serde_json::Map<String, Value> = beside
            .map(|(key, value)| (key.clone(), value.clone()))
            .collect();
        let whole = move |row: &Value| {
            let mut whole = beside.clone();
            whole.extend(row.as_object().cloned().unwrap_or_default());
            Value::Object(whole)
        };
        return Some(Box::new(rows.iter().map(whole)));
    }
    let of_frames = |value: &&Value| {
        let Some(first) = value.as_array().and_then(|frames| frames.first()) else {
            return false;
        };
        first.is_array() && leaves(first) >= PIXELS
    };
    let count = object.values().find(of_frames)?.as_array()?.len();
    let lists = object.iter().filter_map(|(name, values)| {
        let values = values.as_array().filter(|values| values.len() == count)?;
        Some((name, values))
    });
    let lists: Vec<_> = lists.collect();
    let row = move |row: usize| {
        let each = lists
            .iter()
            .filter_map(|(name, values)| Some(((*name).clone(), values.get(row)?.clone())));
        Value::Object(each.collect())
    };
    Some(Box::new((0..count).map(row)))
}

/// Pandas' `to_json(orient="split")`: names, an index, and rows.
fn split_by_pandas(object: &serde_json::Map<String, Value>) -> Option<Rows<'_>> {
    let list = |key: &str| object.get(key).and_then(Value::as_array);
    let (names, rows, indices) = (list("columns")?, list("data")?, list("index"));
    let named = move |(place, row): (usize, &Value)| {
        let mut whole = serde_json::Map::new();
        whole.extend(
            indices
                .and_then(|index| index.get(place))
                .map(|index| ("index".to_owned(), index.clone())),
        );
        let names = names.iter().map(|name| {
            name.as_str()
                .map_or_else(|| name.to_string(), str::to_owned)
        });
        whole.extend(names.zip(row.as_array().cloned().unwrap_or_default()));
        Value::Object(whole)
    };
    Some(Box::new(rows.iter().enumerate().map(named)))
}

/// Pandas' `to_json()`: an object for each column, with the same keys.
fn columns_by_pandas(object: &serde_json::Map<String, Value>) -> Option<Rows<'_>> {
    let columns: Option<Vec<_>> = object
        .iter()
        .map(|(name, column)| Some((name, column.as_object()?)))
        .collect();
    let columns = columns.filter(|columns| columns.len() >= PIXELS)?;
    let mut keys: Vec<&String> = columns[0].1.keys().collect();
    keys.sort_by_key(|key| key.parse::<u64>().unwrap_or(0));
    if columns.iter().any(|(_, column)| column.len() != keys.len())
        || keys.iter().any(|key| key.parse::<u64>().is_err())
    {
        return None;
    }
    let row = move |key: &String| {
        let cells = columns
            .iter()
            .filter_map(|(name, column)| Some(((*name).clone(), column.get(key)?.clone())));
        Value::Object(cells.collect())
    };
    Some(Box::new(keys.into_iter().map(row)))
}

fn flatten(name: String, value: &Value, into: &mut Vec<(String, Field)>) {
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                let key = short(key);
                let name = match name.as_str() {
                    "" => key.to_owned(),
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
        // A list as a text, as in CSV.
        Value::String(text) if list(text).is_some() => {
            into.push((name, Field::Many(list(text).unwrap_or_default())));
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
