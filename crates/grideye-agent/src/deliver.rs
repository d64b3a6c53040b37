//! Delivers records to the collector, and stores them on the disk while it is away.

mod http;
mod post;
mod scheduler;
mod spooler;

pub(crate) use http::Http;
pub use http::{ANSWER_BYTES_MAX, CONFIGURATION_BYTES_MAX, CONFIGURATION_EVERY, client, signed};
pub use post::{
    BACK_OFF_MAX, BACK_OFF_MIN, BACKLOG_FORBIDDEN, BACKLOG_RECORDS_MAX, BATCH_RECORDS_MAX,
    HEARTBEAT_EVERY, HELD_FOR, Post, Posted, RETRY_AFTER_MAX,
};
pub use scheduler::{Pace, Scheduler};
pub use spooler::{
    DISK_RETRY, OPEN_RETRY, Opener, SPOOL_DISK_FULL, SPOOL_FAILED, SPOOL_READ_ONLY, SPOOL_SLOW,
    Spooler, WRITE_RECORDS_MAX, WRITES_MAX,
};
