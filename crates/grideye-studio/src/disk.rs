//! The folder of scenes on the disk: read there and nowhere else, and changed by whole files.

use rustix::fs::OFlags;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;

/// How files are read and written, by whoever serves the scenes.
#[derive(Debug, Clone, Copy)]
pub struct Disk {
    /// A whole text of bounded length; [`io::ErrorKind::InvalidData`] where it is not UTF-8.
    pub read: fn(File) -> io::Result<String>,
    /// Puts a file with this content into the place of whatever has that name: whole, or not at all.
    pub replace: fn(&Path, &mut dyn Read) -> io::Result<()>,
}

impl Disk {
    /// The text of a file that lies below a folder.
    pub(crate) fn read_below(&self, folder: &Path, path: &Path) -> io::Result<String> {
        (self.read)(open_below(folder, path)?)
    }
}

/// Opens a file that lies below a folder, and none that a link leads to elsewhere.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] if it lies elsewhere, or is no file.
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

/// For tests: without bounds, and not synced.
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
