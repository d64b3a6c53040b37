//! Ends epochs, which starts and stops recordings; deletes recordings; writes leases, notes and labels.

use crate::limits::Limits;
use crate::store::error::{RecordingId, Result, StoreError};
use crate::store::postgres::read;
use crate::store::postgres::session::Session;
use crate::store::row::count;
use crate::store::types::{KeptLabel, Label, Recording};

/// Adds a lane in the current epoch, with an unused number.
pub(super) async fn new_lane(session: &Session) -> Result<i64> {
    let work = async {
        // Locked until the commit: no epoch ends between reading it and inserting it.
        let epoch = lock_epoch(session).await?;
        let sql = "INSERT INTO grideye.lanes (lane, epoch, n)
                   SELECT coalesce(max(lane), 0) + 1, $1, 0 FROM grideye.lanes RETURNING lane";
        let rows = session.query(sql, &[&epoch]).await?;
        Ok(rows[0].try_get(0)?)
    };
    session.transact(work).await
}

/// Ends the current epoch for all lanes and returns its number.
pub(super) async fn end_epoch(session: &Session) -> Result<i64> {
    session.transact(next_epoch(session)).await
}

pub(super) async fn start(
    session: &Session,
    name: &str,
    t_start_ns: i64,
    limits: &Limits,
) -> Result<Recording> {
    let work = async {
        let ended = next_epoch(session).await?;
        let sql = "SELECT t_stop_ns IS NULL FROM grideye.recordings WHERE name = $1";
        let taken = session.query(sql, &[&name]).await?;
        if let Some(row) = taken.first() {
            return Err(StoreError::NameTaken {
                name: name.to_owned(),
                running: row.try_get(0)?,
            });
        }
        let sql = "SELECT count(*) FROM grideye.recordings";
        let recordings: i64 = session.query(sql, &[]).await?[0].try_get(0)?;
        if recordings >= count(limits.recordings_max) {
            return Err(StoreError::TooManyRecordings(limits.recordings_max));
        }
        let id = next_id(session).await?;
        let sql = "INSERT INTO grideye.recordings (id, name, t_start_ns, after_epoch) VALUES ($1, $2, $3, $4)";
        session
            .execute(sql, &[&id, &name, &t_start_ns, &ended])
            .await?;
        Ok(read::recording(session, RecordingId(id)).await?.0)
    };
    session.transact(work).await
}

/// A number is not given again, even if the newest recording was deleted.
async fn next_id(session: &Session) -> Result<i64> {
    let sql = "SELECT 1 + greatest(coalesce(max(id), 0), coalesce(
                   (SELECT split_part(fact, ' ', 2)::BIGINT FROM grideye.facts WHERE fact LIKE 'recording %'), 0))
               FROM grideye.recordings";
    Ok(session.query(sql, &[]).await?[0].try_get(0)?)
}

pub(super) async fn stop(session: &Session, id: RecordingId, t_stop_ns: i64) -> Result<Recording> {
    let work = async {
        let ended = next_epoch(session).await?;
        running(session, id).await?;
        let sql = "DELETE FROM grideye.leases WHERE recording = $1";
        session.execute(sql, &[&id.0]).await?;
        let sql = "UPDATE grideye.recordings SET t_stop_ns = $2, through_epoch = $3 WHERE id = $1";
        session.execute(sql, &[&id.0, &t_stop_ns, &ended]).await?;
        Ok(read::recording(session, id).await?.0)
    };
    session.transact(work).await
}

/// Checks that a recording runs; it does until the caller's transaction ends.
async fn running(session: &Session, id: RecordingId) -> Result<()> {
    lock(session, id).await?;
    let (recording, _) = read::recording(session, id).await?;
    match recording.t_stop_ns {
        None => Ok(()),
        Some(_) => Err(StoreError::NotRunning {
            id,
            name: recording.name,
        }),
    }
}

pub(super) async fn renew(session: &Session, id: RecordingId) -> Result<()> {
    let work = async {
        running(session, id).await?;
        let sql = "INSERT INTO grideye.leases AS l VALUES ($1, 1)
                   ON CONFLICT (recording) DO UPDATE SET renewals = l.renewals + 1";
        session.execute(sql, &[&id.0]).await.map(drop)
    };
    session.transact(work).await
}

pub(super) async fn delete(session: &Session, id: RecordingId) -> Result<()> {
    let work = async {
        // No recording starts or stops meanwhile.
        lock_epoch(session).await?;
        lock(session, id).await?;
        let last = next_id(session).await? - 1;
        let sql = "DELETE FROM grideye.facts WHERE fact LIKE 'recording %'";
        session.execute(sql, &[]).await?;
        let sql = "INSERT INTO grideye.facts VALUES ('recording ' || $1::BIGINT || ' was the last to start')";
        session.execute(sql, &[&last]).await?;
        for sql in [
            "DELETE FROM grideye.leases WHERE recording = $1",
            "DELETE FROM grideye.notes WHERE recording = $1",
            "DELETE FROM grideye.labels WHERE recording = $1",
            "DELETE FROM grideye.recordings WHERE id = $1",
        ] {
            session.execute(sql, &[&id.0]).await?;
        }
        Ok(())
    };
    session.transact(work).await
}

/// Sets a recording's note; this ends no epoch.
pub(super) async fn note(session: &Session, id: RecordingId, note: &str) -> Result<Recording> {
    read::recording(session, id).await?;
    let sql = "INSERT INTO grideye.notes (recording, note) VALUES ($1, $2)
             ON CONFLICT (recording) DO UPDATE SET note = excluded.note";
    session.execute(sql, &[&id.0, &note]).await?;
    Ok(read::recording(session, id).await?.0)
}

/// Waits for all running transactions, blocks new ones until the commit, and moves all lanes to the next epoch.
async fn next_epoch(session: &Session) -> Result<i64> {
    let ended = lock_epoch(session).await?;
    // In the order of their numbers, so that two callers never deadlock.
    let sql = "SELECT lane FROM grideye.lanes ORDER BY lane FOR UPDATE";
    session.query(sql, &[]).await?;
    let sql = "UPDATE grideye.lanes SET epoch = $1";
    session.execute(sql, &[&(ended + 1)]).await?;
    let sql = "UPDATE grideye.layout SET epoch = $1";
    session.execute(sql, &[&(ended + 1)]).await?;
    Ok(ended)
}

async fn lock_epoch(session: &Session) -> Result<i64> {
    let sql = "SELECT epoch FROM grideye.layout FOR UPDATE";
    let rows = session.query(sql, &[]).await?;
    let row = rows.first().ok_or_else(StoreError::foreign)?;
    Ok(row.try_get(0)?)
}

/// A recording's labels, oldest first.
pub(super) async fn labels(session: &Session, id: RecordingId) -> Result<Vec<KeptLabel>> {
    read::recording(session, id).await?;
    let sql = "SELECT number, label FROM grideye.labels WHERE recording = $1 ORDER BY number";
    let rows = session.query(sql, &[&id.0]).await?;
    rows.iter()
        .map(|row| KeptLabel::from_text(row.try_get(0)?, row.try_get(1)?))
        .collect()
}

pub(super) async fn add_label(
    session: &Session,
    id: RecordingId,
    label: Label,
    limits: &Limits,
) -> Result<KeptLabel> {
    let work = async {
        lock(session, id).await?;
        let sql = "SELECT count(*), coalesce(max(number), 0) + 1 FROM grideye.labels WHERE recording = $1";
        let rows = session.query(sql, &[&id.0]).await?;
        let (labels, number): (i64, i64) = (rows[0].try_get(0)?, rows[0].try_get(1)?);
        if labels >= count(limits.labels_max) {
            return Err(StoreError::TooManyLabels(limits.labels_max));
        }
        let sql = "INSERT INTO grideye.labels (recording, number, label) VALUES ($1, $2, $3)";
        let text = label.to_text()?;
        session.execute(sql, &[&id.0, &number, &text]).await?;
        Ok(KeptLabel { number, label })
    };
    session.transact(work).await
}

/// Whether a collector ever asked for tokens with this store; from now on one did, if `is_asking`.
pub(super) async fn ask_for_tokens(session: &Session, is_asking: bool) -> Result<bool> {
    if is_asking {
        let sql = "INSERT INTO grideye.facts VALUES ('asked for tokens') ON CONFLICT DO NOTHING";
        session.execute(sql, &[]).await?;
    }
    let sql = "SELECT fact FROM grideye.facts WHERE fact = 'asked for tokens'";
    Ok(!session.query(sql, &[]).await?.is_empty())
}

pub(super) async fn remove_label(session: &Session, id: RecordingId, number: i64) -> Result<()> {
    read::recording(session, id).await?;
    let sql = "DELETE FROM grideye.labels WHERE recording = $1 AND number = $2";
    match session.execute(sql, &[&id.0, &number]).await? {
        0 => Err(StoreError::NoSuchLabel { id, number }),
        _ => Ok(()),
    }
}

/// Makes two collectors that add to one recording take turns, so that each label number is given once.
async fn lock(session: &Session, id: RecordingId) -> Result<()> {
    let sql = "SELECT id FROM grideye.recordings WHERE id = $1 FOR UPDATE";
    let rows = session.query(sql, &[&id.0]).await?;
    rows.first()
        .map(|_row| ())
        .ok_or(StoreError::NoSuchRecording(id))
}
