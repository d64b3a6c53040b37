//! The store in one SQLite file.

mod backup;
mod known;
mod labels;
mod pending;
mod place;
mod read;
mod retain;
mod schema;
mod store;
mod tend;
mod time;
mod write;

pub use backup::{BackedUp, BackupError, backup};
pub(super) use backup::{open as open_store, prepare};
pub(super) use read::{rows_of, stream_id};
pub use store::SqliteStore;
pub(super) use write::settle;
