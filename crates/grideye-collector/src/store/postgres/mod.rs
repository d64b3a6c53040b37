//! The store in a PostgreSQL database that several collectors share.
//!
//! Every collector has a *lane*: a row of `lanes` that it locks and increments at the start of each transaction. It
//! then locks the streams that it adds to, ordered by key, so that two collectors never deadlock. Under these locks
//! `runs` says which numbers came before.
//!
//! A number drawn from a sequence shows when a transaction began, not when it committed: number 7 may become visible
//! after number 8. So the store uses no ranges of such numbers:
//!
//! - **Recordings are ranges of epochs.** A frame carries the epoch of its lane. A start or stop locks all lanes, which
//!   waits for every running transaction, and advances them in one commit: each transaction lies entirely before or
//!   after it.
//! - **The live page follows lanes.** Within a lane, commits are in the order of its count. A follower remembers the
//!   last count of each lane, and every `follow_every` queries the streams changed after it. No `NOTIFY`: within the
//!   transactions it would make all collectors commit one after another.
//! - **Epochs end rarely**, so `shares` (what an epoch brought to a stream) has one row per stream and recording.
//!
//! A killed collector leaves an unused lane; `idle_in_transaction_session_timeout` disconnects a collector that lost
//! its machine. Keys begin with `device`, so that a distributed engine keeps an append in one place. `frames` is
//! partitioned by the day of arrival, except in CockroachDB, which lacks this `PARTITION BY RANGE`.
//!
//! Tested with PostgreSQL 15; not tested: Citus, YugabyteDB, CockroachDB. The store uses no advisory locks (CockroachDB
//! ignores them), no sequences (YugabyteDB hands them out in blocks), and no `LISTEN`.

mod append;
mod boundary;
mod follow;
mod read;
mod session;
mod store;
mod writer;

pub(super) use append::FrameColumns;
pub(super) use session::{Days, Session, UNFINISHED, prepare as prepare_tables};
pub use store::PostgresStore;
