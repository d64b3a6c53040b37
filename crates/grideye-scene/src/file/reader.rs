//! What reading a scene needs beside its tables, and what several tables share.

use crate::file::files::Files;
use crate::file::keys::STYLE;
use crate::model::{Model, SceneError, limits};
use crate::text::MM_PER_M;
use glam::DVec3;
use grideye_text::{Refusal, Source, Table, Value};
use std::cell::Cell;
use std::collections::HashMap;

pub(crate) type Read<T> = Result<T, SceneError>;

pub(crate) struct Reader<'a> {
    /// Some keys apply to one model only.
    pub(crate) model: Model,
    /// Whether an agent of this name finds its place later: it may leave the room or run into something.
    pub(crate) is_free: &'a dyn Fn(&str) -> bool,
    pub(crate) files: &'a dyn Files,
    /// Bytes of the files that were read.
    pub(crate) named_bytes: Cell<usize>,
}

impl Reader<'_> {
    /// The text of a file that the scene names, in or below its own folder.
    pub(crate) fn read_below(&self, what: &str, path: Value<'_>) -> Read<String> {
        let relative = path.text().unwrap_or_default();
        let unreadable = |source| {
            let problem = format!("cannot read the {what} `{relative}`: {source}");
            let hint = "the path is relative to the scene file's folder";
            let why = path.place().refused(problem, hint);
            SceneError::FileUnreadable { why, source }
        };
        let text = self.files.read(relative).map_err(unreadable)?;
        source(relative, &text)?;
        // A file counts as often as it is named, because it is read as often.
        let named_bytes = self.named_bytes.get().saturating_add(text.len());
        self.named_bytes.set(named_bytes);
        if named_bytes > limits::NAMED_BYTES_MAX {
            let most = limits::NAMED_BYTES_MAX;
            let problem = format!(
                "the files named up to `{relative}` have {named_bytes} bytes, expected at most {most}"
            );
            let hint = "name fewer of them, or simplify the meshes: a sensor of 8 x 8 pixels sees no finer than a few centimeters";
            return Err(path.place().refused(problem, hint).into());
        }
        Ok(text)
    }
}

pub(crate) fn source<'a>(origin: &'a str, text: &'a str) -> Read<Source<'a>> {
    let style = &STYLE;
    let source = Source {
        origin,
        text,
        style,
    };
    source.check_length()?;
    Ok(source)
}

pub(crate) fn check_names(tables: &Table<'_>) -> Result<(), Refusal> {
    let bodies = tables.tables("object").chain(tables.tables("mosaic"));
    check_unique(bodies.chain(tables.tables("agent")), "object and agent")?;
    for agent in tables.tables("agent") {
        check_unique(agent.tables("part"), "part of an agent")?;
    }
    check_unique(tables.tables("sensor"), "sensor")
}

fn check_unique<'d>(tables: impl Iterator<Item = Table<'d>>, kind: &str) -> Result<(), Refusal> {
    let mut first_lines = HashMap::new();
    for name in tables.filter_map(|table| table.get("name")) {
        let text = name.text().unwrap_or_default();
        if let Some(first) = first_lines.insert(text, name) {
            let first_line = first.place().line;
            let problem = format!("the name `{text}` is taken by line {first_line}");
            let hint = format!("give each {kind} its own name");
            return Err(name.place().refused(problem, &hint));
        }
    }
    Ok(())
}

/// The tables that are not left out.
pub(crate) fn present<'d>(table: &Table<'d>, key: &str) -> Vec<Table<'d>> {
    let tables = table.tables(key);
    tables
        .filter(|table| table.flag("present") != Some(false))
        .collect()
}

pub(crate) fn name(table: &Table<'_>) -> String {
    table.text("name").unwrap_or_default().to_owned()
}

/// A place or size of the file, in meters.
pub(crate) fn meters(table: &Table<'_>, key: &str) -> Option<DVec3> {
    Some(DVec3::from_array(table.list(key)?) / MM_PER_M)
}

/// The common length of all rows, at least 1.
pub(crate) fn columns(rows: Value<'_>, expected: &str) -> Read<usize> {
    let columns = rows.each().next().map_or(0, |row| row.each().count());
    let odd = rows.each().find(|row| row.each().count() != columns);
    match odd.or((columns == 0).then_some(rows)) {
        None => Ok(columns),
        Some(wrong) => Err(wrong.refused(expected).into()),
    }
}
