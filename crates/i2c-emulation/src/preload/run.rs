//! Runs a program with the library preloaded, and serves its requests.

use super::carried::{self, Library};
use super::server::Server;
use super::{program_file, protocol};
use crate::ioctl::AdapterMode;
use crate::rack::Rack;
use crate::run::{Ended, PRELOAD_NEEDS, RunError, Way, not_started, socket_pair, wait_for};
use std::ffi::{OsStr, OsString};
use std::os::fd::AsFd;
use std::os::unix::ffi::OsStrExt;
use std::process::{Command, ExitStatus};
use std::thread;

const LD_PRELOAD: &str = "LD_PRELOAD";

/// Checks whether preloading can reach this program, without starting it. Programs that it starts later are not
/// checked.
/// # Errors
/// What prevents preloading.
pub fn check(command: &Command) -> Result<(), RunError> {
    carried::bytes()?;
    program_file::check(&program_file::find(command)?)
}

/// Runs `command` to its end with the buses of `rack`; calls `started` with the program's process number.
pub(crate) fn run_rack(
    rack: &Rack,
    mode: AdapterMode,
    command: &mut Command,
    started: &(dyn Fn(u32) + Sync),
) -> Result<Ended, RunError> {
    let library = Library::new()?;
    let server = Server::new(rack, mode)?;
    let before = program_file::environment(command, LD_PRELOAD);
    let variable = OsStr::from_bytes(protocol::ENVIRONMENT.to_bytes());
    command.env(variable, server.address());
    command.env(LD_PRELOAD, with_library(&library, before.as_ref()));
    let outcome = serve_while_it_runs(&server, command, started);
    command.env_remove(variable);
    match before {
        Some(before) => command.env(LD_PRELOAD, before),
        None => command.env_remove(LD_PRELOAD),
    };
    outcome.map(|status| Ended {
        status,
        via: Way::Preload,
        opens: server.opens(),
    })
}

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
    // Closing one end wakes the reader of the other.
    let (wake, awake) = socket_pair(PRELOAD_NEEDS)?;
    thread::scope(|scope| {
        let wake = &wake;
        scope.spawn(move || server.serve(wake.as_fd(), scope));
        let spawned = command.spawn();
        let outcome = spawned
            .map_err(|source| not_started(command, source))
            .and_then(|child| wait_for(child, command, started));
        drop(awake);
        outcome
    })
}
