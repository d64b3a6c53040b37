//! A disk that forgets unsynced data, tears interrupted writes, fills, and fails.

use grideye_agent::spool::Disk;
use std::collections::BTreeMap;
use std::io;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// How a disk fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Failure {
    /// Writes fail for lack of space.
    Full,
    /// Writes fail permanently.
    ReadOnly,
    /// Writes succeed, syncs fail.
    Sync,
    /// Everything fails.
    Io,
}

impl Failure {
    fn error(self) -> io::Error {
        io::Error::from_raw_os_error(match self {
            Self::Full => 28,
            Self::ReadOnly => 30,
            Self::Sync | Self::Io => 5,
        })
    }
}

/// What a power cut does to unsynced bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tear {
    /// All are lost.
    Lost,
    /// All are there.
    Kept,
    /// This percentage of them is there, and nothing after.
    Cut(usize),
    /// The file has its full length, with zeros after this percentage of them.
    Zeros(usize),
}

#[derive(Debug, Default, Clone)]
struct File {
    bytes: Vec<u8>,
    synced: usize,
}

#[derive(Debug, Default)]
struct Inner {
    /// The names on the disk, each with its file.
    durable: BTreeMap<String, u64>,
    names: BTreeMap<String, u64>,
    stored: BTreeMap<u64, File>,
    next: u64,
    operations: u64,
    dies_at: Option<u64>,
    failure: Option<Failure>,
    free: Option<u64>,
    sync_takes: Duration,
}

/// One disk with shared ownership.
#[derive(Debug, Clone, Default)]
pub(crate) struct ModelDisk(Arc<Mutex<Inner>>);

impl ModelDisk {
    /// The power fails at this operation: it and all later ones fail.
    pub(crate) fn die_at(&self, operation: u64) {
        self.with(|inner| inner.dies_at = Some(operation));
    }

    pub(crate) fn operations(&self) -> u64 {
        self.with(|inner| inner.operations)
    }

    pub(crate) fn fail(&self, failure: Option<Failure>) {
        self.with(|inner| inner.failure = failure);
    }

    /// From now on a sync takes this long.
    pub(crate) fn slow_down(&self, sync_takes: Duration) {
        self.with(|inner| inner.sync_takes = sync_takes);
    }

    pub(crate) fn leave_free(&self, bytes: u64) {
        self.with(|inner| inner.free = Some(bytes));
    }

    /// Restores power. Unsynced data is torn this way; unsynced names survive if `keeps_names`.
    pub(crate) fn power_cycle(&self, tear: Tear, keeps_names: bool) {
        self.with(|inner| {
            let names = if keeps_names {
                inner.names.clone()
            } else {
                inner.durable.clone()
            };
            for file in inner.stored.values_mut() {
                let pending = file.bytes.len() - file.synced;
                let part = |percent: usize| file.synced + pending * percent / 100;
                match tear {
                    Tear::Lost => file.bytes.truncate(file.synced),
                    Tear::Kept => {}
                    Tear::Cut(percent) => file.bytes.truncate(part(percent)),
                    Tear::Zeros(percent) => {
                        let from = part(percent);
                        file.bytes[from..].fill(0);
                    }
                }
                file.synced = file.bytes.len();
            }
            inner.durable = names.clone();
            inner.names = names;
            (inner.dies_at, inner.failure, inner.operations) = (None, None, 0);
        });
    }

    pub(crate) fn names(&self) -> Vec<String> {
        self.with(|inner| inner.names.keys().cloned().collect())
    }

    pub(crate) fn bytes(&self, name: &str) -> Vec<u8> {
        self.with(|inner| inner.stored[&inner.names[name]].bytes.clone())
    }

    /// Puts a file on the disk as if it had always been there.
    pub(crate) fn put(&self, name: &str, bytes: &[u8]) {
        self.with(|inner| {
            let number = inner.next;
            inner.next += 1;
            let synced = bytes.len();
            inner.stored.insert(
                number,
                File {
                    bytes: bytes.to_vec(),
                    synced,
                },
            );
            inner.names.insert(name.to_owned(), number);
            inner.durable.insert(name.to_owned(), number);
        });
    }

    fn with<T>(&self, work: impl FnOnce(&mut Inner) -> T) -> T {
        work(&mut self.0.lock().unwrap())
    }
}

impl Inner {
    fn begin(&mut self, is_sync: bool) -> io::Result<()> {
        let number = self.operations;
        self.operations += 1;
        if self.dies_at.is_some_and(|dies_at| number >= dies_at) {
            return Err(Failure::Io.error());
        }
        match self.failure {
            Some(Failure::Sync) if !is_sync => Ok(()),
            Some(failure) => Err(failure.error()),
            None => Ok(()),
        }
    }

    fn look(&self, name: &str) -> io::Result<&File> {
        let number = self.names.get(name).ok_or(io::ErrorKind::NotFound)?;
        self.stored
            .get(number)
            .ok_or(io::ErrorKind::NotFound.into())
    }

    fn file(&mut self, name: &str) -> &mut File {
        let next = self.next;
        let number = *self.names.entry(name.to_owned()).or_insert(next);
        if number == next {
            self.next += 1;
        }
        self.stored.entry(number).or_default()
    }

    /// A power cut interrupts its operation halfway.
    fn add(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        let is_last = self.dies_at == Some(self.operations);
        let begun = self.begin(false);
        if is_last {
            self.file(name).bytes.extend(&bytes[..bytes.len() / 2]);
        }
        begun?;
        self.file(name).bytes.extend(bytes);
        Ok(())
    }
}

impl Disk for ModelDisk {
    fn list(&self) -> io::Result<Vec<String>> {
        Ok(self.names())
    }

    fn size(&self, name: &str) -> io::Result<u64> {
        self.with(|inner| Ok(u64::try_from(inner.look(name)?.bytes.len()).unwrap()))
    }

    fn read(&self, name: &str, offset: u64, len: usize) -> io::Result<Vec<u8>> {
        self.with(|inner| {
            if inner.failure == Some(Failure::Io) {
                return Err(Failure::Io.error());
            }
            let bytes = &inner.look(name)?.bytes;
            let from = usize::try_from(offset).unwrap().min(bytes.len());
            let to = from.saturating_add(len).min(bytes.len());
            Ok(bytes[from..to].to_vec())
        })
    }

    fn write(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        self.with(|inner| {
            if inner
                .dies_at
                .is_none_or(|dies_at| inner.operations <= dies_at)
            {
                // Overwriting makes a new file: the old one leaves the disk with its name.
                let file = inner.file(name);
                *file = File::default();
            }
            inner.add(name, bytes)
        })
    }

    fn append(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        self.with(|inner| inner.add(name, bytes))
    }

    fn sync(&mut self, name: &str) -> io::Result<()> {
        std::thread::sleep(self.with(|inner| inner.sync_takes));
        self.with(|inner| {
            inner.begin(true)?;
            let file = inner.file(name);
            file.synced = file.bytes.len();
            Ok(())
        })
    }

    fn rename(&mut self, from: &str, to: &str) -> io::Result<()> {
        self.with(|inner| {
            inner.begin(false)?;
            let number = inner.names.remove(from).ok_or(io::ErrorKind::NotFound)?;
            inner.names.insert(to.to_owned(), number);
            Ok(())
        })
    }

    fn remove(&mut self, name: &str) -> io::Result<()> {
        self.with(|inner| {
            inner.begin(false)?;
            inner.names.remove(name).ok_or(io::ErrorKind::NotFound)?;
            Ok(())
        })
    }

    fn sync_folder(&mut self) -> io::Result<()> {
        self.with(|inner| {
            inner.begin(true)?;
            inner.durable = inner.names.clone();
            Ok(())
        })
    }

    fn free_bytes(&self) -> io::Result<u64> {
        self.with(|inner| Ok(inner.free.unwrap_or(u64::MAX)))
    }
}
