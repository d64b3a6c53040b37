//! Checks a program's file before it starts: whether a library can be preloaded into it.

use super::carried;
use crate::run::RunError;
use rustix::fs::getxattr_query;
use rustix::process::{getegid, geteuid};
use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::Read;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{FileExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The most scripts that name another script as their interpreter, as in the kernel.
pub const SCRIPTS_MAX: usize = 5;
/// The most bytes of a script's first line that the kernel reads.
const FIRST_LINE_BYTES_MAX: u64 = 256;
/// The most program headers to check; linkers make about a dozen.
const HEADERS_MAX: usize = 256;
/// The default search path for programs.
const PATH_OF_OLD: &str = "/bin:/usr/bin";

pub(crate) fn find(command: &Command) -> Result<PathBuf, RunError> {
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
pub(super) fn environment(command: &Command, name: &str) -> Option<OsString> {
    let set = command.get_envs().find(|(key, _)| *key == OsStr::new(name));
    match set {
        Some((_, value)) => value.map(OsStr::to_owned),
        None => std::env::var_os(name),
    }
}

/// Checks whether the loader will accept the library for this program. If the file cannot be read, starting it will
/// report why.
pub(super) fn check(program: &Path) -> Result<(), RunError> {
    let library = Header::parse(carried::bytes()?).map(|header| header.machine);
    let Some((path, file, header)) = without_scripts(program) else {
        return Ok(());
    };
    let shown = path.display().to_string();
    if !header.has_loader(&file) {
        Err(RunError::StaticProgram(shown))
    } else if library.is_some_and(|library| library != header.machine) {
        Err(RunError::OtherMachine(shown))
    } else if gains_rights(&path) {
        Err(RunError::GainsRights(shown))
    } else {
        Ok(())
    }
}

/// The program that finally starts, after following scripts to their interpreters.
fn without_scripts(program: &Path) -> Option<(PathBuf, File, Header)> {
    let mut path = program.to_owned();
    for _ in 0..SCRIPTS_MAX {
        let file = File::open(&path).ok()?;
        let mut front = Vec::new();
        let mut first_line = (&file).take(FIRST_LINE_BYTES_MAX);
        first_line.read_to_end(&mut front).ok()?;
        match interpreter_of(&front) {
            Some(interpreter) => path = interpreter,
            None => return Some((path, file, Header::parse(&front)?)),
        }
    }
    None
}

fn is_executable(path: &Path) -> bool {
    const ANYONE: u32 = 0o111;
    fs::metadata(path)
        .is_ok_and(|found| found.is_file() && found.permissions().mode() & ANYONE != 0)
}

fn interpreter_of(front: &[u8]) -> Option<PathBuf> {
    let line = front.strip_prefix(b"#!")?;
    let line = line.split(|byte| *byte == b'\n').next()?;
    let mut words = line.split(|byte| matches!(byte, b' ' | b'\t'));
    let word = words.find(|word| !word.is_empty())?;
    Some(PathBuf::from(OsStr::from_bytes(word)))
}

/// Whether the kernel gives the program rights that its user lacks; its loader then ignores LD_PRELOAD.
fn gains_rights(path: &Path) -> bool {
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

/// The first bytes of an ELF file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Header {
    /// Pointer width, byte order and instruction set, which must match between a program and its libraries.
    machine: [u8; 4],
    big_endian: bool,
    headers_at: u64,
    header_bytes: u16,
    headers_count: u16,
}

impl Header {
    fn parse(bytes: &[u8]) -> Option<Self> {
        if !bytes.starts_with(b"\x7fELF") {
            return None;
        }
        let byte = |at: usize| bytes.get(at).copied();
        let machine = [byte(4)?, byte(5)?, byte(18)?, byte(19)?];
        let big_endian = machine[1] == 2;
        let fields = Fields { bytes, big_endian };
        let (headers_at, sizes_at) = match machine[0] {
            2 => (fields.number(32, 8)?, 54),
            _ => (fields.number(28, 4)?, 42),
        };
        Some(Self {
            machine,
            big_endian,
            headers_at,
            header_bytes: fields.short(sizes_at)?,
            headers_count: fields.short(sizes_at + 2)?,
        })
    }

    /// Whether the program names a loader; a static one does not.
    fn has_loader(&self, file: &File) -> bool {
        const PT_INTERP: u64 = 3;
        let count = usize::from(self.headers_count).min(HEADERS_MAX);
        let mut headers = vec![0; count * usize::from(self.header_bytes)];
        if self.header_bytes == 0 || file.read_exact_at(&mut headers, self.headers_at).is_err() {
            return true;
        }
        let big_endian = self.big_endian;
        let kind = |bytes| Fields { bytes, big_endian }.number(0, 4);
        let mut each = headers.chunks_exact(self.header_bytes.into());
        each.any(|bytes| kind(bytes) == Some(PT_INTERP))
    }
}

struct Fields<'a> {
    bytes: &'a [u8],
    big_endian: bool,
}

impl Fields<'_> {
    fn number(&self, at: usize, length: usize) -> Option<u64> {
        let bytes = self.bytes.get(at..at + length)?;
        let step = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        Some(if self.big_endian {
            bytes.iter().fold(0, step)
        } else {
            bytes.iter().rev().fold(0, step)
        })
    }

    fn short(&self, at: usize) -> Option<u16> {
        self.number(at, 2).and_then(|number| number.try_into().ok())
    }
}
