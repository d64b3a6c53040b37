//! Edits of keys and their values.

use super::change::{Step, check_path, nothing_at, said};
use super::headers::{headers, lead, set_lead, table_at};
use crate::editor::fault::Fault;
use serde_json::Value as Wanted;
use toml_edit::{Array, DocumentMut, InlineTable, Item, Key, Table, TableLike, Value};

/// Sets the key at the path to a value.
pub(super) fn set(document: &mut DocumentMut, path: &[Step], to: &Wanted) -> Result<(), Fault> {
    check_path(path)?;
    if let Some(known) = place_at(document.as_table_mut(), path) {
        return known.replace(to);
    }
    let Some((Step::Key(key), parents)) = path.split_last() else {
        return Err(nothing_at(path));
    };
    if parents.is_empty() {
        return at_the_top(document, key, to);
    }
    match place_at(document.as_table_mut(), parents) {
        None => Err(nothing_at(path)),
        Some(Place::Table(table)) if !table.is_implicit() || table.is_dotted() => {
            table.insert(key, Item::Value(value_of(to)?));
            Ok(())
        }
        Some(Place::Table(_)) => Err(unwritable(key)),
        Some(Place::Value(Value::InlineTable(table))) => within_braces(table, key, to),
        Some(Place::Value(_) | Place::Tables) => Err(Fault::unfit(&format!(
            "`{key}` would be inside a value that is not a table"
        ))),
    }
}

/// Deletes the key at the path. Comments above and after it stay, on lines of their own.
pub(super) fn unset(document: &mut DocumentMut, path: &[Step]) -> Result<(), Fault> {
    check_path(path)?;
    let Some((Step::Key(key), parents)) = path.split_last() else {
        return Err(nothing_at(path));
    };
    let is_value = match place_at(document.as_table_mut(), path) {
        None => return Err(nothing_at(path)),
        Some(place) => matches!(place, Place::Value(_)),
    };
    if let Some(Place::Value(Value::InlineTable(table))) =
        place_at(document.as_table_mut(), parents)
    {
        return unset_within_braces(table, key);
    }
    let table = table_at(document, parents).filter(|table| is_value && !table.is_dotted());
    let table = table.ok_or_else(|| unwritable(&said(path)))?;
    let next = table
        .get_values()
        .iter()
        .skip_while(|(keys, _)| keys.first().is_none_or(|first| first.get() != key))
        .nth(1)
        .map(|(keys, _)| keys.iter().map(|key| key.get().to_owned()).collect());
    let Some((key, Item::Value(value))) = table.remove_entry(key) else {
        return Err(nothing_at(path));
    };
    let left = remarks_of(&key, &value);
    let next: Option<Vec<String>> = next;
    if let Some(next) = next {
        put_above(table, &next, &left);
        return Ok(());
    }
    // It was the last key: a header or the end of the text follows.
    let headers = headers(document);
    let own = headers.iter().position(|header| header.path == parents);
    let next = headers.get(own.map_or(0, |own| own + 1));
    let above = lead(document, next);
    set_lead(document, next, &format!("{left}{above}"));
    Ok(())
}

enum Place<'a> {
    Table(&'a mut Table),
    Tables,
    Value(&'a mut Value),
}

fn place_at<'a>(root: &'a mut Table, path: &[Step]) -> Option<Place<'a>> {
    let mut place = Place::Table(root);
    let mut steps = path.iter();
    while let Some(step) = steps.next() {
        place = match (place, step) {
            (Place::Table(table), Step::Key(key)) => match table.get_mut(key)? {
                Item::None => return None,
                Item::Value(value) => Place::Value(value),
                Item::Table(table) => Place::Table(table),
                Item::ArrayOfTables(list) => match steps.next() {
                    None => Place::Tables,
                    Some(Step::Index(index)) => Place::Table(list.get_mut(*index)?),
                    Some(Step::Key(_)) => return None,
                },
            },
            (Place::Value(Value::InlineTable(table)), Step::Key(key)) => {
                Place::Value(table.get_mut(key)?)
            }
            (Place::Value(Value::Array(list)), Step::Index(index)) => {
                Place::Value(list.get_mut(*index)?)
            }
            _ => return None,
        };
    }
    Some(place)
}

impl Place<'_> {
    fn replace(self, to: &Wanted) -> Result<(), Fault> {
        match self {
            Self::Value(value) => replace(value, to),
            Self::Table(_) | Self::Tables => Err(whole_table()),
        }
    }
}

/// Replaces what differs; in a list of equal length, only the elements that differ.
fn replace(known: &mut Value, to: &Wanted) -> Result<(), Fault> {
    match (&mut *known, to) {
        (Value::InlineTable(_), _) => return Err(whole_table()),
        (Value::Array(known), Wanted::Array(wanted)) if known.len() == wanted.len() => {
            let mut pairs = known.iter_mut().zip(wanted);
            return pairs.try_for_each(|(one, other)| replace(one, other));
        }
        _ => {}
    }
    if !is_same(known, to) {
        let mut value = value_of(to)?;
        value.decor_mut().clone_from(known.decor());
        *known = value;
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
fn at_the_top(document: &mut DocumentMut, key: &str, to: &Wanted) -> Result<(), Fault> {
    let value = value_of(to)?;
    let is_first = document.get_values().is_empty();
    document.insert(key, Item::Value(value));
    if is_first {
        let headers = headers(document);
        let above = lead(document, headers.first());
        put_above(document.as_table_mut(), &[key.to_owned()], &above);
        let divided = if headers.is_empty() { "" } else { "\n" };
        set_lead(document, headers.first(), divided);
    }
    Ok(())
}

/// A key of an inline table: goes last.
fn within_braces(table: &mut InlineTable, key: &str, to: &Wanted) -> Result<(), Fault> {
    let mut value = value_of(to)?;
    if table.is_empty() {
        table.set_trailing("");
    }
    let last = table.iter_mut().last();
    let behind = last.map(|(_, last)| {
        let behind = last.decor().suffix().cloned().unwrap_or_default();
        last.decor_mut().set_suffix("");
        behind
    });
    value.decor_mut().set_prefix(" ");
    value.decor_mut().set_suffix(behind.unwrap_or(" ".into()));
    table.insert(key, value);
    Ok(())
}

/// Deletes a key of an inline table; the spaces after and before the braces stay.
fn unset_within_braces(table: &mut InlineTable, key: &str) -> Result<(), Fault> {
    let place = table.iter().position(|(known, _)| known == key);
    let remarks = table.get_key_value(key).map(|(known, value)| {
        let value = value.as_value().map(|value| remarks_of(known, value));
        value.unwrap_or_default()
    });
    if remarks.is_none_or(|remarks| remarks.contains('#')) {
        return Err(Fault::unfit(&format!(
            "deleting `{key}` would delete its comment"
        )));
    }
    let Some((key, value)) = table.remove_entry(key) else {
        return Ok(());
    };
    let is_last = place == Some(table.len());
    if let Some((mut first, _)) = table.iter_mut().next().filter(|_| place == Some(0)) {
        *first.leaf_decor_mut() = key.leaf_decor().clone();
    }
    if let Some((_, last)) = table.iter_mut().last().filter(|_| is_last) {
        let behind = value.decor().suffix().cloned().unwrap_or_default();
        last.decor_mut().set_suffix(behind);
    }
    Ok(())
}

/// Puts comments above a key, before those already there.
fn put_above(table: &mut dyn TableLike, path: &[String], remarks: &str) {
    match path {
        [] => {}
        [key] => {
            if let Some(mut key) = table.key_mut(key) {
                let known = key.leaf_decor().prefix().and_then(|known| known.as_str());
                let both = format!("{remarks}{}", known.unwrap_or_default());
                key.leaf_decor_mut().set_prefix(both);
            }
        }
        [first, rest @ ..] => {
            if let Some(inner) = table.get_mut(first).and_then(Item::as_table_like_mut) {
                put_above(inner, rest, remarks);
            }
        }
    }
}

/// The comments above a key and after its value, each on its own line.
fn remarks_of(key: &Key, value: &Value) -> String {
    let above = key.leaf_decor().prefix().and_then(|above| above.as_str());
    let behind = value.decor().suffix().and_then(|behind| behind.as_str());
    let above = above.unwrap_or_default();
    match behind.map(str::trim).filter(|behind| !behind.is_empty()) {
        Some(behind) => format!("{above}{behind}\n"),
        None => above.to_owned(),
    }
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
