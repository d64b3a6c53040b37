//! Stores for the checks, and common queries.

use crate::postgres;
use grideye_collector::store::{Appended, Members, StoredRecord};
use grideye_collector::{FrameStore, Limits, PostgresStore, SqliteStore, StoreLocation};
use grideye_recording::wire::Batch;
use std::path::Path;
use std::sync::Arc;

pub(super) fn limits() -> Limits {
    Limits {
        gaps_listed_max: 3,
        streams_listed_max: 6,
        recordings_max: 4,
        labels_max: 3,
        ..Limits::default()
    }
}

pub(super) fn open(location: &StoreLocation) -> SqliteStore {
    SqliteStore::open(location, &limits()).unwrap()
}

pub(super) fn open_in(folder: &Path) -> SqliteStore {
    open(&StoreLocation::File(folder.join("frames.sqlite")))
}

/// A store in a new database of a real PostgreSQL.
pub(super) async fn open_database() -> Option<PostgresStore> {
    let cluster = postgres::shared("the store in PostgreSQL")?;
    let url = cluster.database().parse().unwrap();
    Some(PostgresStore::open(&url, &limits()).await.unwrap())
}

pub(super) async fn append(store: &dyn FrameStore, batch: Batch) -> Appended {
    store.append(Arc::new(batch), 7).await.unwrap()
}

/// Gaps and the highest number, after a batch of one sensor.
pub(super) fn gaps(appended: &Appended) -> (Option<u64>, Vec<(u64, u64)>, u64) {
    let stream = &appended.sensors[0].stream;
    let gaps = stream.gaps.iter().map(|gap| (gap.from, gap.to)).collect();
    (stream.durable_through, gaps, stream.never_came)
}

pub(super) async fn everything(store: &dyn FrameStore, members: &Members) -> Vec<StoredRecord> {
    let mut records = Vec::new();
    for span in &members.spans {
        records.extend(store.page(span.clone(), None, 10_000).await.unwrap());
    }
    records
}

pub(super) fn seqs(records: &[StoredRecord]) -> Vec<u64> {
    records.iter().map(|stored| stored.record.seq).collect()
}
