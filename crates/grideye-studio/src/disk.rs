//! The folder of scenes: never read outside of it, and only changed by replacing whole files.

use grideye_scene::Files;
use rustix::fs::OFlags;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;

/// How the program reads and writes files.
#[derive(Debug, Clone, Copy)]
pub struct Disk {
    /// Reads a whole text of bounded length; [`io::ErrorKind::InvalidData`] if it is not UTF-8.
    pub read: fn(File) -> io::Result<String>,
    /// Replaces the file at this path atomically.
    pub replace: fn(&Path, &mut dyn Read) -> io::Result<()>,
}

impl Disk {
    /// The text of a file below the folder.
    pub(crate) fn read_below(&self, folder: &Path, path: &Path) -> io::Result<String> {
        (self.read)(open_below(folder, path)?)
    }
}

/// The files that a scene names: those of the page before those of the folder. Remembers what was read from the folder.
pub(crate) struct Named<'a> {
    pub(crate) folder: &'a Path,
    pub(crate) disk: Disk,
    pub(crate) of_the_page: &'a BTreeMap<String, String>,
    pub(crate) read: RefCell<BTreeMap<String, String>>,
}

impl Files for Named<'_> {
    fn read(&self, relative: &str) -> io::Result<String> {
        if let Some(text) = self.of_the_page.get(relative) {
            return Ok(text.clone());
        }
        let path = self.folder.join(relative);
        let text = self.disk.read_below(self.folder, &path)?;
        let mut read = self.read.borrow_mut();
        read.insert(relative.to_owned(), text.clone());
        Ok(text)
    }
}

/// Opens a file below a folder; rejects links that lead elsewhere.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] if it lies elsewhere, or is not a file.
pub(crate) fn open_below(folder: &Path, path: &Path) -> io::Result<File> {
    let real = fs::canonicalize(path)?;
    if !real.starts_with(fs::canonicalize(folder)?) || !real.is_file() {
        let told = "it is not a file in the scenes folder";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, told));
    }
    let no_follow = i32::try_from(OFlags::NOFOLLOW.bits()).unwrap_or_default();
    OpenOptions::new()
        .read(true)
        .custom_flags(no_follow)
        .open(real)
}
