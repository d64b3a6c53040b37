//! The spool: records that the collector does not have, on a disk that may fill, fail and lose power.
//!
//! ```text
//!   segment-0000000000000007   header │ stream │ account │ frame │ frame │ …        appended, then synced
//!   segment-0000000000000008   header │ stream │ account │ frame │ …  ◀─ writing
//!   state                      cursor: segment 7, byte 4321; boots not yet fully reported to the collector, and the last others
//!   quarantine/                unreadable data, and records that the collector rejects
//!   lock                       locked while an agent uses the folder
//! ```
//!
//! * The spool is the log of all records that are not acknowledged; only its newest part, in the ring, may not be on the
//!   disk yet. A record has one position in it, and is taken off by that, wherever it was sent from.
//! * A record is on disk once its segment was synced after it, and not before.
//! * The cursor is written, synced and renamed into place BEFORE a segment is removed: a crash between the two leaves a
//!   segment that the next start removes, never a cursor that points at nothing.
//! * A start reads each segment up to the first incomplete record, sets the rest aside by name, and goes on.
//! * After a failed write or sync the segment is abandoned, and the records, still in memory, go to a new one.
//! * When the spool is full, the oldest segment is dropped, and its frames count as [`SPOOL_FULL`].
//! * After a kill, the next boot reports for the killed one: its records go first, with an account marked as ended.
//! * After that, the last ended boots stay in the state, to be reported again if the collector loses them.
//! * Files of a later version of this program are rejected by name, and nothing in the folder changes.
//! * If the collector forbids a boot's records, they are held, and later boots go on.

mod backlog;
mod cursor;
mod disk;
mod index;
mod limits;
mod name;
mod quarantine;
mod recover;
mod runs;
pub mod segment;
mod state;
mod types;
mod writing;

pub use disk::{Disk, Folder, FolderError, LOCK, OpenError, QUARANTINE, REFUSED};
pub use index::Spool;
pub use limits::{
    Limits, QUARANTINE_BYTES_MAX, READS_MAX, RUNS_AHEAD_MAX, RUNS_MAX, SEGMENT_BYTES,
    SPOOL_DAMAGED, SPOOL_FULL,
};
pub(crate) use runs::count_lost;
pub use types::{Content, Dropped, Written};
