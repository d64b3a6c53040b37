//! Edits of whole tables: add, delete or copy objects, people and sensors.

use super::change::{Kind, Step, check_path, nothing_at, said};
use super::headers::{Header, headers, lead, set_lead, table_at};
use super::keys::value_of;
use super::remarks::{above, behind_empty_lines, below};
use crate::editor::fault::Fault;
use serde_json::json;
use std::ops::Range;
use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, Table, Value};

/// Adds a table after the others of its kind, or at the end.
pub(super) fn add(
    document: &mut DocumentMut,
    kind: Kind,
    name: &str,
    at_mm: [f64; 3],
) -> Result<(), Fault> {
    let (key, rest) = template(kind);
    let mut table = Table::new();
    let at_mm = json!(at_mm.map(f64::round));
    table.insert("name", Item::Value(name.into()));
    table.insert("position_mm", Item::Value(value_of(&at_mm)?));
    for (key, value) in rest {
        table.insert(key, Item::Value(value));
    }
    insert(document, key, table)
}

type Template = (&'static str, Vec<(&'static str, Value)>);

/// The table's key, and its values except name and position.
fn template(kind: Kind) -> Template {
    match kind {
        Kind::Object => {
            let size_mm = [600, 400, 500].into_iter().collect::<Array>();
            ("object", vec![("size_mm", size_mm.into())])
        }
        Kind::Agent => ("agent", vec![("person", InlineTable::new().into())]),
        Kind::Sensor => (
            "sensor",
            vec![
                ("preset", "grid-eye".into()),
                ("elevation_deg", 90.into()),
                ("azimuth_deg", (-90).into()),
            ],
        ),
    }
}

pub(super) fn copy(document: &mut DocumentMut, path: &[Step], name: &str) -> Result<(), Fault> {
    let headers = headers(document);
    let (key, _) = block(document, &headers, path)?;
    let mut table = table_at(document, path)
        .ok_or_else(|| nothing_at(path))?
        .clone();
    let known = table.get_mut("name").and_then(Item::as_value_mut);
    let known = known.ok_or_else(|| Fault::unfit(&format!("{} has no name", said(path))))?;
    let mut named = Value::from(name);
    named.decor_mut().clone_from(known.decor());
    *known = named;
    insert(document, key, table)
}

/// Deletes a table with its own comments.
pub(super) fn remove(document: &mut DocumentMut, path: &[Step]) -> Result<(), Fault> {
    let headers = headers(document);
    let (key, block) = block(document, &headers, path)?;
    let before = lead(document, headers.get(block.start));
    let before = before.get(..above(&before)).unwrap_or_default();
    let next = headers.get(block.end);
    let behind = lead(document, next);
    let behind = behind
        .get(below(&behind, next.is_none())..)
        .unwrap_or_default();
    let mut left = format!("{before}{}", behind_empty_lines(behind));
    if next.is_none() {
        // After deleting the last table, the empty line above it goes too.
        left.truncate(left.trim_end().len());
        left.push_str(if left.is_empty() { "" } else { "\n" });
    }
    set_lead(document, next, &left);
    let tables = document.get_mut(key).and_then(Item::as_array_of_tables_mut);
    if let (Some(tables), [_, Step::Index(index)]) = (tables, path) {
        tables.remove(*index);
    }
    Ok(())
}

/// The key of a list's table, and which headers belong to it and its subtables.
fn block<'p>(
    document: &DocumentMut,
    headers: &[Header],
    path: &'p [Step],
) -> Result<(&'p str, Range<usize>), Fault> {
    check_path(path)?;
    let [Step::Key(key), Step::Index(index)] = path else {
        return Err(Fault::unfit(&format!(
            "{} is not a table of a list",
            said(path)
        )));
    };
    let one_piece = || {
        Fault::unfit(&format!(
            "{} is not in one piece under [[{key}]]",
            said(path)
        ))
    };
    match document.get(key) {
        Some(Item::ArrayOfTables(list)) if *index < list.len() => {}
        Some(Item::Value(Value::Array(list))) if *index < list.len() => return Err(one_piece()),
        _ => return Err(nothing_at(path)),
    }
    let is_own = |header: &Header| header.path.starts_with(path);
    let start = headers.iter().position(is_own).ok_or_else(one_piece)?;
    let own = headers.iter().filter(|header| is_own(header)).count();
    let end = start + own;
    match headers.get(start..end) {
        Some(piece) if piece.iter().all(is_own) => Ok((key, start..end)),
        _ => Err(one_piece()),
    }
}

/// Inserts a table after the last of its kind, separated by an empty line.
fn insert(document: &mut DocumentMut, key: &str, mut table: Table) -> Result<(), Fault> {
    let headers = headers(document);
    let is_kind = |header: &Header| header.path.first() == Some(&Step::Key(key.to_owned()));
    let last = headers.iter().rposition(is_kind);
    let next = last.and_then(|last| headers.get(last + 1));
    let position = headers.get(last.unwrap_or(headers.len().saturating_sub(1)));
    let position = position.map_or(0, |header| header.position);
    let between = lead(document, next);
    let of_the_last = below(&between, next.is_none());
    let (before, behind) = between.split_at(of_the_last);
    let is_empty = headers.is_empty() && document.is_empty() && before.is_empty();
    table
        .decor_mut()
        .set_prefix(format!("{before}{}", if is_empty { "" } else { "\n" }));
    let is_divided = behind.starts_with('\n') || next.is_none() && behind.is_empty();
    set_lead(
        document,
        next,
        &format!("{}{behind}", if is_divided { "" } else { "\n" }),
    );
    place(&mut table, position);
    let list = Item::ArrayOfTables(ArrayOfTables::new());
    match document.entry(key).or_insert(list) {
        Item::ArrayOfTables(list) => list.push(table),
        Item::None | Item::Value(_) | Item::Table(_) => {
            return Err(Fault::unfit(
                "the layout of the scene file does not allow this edit",
            ));
        }
    }
    Ok(())
}

/// Moves a table and its subtables after the header at that position.
fn place(table: &mut Table, position: isize) {
    table.set_position(Some(position));
    for (_, item) in table.iter_mut() {
        match item {
            Item::Table(table) => place(table, position),
            Item::ArrayOfTables(list) => {
                list.iter_mut().for_each(|table| place(table, position));
            }
            Item::None | Item::Value(_) => {}
        }
    }
}
