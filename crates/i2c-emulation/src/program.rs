//! A `/dev/i2c-N` for one program, by [`syscalls`].

use crate::ioctl::AdapterMode;
use crate::rack::Rack;
pub use crate::run::{Ended, RunError};
use crate::syscalls::{self, Rights};
use std::process::Command;

mod file;
mod signals;

/// How to run a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// The adapter that every bus imitates.
    pub mode: AdapterMode,
    /// Whether to pass signals for this process on to the program; see [`run`].
    pub signals: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            mode: AdapterMode::default(),
            signals: true,
        }
    }
}

/// Checks whether `command` can run here with the buses of `rack`, without starting it. Programs that it starts later
/// are not checked.
/// # Errors
/// What is missing.
pub fn check(rack: &Rack, command: &Command) -> Result<(), RunError> {
    if rack.iter().next().is_none() {
        return Err(RunError::NoBus);
    }
    let program = file::find(command)?;
    match syscalls::probe()? {
        Rights::NotGained if file::gains_rights(&program) => {
            Err(RunError::GainsRights(program.display().to_string()))
        }
        _ => Ok(()),
    }
}

/// [Checks](check) `command`, runs it to its end with the buses of `rack` at `/dev/i2c-N`, and returns how it ended.
///
/// If this process dies, the program gets SIGTERM (perhaps more than once), and its buses return ENOTCONN. With
/// [`Options::signals`], this process passes SIGTERM and SIGHUP on to the program, and also SIGINT and SIGQUIT
/// unless they come from the terminal, which signals the program itself. All handlers are restored afterward. Only
/// one such run at a time handles signals.
/// # Errors
/// Why the program could not run with its buses; a program that ended badly is no error.
pub fn run(rack: &Rack, options: &Options, command: &mut Command) -> Result<Ended, RunError> {
    check(rack, command)?;
    let handed_on = signals::HandedOn::begin(options.signals);
    handed_on.prepare(command);
    syscalls::run_rack(rack, options.mode, command, &|pid| handed_on.to(pid))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rack_without_a_bus_is_refused() {
        let refused = check(&Rack::new(), &Command::new("true"));
        assert!(matches!(refused, Err(RunError::NoBus)));
    }
}
