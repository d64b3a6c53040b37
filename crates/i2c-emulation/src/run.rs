//! What both ways to run a program share: starting it, waiting for its end, and errors.

use std::fmt;
use std::io;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus};

/// The way in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Way {
    /// A kernel file in a private mount namespace; see [`fuse`](crate::fuse).
    Fuse,
    /// A preloaded library; see [`preload`](crate::preload).
    Preload,
}

impl fmt::Display for Way {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Fuse => "fuse",
            Self::Preload => "preload",
        })
    }
}

/// How a program ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended {
    /// Its exit code, or the signal that ended it.
    pub status: ExitStatus,
    /// The way used.
    pub via: Way,
    /// How often the program, or what it started, opened a device: 0 means never.
    pub opens: u64,
}

/// Why a program could not run with its buses, or not to its end.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what each is")]
pub enum RunError {
    #[error("no bus for the program\nhint: add at least one bus to the rack")]
    NoBus,
    #[error("FUSE does not work here: {0}\nand preloading does not either: {1}")]
    NoWay(Box<Self>, Box<Self>),
    #[error(
        "cannot open {0}: {1}\nhint: load the kernel module with `modprobe fuse`, or hand the device to the container with `--device /dev/fuse`"
    )]
    NoFuse(PathBuf, #[source] io::Error),
    #[error(
        "not permitted: {0}: {1}\nhint: run as root, or allow user namespaces (user.max_user_namespaces above 0) and /dev/fuse for everyone (chmod 0666 /dev/fuse); a container needs --cap-add SYS_ADMIN --device /dev/fuse --security-opt apparmor=unconfined"
    )]
    NotPermitted(String, #[source] io::Error),
    #[error("{step}: {source}\nhint: this needs {needs}")]
    Setup {
        step: String,
        source: io::Error,
        needs: &'static str,
    },
    #[error(
        "device path does not exist: {0}\nhint: use a path directly in /dev, such as /dev/i2c-1, or create an empty file there first"
    )]
    DeviceMissing(PathBuf),
    #[error("{0} is a folder\nhint: use a file path, such as /dev/i2c-1")]
    DeviceIsFolder(PathBuf),
    #[error("path contains a zero byte: {0}\nhint: use a file path, such as /dev/i2c-1")]
    PathWithZero(PathBuf),
    #[error(
        "/dev has more than {0} entries\nhint: create an empty file at the device's path, so that /dev need not be rebuilt"
    )]
    DevTooFull(usize),
    #[error(
        "the kernel speaks FUSE {0}.{1}, 7.28 or newer is required\nhint: use Linux 4.20 or newer"
    )]
    FuseTooOld(u32, u32),
    #[error("the emulated device failed: {0}\nhint: see the kernel's log (dmesg)")]
    Serve(#[source] io::Error),
    #[error("this build has no preload library: {0}\nhint: use FUSE (--via fuse)")]
    NoLibrary(&'static str),
    #[error(
        "{0} is statically linked: no library can be preloaded into it\nhint: FUSE (--via fuse) reaches static programs"
    )]
    StaticProgram(String),
    #[error(
        "{0} gains rights when it starts (set-user-ID, set-group-ID or file capabilities): its loader ignores preloaded libraries\nhint: FUSE (--via fuse) as root reaches such programs"
    )]
    GainsRights(String),
    #[error(
        "{0} has another instruction set or pointer width than the preload library\nhint: FUSE (--via fuse) also reaches 32-bit programs; for another machine's programs, build this one for that machine"
    )]
    OtherMachine(String),
    #[error("{found} buses, at most {max} are possible by preloading\nhint: use fewer buses")]
    TooManyBuses { found: usize, max: usize },
    #[error(
        "program not found: {0}\nhint: check the spelling, PATH and the working directory; if the file exists, its interpreter or loader is missing"
    )]
    ProgramNotFound(String),
    #[error("cannot start {0}: {1}\nhint: is the file executable, and made for this machine?")]
    ProgramNotStarted(String, #[source] io::Error),
    #[error(
        "cannot wait for {0}: {1}\nhint: does something else in this process collect its children?"
    )]
    Wait(String, #[source] io::Error),
}

pub(crate) const FUSE_NEEDS: &str = "Linux 5.6 or newer with FUSE, tmpfs and a mounted /proc";
pub(crate) const PRELOAD_NEEDS: &str = "Linux 3.17 or newer with a mounted /proc";

/// A step failed for a way with these needs.
pub(crate) fn setup_failed(step: &str, source: io::Error, needs: &'static str) -> RunError {
    RunError::Setup {
        step: step.to_owned(),
        source,
        needs,
    }
}

pub(crate) fn not_started(command: &Command, source: io::Error) -> RunError {
    let program = command.get_program().to_string_lossy().into_owned();
    if source.kind() == io::ErrorKind::NotFound {
        RunError::ProgramNotFound(program)
    } else {
        RunError::ProgramNotStarted(program, source)
    }
}

/// Passes the program's process number to `started`, and waits for its end.
pub(crate) fn wait_for(
    mut child: Child,
    command: &Command,
    started: &(dyn Fn(u32) + Sync),
) -> Result<ExitStatus, RunError> {
    started(child.id());
    let program = || command.get_program().to_string_lossy().into_owned();
    child
        .wait()
        .map_err(|source| RunError::Wait(program(), source))
}

/// Two connected sockets, for a way with these needs.
pub(crate) fn socket_pair(needs: &'static str) -> Result<(UnixStream, UnixStream), RunError> {
    UnixStream::pair().map_err(|source| setup_failed("making a socket pair", source, needs))
}
