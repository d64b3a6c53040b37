//! What layouts 2 and 3 kept of a batch until it was in the tables: rows of `pending`. A row is a group: for each batch
//! its arrival time (8 bytes), its length (4 bytes), both little-endian, and the batch as on the wire.

use crate::limits::Limits;
use crate::store::error::Result;
use crate::store::plan::{StreamName, Taken};
use crate::store::row::damaged;
use crate::store::sqlite::append::Known;
use crate::store::sqlite::read::stream_id;
use crate::store::sqlite::time;
use grideye_recording::StreamId;
use grideye_recording::wire::Batch;
use rusqlite::Connection;
use std::collections::HashMap;
use std::sync::Arc;

/// Batches that share a commit, with the number of the group.
pub(super) struct Group {
    number: i64,
    taken: Vec<Taken>,
}

/// The groups, without those parts of them that the tables of their streams have.
pub(super) fn pending(connection: &Connection) -> Result<Vec<Group>> {
    let mut statement =
        connection.prepare("SELECT device, sensor, boot, kept_group FROM streams")?;
    let kept: HashMap<StreamId, i64> = statement
        .query_map([], |row| Ok((stream_id(row, 0)?, row.get(3)?)))?
        .collect::<Result<_, _>>()?;
    let mut statement = connection.prepare("SELECT id, batches FROM pending ORDER BY id")?;
    let groups = statement.query_and_then([], |row| {
        let number = row.get(0)?;
        let bytes = row.get_ref(1)?.as_blob();
        let bytes = bytes.map_err(|error| damaged(&error.to_string()))?;
        let taken = open(bytes).ok_or_else(|| damaged("a truncated group of batches"))??;
        let is_new = |name: StreamName<'_>| {
            let kept = kept.get(&name.to_id());
            kept.is_none_or(|kept| *kept < number)
        };
        let taken = taken.into_iter().map(|mut taken| {
            let mut batch = (*taken.batch).clone();
            batch.sensors.retain(|part| is_new(taken.name_of(part)));
            taken.batch = Arc::new(batch);
            taken
        });
        Ok(Group {
            number,
            taken: taken.collect(),
        })
    })?;
    groups.collect()
}

/// Brings the groups into the tables of the present layout, in their order and under their numbers.
pub(super) fn take_in(connection: &Connection, groups: Vec<Group>) -> Result<()> {
    let limits = Limits::default();
    let t_store_ns = time::kept(connection)?;
    let mut known = Known::default();
    for Group { number, taken } in groups {
        connection.execute("UPDATE counters SET groups = ? - 1", [number])?;
        for appended in known.append(connection, &taken, t_store_ns, &limits)? {
            appended?;
        }
    }
    Ok(())
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
                    t_arrival_ns: i64::from_le_bytes(*t_arrival_ns),
                });
            }
            Err(error) => return Some(Err(damaged(&format!("a post: {error}")))),
        }
        bytes = rest;
    }
    Some(Ok(group))
}
