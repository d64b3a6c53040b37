//! Files that appear whole under their name, or not at all: written beside it, synced, renamed, and the folder synced.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

/// A file under way, beside the place it is for. It is removed again unless it is put there.
#[derive(Debug)]
pub struct Pending {
    file: File,
    partial: PathBuf,
    path: PathBuf,
}

impl Pending {
    /// An empty file for `path`, with the permissions that the process gives.
    ///
    /// # Errors
    /// What the system said.
    pub fn of(path: &Path) -> io::Result<Self> {
        Self::with_mode(path, 0o666)
    }

    fn with_mode(path: &Path, mode: u32) -> io::Result<Self> {
        let mut name = path.file_name().unwrap_or_default().to_os_string();
        name.push(format!(".{}.partial", std::process::id()));
        let partial = path.with_file_name(name);
        // A program with this number may have been killed; what it left is followed nowhere.
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

    /// The file, to be written to.
    #[must_use]
    pub const fn file(&self) -> &File {
        &self.file
    }

    /// Syncs it and gives it its name.
    ///
    /// # Errors
    /// What the system said.
    pub fn put(&self) -> io::Result<()> {
        self.file.sync_all()?;
        rename(&self.partial, &self.path)
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        // The first error is the one to report; a leftover that cannot be removed keeps its partial name.
        drop(fs::remove_file(&self.partial));
    }
}

/// Puts a file with these bytes, for its owner alone, into the place of whatever has that name.
///
/// # Errors
/// What the system said.
pub fn replace_private(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let pending = Pending::with_mode(path, 0o600)?;
    pending.file().write_all(bytes)?;
    pending.put()
}

/// Gives a synced file its name, which outlasts a power cut.
///
/// # Errors
/// What the system said.
pub fn rename(partial: &Path, path: &Path) -> io::Result<()> {
    fs::rename(partial, path)?;
    sync_folder_of(path)
}

/// Makes the names in a file's folder outlast a power cut.
///
/// # Errors
/// What the system said.
pub fn sync_folder_of(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|name| !name.as_os_str().is_empty());
    match File::open(folder.unwrap_or(Path::new("."))) {
        Ok(folder) => folder.sync_all(),
        // A folder may be for writing alone.
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied => Ok(()),
        Err(error) => Err(error),
    }
}
