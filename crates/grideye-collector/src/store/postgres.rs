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
mod labels;
mod read;
mod schema;
mod session;
mod writer;

use super::plan::Taken;
use super::queue::{Command, Queue, WriteFault};
use super::{
    Answer, Appended, FrameStore, KeptLabel, Label, Members, News, PostgresUrl, Recording,
    RecordingId, Span, StoreError, StoreUsage, StoredRecord, StreamSummary,
};
use crate::Limits;
use grideye_recording::wire::Batch;
pub(super) use schema::{Days, prepare as prepare_tables};
pub(super) use session::Session;
use session::Shared;
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::mpsc;
use tokio::task::JoinHandle;
use writer::Writer;

/// A store in a PostgreSQL database.
pub struct PostgresStore {
    queue: Queue,
    writer: Mutex<Option<JoinHandle<()>>>,
    reader: Shared,
    news: Mutex<Option<mpsc::Receiver<News>>>,
    follower: JoinHandle<()>,
    fault: WriteFault,
    limits: Limits,
}

impl PostgresStore {
    /// Connects, and makes the tables where none are. Must be called within a tokio runtime.
    ///
    /// # Errors
    /// [`StoreError::Unreachable`], [`StoreError::Newer`], and what the database refuses.
    pub async fn open(url: &PostgresUrl, limits: &Limits) -> Result<Self, StoreError> {
        let session = Session::open(url, limits).await?;
        schema::prepare(&session).await?;
        let fault = WriteFault::default();
        let writer = Writer::new(url, limits, session, fault.clone()).await?;
        let reader = Shared::new(url, limits);
        let (news, heard) = mpsc::channel(limits.live_lag_max.max(1));
        let follower = follow::start(url, limits, &writer, news).await?;
        let (queue, commands) = Queue::new(limits.writer_queue_max);
        Ok(Self {
            queue,
            writer: Mutex::new(Some(tokio::spawn(writer.run(commands)))),
            reader,
            news: Mutex::new(Some(heard)),
            follower,
            fault,
            limits: limits.clone(),
        })
    }
}

impl FrameStore for PostgresStore {
    fn append(&self, batch: Arc<Batch>, t_arrival_ns: i64) -> Answer<'_, Appended> {
        let taken = Taken {
            batch,
            compact: None,
            t_arrival_ns,
        };
        self.queue.ask(|reply| Command::Append { taken, reply })
    }

    fn streams(&self) -> Answer<'_, Vec<StreamSummary>> {
        Box::pin(async { read::streams(&*self.reader.session().await?, &self.limits).await })
    }

    fn newest(&self) -> Answer<'_, Vec<StoredRecord>> {
        Box::pin(async { read::newest(&*self.reader.session().await?).await })
    }

    fn start_recording(&self, name: String, t_start_ns: i64) -> Answer<'_, Recording> {
        self.queue.ask(|reply| Command::Start {
            name,
            t_start_ns,
            reply,
        })
    }

    fn stop_recording(&self, id: RecordingId, t_stop_ns: i64) -> Answer<'_, Recording> {
        self.queue.ask(|reply| Command::Stop {
            id,
            t_stop_ns,
            reply,
        })
    }

    fn note_recording(&self, id: RecordingId, note: String) -> Answer<'_, Recording> {
        self.queue.ask(|reply| Command::Note { id, note, reply })
    }

    fn labels(&self, id: RecordingId) -> Answer<'_, Vec<KeptLabel>> {
        Box::pin(async move { labels::all(&*self.reader.session().await?, id).await })
    }

    fn add_label(&self, id: RecordingId, label: Label) -> Answer<'_, KeptLabel> {
        self.queue
            .ask(|reply| Command::AddLabel { id, label, reply })
    }

    fn remove_label(&self, id: RecordingId, number: i64) -> Answer<'_, ()> {
        self.queue
            .ask(|reply| Command::RemoveLabel { id, number, reply })
    }

    fn recordings(&self) -> Answer<'_, Vec<Recording>> {
        Box::pin(async { read::recordings(&*self.reader.session().await?).await })
    }

    fn members(&self, id: RecordingId) -> Answer<'_, Members> {
        Box::pin(async move {
            let session = self.reader.session().await?;
            let (recording, range) = read::recording(&session, id).await?;
            // A running recording is read up to an end that all collectors keep to.
            let through = match recording.t_stop_ns {
                Some(_) => range.1,
                None => self.queue.ask(|reply| Command::EndEpoch { reply }).await?,
            };
            read::members(&session, id, through).await
        })
    }

    fn page(
        &self,
        span: Span,
        after_seq: Option<u64>,
        rows: usize,
    ) -> Answer<'_, Vec<StoredRecord>> {
        Box::pin(
            async move { read::page(&*self.reader.session().await?, &span, after_seq, rows).await },
        )
    }

    fn news(&self) -> Option<mpsc::Receiver<News>> {
        self.news
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take()
    }

    fn usage(&self) -> Answer<'_, StoreUsage> {
        Box::pin(async {
            Ok(StoreUsage {
                bytes: read::bytes(&*self.reader.session().await?).await?,
                bytes_max: self.limits.store_bytes_max,
                deleted_by_age: 0,
                deleted_by_size: 0,
            })
        })
    }

    fn ping(&self) -> Answer<'_, ()> {
        Box::pin(async move {
            read::ping(&*self.reader.session().await?).await?;
            self.fault.get().map_or(Ok(()), Err)
        })
    }

    fn close(&self) -> Answer<'_, ()> {
        self.queue.close();
        self.follower.abort();
        let writer = self
            .writer
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        Box::pin(async move {
            let Some(writer) = writer else { return Ok(()) };
            writer
                .await
                .map_err(|error| StoreError::Failed(error.to_string()))?;
            self.reader.close().await;
            Ok(())
        })
    }
}

impl Drop for PostgresStore {
    fn drop(&mut self) {
        self.follower.abort();
    }
}
