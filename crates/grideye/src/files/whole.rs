//! Files that appear whole under their name, or not at all.

use anyhow::{Context as _, Result};
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes a file that the user named: a link stays one, and a device or a pipe takes it as it comes.
pub(crate) fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> Result<()>,
) -> Result<()> {
    let there = fs::metadata(path);
    if there.is_ok_and(|about| !about.is_file() && !about.is_dir()) {
        let stream = || fill(&OpenOptions::new().write(true).open(path)?, write);
        return stream().with_context(|| format!("cannot write {}", path.display()));
    }
    replace(&target(path), write)
}

/// What a link leads to, and any other path itself.
pub(crate) fn target(path: &Path) -> PathBuf {
    match fs::canonicalize(path) {
        Ok(target) if path.is_symlink() => target,
        _ => path.to_owned(),
    }
}

pub(crate) fn write_text(path: &Path, text: &str) -> Result<()> {
    write_whole(path, |out| Ok(out.write_all(text.as_bytes())?))
}

/// Puts a file into the place of whatever has that name, be it a link.
pub(crate) fn replace(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> Result<()>,
) -> Result<()> {
    let put = || -> Result<()> {
        let pending = Pending::of(path)?;
        fill(pending.file(), write)?;
        Ok(pending.put()?)
    };
    put().with_context(|| format!("cannot write {}", path.display()))
}

/// A file under way, beside the place it is for. It is removed again unless it is put there.
pub(crate) struct Pending {
    file: File,
    partial: PathBuf,
    path: PathBuf,
}

impl Pending {
    /// A file for `path`, empty.
    pub(crate) fn of(path: &Path) -> io::Result<Self> {
        let mut name = path.file_name().unwrap_or_default().to_os_string();
        name.push(format!(".{}.partial", std::process::id()));
        let partial = path.with_file_name(name);
        // A program with this number may have been killed; what it left is followed nowhere.
        match fs::remove_file(&partial) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let created = OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&partial);
        Ok(Self {
            file: created?,
            partial,
            path: path.to_owned(),
        })
    }

    pub(crate) fn file(&self) -> &File {
        &self.file
    }

    /// Syncs it and gives it its name.
    pub(crate) fn put(&self) -> io::Result<()> {
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

/// Writes through a buffer. What is left in it after an error is not written on the way out.
pub(crate) fn fill(
    file: &File,
    write: impl FnOnce(&mut BufWriter<&File>) -> Result<()>,
) -> Result<()> {
    let mut out = BufWriter::new(file);
    let written = write(&mut out).and_then(|()| Ok(out.flush()?));
    drop(out.into_parts());
    written
}

/// Gives a synced file its name, which outlasts a power cut.
pub(crate) fn rename(partial: &Path, path: &Path) -> io::Result<()> {
    fs::rename(partial, path)?;
    match File::open(folder_of(path)) {
        Ok(folder) => folder.sync_all(),
        // A folder may be for writing alone.
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied => Ok(()),
        Err(error) => Err(error),
    }
}

pub(crate) fn folder_of(path: &Path) -> &Path {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_stays_one_unless_it_is_replaced_and_a_device_stays_a_device() {
        let folder = tempfile::tempdir().unwrap();
        let (path, link) = (folder.path().join("a.csv"), folder.path().join("b.csv"));
        fs::write(&path, b"old").unwrap();
        std::os::unix::fs::symlink(&path, &link).unwrap();
        write_text(&link, "new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert!(link.is_symlink());
        replace(&link, |out| Ok(out.write_all(b"other")?)).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert!(!link.is_symlink());
        let null = folder.path().join("null");
        std::os::unix::fs::symlink("/dev/null", &null).unwrap();
        write_text(&null, "nothing").unwrap();
        assert!(null.is_symlink() && !null.is_file());
    }
}
