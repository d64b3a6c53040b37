//! Groups of batches that are stored but not yet in the tables. A row is a group: for each batch its arrival time (8
//! bytes), its length (4 bytes), both little-endian, and the batch as on the wire.

use crate::store::error::{Result, StoreError};
use crate::store::plan::Taken;
use crate::store::row::damaged;
use grideye_recording::wire::{Batch, SensorBatch};
use rusqlite::{Connection, params};
use std::borrow::Cow;
use std::sync::Arc;

/// A little more than a usual batch takes: five frames and their names.
const ROOM_OF_A_POST: usize = 1024;

pub(super) struct Group {
    pub(super) group: i64,
    pub(super) bytes: u64,
    pub(super) taken: Vec<Taken>,
}

/// Stores a group and returns its size in bytes.
pub(super) fn keep(connection: &Connection, group: i64, taken: &[&Taken]) -> Result<u64> {
    let mut bytes = Vec::with_capacity(ROOM_OF_A_POST * taken.len());
    for taken in taken {
        bytes.extend_from_slice(&taken.t_arrival_ns.to_le_bytes());
        let length_at = bytes.len();
        bytes.extend_from_slice(&[0; 4]);
        let began = bytes.len();
        match &taken.compact {
            Some(compact) => bytes.extend_from_slice(compact),
            None => in_order(&taken.batch)
                .append_binary(&mut bytes)
                .map_err(|error| StoreError::Failed(error.to_string()))?,
        }
        let length = u32::try_from(bytes.len() - began)
            .map_err(|_too_long| StoreError::Failed("a batch of 4 GiB".to_owned()))?;
        bytes[length_at..began].copy_from_slice(&length.to_le_bytes());
    }
    connection
        .prepare_cached("INSERT INTO pending (id, batches) VALUES (?, ?)")?
        .execute(params![group, bytes])?;
    Ok(u64::try_from(bytes.len()).unwrap_or(u64::MAX))
}

/// The batch as the wire requires it, each number once and ascending. The stored result is the same.
fn in_order(batch: &Batch) -> Cow<'_, Batch> {
    let is_in_order = |part: &SensorBatch| part.frames.is_sorted_by(|one, next| one.seq < next.seq);
    if batch.sensors.iter().all(is_in_order) {
        return Cow::Borrowed(batch);
    }
    let mut batch = batch.clone();
    for part in &mut batch.sensors {
        part.frames.sort_by_key(|record| record.seq);
        part.frames.dedup_by_key(|record| record.seq);
    }
    Cow::Owned(batch)
}

pub(super) fn all(connection: &Connection) -> Result<Vec<Group>> {
    let mut statement = connection.prepare("SELECT id, batches FROM pending ORDER BY id")?;
    let groups = statement.query_and_then([], |row| {
        let bytes = row.get_ref(1)?.as_blob();
        let bytes = bytes.map_err(|error| damaged(&error.to_string()))?;
        Ok(Group {
            group: row.get(0)?,
            bytes: u64::try_from(bytes.len()).unwrap_or(u64::MAX),
            taken: open(bytes).ok_or_else(|| damaged("a truncated group of batches"))??,
        })
    })?;
    groups.collect()
}

/// `None` if the bytes end within a batch.
fn open(mut bytes: &[u8]) -> Option<Result<Vec<Taken>>> {
    let mut group = Vec::new();
    while !bytes.is_empty() {
        let (t_arrival_ns, rest) = bytes.split_first_chunk()?;
        let (length, rest) = rest.split_first_chunk()?;
        let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
        let (batch, rest) = rest.split_at_checked(length)?;
        match Batch::from_binary(batch) {
            Ok(batch) => {
                group.push(Taken {
                    batch: Arc::new(batch),
                    compact: None,
                    t_arrival_ns: i64::from_le_bytes(*t_arrival_ns),
                });
            }
            Err(error) => return Some(Err(damaged(&format!("a post: {error}")))),
        }
        bytes = rest;
    }
    Some(Ok(group))
}

/// Deletes the groups up to `through`, and stores the number of the last group.
pub(super) fn forget(connection: &Connection, through: i64, last: i64) -> Result<()> {
    connection
        .prepare_cached("DELETE FROM pending WHERE id <= ?")?
        .execute([through])?;
    connection
        .prepare_cached("UPDATE counters SET groups = ?1 WHERE groups <> ?1")?
        .execute([last])?;
    Ok(())
}
