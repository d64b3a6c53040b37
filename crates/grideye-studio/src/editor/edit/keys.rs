//! Edits of keys and their values.

use super::change::{Step, check_path, nothing_at, said};
use super::layout::{Layout, Splice};
use crate::editor::fault::Fault;
use serde_json::Value as Wanted;
use std::ops::Range;
use toml_edit::{Array, InlineTable, Item, Key, Table, Value};

/// Sets the key at the path to a value.
pub(super) fn set(layout: &Layout<'_>, path: &[Step], to: &Wanted) -> Result<Vec<Splice>, Fault> {
    check_path(path)?;
    let mut splices = Vec::new();
    if let Some(known) = layout.at(path) {
        let known = known.as_value().ok_or_else(whole_table)?;
        replace(known, to, &mut splices)?;
        return Ok(splices);
    }
    let Some((Step::Key(key), parents)) = path.split_last() else {
        return Err(nothing_at(path));
    };
    let written = format!("{} = {}", Key::new(key).display_repr(), value_of(to)?);
    splices.push(match layout.at(parents) {
        None => return Err(nothing_at(path)),
        Some(Item::Table(table)) if parents.is_empty() => at_the_top(layout, table, &written),
        Some(Item::Table(table)) if !table.is_implicit() || table.is_dotted() => {
            let written = format!("{}{written}\n", dotted(layout, parents));
            layout.insert(layout.end_of(table), &written)
        }
        Some(Item::Value(Value::InlineTable(table))) if !table.is_dotted() => {
            within_braces(table, &written)?
        }
        Some(Item::Table(_) | Item::Value(Value::InlineTable(_))) => return Err(unwritable(key)),
        Some(_) => {
            let what = format!("`{key}` would be inside a value that is not a table");
            return Err(Fault::unfit(&what));
        }
    });
    Ok(splices)
}

/// Deletes the key at the path. A comment after it stays, on a line of its own.
pub(super) fn unset(layout: &Layout<'_>, path: &[Step]) -> Result<Vec<Splice>, Fault> {
    check_path(path)?;
    let (Some((Step::Key(key), parents)), Some(item)) = (path.split_last(), layout.at(path)) else {
        return Err(nothing_at(path));
    };
    let unwritable = || unwritable(&said(path));
    let value = item.as_value().and_then(Value::span);
    let value = value.ok_or_else(unwritable)?;
    match layout.at(parents) {
        Some(Item::Table(_)) => {}
        Some(Item::Value(Value::InlineTable(table))) if !table.is_dotted() => {
            let range = entry_within_braces(layout, table, key).ok_or_else(unwritable)?;
            let is_remark = |part| layout.part(part).contains('#');
            if is_remark(range.start..value.start) || is_remark(value.end..range.end) {
                let what = format!("deleting `{key}` would delete its comment");
                return Err(Fault::unfit(&what));
            }
            return Ok(vec![(range, String::new())]);
        }
        _ => return Err(unwritable()),
    }
    let line = layout.line_start(value.start)..layout.line_end(value.end);
    let behind = layout.part(value.end..line.end).trim_start();
    let end = if behind.is_empty() {
        line.end
    } else {
        line.end - behind.len()
    };
    Ok(vec![(line.start..end, String::new())])
}

/// Replaces what differs; in a list of equal length, only the elements that differ.
fn replace(known: &Value, to: &Wanted, splices: &mut Vec<Splice>) -> Result<(), Fault> {
    match (known, to) {
        (Value::InlineTable(_), _) => return Err(whole_table()),
        (Value::Array(known), Wanted::Array(wanted)) if known.len() == wanted.len() => {
            let mut pairs = known.iter().zip(wanted);
            return pairs.try_for_each(|(one, other)| replace(one, other, splices));
        }
        _ => {}
    }
    if !is_same(known, to) {
        let value = value_of(to)?.to_string();
        splices.extend(known.span().map(|span| (span, value)));
    }
    Ok(())
}

/// Whether a number has the wanted value, in any notation: `2700` equals `2_700.0`.
fn is_same(known: &Value, wanted: &Wanted) -> bool {
    let whole = || known.as_integer()?.to_string().parse().ok();
    match (known.as_float().or_else(whole), wanted.as_f64()) {
        (Some(is), Some(wanted)) => (is - wanted).abs() <= f64::EPSILON * wanted.abs(),
        _ => false,
    }
}

/// A key outside all tables: goes before the first header, after the comment about the whole file.
fn at_the_top(layout: &Layout<'_>, root: &Table, written: &str) -> Splice {
    let end = layout.end_of(root);
    match layout.headers.first() {
        Some(first) if end == 0 => layout.insert(first.lines.start, &format!("{written}\n\n")),
        None if end == 0 => layout.insert(layout.text.len(), &format!("{written}\n")),
        _ => layout.insert(end, &format!("{written}\n")),
    }
}

/// `person.` for a table of dotted keys, as its keys begin.
fn dotted(layout: &Layout<'_>, path: &[Step]) -> String {
    let table = layout.at(path).and_then(Item::as_table);
    match path.split_last() {
        Some((Step::Key(key), parents)) if table.is_some_and(Table::is_dotted) => {
            let key = Key::new(key);
            format!("{}{}.", dotted(layout, parents), key.display_repr())
        }
        _ => String::new(),
    }
}

/// A key of an inline table: goes last.
fn within_braces(table: &InlineTable, written: &str) -> Result<Splice, Fault> {
    let values = table.get_values().into_iter();
    let last = values
        .filter_map(|(_, value)| Some(value.span()?.end))
        .max();
    let braces = table.span().ok_or_else(whole_table)?;
    Ok(match last {
        Some(last) => (last..last, format!(", {written}")),
        None => (braces, format!("{{ {written} }}")),
    })
}

/// The text of a key with its value, and with the comma that is no longer needed.
fn entry_within_braces(
    layout: &Layout<'_>,
    table: &InlineTable,
    key: &str,
) -> Option<Range<usize>> {
    let entry = |(known, value): (&str, &Value)| {
        let start = table.key(known)?.span()?.start;
        Some(start..value.span()?.end)
    };
    let entries: Option<Vec<_>> = table.iter().map(entry).collect();
    let entries = entries?;
    let place = table.iter().position(|(known, _)| known == key)?;
    let own = entries.get(place)?.clone();
    Some(match (place.checked_sub(1), entries.get(place + 1)) {
        (Some(before), _) => entries.get(before)?.end..own.end,
        (None, Some(next)) => own.start..next.start,
        (None, None) => {
            let braces = table.span()?;
            debug_assert!(layout.part(braces.clone()).starts_with('{'));
            braces.start + 1..braces.end - 1
        }
    })
}

/// A value in TOML; whole numbers without a decimal point, as in this repository's files.
pub(super) fn value_of(wanted: &Wanted) -> Result<Value, Fault> {
    match wanted {
        Wanted::Bool(is) => Ok((*is).into()),
        Wanted::Number(number) => {
            let decimal = number.as_f64().unwrap_or_default();
            let whole = number.as_i64().or_else(|| decimal.to_string().parse().ok());
            Ok(whole.map_or_else(|| decimal.into(), Value::from))
        }
        Wanted::String(text) => Ok(text.into()),
        Wanted::Array(list) => {
            let list: Array = list.iter().map(value_of).collect::<Result<_, _>>()?;
            Ok(list.into())
        }
        Wanted::Null | Wanted::Object(_) => Err(Fault::unfit(
            "a value must be a number, a string, true, false, or a list of these",
        )),
    }
}

fn whole_table() -> Fault {
    Fault::unfit("a whole table cannot get a value; choose one of its keys")
}

fn unwritable(key: &str) -> Fault {
    Fault::unfit(&format!(
        "`{key}` is in a table without a header of its own"
    ))
}
