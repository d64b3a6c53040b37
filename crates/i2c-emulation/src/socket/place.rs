//! The socket's file: made so that it is never half there, taken over from a server that was killed, removed at the end.

use std::ffi::OsStr;
use std::fs::{self, File, Metadata, Permissions};
use std::io::{self, ErrorKind};
use std::os::fd::AsRawFd;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use super::SocketError;

/// Most bytes of a socket's path: `sun_path` has 108, the last of which is zero.
pub const PATH_BYTES_MAX: usize = 107;
/// How often a server tries to take over a stale file that others are taking over at the same time.
pub const TAKEOVER_ATTEMPTS_MAX: usize = 8;

/// Only the owner may connect.
const MODE: u32 = 0o600;
/// How long a live server may take to accept: one with a full queue makes connect() wait.
const PROBE_WAIT_MAX: Duration = Duration::from_secs(2);

/// A socket's file that is removed when this is dropped, unless it has become another server's.
#[derive(Debug)]
pub(super) struct Place {
    path: PathBuf,
    device: u64,
    inode: u64,
}

impl Place {
    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let ours = fs::symlink_metadata(&self.path)
            .is_ok_and(|found| (found.dev(), found.ino()) == (self.device, self.inode));
        if ours {
            // Nobody is left to tell, and the next server takes a stale file over.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Listens at `path`.
pub(super) fn listen(path: &Path) -> Result<(UnixListener, Place), SocketError> {
    let bytes = path.as_os_str().len();
    if bytes > PATH_BYTES_MAX {
        return Err(SocketError::PathTooLong {
            path: path.to_owned(),
            bytes,
        });
    }
    let Some(name) = path.file_name() else {
        return Err(SocketError::NotASocket {
            path: path.to_owned(),
        });
    };
    let folder = Folder::open(path)?;
    refuse_what_is_no_socket(path)?;
    let draft = Draft::new(&folder, path)?;
    publish(&draft, &folder, name, path)?;
    let place = Place {
        path: path.to_owned(),
        device: draft.found.dev(),
        inode: draft.found.ino(),
    };
    Ok((draft.listener, place))
}

/// Gives the draft its place. A link fails where there is a file already, so of two servers only one gets it.
fn publish(draft: &Draft, folder: &Folder, name: &OsStr, path: &Path) -> Result<(), SocketError> {
    for _ in 0..TAKEOVER_ATTEMPTS_MAX {
        match fs::hard_link(&draft.entry.0, folder.entry(name)) {
            Ok(()) => return Ok(()),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                take_over(folder, name, path)?;
            }
            Err(source) => return Err(failed(path, source)),
        }
    }
    Err(SocketError::InUse {
        path: path.to_owned(),
    })
}

/// Connects, but waits no longer than `wait`: connect() itself has no time limit.
pub(super) fn connect(path: &Path, wait: Duration) -> io::Result<UnixStream> {
    let (sender, receiver) = mpsc::sync_channel(1);
    let target = path.to_owned();
    thread::Builder::new()
        .name("i2c connect".to_owned())
        .spawn(move || {
            // A receiver that has gone no longer wants to know.
            let _ = sender.send(UnixStream::connect(target));
        })?;
    receiver
        .recv_timeout(wait)
        .unwrap_or_else(|_| Err(io::Error::from(ErrorKind::TimedOut)))
}

/// A folder by its descriptor, so that a name in it fits into a socket's address however long the folder's path is.
struct Folder(File);

impl Folder {
    fn open(path: &Path) -> Result<Self, SocketError> {
        let folder = match path.parent() {
            Some(parent) if parent.as_os_str().is_empty() => Path::new("."),
            Some(parent) => parent,
            None => path,
        };
        match File::open(folder) {
            Ok(file) if file.metadata().is_ok_and(|found| found.is_dir()) => Ok(Self(file)),
            Ok(_) => Err(SocketError::NoFolder {
                folder: folder.to_owned(),
            }),
            Err(error)
                if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) =>
            {
                Err(SocketError::NoFolder {
                    folder: folder.to_owned(),
                })
            }
            Err(source) => Err(failed(path, source)),
        }
    }

    fn entry(&self, name: &OsStr) -> PathBuf {
        Path::new("/proc/self/fd")
            .join(self.0.as_raw_fd().to_string())
            .join(name)
    }

    /// A name that nobody else uses.
    fn spare_entry(&self) -> PathBuf {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!(".i2c-{}-{number}", std::process::id());
        self.entry(OsStr::from_bytes(name.as_bytes()))
    }
}

/// A socket that listens already but is not at its place yet.
struct Draft {
    listener: UnixListener,
    entry: Entry,
    found: Metadata,
}

impl Draft {
    fn new(folder: &Folder, path: &Path) -> Result<Self, SocketError> {
        let fail = |source| failed(path, source);
        let entry = Entry(folder.spare_entry());
        let listener = UnixListener::bind(&entry.0).map_err(fail)?;
        fs::set_permissions(&entry.0, Permissions::from_mode(MODE)).map_err(fail)?;
        let found = fs::symlink_metadata(&entry.0).map_err(fail)?;
        Ok(Self {
            listener,
            entry,
            found,
        })
    }
}

/// A file that is removed when this is dropped.
struct Entry(PathBuf);

impl Drop for Entry {
    fn drop(&mut self) {
        // It may never have been made, or have been moved.
        let _ = fs::remove_file(&self.0);
    }
}

/// An error unless nothing or a socket is at the path.
fn refuse_what_is_no_socket(path: &Path) -> Result<(), SocketError> {
    match fs::symlink_metadata(path) {
        Ok(found) if found.file_type().is_socket() => Ok(()),
        Ok(_) => Err(SocketError::NotASocket {
            path: path.to_owned(),
        }),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(source) => Err(failed(path, source)),
    }
}

/// Clears a stale file away. Two servers may do so at once: each moves what it found aside and looks again.
fn take_over(folder: &Folder, name: &OsStr, path: &Path) -> Result<(), SocketError> {
    let in_use = || SocketError::InUse {
        path: path.to_owned(),
    };
    let place = folder.entry(name);
    match probe(&place) {
        Found::Live => return Err(in_use()),
        Found::Nothing => return Ok(()),
        Found::Failed(source) => return Err(failed(path, source)),
        Found::Stale => {}
    }
    let aside = Entry(folder.spare_entry());
    match fs::rename(&place, &aside.0) {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(source) => return Err(failed(path, source)),
    }
    if matches!(probe(&aside.0), Found::Live) {
        fs::hard_link(&aside.0, &place).map_err(|source| failed(path, source))?;
        return Err(in_use());
    }
    Ok(())
}

enum Found {
    Live,
    Stale,
    Nothing,
    Failed(io::Error),
}

fn probe(path: &Path) -> Found {
    match connect(path, PROBE_WAIT_MAX) {
        Ok(_) => Found::Live,
        Err(error) => match error.kind() {
            ErrorKind::TimedOut => Found::Live,
            ErrorKind::ConnectionRefused => Found::Stale,
            ErrorKind::NotFound => Found::Nothing,
            _ => Found::Failed(error),
        },
    }
}

fn failed(path: &Path, source: io::Error) -> SocketError {
    let path = path.to_owned();
    match source.kind() {
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            SocketError::NotPermitted { path, source }
        }
        _ => SocketError::Failed { path, source },
    }
}
