//! [`SqliteStore`]: a thread that writes and shares each sync among all waiting requests, and connections that read in
//! parallel.

use crate::clock::Clock;
use crate::counters::load;
use crate::limits::Limits;
use crate::lock::lock;
use crate::log::{Level, Log, LogEvent};
use crate::store::error::{RecordingId, Result, StoreError};
use crate::store::frame_store::FrameStore;
use crate::store::location::StoreLocation;
use crate::store::queue::{Change, Queue, WriteFault};
use crate::store::sqlite::place::{Held, Place, Presence};
use crate::store::sqlite::retain::DeletedCounts;
use crate::store::sqlite::time::StoreTime;
use crate::store::sqlite::write::Writer;
use crate::store::sqlite::{backup, labels, read, schema};
use crate::store::types::{
    Answer, KeptLabel, Members, Recording, Span, StoreUsage, StoredRecord, StreamSummary,
};
use rusqlite::Connection;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use tokio::sync::Semaphore;

/// The writer's page cache. At each commit after a page was split, SQLite visits every page in it, so a larger one costs
/// more than it saves.
const CACHE_KIB: i64 = 4 * 1024;

/// A store in an SQLite file, in WAL mode and synced at every commit.
#[derive(Debug)]
pub struct SqliteStore {
    queue: Queue,
    writer: Mutex<Option<JoinHandle<Result<()>>>>,
    readers: Arc<Mutex<Vec<Connection>>>,
    readers_free: Arc<Semaphore>,
    fault: WriteFault,
    deleted: Arc<DeletedCounts>,
    limits: Limits,
    /// Closed last: closing any descriptor of a file releases SQLite's locks on it.
    held: Option<Arc<Held>>,
}

impl SqliteStore {
    /// Opens the store, or creates it. Without a clock nothing ages, so nothing is sealed or deleted.
    ///
    /// # Errors
    /// As [`SqliteStore::open_tended`].
    pub fn open(location: &StoreLocation, limits: &Limits) -> Result<Self> {
        Self::open_with(location, limits, None, &Log::silent())
    }

    /// Opens the store, or creates it. Frames age by the clock's monotonic time; deletions are logged. A file of an
    /// older layout is copied, then upgraded.
    ///
    /// # Errors
    /// [`StoreError`]: the file cannot be opened, holds something else, or cannot be copied before the upgrade.
    pub fn open_tended(
        location: &StoreLocation,
        limits: &Limits,
        clock: &Arc<dyn Clock>,
        log: &Log,
    ) -> Result<Self> {
        Self::open_with(location, limits, Some(Arc::clone(clock)), log)
    }

    fn open_with(
        location: &StoreLocation,
        limits: &Limits,
        clock: Option<Arc<dyn Clock>>,
        log: &Log,
    ) -> Result<Self> {
        let mut place = Place::of(location, limits, log)?;
        let mut connection = place.connect(limits)?;
        if let Some(upgraded) = backup::prepare(&mut connection, Path::new(&place.name))? {
            log.say(
                &LogEvent::new(Level::Info, "store_upgraded")
                    .with("from", upgraded.from)
                    .with("to", schema::LAYOUT)
                    .with("backup", upgraded.backup.display()),
            );
        }
        if let Some(bytes_max) = limits.store_bytes_max {
            set_quota(&connection, bytes_max)?;
        }
        connection.pragma_update(None, "wal_autocheckpoint", 0)?;
        connection.pragma_update(None, "cache_size", -CACHE_KIB)?;
        let readers = (0..limits.readers_max.max(1))
            .map(|_| place.connect(limits))
            .collect::<Result<Vec<_>, _>>()?;
        let held = place.hold(&connection)?.map(Arc::new);
        let (queue, commands) = Queue::new(limits.writer_queue_max);
        let fault = WriteFault::default();
        let time = StoreTime::open(&connection, clock)?;
        let presence = Presence::new(held.clone(), log.clone());
        let writer = Writer::new(
            (connection, presence),
            limits.clone(),
            fault.clone(),
            time,
            log.clone(),
        );
        writer.try_to_write();
        let deleted = writer.deleted();
        let thread = std::thread::Builder::new()
            .name("store-writer".to_owned())
            .spawn(move || writer.run(commands))
            .map_err(|error| StoreError::Failed(error.to_string()))?;
        Ok(Self {
            queue,
            writer: Mutex::new(Some(thread)),
            readers_free: Arc::new(Semaphore::new(readers.len())),
            readers: Arc::new(Mutex::new(readers)),
            fault,
            deleted,
            limits: limits.clone(),
            held,
        })
    }

    /// Queries everything acknowledged so far. If the file cannot be written, queries only what the tables have.
    fn query_settled<T: Send + 'static>(
        &self,
        query: impl FnOnce(&Connection, &Limits) -> Result<T> + Send + 'static,
    ) -> Answer<'_, T> {
        Box::pin(async move {
            let settled = self.queue.change(Change::Settle);
            if let Err(error @ (StoreError::Busy { .. } | StoreError::Closed)) = settled.await {
                return Err(error);
            }
            self.query(query).await
        })
    }

    /// Runs a query on a connection of its own, off the threads that serve requests.
    fn query<T: Send + 'static>(
        &self,
        query: impl FnOnce(&Connection, &Limits) -> Result<T> + Send + 'static,
    ) -> Answer<'_, T> {
        let (free, readers) = (Arc::clone(&self.readers_free), Arc::clone(&self.readers));
        let (limits, held) = (self.limits.clone(), self.held.clone());
        Box::pin(async move {
            let turn = free
                .acquire_owned()
                .await
                .map_err(|_closed| StoreError::Closed)?;
            let run = move || {
                let _turn = turn;
                let readers = || lock(&readers);
                let taken = readers().pop();
                let connection = taken.ok_or(StoreError::Closed)?;
                let outcome = query(&connection, &limits);
                if let Some(held) = held {
                    held.keep_log_if_overwritten(&connection)?;
                }
                readers().push(connection);
                outcome
            };
            tokio::task::spawn_blocking(run)
                .await
                .map_err(|error| StoreError::Failed(error.to_string()))?
        })
    }
}

impl FrameStore for SqliteStore {
    fn queue(&self) -> &Queue {
        &self.queue
    }

    fn streams(&self) -> Answer<'_, Vec<StreamSummary>> {
        self.query_settled(read::streams)
    }

    fn newest(&self) -> Answer<'_, Vec<StoredRecord>> {
        self.query_settled(|connection, _| read::newest(connection))
    }

    fn labels(&self, id: RecordingId) -> Answer<'_, Vec<KeptLabel>> {
        self.query(move |connection, _| labels::all(connection, id))
    }

    fn leases(&self) -> Answer<'_, Vec<(RecordingId, i64)>> {
        self.query(|connection, _| read::leases(connection))
    }

    fn recordings(&self) -> Answer<'_, Vec<Recording>> {
        self.query_settled(|connection, _| read::recordings(connection))
    }

    fn members(&self, id: RecordingId) -> Answer<'_, Members> {
        Box::pin(async move {
            let stopped = self.query(move |connection, _| read::recording(connection, id));
            // A running recording is read up to an epoch's end; later frames belong to the next epoch.
            let through = match stopped.await?.t_stop_ns {
                Some(_) => i64::MAX,
                None => self.queue.change(Change::EndEpoch).await?,
            };
            self.query(move |connection, _| read::members(connection, id, through))
                .await
        })
    }

    fn page(
        &self,
        span: Span,
        after_seq: Option<u64>,
        rows: usize,
    ) -> Answer<'_, Vec<StoredRecord>> {
        self.query(move |connection, _| read::page(connection, &span, after_seq, rows))
    }

    fn usage(&self) -> Answer<'_, StoreUsage> {
        let deleted = Arc::clone(&self.deleted);
        self.query(move |connection, limits| {
            let (recordings, streams) = read::counts(connection)?;
            Ok(StoreUsage {
                bytes: read::bytes(connection)?,
                bytes_max: limits.store_bytes_max,
                deleted_by_age: load(&deleted.by_age),
                deleted_by_size: load(&deleted.by_size),
                held: load(&deleted.held),
                recordings,
                streams,
            })
        })
    }

    fn ping(&self) -> Answer<'_, ()> {
        let held = self.held.clone();
        let readable = self.query(move |connection, _| {
            // First: what is wrong with the file explains why it cannot be read.
            held.map_or(Ok(()), |held| held.check(connection))?;
            read::ping(connection)
        });
        Box::pin(async move {
            readable.await?;
            match self.fault.get() {
                // The check above passed, so the file is back.
                None | Some(StoreError::Gone { .. }) => Ok(()),
                Some(fault) => Err(fault),
            }
        })
    }

    fn close(&self) -> Answer<'_, ()> {
        self.queue.close();
        let writer = lock(&self.writer).take();
        Box::pin(async move {
            let Some(writer) = writer else { return Ok(()) };
            let ended = tokio::task::spawn_blocking(move || writer.join())
                .await
                .map_err(|error| StoreError::Failed(error.to_string()))?
                .map_err(|_panic| StoreError::Failed("the writer's thread panicked".to_owned()))?;
            self.close_readers();
            ended
        })
    }
}

impl SqliteStore {
    /// Closes the connections that read, and lets a restore have the file.
    fn close_readers(&self) {
        self.readers_free.close();
        let readers = std::mem::take(&mut *lock(&self.readers));
        let Some(held) = &self.held else { return };
        for reader in &readers {
            let _ = held.keep_log_if_overwritten(reader);
        }
        drop(readers);
        held.release();
    }
}

impl Drop for SqliteStore {
    fn drop(&mut self) {
        self.queue.close();
        if let Some(writer) = lock(&self.writer).take() {
            let _ = writer.join();
            self.close_readers();
        }
    }
}

/// SQLite's limit is in pages. It does not shrink a file that is already larger; the store then takes no more frames.
fn set_quota(connection: &Connection, bytes_max: u64) -> Result<()> {
    let page: i64 = connection.pragma_query_value(None, "page_size", |row| row.get(0))?;
    let pages_max = i64::try_from(bytes_max).unwrap_or(i64::MAX) / page.max(1);
    // The pragma takes no parameter, and returns the limit in force.
    let pragma = format!("PRAGMA max_page_count = {}", pages_max.max(1));
    connection.query_row(&pragma, [], |_| Ok(()))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn readers_beyond_the_limit_wait() {
        let limits = Limits {
            readers_max: 2,
            ..Limits::default()
        };
        let store = SqliteStore::open(&StoreLocation::Memory, &limits).unwrap();
        let first = Arc::clone(&store.readers_free).try_acquire_owned().unwrap();
        assert_eq!(store.streams().await.unwrap(), [], "one is left");
        let second = Arc::clone(&store.readers_free).try_acquire_owned().unwrap();
        assert!(store.readers_free.try_acquire().is_err());
        let mut third = store.streams();
        let wait = std::time::Duration::from_millis(50);
        assert!(tokio::time::timeout(wait, &mut third).await.is_err());
        drop((first, second));
        assert_eq!(third.await.unwrap(), []);
    }
}
