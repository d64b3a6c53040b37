//! Stores on a full disk.

use crate::batches::numbered;
use crate::server::Server;
use grideye_collector::{FrameStore, Limits, SqliteStore, StoreError, StoreLocation};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

/// A small disk in memory.
pub(crate) struct Small {
    path: PathBuf,
}

impl Small {
    /// Mounts a disk of `kib` KiB; `None` if mounts are switched off.
    pub(crate) fn mount(folder: &Path, kib: u32, what: &str) -> Option<Self> {
        if std::env::var_os("GRIDEYE_WITHOUT_MOUNTS").is_some() {
            println!("left out: {what} (GRIDEYE_WITHOUT_MOUNTS is set)");
            return None;
        }
        let path = folder.join("disk");
        std::fs::create_dir(&path).unwrap();
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &format!("size={kib}k"), "grideye-disk"])
            .arg(&path)
            .status()
            .unwrap();
        let hint = "hint: run as root, or set GRIDEYE_WITHOUT_MOUNTS=1";
        assert!(mounted.success(), "cannot mount a tmpfs\n{hint}");
        Some(Self { path })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Fills it except for `bytes`.
    pub(crate) fn fill_but(&self, bytes: usize) {
        let ballast = self.path.join("ballast");
        let mut length = 0;
        let piece = vec![1_u8; 4096];
        let mut file = std::fs::File::create(&ballast).unwrap();
        while std::io::Write::write_all(&mut file, &piece).is_ok() {
            length += piece.len();
        }
        let left = u64::try_from(length.saturating_sub(bytes)).unwrap();
        file.set_len(left).unwrap();
    }

    pub(crate) fn make_room(&self) {
        std::fs::remove_file(self.path.join("ballast")).unwrap();
    }
}

impl Drop for Small {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(&self.path).status();
    }
}

fn open(folder: &Path, limits: &Limits) -> Result<SqliteStore, StoreError> {
    SqliteStore::open(&StoreLocation::File(folder.join("frames.sqlite")), limits)
}

async fn health(server: &Server) -> (u16, String) {
    let reply = server.get("/healthz").await;
    let status = reply.json()["status"].as_str().unwrap().to_owned();
    (reply.status.as_u16(), status)
}

#[tokio::test]
async fn a_collector_started_on_a_full_disk_is_unhealthy_before_the_first_batch() {
    let folder = tempfile::tempdir().unwrap();
    let Some(disk) = Small::mount(folder.path(), 1024, "a start on a full disk") else {
        return;
    };
    let limits = Limits::default();
    let store = open(disk.path(), &limits).unwrap();
    store.append(Arc::new(numbered(0..50)), 1).await.unwrap();
    store.close().await.unwrap();
    // Room for SQLite's index of the log, but for no page in the log.
    disk.fill_but(32 * 1024);
    let server = Server::on(Arc::new(open(disk.path(), &limits).unwrap()), limits).await;
    assert_eq!(health(&server).await, (503, "full".to_owned()));
    let refused = server.frames(&numbered(50..55)).await;
    assert_eq!(refused.error().1, "disk_full");
    disk.make_room();
    assert_eq!(server.frames(&numbered(50..55)).await.status, 200);
    assert_eq!(health(&server).await, (200, "ok".to_owned()));
}

#[tokio::test]
async fn a_collector_started_at_its_quota_is_unhealthy_before_the_first_batch() {
    let folder = tempfile::tempdir().unwrap();
    let store = open(folder.path(), &Limits::default()).unwrap();
    store.append(Arc::new(numbered(0..1000)), 1).await.unwrap();
    store.close().await.unwrap();
    // The file has no free page and may not grow.
    let path = folder.path().join("frames.sqlite");
    let other = rusqlite::Connection::open(&path).unwrap();
    other
        .execute_batch("VACUUM; PRAGMA wal_checkpoint(TRUNCATE)")
        .unwrap();
    drop(other);
    let bytes = std::fs::metadata(&path).unwrap().len();
    let limits = Limits {
        store_bytes_max: Some(bytes),
        ..Limits::default()
    };
    let server = Server::on(Arc::new(open(folder.path(), &limits).unwrap()), limits).await;
    assert_eq!(health(&server).await, (503, "full".to_owned()));
    let roomy = Limits {
        store_bytes_max: Some(2 * 1024 * 1024),
        ..Limits::default()
    };
    let server = Server::on(Arc::new(open(folder.path(), &roomy).unwrap()), roomy).await;
    assert_eq!(health(&server).await, (200, "ok".to_owned()));
}
