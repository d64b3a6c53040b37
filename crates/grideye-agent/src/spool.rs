//! The spool: what the collector does not have, on a disk that may fill, fail and lose power.
//!
//! ```text
//!   segment-0000000000000007   header │ stream │ account │ frame │ frame │ …        appended, then synced
//!   segment-0000000000000008   header │ stream │ account │ frame │ …  ◀─ writing
//!   state                      cursor: segment 7, byte 4321; the runs that the collector has not heard to the end
//!   quarantine/                what could not be read, and what the collector refused
//!   lock                       held while an agent uses the folder
//! ```
//!
//! * A record is on disk when its segment was synced behind it, and not before.
//! * The cursor is written, synced and renamed into place BEFORE a segment is removed: a crash between the two leaves a
//!   segment that the next start removes, never a cursor that points at nothing.
//! * A start reads each segment up to the first record that is not whole, sets the rest aside by name, and goes on.
//! * After a failed write or sync the segment is given up and the records, which are still in memory, go to a new one.
//! * When it is full the oldest segment goes, and its frames are counted as [`SPOOL_FULL`].
//! * A run that was killed is spoken for by the next one: its records go first, with an account that says that it ended.
//! * What a later version of this program wrote is refused by name, and nothing of the folder is changed.
//! * A run whose records the collector does not let this agent send is held, and those behind it go on.

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

pub use disk::{Disk, Folder, FolderError, LOCK, OpenError, QUARANTINE};
pub use index::Spool;
pub use limits::{
    EXTENTS_MAX, Limits, QUARANTINE_BYTES_MAX, READS_MAX, RUNS_MAX, SEGMENT_BYTES, SPOOL_DAMAGED,
    SPOOL_FULL,
};
pub use types::{Content, Dropped, Written};
