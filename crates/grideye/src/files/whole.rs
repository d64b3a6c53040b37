//! Files that appear whole under their name, or not at all.

use anyhow::{Context as _, Result};
pub(crate) use grideye_recording::whole::{Pending, rename};
use std::fs::{self, File, OpenOptions};
use std::io::{BufWriter, Write};
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

/// [`write_whole`] of a text.
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

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_leftover() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("recording.csv");
        let fail = || {
            write_whole(&path, |out| {
                out.write_all(b"half a row")?;
                Err(anyhow!("the source broke off"))
            })
        };
        let error = fail().unwrap_err();
        assert!(format!("{error:#}").contains("the source broke off"));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        fs::write(&path, b"old").unwrap();
        fail().unwrap_err();
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_whole_write_replaces_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("recording.csv");
        fs::write(&path, b"old").unwrap();
        write_text(&path, "new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

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
