//! The spooler: writes records that wait too long from memory to the disk, and removes segments no longer needed. It
//! has its own thread, so that a slow card delays neither the buses nor the posts.

use crate::batch::Item;
use crate::config::SpoolMode;
use crate::limits::{LIVE_FOR, LOOK_EVERY, SYNC_MAX};
use crate::log::Log;
use crate::queue::Shared;
use crate::spool::{FolderError, READS_MAX, SPOOL_FULL, Spool};
use std::io;
use std::sync::Arc;
use std::time::Duration;

/// Maximum records per write; each write is synced.
pub const WRITE_RECORDS_MAX: usize = 5000;
/// Maximum writes in a row before anything else gets a turn.
pub const WRITES_MAX: usize = 4;
/// The pause after a failed write.
pub const DISK_RETRY: Duration = Duration::from_secs(5);
/// The pause before another attempt to open the spool.
pub const OPEN_RETRY: Duration = Duration::from_secs(60);

/// How often to look whether what waits on the disk can be read.
const LOOK_AT_DISK_EVERY: Duration = Duration::from_secs(10);

/// Time for other threads to lock the spool when the disk takes longer than the interval between looks.
const BREATH: Duration = Duration::from_millis(10);
/// Writes the spool of a running agent.
pub struct Spooler {
    shared: Arc<Shared>,
    mode: SpoolMode,
    log: Log,
    retry_at: Duration,
    look_at: Duration,
    said: Option<String>,
    synced_at: Option<Duration>,
    slowest: Duration,
    opener: Option<Opener>,
}

/// Opens a spool.
pub type Opener = Box<dyn FnMut() -> Result<Spool, FolderError> + Send>;

impl Spooler {
    /// A spooler for the shared spool, if there is one.
    #[must_use]
    pub fn new(shared: Arc<Shared>, mode: SpoolMode, log: Log) -> Self {
        Self {
            shared,
            mode,
            log,
            retry_at: Duration::ZERO,
            look_at: Duration::ZERO,
            said: None,
            synced_at: None,
            slowest: SYNC_MAX,
            opener: None,
        }
    }

    /// Opens the spool. If the disk fails, logs it and retries later.
    ///
    /// # Errors
    /// [`FolderError::Locked`] if another agent uses it, [`FolderError::Newer`] if a later version wrote it.
    pub fn open(&mut self, mut opener: Opener) -> Result<(), FolderError> {
        match opener() {
            Ok(spool) => {
                *self.shared.spool() = Some(spool);
                self.opener = None;
                if self.said.take().is_some() {
                    self.log.info("the spool takes frames again");
                }
                Ok(())
            }
            Err(FolderError::Unusable(folder, error)) => {
                let what = format!("{}: {error}", folder.display());
                self.failed(self.shared.now(), &io::Error::new(error.kind(), what));
                self.retry_at = self.shared.now() + OPEN_RETRY;
                self.opener = Some(opener);
                Ok(())
            }
            Err(refused) => Err(refused),
        }
    }

    fn open_again(&mut self, now: Duration) {
        if now < self.retry_at {
            return;
        }
        let refused = self.opener.take().map(|opener| self.open(opener));
        if let Some(Err(refused)) = refused {
            self.log.error(refused.to_string());
        }
    }

    /// Works until told to end, then writes the rest of memory to the disk.
    pub fn run(&mut self) {
        let mut pause = self.pause();
        while !self.shared.waits_for_spooler(pause) {
            let began = self.shared.now();
            self.step(began);
            // Keep the interval between looks however long the disk took; else its time would be lost twice.
            let took = self.shared.now().saturating_sub(began);
            pause = self.pause().saturating_sub(took).max(BREATH);
        }
        self.finish(self.shared.now());
    }

    fn pause(&self) -> Duration {
        match self.mode {
            SpoolMode::Always { sync_every: time } | SpoolMode::Outage { after: time } => {
                LOOK_EVERY.min(time)
            }
            SpoolMode::Ram => LOOK_EVERY,
        }
    }

    /// Does the work due at `now`.
    pub fn step(&mut self, now: Duration) {
        let older_than = match self.mode {
            SpoolMode::Ram => return,
            SpoolMode::Outage { after } => after,
            SpoolMode::Always { .. } => Duration::ZERO,
        };
        self.open_again(now);
        let shared = Arc::clone(&self.shared);
        let mut spool = shared.spool();
        let Some(spool) = spool.as_mut() else { return };
        if now >= self.retry_at && self.is_sync_due(now) {
            self.write(spool, now, older_than);
        }
        spool.recover();
        if now >= self.look_at {
            self.look_at = now + LOOK_AT_DISK_EVERY;
            spool.look();
        }
        self.reconcile(spool, &[]);
        self.clear_up(spool, now);
    }

    fn is_sync_due(&self, now: Duration) -> bool {
        match (self.mode, self.synced_at) {
            (SpoolMode::Always { sync_every }, Some(at)) => now >= at + sync_every,
            _ => true,
        }
    }

    /// Writes what is due. Each write is taken in before the next, so that in a full spool the oldest make room.
    fn write(&mut self, spool: &mut Spool, now: Duration, older_than: Duration) {
        for _ in 0..WRITES_MAX {
            let (records, accounts) = self.shared.with_ring(|ring| {
                let records = ring.claim(now, older_than, WRITE_RECORDS_MAX);
                (records, ring.stream_accounts())
            });
            if records.is_empty() {
                return;
            }
            self.synced_at = Some(now);
            let began = self.shared.now();
            let written = spool.write(&records, &accounts);
            self.hold_to_time(self.shared.now().saturating_sub(began));
            let is_done = written.error.is_some() || records.len() < WRITE_RECORDS_MAX;
            self.reconcile(spool, &records[..written.records]);
            match written.error {
                Some(error) => self.failed(now, &error),
                None if self.said.take().is_some() => self.log.info("the spool takes frames again"),
                None => {}
            }
            if is_done {
                return;
            }
        }
    }

    /// Counts a write slower than the stated guarantee allows. Logs the first, and each that is twice as slow as the
    /// last one logged.
    fn hold_to_time(&mut self, took: Duration) {
        if took <= SYNC_MAX {
            return;
        }
        self.shared
            .with_ring(|ring| ring.count_fault_of_all(SPOOL_SLOW));
        if self.slowest > SYNC_MAX && took < 2 * self.slowest {
            return;
        }
        self.slowest = took;
        self.log.warning(format!(
            "the spool's disk took {:.2} s for a write: a power cut could lose that much data (limit: {:.3} s)\nhint: see what else writes to the card; a card that is often this slow is worn out",
            took.as_secs_f64(),
            SYNC_MAX.as_secs_f64()
        ));
    }

    /// Brings ring and spool up to date with each other, and logs what was dropped.
    fn reconcile(&self, spool: &mut Spool, written: &[Item]) {
        let dropped = self.shared.reconcile(spool, written);
        let full = dropped
            .iter()
            .filter(|dropped| dropped.reason == SPOOL_FULL);
        let frames: u64 = full.map(|dropped| dropped.content.frames).sum();
        if frames > 0 {
            self.log.error(format!(
                "the spool is full: the oldest {frames} frames of the backlog were dropped\nhint: raise spool.mib_max, or find out why the collector is away"
            ));
        }
    }

    fn failed(&mut self, now: Duration, error: &io::Error) {
        self.retry_at = now + DISK_RETRY;
        let (kind, hint) = kind_and_hint(error);
        self.shared.with_ring(|ring| ring.count_fault_of_all(kind));
        let why = error.to_string();
        if self.said.as_ref() != Some(&why) {
            self.log.error(format!(
                "the spool cannot be written: {why}; the frames stay in memory\nhint: {hint}"
            ));
            self.said = Some(why);
        }
    }

    /// Removes what is on the disk and no longer live from memory, and unused segments, and logs the spool's messages.
    fn clear_up(&mut self, spool: &mut Spool, now: Duration) {
        let older_than = match self.mode {
            SpoolMode::Always { .. } => LIVE_FOR,
            // Everything written was too old for memory, or came after such a record.
            SpoolMode::Outage { .. } | SpoolMode::Ram => Duration::ZERO,
        };
        self.shared.with_ring(|ring| ring.evict(now, older_than));
        let keeps_writing = matches!(self.mode, SpoolMode::Always { .. });
        if let Err(error) = spool.tidy(keeps_writing) {
            self.failed(now, &error);
        }
        for message in spool.take_messages() {
            self.log.warning(message);
        }
    }

    /// Writes everything in memory to the disk, and saves where the next start begins.
    pub fn finish(&mut self, now: Duration) {
        if self.mode == SpoolMode::Ram {
            return;
        }
        let shared = Arc::clone(&self.shared);
        let mut spool = shared.spool();
        let Some(spool) = spool.as_mut() else { return };
        let rounds = shared.with_ring(|ring| ring.len()) / (WRITES_MAX * WRITE_RECORDS_MAX);
        for _ in 0..=rounds {
            self.write(spool, now, Duration::ZERO);
        }
        for _ in 0..READS_MAX {
            spool.look();
        }
        self.reconcile(spool, &[]);
        let accounts = shared.with_ring(|ring| {
            ring.evict(now, Duration::ZERO);
            ring.stream_accounts()
        });
        let tidied = spool.tidy(false);
        let closed = tidied.and_then(|()| spool.checkpoint(&accounts));
        if closed.is_err() {
            self.log.warning("the spool's state could not be written: the next start may send some frames again, which is harmless");
        }
    }
}

/// The count of writes that found the spool's disk full.
pub const SPOOL_DISK_FULL: &str = "spool-disk-full";
/// The count of writes that the spool's folder did not allow.
pub const SPOOL_READ_ONLY: &str = "spool-read-only";
/// The count of writes that failed for another reason.
pub const SPOOL_FAILED: &str = "spool-failed";

/// The count of writes slower than [`SYNC_MAX`].
pub const SPOOL_SLOW: &str = "spool-slow";

/// The name that counts a disk failure, and how to fix it.
fn kind_and_hint(error: &io::Error) -> (&'static str, &'static str) {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => (
            SPOOL_DISK_FULL,
            "make room on the disk, or lower spool.free_mib_min",
        ),
        io::ErrorKind::ReadOnlyFilesystem | io::ErrorKind::PermissionDenied => (
            SPOOL_READ_ONLY,
            "make the folder writable; a card that turned read-only is worn out (see `dmesg`)",
        ),
        _ => (SPOOL_FAILED, "see `dmesg`: a card with errors is worn out"),
    }
}
