//! The store in one SQLite file.

mod append;
mod backup;
mod identity;
mod labels;
mod older;
mod place;
mod read;
mod restore;
mod retain;
mod schema;
mod store;
mod tend;
mod time;
mod write;

pub(super) use append::move_arrivals;
pub use backup::{BackedUp, BackupError, backup};
pub(super) use backup::{open as open_store, prepare};
pub(super) use read::{rows_of, stream_id};
pub use restore::{RestoreError, Restored, restore};
pub use store::SqliteStore;
