//! [`PostgresStore`]: a task that writes, a task that follows the other collectors, and a connection that reads.

use crate::limits::Limits;
use crate::lock::lock;
use crate::store::error::{RecordingId, Result, StoreError};
use crate::store::frame_store::FrameStore;
use crate::store::location::PostgresUrl;
use crate::store::postgres::session::{Session, Shared};
use crate::store::postgres::writer::Writer;
use crate::store::postgres::{boundary, follow, read, session};
use crate::store::queue::{Change, Queue, WriteFault};
use crate::store::types::{
    Answer, KeptLabel, Members, News, Recording, Span, StoreUsage, StoredRecord, StreamSummary,
};
use std::sync::Mutex;
use tokio::sync::mpsc;
use tokio::task::JoinHandle;

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
    /// Connects, and creates missing tables. Must be called within a tokio runtime.
    ///
    /// # Errors
    /// [`StoreError::Unreachable`], a later version's tables, and errors of the database.
    pub async fn open(url: &PostgresUrl, limits: &Limits) -> Result<Self> {
        let session = Session::open(url, limits).await?;
        session::prepare(&session).await?;
        let fault = WriteFault::default();
        let writer = Writer::new(limits, session, fault.clone()).await?;
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
    fn queue(&self) -> &Queue {
        &self.queue
    }

    fn streams(&self) -> Answer<'_, Vec<StreamSummary>> {
        Box::pin(async { read::streams(&*self.reader.session().await?, &self.limits).await })
    }

    fn newest(&self) -> Answer<'_, Vec<StoredRecord>> {
        Box::pin(async { read::newest(&*self.reader.session().await?).await })
    }

    fn labels(&self, id: RecordingId) -> Answer<'_, Vec<KeptLabel>> {
        Box::pin(async move { boundary::labels(&*self.reader.session().await?, id).await })
    }

    fn leases(&self) -> Answer<'_, Vec<(RecordingId, i64)>> {
        Box::pin(async { read::leases(&*self.reader.session().await?).await })
    }

    fn recordings(&self) -> Answer<'_, Vec<Recording>> {
        Box::pin(async { read::recordings(&*self.reader.session().await?).await })
    }

    fn members(&self, id: RecordingId) -> Answer<'_, Members> {
        Box::pin(async move {
            let session = self.reader.session().await?;
            let (recording, range) = read::recording(&session, id).await?;
            // A running recording is read up to an epoch's end that all collectors share.
            let through = match recording.t_stop_ns {
                Some(_) => range.1,
                None => self.queue.change(Change::EndEpoch).await?,
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
        lock(&self.news).take()
    }

    fn usage(&self) -> Answer<'_, StoreUsage> {
        let bytes_max = self.limits.store_bytes_max;
        Box::pin(async move { read::usage(&*self.reader.session().await?, bytes_max).await })
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
        let writer = lock(&self.writer).take();
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
