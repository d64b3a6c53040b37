//! How records come to the collector, and to the disk while it is away.

mod back_off;
mod choice;
mod hold;
mod http;
mod limits;
mod outcome;
mod post;
mod scheduler;
mod spooler;
pub mod transport;
mod uploader;

pub use http::{ANSWER_BYTES_MAX, CONFIGURATION_BYTES_MAX, CONFIGURATION_EVERY, Http};
pub use limits::{
    BACK_OFF_MAX, BACK_OFF_MIN, BACKLOG_FORBIDDEN, BACKLOG_RECORDS_MAX, BATCH_RECORDS_MAX,
    HEARTBEAT_EVERY, HELD_FOR, RETRY_AFTER_MAX,
};
pub use post::{Post, Posted};
pub use scheduler::{Now, Pace, Scheduler};
pub use spooler::{
    DISK_RETRY, EVICT_AFTER, OPEN_RETRY, Opener, SPOOL_DISK_FULL, SPOOL_FAILED, SPOOL_READ_ONLY,
    SPOOL_SLOW, Spooler, WRITE_RECORDS_MAX, WRITES_MAX,
};
pub use uploader::Uploader;
