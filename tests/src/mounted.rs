//! File systems of a test's own; only root can mount them.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A file system, until it is dropped.
#[derive(Debug)]
pub struct Mounted(PathBuf);

impl Mounted {
    /// So many MiB of memory.
    ///
    /// # Panics
    /// When it cannot be mounted.
    #[must_use]
    pub fn tmpfs(path: PathBuf, mib: u32) -> Self {
        let size = format!("size={mib}m");
        std::fs::create_dir_all(&path).unwrap();
        Self::mount(&["-t", "tmpfs", "-o", &size, "grideye-test"], path)
    }

    /// A file in `behind` as a disk of twice its size.
    ///
    /// # Panics
    /// When it cannot be made or mounted.
    #[must_use]
    pub fn ext4(behind: &Self, path: PathBuf) -> Self {
        let image = behind.0.join("image");
        let file = std::fs::File::create(&image).unwrap();
        file.set_len(16 << 20).unwrap();
        let made = Command::new("mkfs.ext4")
            .args(["-q", "-F"])
            .arg(&image)
            .status();
        assert!(made.unwrap().success());
        std::fs::create_dir(&path).unwrap();
        Self::ext4_again(behind, path)
    }

    /// The same disk once more, after it was dropped.
    ///
    /// # Panics
    /// When it cannot be mounted.
    #[must_use]
    pub fn ext4_again(behind: &Self, path: PathBuf) -> Self {
        let image = behind.0.join("image");
        let image = image.to_str().unwrap();
        Self::mount(&["-o", "loop,errors=remount-ro", image], path)
    }

    fn mount(arguments: &[&str], path: PathBuf) -> Self {
        let done = Command::new("mount").args(arguments).arg(&path).status();
        assert!(done.unwrap().success(), "mount {arguments:?}");
        Self(path)
    }

    /// Where it is mounted.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Takes all room that is left.
    ///
    /// # Panics
    /// When nothing can be written at all.
    pub fn fill(&self) {
        let mut file = std::fs::File::create(self.0.join("filler")).unwrap();
        while file.write_all(&[0; 1024]).is_ok() {}
    }

    /// Gives that room back.
    ///
    /// # Panics
    /// When it was not filled.
    pub fn empty(&self) {
        std::fs::remove_file(self.0.join("filler")).unwrap();
    }
}

impl Drop for Mounted {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(&self.0).status();
    }
}
