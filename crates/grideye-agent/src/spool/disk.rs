//! What the spool needs of a disk, and the folder that gives it.
//!
//! The trait is small so that a test can put a disk under the spool that fills, fails and loses power.

use rustix::fs::{FlockOperation, flock, statvfs};
use std::fs::{File, OpenOptions};
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

/// The folder within a spool for what could not be used and is not thrown away either.
pub const QUARANTINE: &str = "quarantine";
/// The file that is locked while an agent uses the folder.
pub const LOCK: &str = "lock";

/// A folder of files. Names are relative to it, with at most one `/`, behind [`QUARANTINE`].
///
/// Nothing survives a loss of power but what was synced: the bytes of a file by [`Disk::sync`], its name and its absence
/// by [`Disk::sync_folder`].
///
/// # Errors
/// Each gives what the system said.
#[expect(clippy::missing_errors_doc, reason = "the same for all of them")]
pub trait Disk: Send {
    /// The names of all files, those in quarantine included.
    fn list(&self) -> io::Result<Vec<String>>;

    /// Bytes of a file.
    fn size(&self, name: &str) -> io::Result<u64>;

    /// Up to `len` bytes from `offset` on; fewer at the file's end.
    fn read(&self, name: &str, offset: u64, len: usize) -> io::Result<Vec<u8>>;

    /// Writes a file of these bytes, in place of the one that was there.
    ///
    /// # Errors
    /// What the system said; the file may then hold a part of the bytes.
    fn write(&mut self, name: &str, bytes: &[u8]) -> io::Result<()>;

    /// Adds bytes at the file's end, and makes the file if it is not there.
    ///
    /// # Errors
    /// What the system said; the file may then end with a part of the bytes.
    fn append(&mut self, name: &str, bytes: &[u8]) -> io::Result<()>;

    /// Returns when the file's bytes are on the disk.
    ///
    /// # Errors
    /// What the system said; what was not synced before may then be lost, whatever a later sync says.
    fn sync(&mut self, name: &str) -> io::Result<()>;

    /// Gives a file another name, in place of the file that has it.
    fn rename(&mut self, from: &str, to: &str) -> io::Result<()>;

    /// Removes a file.
    fn remove(&mut self, name: &str) -> io::Result<()>;

    /// Returns when names, new ones and removed ones, are on the disk.
    fn sync_folder(&mut self) -> io::Result<()>;

    /// Bytes that this user could still write.
    fn free_bytes(&self) -> io::Result<u64>;
}

/// Why a disk is not taken as a spool.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// A later version of this program wrote this file, in this layout; the newest that is known is the last.
    #[error(
        "{0} has layout {1}, and this program knows layouts up to {2}\nhint: start the version of grideye-agent that wrote it, or a newer one; or name an empty spool.folder: this folder stays as it is, and that version can deliver it"
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
    /// A later version of this program wrote in this folder the file that the error names.
    #[error("{}/{}", .0.display(), .1)]
    Newer(PathBuf, OpenError),
    /// This folder cannot be made, opened or locked, as the system said.
    #[error(
        "{}: {}\nhint: spool.folder must be a folder that this user may write; systemd makes one with StateDirectory=grideye-agent", .0.display(), .1
    )]
    Unusable(PathBuf, #[source] io::Error),
}

/// A folder of the file system, locked against a second agent.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// The file that is being appended to.
    open: Option<(String, File)>,
    _lock: File,
}

impl Folder {
    /// Opens the folder, makes it if it is not there, and locks it until it is dropped, however the program ends.
    ///
    /// # Errors
    /// [`FolderError`] if it cannot be written, or if another agent uses it.
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
            // A name that is not UTF-8 is none of ours.
            match entry.file_name().into_string() {
                Ok(name) if folder.is_empty() => names.push(name),
                Ok(name) => names.push(format!("{folder}/{name}")),
                Err(_) => {}
            }
        }
        Ok(names)
    }

    fn appendable(&mut self, name: &str) -> io::Result<&mut File> {
        if self.open.as_ref().is_none_or(|(open, _)| open != name) {
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

/// Puts these bytes in a file's place, so that at every moment either the old or the new ones are there.
///
/// # Errors
/// What the system said; the old bytes are then still there.
pub(super) fn replace(disk: &mut dyn Disk, name: &str, bytes: &[u8]) -> io::Result<()> {
    let temporary = format!("{name}.new");
    disk.write(&temporary, bytes)?;
    disk.sync(&temporary)?;
    disk.rename(&temporary, name)?;
    disk.sync_folder()
}
