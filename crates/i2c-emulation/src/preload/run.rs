//! Runs a program with the library preloaded, and serves what it asks.

use std::ffi::OsString;
use std::io;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::process::{Command, ExitStatus};
use std::thread;

use super::carried::{self, Library};
use super::error::RunError;
use super::server::Server;
use super::{program_file, protocol};
use crate::ended::Ended;
use crate::ioctl::AdapterMode;
use crate::rack::Rack;

const LD_PRELOAD: &str = "LD_PRELOAD";

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
