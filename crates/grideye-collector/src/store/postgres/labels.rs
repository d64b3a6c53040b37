//! Labels of recordings.

use crate::limits::Limits;
use crate::store::error::StoreError;
use crate::store::label::{KeptLabel, Label};
use crate::store::postgres::read;
use crate::store::postgres::session::Session;
use crate::store::recording_id::RecordingId;
use crate::store::row::count;

/// In the order in which they were added.
pub(super) async fn all(session: &Session, id: RecordingId) -> Result<Vec<KeptLabel>, StoreError> {
    read::recording(session, id).await?;
    let sql = "SELECT number, label FROM grideye.labels WHERE recording = $1 ORDER BY number";
    let rows = session.query(sql, &[&id.0]).await?;
    rows.iter()
        .map(|row| KeptLabel::from_text(row.try_get(0)?, row.try_get(1)?))
        .collect()
}

pub(super) async fn add(
    session: &Session,
    id: RecordingId,
    label: Label,
    limits: &Limits,
) -> Result<KeptLabel, StoreError> {
    session.batch("BEGIN").await?;
    let added = async {
        lock(session, id).await?;
        let sql = "SELECT count(*), coalesce(max(number), 0) + 1 FROM grideye.labels WHERE recording = $1";
        let rows = session.query(sql, &[&id.0]).await?;
        let (labels, number): (i64, i64) = (rows[0].try_get(0)?, rows[0].try_get(1)?);
        if labels >= count(limits.labels_max) {
            return Err(StoreError::TooManyLabels {
                limit: limits.labels_max,
            });
        }
        let sql = "INSERT INTO grideye.labels (recording, number, label) VALUES ($1, $2, $3)";
        session
            .execute(sql, &[&id.0, &number, &label.to_text()?])
            .await?;
        Ok(KeptLabel { number, label })
    }
    .await;
    session.end(added).await
}

pub(super) async fn remove(
    session: &Session,
    id: RecordingId,
    number: i64,
) -> Result<(), StoreError> {
    read::recording(session, id).await?;
    let sql = "DELETE FROM grideye.labels WHERE recording = $1 AND number = $2";
    match session.execute(sql, &[&id.0, &number]).await? {
        0 => Err(StoreError::NoSuchLabel { id, number }),
        _ => Ok(()),
    }
}

/// Two collectors that add to one recording do so one after the other: each number is given once.
async fn lock(session: &Session, id: RecordingId) -> Result<(), StoreError> {
    let sql = "SELECT id FROM grideye.recordings WHERE id = $1 FOR UPDATE";
    let rows = session.query(sql, &[&id.0]).await?;
    rows.first()
        .map(|_row| ())
        .ok_or(StoreError::NoSuchRecording { id })
}
