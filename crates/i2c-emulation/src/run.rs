//! What running a program shares: errors, and waiting for its end.

use std::io;
use std::process::{Child, Command, ExitStatus};

/// How a program ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended {
    /// Its exit code, or the signal that ended it.
    pub status: ExitStatus,
    /// How often the program, or what it started, opened a device: 0 means never.
    pub opens: u64,
}

/// Why a program could not run with its buses, or not to its end.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what each is")]
pub enum RunError {
    #[error("no bus for the program\nhint: add at least one bus to the rack")]
    NoBus,
    #[error(
        "this kernel does not let one process answer another's system calls: {0}\nhint: Linux 5.9 or newer does, gVisor and qemu-user do not; --via socket needs nothing, --via usbip needs root"
    )]
    NoNotification(#[source] io::Error),
    #[error(
        "system calls are already answered by a supervisor, and Linux has one for each program\nhint: start this outside of the other `grideye emulate` or sandbox, or use --via socket"
    )]
    AlreadySupervised,
    #[error(
        "not permitted: reading another process's memory (process_vm_readv): {0}\nhint: allow ptrace in this container (--cap-add SYS_PTRACE), or use --via socket"
    )]
    NoMemory(#[source] io::Error),
    #[error(
        "{0} gains rights when it starts (set-user-ID, set-group-ID or file capabilities), which Linux withholds from programs that another user supervises\nhint: run as root with CAP_SYS_ADMIN, or use --via socket"
    )]
    GainsRights(String),
    #[error("{step}: {source}\nhint: are there too many processes or open files?")]
    Setup { step: String, source: io::Error },
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

pub(crate) fn setup_failed(step: &str, source: io::Error) -> RunError {
    RunError::Setup {
        step: step.to_owned(),
        source,
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
