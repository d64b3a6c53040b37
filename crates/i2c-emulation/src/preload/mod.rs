//! Way 3 where FUSE is not allowed: a preloaded library that answers for `/dev/i2c-N`.
//!
//! ```text
//!  this process                                                the program, and whatever it starts
//!  ────────────                                                ──────────────────────────────────
//!  the buses, and the one ioctl layer                          LD_PRELOAD: a library of 36 KiB
//!      ▲                                                           open("/dev/i2c-1") ─▶ a socket as descriptor
//!      └── a socket without a path, a secret in the environment ◀──── ioctl, read, write on it
//! ```
//!
//! The library is carried inside this crate and lies in memory, at a path below `/proc` that ends with this process; the
//! socket has no path at all. So nothing is left behind, whatever ends whom. It holds no chip and no open file: those
//! are here, and a forked or started child finds the very same ones.
//!
//! What a program can notice, beside what the crate's page says: `ls /dev` does not list the device; the descriptor is a
//! socket in `/proc/self/fd`; a stream of the C library (`fopen`) is refused with EOPNOTSUPP; system calls that are made
//! without the C library (static programs, Go) find no device. Children that are started with an empty environment, as
//! another user, or in a process-number or network namespace of their own do not find it either.

mod carried;
mod program_file;
#[cfg_attr(not(test), expect(dead_code, reason = "each side uses its half"))]
mod protocol;
mod server;
#[cfg(test)]
#[expect(
    dead_code,
    reason = "here only what needs no interception can be called"
)]
mod shim;

use std::ffi::OsString;
use std::io;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::process::{Command, ExitStatus};
use std::thread;

pub use program_file::SCRIPTS_MAX;
pub use server::{CHANNELS_MAX, OPEN_FILES_MAX, STRANGERS_MAX};

use crate::fuse::Ended;
use crate::ioctl::AdapterMode;
use crate::rack::Rack;
use carried::Library;
use server::Server;

const LD_PRELOAD: &str = "LD_PRELOAD";

/// Most buses that one program can be shown by preloading.
pub const BUSES_MAX: usize = protocol::BUSES_MAX;

/// Why a program cannot be run with a preloaded library.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// This program was built without the library.
    #[error("this build carries no library to preload: {reason}\nhint: use FUSE (--via fuse)")]
    NoLibrary {
        /// Why it was built without.
        reason: &'static str,
    },
    /// There is no such program.
    #[error(
        "program not found: {program}\nhint: check the spelling and PATH; a file that is there names an interpreter or a loader that is not"
    )]
    ProgramNotFound {
        /// The program's name.
        program: String,
    },
    /// The program is there but does not start.
    #[error(
        "cannot start {program}: {source}\nhint: is the file executable, and made for this machine?"
    )]
    ProgramNotStarted {
        /// The program's name.
        program: String,
        /// What the kernel said.
        source: io::Error,
    },
    /// The program does not load libraries.
    #[error(
        "{program} is statically linked: no library can be preloaded into it\nhint: FUSE (--via fuse) reaches static programs"
    )]
    StaticProgram {
        /// The program's file, or that of the interpreter which its script names.
        program: String,
    },
    /// The program's loader ignores LD_PRELOAD.
    #[error(
        "{program} gains rights when it starts (set-user-ID, set-group-ID or file capabilities): its loader ignores libraries to preload\nhint: FUSE (--via fuse) as root reaches such programs"
    )]
    GainsRights {
        /// The program's file.
        program: String,
    },
    /// The program is made for another machine than this one, a 32-bit one for example.
    #[error(
        "{program} is made for another machine than the library to preload (another instruction set or width of pointers)\nhint: FUSE (--via fuse) reaches 32-bit programs as well; for another machine's programs build this one for that machine"
    )]
    OtherMachine {
        /// The program's file.
        program: String,
    },
    /// There are more buses than the library knows.
    #[error("{found} buses, but by preloading a program can be shown {max}\nhint: show it fewer")]
    TooManyBuses {
        /// How many there are.
        found: usize,
        /// The limit, [`BUSES_MAX`].
        max: usize,
    },
    /// A step of the preparation failed.
    #[error("{step}: {source}\nhint: this needs Linux 3.17 or newer with a mounted /proc")]
    Setup {
        /// What was being done.
        step: &'static str,
        /// What the kernel said.
        source: io::Error,
    },
    /// The end of the program could not be waited for.
    #[error(
        "cannot wait for {program}: {source}\nhint: does something else in this process collect its children?"
    )]
    Wait {
        /// The program's name.
        program: String,
        /// What the kernel said.
        source: io::Error,
    },
}

/// Tells whether preloading can reach this program, without starting it. What the program starts later is not known.
///
/// # Errors
/// What stands in the way.
pub fn check(command: &Command) -> Result<(), RunError> {
    carried::bytes()?;
    program_file::check(&program_file::find(command)?)
}

/// Finds the program's file, or says that there is none.
pub(crate) fn find(command: &Command) -> Result<(), RunError> {
    program_file::find(command).map(drop)
}

/// Runs `command` to its end with the buses of `rack`; `started` is told the program's process number.
pub(crate) fn run_rack(
    rack: &Rack,
    mode: AdapterMode,
    command: &mut Command,
    started: &(dyn Fn(u32) + Sync),
) -> Result<Ended, RunError> {
    let library = Library::new()?;
    let server = Server::new(rack, mode)?;
    let before = program_file::environment(command, LD_PRELOAD);
    command.env(protocol::ENVIRONMENT, server.address());
    command.env(LD_PRELOAD, with_library(&library, before.as_ref()));
    let outcome = serve_while_it_runs(&server, command, started);
    command.env_remove(protocol::ENVIRONMENT);
    match before {
        Some(before) => command.env(LD_PRELOAD, before),
        None => command.env_remove(LD_PRELOAD),
    };
    outcome.map(|status| Ended {
        status,
        opens: server.opens(),
    })
}

/// In front of what else is to be preloaded.
fn with_library(library: &Library, before: Option<&OsString>) -> OsString {
    let mut list = OsString::from(library.path());
    if let Some(before) = before.filter(|before| !before.is_empty()) {
        list.push(":");
        list.push(before);
    }
    list
}

fn serve_while_it_runs(
    server: &Server,
    command: &mut Command,
    started: &(dyn Fn(u32) + Sync),
) -> Result<ExitStatus, RunError> {
    // Closing the one end wakes whoever waits for the other.
    let (wake, awake) = UnixStream::pair().map_err(|source| RunError::Setup {
        step: "making a socket pair",
        source,
    })?;
    thread::scope(|scope| {
        let wake = &wake;
        scope.spawn(move || server.serve(wake.as_fd(), scope));
        let outcome = start_and_wait(command, started);
        drop(awake);
        outcome
    })
}

fn start_and_wait(
    command: &mut Command,
    started: &(dyn Fn(u32) + Sync),
) -> Result<ExitStatus, RunError> {
    let program = command.get_program().to_string_lossy().into_owned();
    let mut child = match command.spawn() {
        Ok(child) => child,
        Err(source) if source.kind() == io::ErrorKind::NotFound => {
            return Err(RunError::ProgramNotFound { program });
        }
        Err(source) => {
            return Err(RunError::ProgramNotStarted { program, source });
        }
    };
    started(child.id());
    child
        .wait()
        .map_err(|source| RunError::Wait { program, source })
}
