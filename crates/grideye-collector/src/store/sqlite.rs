//! The store in one SQLite file: a thread that writes and shares each sync among all who wait, and connections
//! that read beside it.

mod read;
mod write;

use super::{
    Answer, Appended, FrameStore, Members, Recording, RecordingId, Span, StoreError, StoreLocation,
    StoredRecord, StreamSummary, schema,
};
use crate::Limits;
use grideye_recording::wire::Batch;
use rusqlite::{Connection, ErrorCode, OpenFlags};
use std::fs::OpenOptions;
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::{Semaphore, mpsc, oneshot};
use write::{Command, Writer};

/// Prepared statements that a connection keeps: more than there are in this crate.
const STATEMENTS_MAX: usize = 64;

/// A store in an SQLite file, in WAL mode and synced at every commit.
#[derive(Debug)]
pub struct SqliteStore {
    commands: Mutex<Option<mpsc::Sender<Command>>>,
    writer: Mutex<Option<JoinHandle<()>>>,
    readers: Arc<Mutex<Vec<Connection>>>,
    readers_free: Arc<Semaphore>,
    fault: WriteFault,
    limits: Limits,
}

impl SqliteStore {
    /// Opens the store, or makes it where none is.
    ///
    /// # Errors
    /// [`StoreError::Unusable`], [`StoreError::NotADatabase`], [`StoreError::Foreign`], [`StoreError::Newer`].
    pub fn open(location: &StoreLocation, limits: &Limits) -> Result<Self, StoreError> {
        let place = Place::of(location)?;
        let mut connection = place.connect(limits)?;
        schema::prepare(&mut connection)?;
        let readers = (0..limits.readers_max.max(1))
            .map(|_| place.connect(limits))
            .collect::<Result<Vec<_>, _>>()?;
        let (commands, queue) = mpsc::channel(limits.writer_queue_max.max(1));
        let fault = WriteFault::default();
        let writer = Writer::new(connection, limits.clone(), fault.clone());
        let thread = std::thread::Builder::new()
            .name("store-writer".to_owned())
            .spawn(move || writer.run(queue))
            .map_err(|error| StoreError::Failed(error.to_string()))?;
        Ok(Self {
            commands: Mutex::new(Some(commands)),
            writer: Mutex::new(Some(thread)),
            readers_free: Arc::new(Semaphore::new(readers.len())),
            readers: Arc::new(Mutex::new(readers)),
            fault,
            limits: limits.clone(),
        })
    }

    /// Hands a command to the writer and waits until it is committed.
    fn ask<T: Send + 'static>(
        &self,
        command: impl FnOnce(oneshot::Sender<Result<T, StoreError>>) -> Command,
    ) -> Answer<'_, T> {
        let (reply, answer) = oneshot::channel();
        let sent = {
            let commands = self.commands.lock().unwrap_or_else(PoisonError::into_inner);
            match commands.as_ref() {
                None => Err(StoreError::Closed),
                Some(queue) => queue.try_send(command(reply)).map_err(|error| match error {
                    TrySendError::Full(_) => StoreError::Busy {
                        waiting: queue.max_capacity(),
                    },
                    TrySendError::Closed(_) => StoreError::Closed,
                }),
            }
        };
        Box::pin(async move {
            sent?;
            answer.await.map_err(|_gone| StoreError::Closed)?
        })
    }

    /// Runs a query on a connection of its own, away from the threads that serve requests.
    fn query<T: Send + 'static>(
        &self,
        query: impl FnOnce(&Connection, &Limits) -> Result<T, StoreError> + Send + 'static,
    ) -> Answer<'_, T> {
        let (free, readers) = (Arc::clone(&self.readers_free), Arc::clone(&self.readers));
        let limits = self.limits.clone();
        Box::pin(async move {
            let turn = free
                .acquire_owned()
                .await
                .map_err(|_closed| StoreError::Closed)?;
            let run = move || {
                let _turn = turn;
                let taken = readers.lock().unwrap_or_else(PoisonError::into_inner).pop();
                let connection = taken.ok_or(StoreError::Closed)?;
                let outcome = query(&connection, &limits);
                readers
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .push(connection);
                outcome
            };
            tokio::task::spawn_blocking(run)
                .await
                .map_err(|error| StoreError::Failed(error.to_string()))?
        })
    }
}

impl FrameStore for SqliteStore {
    fn append(&self, batch: Arc<Batch>, t_arrival_ns: i64) -> Answer<'_, Appended> {
        self.ask(|reply| Command::Append {
            batch,
            t_arrival_ns,
            reply,
        })
    }

    fn streams(&self) -> Answer<'_, Vec<StreamSummary>> {
        self.query(read::streams)
    }

    fn newest(&self) -> Answer<'_, Vec<StoredRecord>> {
        self.query(|connection, _| read::newest(connection))
    }

    fn start_recording(&self, name: String, t_start_ns: i64) -> Answer<'_, Recording> {
        self.ask(|reply| Command::Start {
            name,
            t_start_ns,
            reply,
        })
    }

    fn stop_recording(&self, id: RecordingId, t_stop_ns: i64) -> Answer<'_, Recording> {
        self.ask(|reply| Command::Stop {
            id,
            t_stop_ns,
            reply,
        })
    }

    fn recordings(&self) -> Answer<'_, Vec<Recording>> {
        self.query(|connection, _| read::recordings(connection))
    }

    fn members(&self, id: RecordingId) -> Answer<'_, Members> {
        self.query(move |connection, _| read::members(connection, id))
    }

    fn page(
        &self,
        span: Span,
        after_seq: Option<u64>,
        rows: usize,
    ) -> Answer<'_, Vec<StoredRecord>> {
        self.query(move |connection, _| read::page(connection, &span, after_seq, rows))
    }

    fn ping(&self) -> Answer<'_, ()> {
        let readable = self.query(|connection, _| read::ping(connection));
        Box::pin(async move {
            readable.await?;
            self.fault.get().map_or(Ok(()), Err)
        })
    }

    fn close(&self) -> Answer<'_, ()> {
        let commands = self
            .commands
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        let writer = self
            .writer
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        Box::pin(async move {
            // The writer ends when the last sender is gone and the queue is empty.
            drop(commands);
            let Some(writer) = writer else { return Ok(()) };
            tokio::task::spawn_blocking(move || writer.join())
                .await
                .map_err(|error| StoreError::Failed(error.to_string()))?
                .map_err(|_panic| StoreError::Failed("the writer's thread panicked".to_owned()))?;
            self.readers_free.close();
            self.readers
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .clear();
            Ok(())
        })
    }
}

/// Why the last write failed; nothing after one that went well.
#[derive(Debug, Clone, Default)]
struct WriteFault(Arc<Mutex<Option<StoreError>>>);

impl WriteFault {
    fn get(&self) -> Option<StoreError> {
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    fn set(&self, fault: Option<StoreError>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = fault;
    }
}

/// What every connection of one store opens.
struct Place {
    name: String,
    flags: OpenFlags,
    on_disk: bool,
}

impl Place {
    fn of(location: &StoreLocation) -> Result<Self, StoreError> {
        let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        match location {
            StoreLocation::File(path) => {
                make_file(path)?;
                let name = path.to_str().ok_or_else(|| StoreError::Unusable {
                    message: "the path is not UTF-8".to_owned(),
                })?;
                Ok(Self {
                    name: name.to_owned(),
                    flags,
                    on_disk: true,
                })
            }
            StoreLocation::Memory => {
                static STORES: AtomicU64 = AtomicU64::new(0);
                let number = STORES.fetch_add(1, Ordering::Relaxed);
                Ok(Self {
                    name: format!("file:/grideye-{number}?vfs=memdb"),
                    flags: flags | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_CREATE,
                    on_disk: false,
                })
            }
        }
    }

    fn connect(&self, limits: &Limits) -> Result<Connection, StoreError> {
        let connection = Connection::open_with_flags(&self.name, self.flags)?;
        connection.busy_timeout(limits.store_lock_time_max)?;
        connection.set_prepared_statement_cache_capacity(STATEMENTS_MAX);
        if self.on_disk {
            // The change to WAL is written into the file, so it must be ours.
            schema::recognise(&connection)?;
            connection.pragma_update(None, "journal_mode", "WAL")?;
        }
        connection.pragma_update(None, "synchronous", "FULL")?;
        connection.pragma_update(None, "foreign_keys", true)?;
        Ok(connection)
    }
}

/// Makes an empty file that only this user may read, or finds that the one there may be written.
fn make_file(path: &Path) -> Result<(), StoreError> {
    let opened = OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .mode(0o600)
        .open(path);
    let unusable = |error: io::Error| StoreError::Unusable {
        message: error.to_string(),
    };
    let file = opened.map_err(unusable)?;
    if file.metadata().map_err(unusable)?.is_file() {
        return Ok(());
    }
    Err(StoreError::Unusable {
        message: "it is not a plain file".to_owned(),
    })
}

impl From<rusqlite::Error> for StoreError {
    fn from(error: rusqlite::Error) -> Self {
        match error.sqlite_error_code() {
            Some(ErrorCode::DiskFull) => Self::Full,
            Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => Self::Locked,
            Some(ErrorCode::NotADatabase) => Self::NotADatabase,
            Some(ErrorCode::CannotOpen | ErrorCode::ReadOnly | ErrorCode::PermissionDenied) => {
                Self::Unusable {
                    message: error.to_string(),
                }
            }
            _ => Self::Failed(error.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_commit_to_a_file_is_synced() {
        let folder = tempfile::tempdir().unwrap();
        let location = StoreLocation::File(folder.path().join("frames.sqlite"));
        let connection = Place::of(&location)
            .unwrap()
            .connect(&Limits::default())
            .unwrap();
        let text =
            |pragma| connection.pragma_query_value(None, pragma, |row| row.get::<_, String>(0));
        let number =
            |pragma| connection.pragma_query_value(None, pragma, |row| row.get::<_, i64>(0));
        assert_eq!(text("journal_mode").unwrap(), "wal");
        // 2 is FULL: the log is synced at every commit (https://sqlite.org/pragma.html#pragma_synchronous).
        assert_eq!(number("synchronous").unwrap(), 2);
    }

    #[test]
    fn a_full_disk_is_told_from_other_faults() {
        let fault = |code| {
            StoreError::from(rusqlite::Error::SqliteFailure(
                rusqlite::ffi::Error::new(code),
                None,
            ))
        };
        assert!(matches!(
            fault(rusqlite::ffi::SQLITE_FULL),
            StoreError::Full
        ));
        assert!(matches!(
            fault(rusqlite::ffi::SQLITE_IOERR),
            StoreError::Failed(_)
        ));
        assert!(matches!(
            fault(rusqlite::ffi::SQLITE_READONLY),
            StoreError::Unusable { .. }
        ));
    }
}
