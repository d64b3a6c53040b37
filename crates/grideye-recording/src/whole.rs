//! Writes files that appear complete or not at all: written under a temporary name, synced, renamed, and the folder
//! synced.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

/// A file being written next to its final place. Dropping it removes it, unless it was put in place.
#[derive(Debug)]
pub struct Pending {
    file: File,
    partial: PathBuf,
    path: PathBuf,
}

impl Pending {
    /// An empty file for `path`, with the process's default permissions.
    ///
    /// # Errors
    /// The system's error.
    pub fn of(path: &Path) -> io::Result<Self> {
        Self::with_mode(path, 0o666)
    }

    fn with_mode(path: &Path, mode: u32) -> io::Result<Self> {
        let mut name = path.file_name().unwrap_or_default().to_os_string();
        name.push(format!(".{}.partial", std::process::id()));
        let partial = path.with_file_name(name);
        // A killed program may have had the same process number; remove its file rather than follow it.
        match fs::remove_file(&partial) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let mut options = OpenOptions::new();
        let created = options.write(true).create_new(true).mode(mode);
        Ok(Self {
            file: created.open(&partial)?,
            partial,
            path: path.to_owned(),
        })
    }

    /// The file to write to.
    #[must_use]
    pub const fn file(&self) -> &File {
        &self.file
    }

    /// Syncs the file and gives it its final name.
    ///
    /// # Errors
    /// The system's error.
    pub fn put(&self) -> io::Result<()> {
        self.file.sync_all()?;
        rename(&self.partial, &self.path)
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        // Report the first error only; a file that cannot be removed keeps its temporary name.
        drop(fs::remove_file(&self.partial));
    }
}

/// Writes these bytes, readable for the owner only, in place of any file of that name.
///
/// # Errors
/// The system's error.
pub fn replace_private(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let pending = Pending::with_mode(path, 0o600)?;
    pending.file().write_all(bytes)?;
    pending.put()
}

/// Gives a synced file its final name, in a way that survives a power cut.
///
/// # Errors
/// The system's error.
pub fn rename(partial: &Path, path: &Path) -> io::Result<()> {
    fs::rename(partial, path)?;
    sync_folder_of(path)
}

/// Makes the names in a file's folder survive a power cut.
///
/// # Errors
/// The system's error.
pub fn sync_folder_of(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|name| !name.as_os_str().is_empty());
    match File::open(folder.unwrap_or(Path::new("."))) {
        Ok(folder) => folder.sync_all(),
        // A folder may be write-only.
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied => Ok(()),
        Err(error) => Err(error),
    }
}

/// A file, whatever name it was given.
#[derive(Debug, PartialEq, Eq)]
pub enum Identity {
    /// An existing file.
    There {
        /// Its file system.
        device: u64,
        /// Its number there.
        inode: u64,
    },
    /// A path without a file, with the links of its folder resolved.
    New(PathBuf),
}

/// The file that a path names; `None` for devices, pipes and folders.
#[must_use]
pub fn identity(path: &Path) -> Option<Identity> {
    let name = path.file_name()?;
    match fs::metadata(path) {
        Ok(about) => about.is_file().then(|| Identity::There {
            device: about.dev(),
            inode: about.ino(),
        }),
        Err(_not_there) => {
            let folder = path
                .parent()
                .filter(|folder| !folder.as_os_str().is_empty());
            let folder = fs::canonicalize(folder.unwrap_or(Path::new("."))).ok()?;
            Some(Identity::New(folder.join(name)))
        }
    }
}
