//! The socket's file: never half-made, taken over from a killed server, removed at the end.

use super::error::{PATH_BYTES_MAX, SocketError};
use std::ffi::OsStr;
use std::fs::{self, File, Permissions};
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

/// How much of a name fits after the folder's numbers in an abstract socket address.
const CLAIM_NAME_BYTES: usize = 56;
const MODE: u32 = 0o600;
/// How long to wait for a live server to accept: with a full queue, connect() blocks.
const PROBE_WAIT_MAX: Duration = Duration::from_secs(2);

/// A socket's file, removed on drop unless another server has taken it over.
#[derive(Debug)]
pub(super) struct Place {
    pub(super) path: PathBuf,
    /// The file's device and inode.
    file: (u64, u64),
}

impl Drop for Place {
    fn drop(&mut self) {
        let found = fs::symlink_metadata(&self.path);
        if found.is_ok_and(|found| (found.dev(), found.ino()) == self.file) {
            // There is no one left to report to, and the next server takes over a stale file.
            let _ = fs::remove_file(&self.path);
        }
    }
}

pub(super) fn listen(path: &Path) -> Result<(UnixListener, Place), SocketError> {
    let bytes = path.as_os_str().len();
    if bytes > PATH_BYTES_MAX {
        return Err(SocketError::PathTooLong(path.to_owned(), bytes));
    }
    let Some(name) = path.file_name() else {
        return Err(SocketError::NotASocket(path.to_owned()));
    };
    let folder = Folder::open(path)?;
    let _claim = folder.claim(name, path)?;
    clear_stale(path)?;
    // The socket listens before it gets its final name.
    let draft = Draft(folder.spare_entry());
    let fail = |source| failed(path, source);
    let listener = UnixListener::bind(&draft.0).map_err(fail)?;
    fs::set_permissions(&draft.0, Permissions::from_mode(MODE)).map_err(fail)?;
    let found = fs::symlink_metadata(&draft.0).map_err(fail)?;
    fs::hard_link(&draft.0, folder.entry(name)).map_err(fail)?;
    let place = Place {
        path: path.to_owned(),
        file: (found.dev(), found.ino()),
    };
    Ok((listener, place))
}

/// Connects within `wait`: connect() itself has no time limit.
pub(super) fn connect(path: &Path, wait: Duration) -> io::Result<UnixStream> {
    let (sender, receiver) = mpsc::sync_channel(1);
    let target = path.to_owned();
    thread::Builder::new()
        .name("i2c connect".to_owned())
        .spawn(move || {
            // A receiver that timed out does not need the result.
            let _ = sender.send(UnixStream::connect(target));
        })?;
    receiver
        .recv_timeout(wait)
        .unwrap_or_else(|_| Err(io::Error::from(ErrorKind::TimedOut)))
}

/// A folder by its descriptor, so that a name in it fits a socket address however long the folder's path is.
struct Folder(File);

impl Folder {
    fn open(path: &Path) -> Result<Self, SocketError> {
        let folder = match path.parent() {
            Some(parent) if parent.as_os_str().is_empty() => Path::new("."),
            Some(parent) => parent,
            None => path,
        };
        let missing = || SocketError::NoFolder(folder.to_owned());
        let file = File::open(folder).map_err(|source| match source.kind() {
            ErrorKind::NotFound | ErrorKind::NotADirectory => missing(),
            _ => failed(path, source),
        })?;
        let is_folder = file.metadata().is_ok_and(|found| found.is_dir());
        is_folder.then_some(Self(file)).ok_or_else(missing)
    }

    fn entry(&self, name: &OsStr) -> PathBuf {
        Path::new("/proc/self/fd")
            .join(self.0.as_raw_fd().to_string())
            .join(name)
    }

    /// The right to change this name while this process lives: without it, one server could replace another that has
    /// just replaced a stale file.
    fn claim(&self, name: &OsStr, path: &Path) -> Result<UnixListener, SocketError> {
        let fail = |source: io::Error| match source.kind() {
            ErrorKind::AddrInUse => in_use(path),
            _ => failed(path, source),
        };
        let found = self.0.metadata().map_err(fail)?;
        let name = name.as_bytes();
        let tail = &name[name.len().saturating_sub(CLAIM_NAME_BYTES)..];
        let place = format!("i2c-emulation {:x}:{:x} ", found.dev(), found.ino());
        let claim = [place.as_bytes(), tail].concat();
        let address = SocketAddr::from_abstract_name(claim).map_err(fail)?;
        UnixListener::bind_addr(&address).map_err(fail)
    }

    /// A unique name.
    fn spare_entry(&self) -> PathBuf {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!(".i2c-{}-{number}", std::process::id());
        self.entry(OsStr::from_bytes(name.as_bytes()))
    }
}

/// A file that is removed on drop.
struct Draft(PathBuf);

impl Drop for Draft {
    fn drop(&mut self) {
        // It may not exist.
        let _ = fs::remove_file(&self.0);
    }
}

/// Removes a socket file without a server; an error for anything else.
fn clear_stale(path: &Path) -> Result<(), SocketError> {
    match fs::symlink_metadata(path) {
        Ok(found) if found.file_type().is_socket() => {}
        Ok(_) => return Err(SocketError::NotASocket(path.to_owned())),
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(source) => return Err(failed(path, source)),
    }
    match connect(path, PROBE_WAIT_MAX) {
        Ok(_) => Err(in_use(path)),
        Err(error) => match error.kind() {
            ErrorKind::ConnectionRefused => {
                fs::remove_file(path).map_err(|source| failed(path, source))
            }
            // Its queue is full, so a server listens.
            ErrorKind::TimedOut => Err(in_use(path)),
            // The other server has ended since.
            ErrorKind::NotFound => Ok(()),
            _ => Err(failed(path, error)),
        },
    }
}

fn in_use(path: &Path) -> SocketError {
    SocketError::InUse(path.to_owned())
}

fn failed(path: &Path, source: io::Error) -> SocketError {
    let path = path.to_owned();
    match source.kind() {
        // Another program's server, which makes no claim, was faster.
        ErrorKind::AlreadyExists => SocketError::InUse(path),
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            SocketError::NotPermitted(path, source)
        }
        _ => SocketError::Failed(path, source),
    }
}
