//! The folder of scenes: never read outside of it, and only changed by replacing whole files.

use rustix::fs::OFlags;
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

/// For tests: without limits, and not synced.
#[cfg(test)]
pub(crate) fn plain() -> Disk {
    Disk {
        read: |mut file| {
            let mut text = String::new();
            file.read_to_string(&mut text).map(|_bytes| text)
        },
        replace: |path, content| {
            let partial = path.with_extension("partial");
            io::copy(content, &mut File::create(&partial)?)?;
            fs::rename(partial, path)
        },
    }
}
