//! The store in a PostgreSQL database that several collectors share.
//!
//! Every collector has a *lane*: a row of `lanes` that it locks at the beginning of each transaction, and counts up. It then
//! locks the streams that it adds to, ordered by key, so that no two wait for each other in a circle. Under that lock the
//! store knows from `runs` which numbers came before.
//!
//! A number drawn from a sequence says when a transaction began, not when it was committed: number 7 may become visible
//! after number 8. So nothing here is a range of such numbers:
//!
//! - **Recordings are ranges of epochs.** A frame carries the epoch of its lane. A start or stop locks all lanes, which waits
//!   for every transaction in flight, and moves them on in one commit: each transaction lies whole before or after it.
//! - **The live page follows lanes.** Within a lane, commits are in the order of its count. A follower remembers the count
//!   that it has seen of each and asks for the streams changed after it. `NOTIFY` only says that it is worth asking now, on
//!   a connection of its own, as it would make all collectors commit one after another; a lost one costs `follow_every`.
//! - **Epochs end rarely**, so `shares` (what an epoch brought to a stream) has a row for each stream and recording.
//!
//! A killed collector leaves a lane that nobody uses; one whose machine vanished is cut off by
//! `idle_in_transaction_session_timeout`. Keys begin with `device`, so that a distributed engine keeps an append in one
//! place. `frames` is cut by the day of arrival, but not in CockroachDB, which does not know `PARTITION BY RANGE` so.
//!
//! Tried against PostgreSQL 15; not tried: Citus, YugabyteDB, CockroachDB. No advisory locks, which CockroachDB ignores, no
//! sequences, which YugabyteDB hands out in pieces, and no `LISTEN` that correctness depends on.

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
