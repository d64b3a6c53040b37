//! The disk operations that the spool needs, and the folder that provides them.
//!
//! The trait is small so that a test can replace the disk with one that fills, fails and loses power.

use rustix::fs::{FlockOperation, flock, statvfs};
use std::fs::{File, OpenOptions};
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

/// The folder within a spool for data that is unusable but worth keeping.
pub const QUARANTINE: &str = "quarantine";
/// How the names of its files begin that hold records which the collector rejected, a line of JSON each.
pub const REFUSED: &str = "refused-";
/// The file that is locked while an agent uses the folder.
pub const LOCK: &str = "lock";

/// A folder of files. Names are relative to it, with at most one `/`, after [`QUARANTINE`].
///
/// Only synced data survives a power cut: a file's bytes after [`Disk::sync`], its name or absence after
/// [`Disk::sync_folder`].
///
/// # Errors
/// Each returns the system's error.
#[expect(clippy::missing_errors_doc, reason = "the same for all of them")]
pub trait Disk: Send {
    /// The names of all files, including those in quarantine.
    fn list(&self) -> io::Result<Vec<String>>;

    /// Size of a file in bytes.
    fn size(&self, name: &str) -> io::Result<u64>;

    /// Up to `len` bytes from `offset`; fewer at the end of the file.
    fn read(&self, name: &str, offset: u64, len: usize) -> io::Result<Vec<u8>>;

    /// Creates or replaces a file with these bytes.
    ///
    /// # Errors
    /// The system's error; the file may then contain part of the bytes.
    fn write(&mut self, name: &str, bytes: &[u8]) -> io::Result<()>;

    /// Appends bytes to a file, creating it if needed.
    ///
    /// # Errors
    /// The system's error; the file may then end with part of the bytes.
    fn append(&mut self, name: &str, bytes: &[u8]) -> io::Result<()>;

    /// Returns when the file's bytes are on the disk.
    ///
    /// # Errors
    /// The system's error; unsynced bytes may then be lost, whatever a later sync returns.
    fn sync(&mut self, name: &str) -> io::Result<()>;

    /// Renames a file, replacing any file of the new name.
    fn rename(&mut self, from: &str, to: &str) -> io::Result<()>;

    /// Removes a file.
    fn remove(&mut self, name: &str) -> io::Result<()>;

    /// Returns when created, renamed and removed names are on the disk.
    fn sync_folder(&mut self) -> io::Result<()>;

    /// Bytes that this user can still write.
    fn free_bytes(&self) -> io::Result<u64>;
}

/// Why a disk cannot become a spool.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// A later version of this program wrote this file in this layout; the last number is the newest layout known here.
    #[error(
        "{0} has layout {1}, but this program knows layouts up to {2}\nhint: run the version of grideye-agent that wrote it, or a newer one; or set spool.folder to an empty folder: this one stays unchanged, and that version can deliver it"
    )]
    Newer(String, u32, u32),
    /// The disk cannot be read.
    #[error(transparent)]
    Disk(#[from] io::Error),
}

/// Why a folder cannot be a spool.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FolderError {
    /// Another agent uses it.
    #[error(
        "{}: another agent uses this spool\nhint: one agent reads all sensors of a device; stop the other (systemctl stop grideye-agent), or give this one a folder and a `device` of its own", .0.display()
    )]
    Locked(PathBuf),
    /// A later version of this program wrote the named file in this folder.
    #[error("{}/{}", .0.display(), .1)]
    Newer(PathBuf, OpenError),
    /// This folder cannot be created, opened or locked, with the system's error.
    #[error(
        "{}: {}\nhint: spool.folder must be a folder that this user may write; systemd makes one with StateDirectory=grideye-agent", .0.display(), .1
    )]
    Unusable(PathBuf, #[source] io::Error),
}

/// A folder of the file system, locked against a second agent.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// The file that is open for appending.
    open: Option<(String, File)>,
    _lock: File,
}

impl Folder {
    /// Opens the folder, creating it if needed, and locks it until the value or the process ends.
    ///
    /// # Errors
    /// [`FolderError`] if it is not writable, or another agent uses it.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        let unusable = |error| FolderError::Unusable(path.to_owned(), error);
        std::fs::create_dir_all(path.join(QUARANTINE)).map_err(unusable)?;
        let lock = OpenOptions::new()
            .create(true)
            .truncate(false)
            .write(true)
            .open(path.join(LOCK))
            .map_err(unusable)?;
        match flock(&lock, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => Ok(Self {
                path: path.to_owned(),
                open: None,
                _lock: lock,
            }),
            Err(rustix::io::Errno::WOULDBLOCK) => Err(FolderError::Locked(path.to_owned())),
            Err(error) => Err(unusable(error.into())),
        }
    }

    fn names_in(&self, folder: &str) -> io::Result<Vec<String>> {
        let mut names = Vec::new();
        for entry in std::fs::read_dir(self.path.join(folder))? {
            let entry = entry?;
            if !entry.file_type()?.is_file() {
                continue;
            }
            // The spool writes no names that are not UTF-8.
            match entry.file_name().into_string() {
                Ok(name) if folder.is_empty() => names.push(name),
                Ok(name) => names.push(format!("{folder}/{name}")),
                Err(_) => {}
            }
        }
        Ok(names)
    }

    fn appendable(&mut self, name: &str) -> io::Result<&mut File> {
        // `resend` may have renamed a file in quarantine.
        let is_open = |(open, _): &(String, File)| open == name && !name.starts_with(QUARANTINE);
        if !self.open.as_ref().is_some_and(is_open) {
            let mut options = OpenOptions::new();
            let file = options.create(true).append(true).open(self.path.join(name));
            self.open = Some((name.to_owned(), file?));
        }
        match &mut self.open {
            Some((_, file)) => Ok(file),
            None => Err(io::ErrorKind::NotFound.into()),
        }
    }

    fn forget(&mut self, name: &str) {
        if self.open.as_ref().is_some_and(|(open, _)| open == name) {
            self.open = None;
        }
    }
}

impl Disk for Folder {
    fn list(&self) -> io::Result<Vec<String>> {
        let mut names = self.names_in("")?;
        names.extend(self.names_in(QUARANTINE)?);
        Ok(names)
    }

    fn size(&self, name: &str) -> io::Result<u64> {
        Ok(std::fs::metadata(self.path.join(name))?.len())
    }

    fn read(&self, name: &str, offset: u64, len: usize) -> io::Result<Vec<u8>> {
        let mut file = File::open(self.path.join(name))?;
        file.seek(SeekFrom::Start(offset))?;
        let mut bytes = Vec::new();
        let limit = u64::try_from(len).unwrap_or(u64::MAX);
        file.take(limit).read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    fn write(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        self.forget(name);
        std::fs::write(self.path.join(name), bytes)
    }

    fn append(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        self.appendable(name)?.write_all(bytes)
    }

    fn sync(&mut self, name: &str) -> io::Result<()> {
        self.appendable(name)?.sync_data()
    }

    fn rename(&mut self, from: &str, to: &str) -> io::Result<()> {
        self.forget(from);
        self.forget(to);
        std::fs::rename(self.path.join(from), self.path.join(to))
    }

    fn remove(&mut self, name: &str) -> io::Result<()> {
        self.forget(name);
        std::fs::remove_file(self.path.join(name))
    }

    fn sync_folder(&mut self) -> io::Result<()> {
        File::open(self.path.join(QUARANTINE))?.sync_all()?;
        File::open(&self.path)?.sync_all()
    }

    fn free_bytes(&self) -> io::Result<u64> {
        let system = statvfs(&self.path)?;
        Ok(system.f_bavail.saturating_mul(system.f_frsize))
    }
}

/// Replaces a file's bytes so that at every moment either the old or the new ones are there.
///
/// # Errors
/// The system's error; the old bytes are then still there.
pub(super) fn replace(disk: &mut dyn Disk, name: &str, bytes: &[u8]) -> io::Result<()> {
    let temporary = format!("{name}.new");
    disk.write(&temporary, bytes)?;
    disk.sync(&temporary)?;
    disk.rename(&temporary, name)?;
    disk.sync_folder()
}
