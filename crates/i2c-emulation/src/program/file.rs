//! Finds a program's file before it starts, and whether it gains rights.

use crate::run::RunError;
use rustix::fs::getxattr_query;
use rustix::process::{getegid, geteuid};
use std::ffi::{OsStr, OsString};
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The default search path for programs.
const PATH_OF_OLD: &str = "/bin:/usr/bin";

pub(super) fn find(command: &Command) -> Result<PathBuf, RunError> {
    let name = command.get_program();
    let folder = command.get_current_dir().unwrap_or(Path::new(""));
    let found = if name.as_bytes().contains(&b'/') {
        Some(folder.join(name)).filter(|path| path.exists())
    } else {
        let path = environment(command, "PATH").unwrap_or_else(|| PATH_OF_OLD.into());
        std::env::split_paths(&path)
            .map(|entry| folder.join(entry).join(name))
            .find(|candidate| is_executable(candidate))
    };
    found.ok_or_else(|| RunError::ProgramNotFound(name.to_string_lossy().into_owned()))
}

/// The variable's value in the program.
fn environment(command: &Command, name: &str) -> Option<OsString> {
    let set = command.get_envs().find(|(key, _)| *key == OsStr::new(name));
    match set {
        Some((_, value)) => value.map(OsStr::to_owned),
        None => std::env::var_os(name),
    }
}

fn is_executable(path: &Path) -> bool {
    const ANYONE: u32 = 0o111;
    fs::metadata(path)
        .is_ok_and(|found| found.is_file() && found.permissions().mode() & ANYONE != 0)
}

/// Whether the kernel gives the program rights that its user lacks. For a script it does not.
pub(super) fn gains_rights(path: &Path) -> bool {
    const SET_USER: u32 = 0o4000;
    const SET_GROUP: u32 = 0o2000;
    let Ok(found) = fs::metadata(path) else {
        return false;
    };
    let (user, group) = (geteuid().as_raw(), getegid().as_raw());
    let mode = found.permissions().mode();
    let other_user = mode & SET_USER != 0 && found.uid() != user;
    let other_group = mode & SET_GROUP != 0 && found.gid() != group;
    let capable =
        user != 0 && getxattr_query(path, c"security.capability").is_ok_and(|bytes| bytes > 0);
    other_user || other_group || capable
}
