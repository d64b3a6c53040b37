//! Stores frames: one trait, so that a site that outgrows one machine can use another engine.

pub(crate) mod account;
mod chunk;
mod error;
mod frame_store;
mod location;
pub mod migrate;
mod plan;
mod postgres;
mod queue;
mod row;
mod runs;
pub mod segment;
mod sqlite;
mod types;

pub use error::{RecordingId, StoreError};
pub use frame_store::FrameStore;
pub use location::{PostgresUrl, StoreLocation, UrlError};
pub use postgres::PostgresStore;
pub use sqlite::{BackedUp, BackupError, RestoreError, Restored, SqliteStore, backup, restore};
pub use types::{
    Answer, Appended, Elsewhere, KeptLabel, Label, LabelSpan, Members, News, Recording,
    SensorAppended, Span, Stage, StoreUsage, StoredRecord, StreamSummary,
};

use crate::clock::Clock;
use crate::limits::Limits;
use crate::log::Log;
use std::sync::Arc;

/// Opens the store at a location, or creates it. Must be called within a tokio runtime.
///
/// # Errors
/// [`StoreError`] of the engine: the file or database cannot be opened, or holds something else.
pub async fn open(
    location: &StoreLocation,
    limits: &Limits,
    clock: &Arc<dyn Clock>,
    log: &Log,
) -> Result<Arc<dyn FrameStore>, StoreError> {
    Ok(match location {
        StoreLocation::Postgres(url) => Arc::new(PostgresStore::open(url, limits).await?),
        StoreLocation::File(_) | StoreLocation::Memory => {
            Arc::new(SqliteStore::open_tended(location, limits, clock, log)?)
        }
    })
}
