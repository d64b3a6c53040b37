//! Labels of recordings.

use crate::store::error::{RecordingId, Result, StoreError};
use crate::store::row::count;
use crate::store::sqlite::read;
use crate::store::types::{KeptLabel, Label};
use rusqlite::{Connection, params};

/// A recording's labels, oldest first.
pub(super) fn all(connection: &Connection, id: RecordingId) -> Result<Vec<KeptLabel>> {
    read::recording(connection, id)?;
    let mut statement = connection.prepare_cached(
        "SELECT number, label FROM labels WHERE recording_id = ? ORDER BY number",
    )?;
    let labels = statement.query_and_then([id.0], |row| {
        KeptLabel::from_text(row.get(0)?, &row.get::<_, String>(1)?)
    })?;
    labels.collect()
}

pub(super) fn add(
    connection: &Connection,
    id: RecordingId,
    label: Label,
    labels_max: usize,
) -> Result<KeptLabel> {
    read::recording(connection, id)?;
    let (labels, number): (i64, i64) = connection
        .prepare_cached(
            "SELECT count(*), coalesce(max(number), 0) + 1 FROM labels WHERE recording_id = ?",
        )?
        .query_row([id.0], |row| Ok((row.get(0)?, row.get(1)?)))?;
    if labels >= count(labels_max) {
        return Err(StoreError::TooManyLabels(labels_max));
    }
    connection
        .prepare_cached("INSERT INTO labels (recording_id, number, label) VALUES (?, ?, ?)")?
        .execute(params![id.0, number, label.to_text()?])?;
    Ok(KeptLabel { number, label })
}

pub(super) fn remove(connection: &Connection, id: RecordingId, number: i64) -> Result<()> {
    read::recording(connection, id)?;
    let removed = connection
        .prepare_cached("DELETE FROM labels WHERE recording_id = ? AND number = ?")?
        .execute(params![id.0, number])?;
    match removed {
        0 => Err(StoreError::NoSuchLabel { id, number }),
        _ => Ok(()),
    }
}
