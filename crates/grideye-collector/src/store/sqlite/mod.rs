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

pub(super) use backup::prepare;
pub use backup::{BackedUp, BackupError, backup};
pub(super) use read::rows_of;
pub(super) use schema::{Found, recognize};
pub use store::SqliteStore;
pub(super) use write::settle;
