//! The store in a PostgreSQL database that several collectors share.
//!
//! # Who may write what, and in which order
//!
//! Every collector has a *lane*: a row of `lanes` that it locks at the beginning of each of its transactions, and
//! counts up. A transaction then locks the streams that it adds to, ordered by key, so that two collectors that get
//! frames of the same agent take turns and never wait for each other in a circle. Under that lock the store knows from
//! `runs` which numbers came before: identity does not hang on an index over all frames, which therefore may be
//! cut into partitions by time.
//!
//! # The order of arrivals without an order of commits
//!
//! A number drawn from a sequence says when a transaction began to write, not when it was committed: with two
//! collectors, number 7 may become visible after number 8, and whoever has read "all up to 8" never sees 7. So nothing
//! here is a range of such numbers.
//!
//! - **Recordings are ranges of epochs.** A frame carries the epoch of its lane. Starting or stopping a recording locks
//!   all lanes, which waits for every transaction in flight and holds off the next ones, and then moves all lanes to
//!   the next epoch in one commit. So each transaction lies whole before or whole after each start and stop, as a
//!   start that everybody saw would have it, and transactions of different collectors need no order among each other.
//!   Locks on rows of their own are queued fairly; a shared lock on one row would let a stream of writers keep a
//!   recording from ever starting.
//! - **The live page follows lanes.** Within a lane, the order of commits is the order of its count, because the row
//!   stays locked until the commit. A follower remembers the count that it has seen of each lane and asks for the
//!   streams that were changed in a lane after it. Nothing can become visible behind its back. `NOTIFY` only says that
//!   it is worth asking now; a notice that is lost, with a connection or with a collector that was killed between
//!   commit and notice, costs at most [`Limits::follow_every`](crate::Limits::follow_every). Notices go out on a connection of their own, after the
//!   commit: in the same transaction they would make all collectors commit one after another.
//! - **Epochs end rarely**, at starts, stops, and readings of a running recording, so `shares` (what an epoch brought
//!   to a stream) has a row for each stream and recording, not for each batch.
//!
//! A collector that is killed leaves a lane that nobody uses: PostgreSQL ends its transaction and frees the row. One
//! whose machine vanished is cut off by `idle_in_transaction_session_timeout`.
//!
//! # Keys
//!
//! Each table of frames begins its key with `device`; a stream's number counts within its device. So a distributed
//! engine can keep all that one append touches in one place. `layout`, `lanes` and `recordings` are small and read by
//! all. `frames` is cut by the day of arrival. CockroachDB does not know `PARTITION BY RANGE` in this form: there the
//! same table is made whole.
//!
//! Tried against PostgreSQL 15. Not tried: Citus, YugabyteDB and CockroachDB, which are not to be had as Debian
//! packages. What is used is in the dialect of each by its documentation: `unnest` with several arrays,
//! `INSERT … ON CONFLICT`, `UPDATE … FROM`, `LATERAL`, `FOR UPDATE`; no advisory locks, which CockroachDB takes and ignores, no
//! sequences, which YugabyteDB hands out in pieces, and no `LISTEN` that correctness depends on.

mod append;
mod boundary;
mod follow;
mod read;
mod session;
mod store;
mod writer;

pub(super) use append::FrameColumns;
pub(super) use session::{Days, Parameters, Session, UNFINISHED, prepare as prepare_tables};
pub use store::PostgresStore;
