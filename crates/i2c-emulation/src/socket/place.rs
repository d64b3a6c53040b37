//! The socket's file: made so that it is never half there, taken over from a server that was killed, removed at the end.

use std::ffi::OsStr;
use std::fs::{self, File, Metadata, Permissions};
use std::io::{self, ErrorKind};
use std::os::fd::AsRawFd;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt};
use std::os::unix::net::{SocketAddr, UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use super::error::{PATH_BYTES_MAX, SocketError};

/// As much of a name as fits behind the folder's numbers in an abstract socket's address.
const CLAIM_NAME_BYTES: usize = 56;
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
    let _claim = folder.claim(name, path)?;
    clear_stale(path)?;
    let draft = Draft::new(&folder, path)?;
    fs::hard_link(&draft.entry.0, folder.entry(name)).map_err(|source| failed(path, source))?;
    let place = Place {
        path: path.to_owned(),
        device: draft.found.dev(),
        inode: draft.found.ino(),
    };
    Ok((draft.listener, place))
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

    /// The right to change what this name stands for; the kernel gives it back, however this process ends.
    ///
    /// Without it, one server could take the place of another that has just taken a stale file's.
    fn claim(&self, name: &OsStr, path: &Path) -> Result<UnixListener, SocketError> {
        let fail = |source: io::Error| match source.kind() {
            ErrorKind::AddrInUse => in_use(path),
            _ => failed(path, source),
        };
        let found = self.0.metadata().map_err(fail)?;
        let name = name.as_bytes();
        let tail = name
            .get(name.len().saturating_sub(CLAIM_NAME_BYTES)..)
            .unwrap_or(name);
        let place = format!("i2c-emulation {:x}:{:x} ", found.dev(), found.ino());
        let address =
            SocketAddr::from_abstract_name([place.as_bytes(), tail].concat()).map_err(fail)?;
        UnixListener::bind_addr(&address).map_err(fail)
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
        // It may never have been made.
        let _ = fs::remove_file(&self.0);
    }
}

/// Removes a socket's file with nobody behind it; an error if there is anything else.
fn clear_stale(path: &Path) -> Result<(), SocketError> {
    match fs::symlink_metadata(path) {
        Ok(found) if found.file_type().is_socket() => {}
        Ok(_) => {
            return Err(SocketError::NotASocket {
                path: path.to_owned(),
            });
        }
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(source) => return Err(failed(path, source)),
    }
    match connect(path, PROBE_WAIT_MAX) {
        Ok(_) => Err(in_use(path)),
        Err(error) => match error.kind() {
            ErrorKind::ConnectionRefused => {
                fs::remove_file(path).map_err(|source| failed(path, source))
            }
            // Its queue is full: somebody listens.
            ErrorKind::TimedOut => Err(in_use(path)),
            // The other server has ended meanwhile.
            ErrorKind::NotFound => Ok(()),
            _ => Err(failed(path, error)),
        },
    }
}

fn in_use(path: &Path) -> SocketError {
    SocketError::InUse {
        path: path.to_owned(),
    }
}

fn failed(path: &Path, source: io::Error) -> SocketError {
    let path = path.to_owned();
    match source.kind() {
        // A server that claims nothing, of another program, was faster.
        ErrorKind::AlreadyExists => SocketError::InUse { path },
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            SocketError::NotPermitted { path, source }
        }
        _ => SocketError::Failed { path, source },
    }
}
