//! Puts a copy of a backup in the place of a store. The store that was there is kept under another name, with its log.

use crate::store::sqlite::backup::{BackedUp, BackupError, backup};
use crate::store::sqlite::identity::{aside, beside};
use crate::store::types::Stage;
use grideye_recording::whole::sync_folder_of;
use rustix::fs::{CWD, FlockOperation, RenameFlags, flock, renameat_with};
use rustix::io::Errno;
use std::fs::{File, rename};
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

/// The result of a restore.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Restored {
    /// What the store has now.
    pub copied: BackedUp,
    /// Where the store before is, if there was one.
    pub replaced: Option<PathBuf>,
}

/// Why a store was not restored.
#[derive(Debug, thiserror::Error)]
pub enum RestoreError {
    /// A collector writes the store.
    #[error("a collector uses {}\nhint: stop it, restore, and start it again; agents keep their frames meanwhile", .0.display())]
    InUse(PathBuf),
    /// The backup cannot be read or copied.
    #[error(transparent)]
    Copy(#[from] BackupError),
    /// A file cannot be renamed.
    #[error("cannot put the store in its place: {reason}\nhint: the copy of the backup is {}", .copy.display())]
    Rename {
        /// The copy of the backup.
        copy: PathBuf,
        /// The system's error.
        reason: io::Error,
    },
}

/// Copies `from`, checks the copy as [`backup`] does, and gives it the name `file`, which must not be in use.
///
/// # Errors
/// [`RestoreError`]; then the store is as it was, or under another name beside a whole copy.
pub fn restore(
    from: &Path,
    file: &Path,
    progress: impl FnMut(Stage, u64, u64),
) -> Result<Restored, RestoreError> {
    let before = match File::open(file) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        Err(reason) => return Err(unwritable(file, &reason).into()),
        Ok(before) => Some(before),
    };
    if let Some(before) = &before {
        if flock(before, FlockOperation::NonBlockingLockExclusive) == Err(Errno::WOULDBLOCK) {
            return Err(RestoreError::InUse(file.to_owned()));
        }
        let is_itself = |from: std::fs::Metadata| {
            let before = before.metadata()?;
            io::Result::Ok((from.dev(), from.ino()) == (before.dev(), before.ino()))
        };
        if std::fs::metadata(from).and_then(is_itself).unwrap_or(false) {
            return Err(BackupError::Itself(from.to_owned()).into());
        }
    }
    let copy = beside(file, ".restored");
    // What a killed restore left; nobody else gives files this name.
    match std::fs::remove_file(&copy) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            return Err(unwritable(&copy, &error).into());
        }
        _ => {}
    }
    let copied = backup(from, &copy, progress)?;
    let replaced = put(&copy, file, before.is_some())
        .map_err(|reason| RestoreError::Rename { copy, reason })?;
    Ok(Restored { copied, replaced })
}

/// Names the copy `file`. First the log, so that no store is ever beside a log that is not its own.
fn put(copy: &Path, file: &Path, is_there: bool) -> io::Result<Option<PathBuf>> {
    let replaced = is_there.then(|| aside(file, "replaced"));
    if let Some(replaced) = &replaced {
        for end in ["-wal", "-shm"] {
            match rename(beside(file, end), beside(replaced, end)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        rename(file, replaced)?;
    }
    // Unless a collector made a new store meanwhile.
    match renameat_with(CWD, copy, CWD, file, RenameFlags::NOREPLACE) {
        Err(Errno::INVAL | Errno::NOSYS) => rename(copy, file)?,
        renamed => renamed?,
    }
    sync_folder_of(file)?;
    Ok(replaced)
}

fn unwritable(file: &Path, reason: &io::Error) -> BackupError {
    BackupError::Write {
        out: file.to_owned(),
        reason: reason.to_string(),
    }
}
