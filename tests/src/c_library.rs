//! Programs in C and C++ on `libamg8833_c`, compiled by this machine's compilers.

use crate::programs::{Ended, root, run};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

/// The static library that was built with this test.
///
/// # Panics
/// If there is none.
#[must_use]
pub fn library() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let mut newest: Option<(SystemTime, PathBuf)> = None;
    for file in test.parent().unwrap().read_dir().unwrap() {
        let file = file.unwrap();
        let name = file.file_name().into_string().unwrap_or_default();
        if name.starts_with("libamg8833_c") && name.ends_with(".a") {
            let made = (file.metadata().unwrap().modified().unwrap(), file.path());
            newest = newest.max(Some(made));
        }
    }
    newest.unwrap().1
}

/// Compiles sources with the header and the library, without a warning; the program is `program` in `folder`.
///
/// # Panics
/// With what the compiler says.
pub fn compile(compiler: &str, flags: &[&str], sources: &[&Path], program: &Path) {
    let mut command = Command::new(compiler);
    command.args(["-Wall", "-Wextra", "-Werror", "-g", "-I"]);
    command.arg(root().join("crates/amg8833-c/include"));
    command.args(flags).args(sources).arg(library());
    let ended = run(command
        .args(["-lm", "-lpthread", "-ldl", "-o"])
        .arg(program));
    assert_eq!(ended.code, 0, "{sources:?}: {ended:?}");
}

/// Runs a program, and expects that it says nothing is wrong.
///
/// # Panics
/// With what it says.
pub fn succeed(command: &mut Command) -> Ended {
    let ended = run(command);
    assert_eq!(
        ended.code, 0,
        "{command:?}: {}{}",
        ended.stdout, ended.stderr
    );
    ended
}
