//! Edits of whole tables: add, delete or copy objects, people and sensors.

use super::change::{Kind, Step, check_path, nothing_at, said};
use super::keys::value_of;
use super::layout::{Header, Layout, Splice};
use crate::editor::fault::Fault;
use serde_json::json;
use std::ops::Range;
use toml_edit::{Item, Value};

/// Adds a table after the others of its kind, or at the end.
pub(super) fn add(
    layout: &Layout<'_>,
    kind: Kind,
    name: &str,
    at_mm: [f64; 3],
) -> Result<Vec<Splice>, Fault> {
    let (key, rest) = match kind {
        Kind::Object => ("object", "size_mm = [600, 400, 500]\n"),
        Kind::Agent => ("agent", "person = {}\n"),
        Kind::Sensor => (
            "sensor",
            "preset = \"grid-eye\"\nelevation_deg = 90\nazimuth_deg = -90\n",
        ),
    };
    let (name, at_mm) = (Value::from(name), value_of(&json!(at_mm.map(f64::round)))?);
    let table = format!("[[{key}]]\nname = {name}\nposition_mm = {at_mm}\n{rest}");
    insert(layout, key, &table)
}

pub(super) fn copy(layout: &Layout<'_>, path: &[Step], name: &str) -> Result<Vec<Splice>, Fault> {
    let (key, block) = block(layout, path)?;
    let lines = layout.headers[block.start].lines.start..layout.headers[block.end - 1].lines.end;
    let own_name = [path, &[Step::Key("name".to_owned())]].concat();
    let known = layout.at(&own_name).and_then(Item::span);
    let known = known.ok_or_else(|| Fault::unfit(&format!("{} has no name", said(path))))?;
    let (before, behind) = (
        layout.part(lines.start..known.start),
        layout.part(known.end..lines.end),
    );
    let table = format!("{before}{}{behind}", Value::from(name)).replace("\r\n", "\n");
    insert(layout, key, &format!("{}\n", table.trim_end()))
}

/// Deletes a table with its own comments.
pub(super) fn remove(layout: &Layout<'_>, path: &[Step]) -> Result<Vec<Splice>, Fault> {
    let (_, block) = block(layout, path)?;
    let start = layout.remarks_above(block.start);
    let mut end = layout.remarks_below(block.end).end;
    let behind = layout.part(end..layout.between(block.end).end);
    let empty = behind.split_inclusive('\n');
    let empty = empty.take_while(|line| line.trim().is_empty());
    end += empty.map(str::len).sum::<usize>();
    if block.end < layout.headers.len() || !layout.part(end..layout.text.len()).is_empty() {
        return Ok(vec![(start..end, String::new())]);
    }
    // After deleting the last table, the empty line above it goes too.
    let left = layout.part(0..start).trim_end().len();
    let newline = if left == 0 { "" } else { layout.newline };
    Ok(vec![(left..end, newline.to_owned())])
}

/// The key of a list's table, and which headers belong to it and its subtables.
fn block<'p>(layout: &Layout<'_>, path: &'p [Step]) -> Result<(&'p str, Range<usize>), Fault> {
    check_path(path)?;
    let [list @ Step::Key(key), Step::Index(_)] = path else {
        let what = format!("{} is not a table of a list", said(path));
        return Err(Fault::unfit(&what));
    };
    let is_own = |header: &Header| header.path.starts_with(path);
    let own = layout.headers.iter().filter(|header| is_own(header));
    let start = layout.headers.iter().position(is_own);
    let block = start.map(|start| start..start + own.count());
    let is_whole = |block: &Range<usize>| layout.headers[block.clone()].iter().all(is_own);
    match (layout.at(path), block.filter(is_whole)) {
        (Some(_), Some(block)) => Ok((key, block)),
        (Some(_), None) => Err(Fault::unfit(&format!(
            "{} is not in one piece under [[{}]]",
            said(path),
            said(std::slice::from_ref(list))
        ))),
        (None, _) => Err(nothing_at(path)),
    }
}

/// Inserts a table after the last of its kind, separated by an empty line.
fn insert(layout: &Layout<'_>, key: &str, table: &str) -> Result<Vec<Splice>, Fault> {
    let kind = Step::Key(key.to_owned());
    if !matches!(
        layout.at(std::slice::from_ref(&kind)),
        None | Some(Item::ArrayOfTables(_))
    ) {
        let what = "the layout of the scene file does not allow this edit";
        return Err(Fault::unfit(what));
    }
    let is_kind = |header: &Header| header.path.first() == Some(&kind);
    let last = layout.headers.iter().rposition(is_kind);
    let next = last.map_or(layout.headers.len(), |last| last + 1);
    let at = layout.remarks_below(next).end;
    let behind = layout.part(at..layout.text.len());
    let above = if at == 0 { "" } else { "\n" };
    let below = match behind.is_empty() || behind.starts_with(layout.newline) {
        true => "",
        false => "\n",
    };
    Ok(vec![layout.insert(at, &format!("{above}{table}{below}"))])
}
