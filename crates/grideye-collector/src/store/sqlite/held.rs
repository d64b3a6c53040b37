//! Whether the path of a store still names the file that is written.
//!
//! A file can be deleted, moved or replaced while a program writes it: every write goes on to succeed, into a file that
//! nobody finds again. So the writer looks after each commit and before it answers: two calls of the system. While the file
//! is gone nothing more is written, so that what the system still holds of it can be copied; every post looks again.

use crate::log::{Level, Log, LogEvent};
use crate::store::error::StoreError;
use rusqlite::Connection;
use std::fs::File;
use std::io;
use std::os::fd::AsRawFd as _;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What the database is called in messages, and its log.
const FILE: &str = "file";
const LOG: &str = "log";

/// The database and its log, as they were when the store was opened.
#[derive(Debug)]
pub(super) struct Held {
    file: Part,
    log: Part,
}

/// A file, and where it was. It is held open, so that no other file can get its number.
#[derive(Debug)]
struct Part {
    name: &'static str,
    path: PathBuf,
    held: File,
    identity: (u64, u64),
}

impl Held {
    /// Takes note of the file that was opened at `path`, and of the log of the connection to it.
    pub(super) fn new(path: &Path, file: File, connection: &Connection) -> io::Result<Self> {
        let log = PathBuf::from(format!("{}-wal", connection.path().unwrap_or_default()));
        let held = Self {
            file: Part::new(FILE, std::path::absolute(path)?, file)?,
            log: Part::new(LOG, log.clone(), File::open(&log)?)?,
        };
        Ok(held)
    }

    pub(super) fn check(&self) -> Result<(), StoreError> {
        self.file.check()?;
        self.log.check()
    }

    fn event(&self, part: &'static str, fate: &'static str, is_folded: bool) -> LogEvent {
        let (file, log) = (self.file.path.display(), self.log.path.display());
        let (at_risk, hint) = if part == LOG {
            let at_risk = if is_folded {
                "nothing that was acknowledged: the file has all that its log held".to_owned()
            } else {
                "the frames of the last seconds: only the log has them".to_owned()
            };
            let hint = "stop this program and start it again, or put the log back if it was moved";
            (at_risk, hint.to_owned())
        } else if self.file.is_linked() {
            let at_risk = format!("the newest frames, for whoever opens the file without {log}");
            let hint = format!(
                "put it back to {file}: this program then goes on by itself; to leave it where it is, stop this program, which folds {log} into it"
            );
            (at_risk, hint)
        } else {
            let at_risk = "every frame of the store: the file is lost when this program ends";
            let folder = format!("/proc/{}/fd", std::process::id());
            let (file, log) = (self.file.held.as_raw_fd(), self.log.held.as_raw_fd());
            let hint = format!(
                "copy it now: cp {folder}/{file} SAVED && cp {folder}/{log} SAVED-wal; then stop this program, and start it with --store SAVED"
            );
            (at_risk.to_owned(), hint)
        };
        LogEvent::new(Level::Error, "store_gone")
            .with("store", file)
            .with(
                "what",
                format!("the store's {part} was {fate}; no frame is acknowledged"),
            )
            .with("at_risk", at_risk)
            .with("hint", hint)
    }
}

impl Part {
    fn new(name: &'static str, path: PathBuf, held: File) -> io::Result<Self> {
        let metadata = held.metadata()?;
        Ok(Self {
            name,
            path,
            held,
            identity: (metadata.dev(), metadata.ino()),
        })
    }

    fn check(&self) -> Result<(), StoreError> {
        let there = std::fs::metadata(&self.path);
        let fate = match there.map(|there| (there.dev(), there.ino())) {
            Ok(identity) if identity == self.identity => return Ok(()),
            Ok(_other) => "replaced by another file",
            Err(error) if error.kind() != io::ErrorKind::NotFound => "made unreachable",
            Err(_) if self.is_linked() => "moved away",
            Err(_) => "deleted",
        };
        Err(StoreError::Gone {
            part: self.name,
            fate,
        })
    }

    fn is_linked(&self) -> bool {
        self.held.metadata().is_ok_and(|held| held.nlink() > 0)
    }
}

/// What the writer knows of its file. A store in memory has none.
#[derive(Debug)]
pub(super) struct Presence {
    held: Option<Arc<Held>>,
    log: Log,
    gone: Option<(&'static str, &'static str)>,
}

impl Presence {
    pub(super) fn new(held: Option<Arc<Held>>, log: Log) -> Self {
        Self {
            held,
            log,
            gone: None,
        }
    }

    /// Before a commit: nothing more is written into a file that is gone.
    pub(super) fn check_before(&mut self, connection: &Connection) -> Result<(), StoreError> {
        match self.gone {
            None => Ok(()),
            Some(_) => self.check(connection),
        }
    }

    /// After a commit, before it is answered.
    pub(super) fn check(&mut self, connection: &Connection) -> Result<(), StoreError> {
        let Some(held) = &self.held else {
            return Ok(());
        };
        let found = held.check();
        let gone = match found {
            Err(StoreError::Gone { part, fate }) => Some((part, fate)),
            _ => None,
        };
        if gone != self.gone {
            let event = match gone {
                Some((part, fate)) => held.event(part, fate, part == LOG && fold(connection)),
                None => {
                    LogEvent::new(Level::Info, "store_back").with("store", held.file.path.display())
                }
            };
            self.log.say(&event);
            self.gone = gone;
        }
        found
    }

    /// At the end: folds the log in, and tells whether all that was acknowledged will be found.
    pub(super) fn check_at_end(&self, connection: &Connection) -> Result<(), StoreError> {
        let is_folded = fold(connection);
        match &self.held {
            None => Ok(()),
            Some(held) if is_folded => held.file.check(),
            Some(held) => held.check(),
        }
    }
}

/// Writes all that the log holds into the file, and syncs it; whether that was done.
fn fold(connection: &Connection) -> bool {
    let folded = connection.query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |row| {
        Ok(row.get::<_, i64>(0)? == 0)
    });
    folded.unwrap_or(false)
}
