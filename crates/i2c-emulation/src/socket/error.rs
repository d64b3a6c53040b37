//! Why the server could not start.

use std::io;
use std::path::PathBuf;

/// The longest socket path: `sun_path` has 108 bytes, the last of them zero.
pub const PATH_BYTES_MAX: usize = 107;

/// Why the server could not start.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what each is")]
pub enum SocketError {
    #[error(
        "{0} is in use: another server answers or starts there\nhint: stop that server, or choose another path"
    )]
    InUse(PathBuf),
    #[error("{0} exists and is not a socket\nhint: choose another path; nothing was changed")]
    NotASocket(PathBuf),
    #[error("there is no folder {0}\nhint: make it with `mkdir -p`, or choose another path")]
    NoFolder(PathBuf),
    #[error(
        "socket path is {1} bytes long, at most {PATH_BYTES_MAX} are possible: {0}\nhint: choose a shorter path, such as /tmp/grideye.sock"
    )]
    PathTooLong(PathBuf, usize),
    #[error(
        "not permitted to make {0}: {1}\nhint: choose a folder in which you may make files, such as /tmp or $XDG_RUNTIME_DIR"
    )]
    NotPermitted(PathBuf, #[source] io::Error),
    #[error("no bus to serve\nhint: add at least one bus to the rack")]
    NoBus,
    #[error(
        "cannot make {0}: {1}\nhint: the folder must be on a file system with sockets and links, and /proc must be mounted"
    )]
    Failed(PathBuf, #[source] io::Error),
}
