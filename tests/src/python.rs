//! Python drivers from PyPI, in an environment of their own.

use crate::programs::{is_left_out, root, run, target};
use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

/// Leaves out the Python drivers where neither they nor PyPI are to be had.
pub const WITHOUT_PYTHON_DRIVERS: &str = "GRIDEYE_WITHOUT_PYTHON_DRIVERS";

/// A command that runs a script of `tests/python` with the drivers of its `requirements.txt`, or `None` if they are left out.
///
/// # Panics
/// When they cannot be installed.
#[must_use]
pub fn script(name: &str, arguments: &[&str], what: &str) -> Option<Command> {
    if is_left_out(WITHOUT_PYTHON_DRIVERS, what) {
        return None;
    }
    let mut command = Command::new(environment().join("bin/python"));
    command
        .arg(root().join("tests/python").join(name))
        .args(arguments);
    Some(command)
}

fn environment() -> &'static PathBuf {
    static ENVIRONMENT: OnceLock<PathBuf> = OnceLock::new();
    ENVIRONMENT.get_or_init(|| {
        let path = target().join("python");
        let ended = run(Command::new(root().join("tests/python/set-up")).arg(&path));
        assert!(
            ended.code == 0,
            "the Python drivers could not be installed: {ended:?}\n\
             hint: apt-get install python3-venv, or set {WITHOUT_PYTHON_DRIVERS}=1 to leave them out"
        );
        path
    })
}
