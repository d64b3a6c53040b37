//! What a system call is about: the path of a device, or an open file of one. Nothing here allocates, because a
//! caretaker asks too.

use super::call::{Call, Path};
use super::listener::Question;
use super::memory::ProcessMemory;
use rustix::fs::{CWD, readlinkat_raw};
use std::ffi::CStr;
use std::io::Write;
use std::mem::MaybeUninit;

/// The most bytes of a path that may name a device.
const PATH_BYTES_MAX: usize = 128;
/// The most bytes of the name of a device's open file, as /proc shows it.
const LINK_BYTES_MAX: usize = 96;

pub(super) const FILE_NAME: &str = "i2c-emulation";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Subject {
    /// The path of this bus.
    Path(u32),
    /// An open file.
    File(FileName),
}

/// The name of an open file in the program: `i2c-emulation:SERVER:TOKEN:BUS`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct FileName {
    pub(super) token: u64,
    pub(super) bus: u32,
}

/// The devices that there are.
pub(super) struct Devices {
    /// The process that makes their open files.
    pub(super) server: u32,
    pub(super) buses: Vec<u32>,
}

impl Devices {
    pub(super) fn subject_of(&self, question: &Question) -> Option<Subject> {
        let path = |at| self.path(question, at);
        match question.call {
            Call::Open(at) | Call::Stat(at) | Call::Access(at) => path(at),
            Call::Create => path(Path::First),
            Call::OpenHow | Call::StatMore => path(Path::InFolder),
            _ => self
                .file(question.thread, question.word(0))
                .map(Subject::File),
        }
    }

    /// The open file behind a thread's descriptor.
    pub(super) fn file(&self, thread: u32, descriptor: u32) -> Option<FileName> {
        let mut room = [MaybeUninit::uninit(); LINK_BYTES_MAX];
        let name = link(thread, format_args!("fd/{descriptor}"), &mut room)?;
        let name = name
            .strip_prefix(b"/memfd:")?
            .strip_prefix(FILE_NAME.as_bytes())?;
        let name = name.strip_suffix(b" (deleted)")?.strip_prefix(b":")?;
        let mut numbers = name.split(|byte| *byte == b':').map(decimal);
        let mut next = || numbers.next().flatten();
        let (server, token, bus) = (next()?, next()?, u32::try_from(next()?).ok()?);
        let ours = server == u64::from(self.server) && self.buses.contains(&bus);
        ours.then_some(FileName { token, bus })
    }

    fn path(&self, question: &Question, at: Path) -> Option<Subject> {
        let (folder, address) = match at {
            Path::First => (None, question.arguments[0]),
            Path::InFolder => (Some(question.word(0)), question.arguments[1]),
        };
        let mut room = [0; PATH_BYTES_MAX];
        let memory = ProcessMemory::new(question.thread, question.width());
        let length = memory.read_some(address, &mut room);
        let path = CStr::from_bytes_until_nul(&room[..length]).ok()?.to_bytes();
        if path.is_empty() {
            return self.without_path(question, folder?);
        }
        let (front, bus) = split(path)?;
        let in_dev = is_dev(front) || is_here(front) && is_dev_folder(question.thread, folder);
        (in_dev && self.buses.contains(&bus)).then_some(Subject::Path(bus))
    }

    /// The kernel refuses an empty path unless the flags ask for the open file.
    fn without_path(&self, question: &Question, folder: u32) -> Option<Subject> {
        const AT_EMPTY_PATH: u32 = 0x1000;
        let flags = match question.call {
            Call::Stat(_) => question.word(3),
            Call::StatMore => question.word(2),
            _ => 0,
        };
        let asked = flags & AT_EMPTY_PATH != 0;
        let file = asked.then(|| self.file(question.thread, folder))?;
        file.map(Subject::File)
    }
}

/// Whether an open folder, or the working directory, is `/dev`.
fn is_dev_folder(thread: u32, folder: Option<u32>) -> bool {
    // AT_FDCWD, -100
    const WORKING_FOLDER: u32 = u32::MAX - 99;
    let mut room = [MaybeUninit::uninit(); LINK_BYTES_MAX];
    let target = match folder.filter(|folder| *folder != WORKING_FOLDER) {
        Some(folder) => link(thread, format_args!("fd/{folder}"), &mut room),
        None => link(thread, format_args!("cwd"), &mut room),
    };
    target == Some(b"/dev")
}

/// Where a link in a thread's folder of /proc leads; none if there is none, or if its target is longer.
pub(super) fn link<'a>(
    thread: u32,
    name: std::fmt::Arguments<'_>,
    room: &'a mut [MaybeUninit<u8>],
) -> Option<&'a [u8]> {
    let mut path = [0; 48];
    write!(&mut path[..], "/proc/{thread}/{name}\0").ok()?;
    let path = CStr::from_bytes_until_nul(&path).ok()?;
    let (target, rest) = readlinkat_raw(CWD, path, room).ok()?;
    (!rest.is_empty()).then_some(&*target)
}

/// The folder and the bus number of a path that ends in `i2c-N`.
fn split(path: &[u8]) -> Option<(&[u8], u32)> {
    let slash = path.iter().rposition(|byte| *byte == b'/');
    let (folder, name) = path.split_at_checked(slash.map_or(0, |at| at + 1))?;
    let bus = decimal(name.strip_prefix(b"i2c-")?)?;
    Some((folder, u32::try_from(bus).ok()?))
}

/// Whether an absolute folder path is `/dev`, judged by its text alone.
fn is_dev(folder: &[u8]) -> bool {
    folder.starts_with(b"/") && parts(folder).eq([&b"dev"[..]])
}

/// Whether a relative path is the folder it starts from.
fn is_here(folder: &[u8]) -> bool {
    !folder.starts_with(b"/") && parts(folder).next().is_none()
}

/// A number without a sign or leading zeros.
fn decimal(digits: &[u8]) -> Option<u64> {
    if digits.is_empty() || digits.len() > 1 && digits.starts_with(b"0") {
        return None;
    }
    digits.iter().try_fold(0u64, |number, digit| {
        let value = digit.checked_sub(b'0').filter(|value| *value < 10)?;
        number.checked_mul(10)?.checked_add(value.into())
    })
}

fn parts(path: &[u8]) -> impl Iterator<Item = &[u8]> {
    path.split(|byte| *byte == b'/')
        .filter(|part| !part.is_empty() && *part != b".")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_of_i2c_dev_have_a_number() {
        for (path, folder, number) in [
            ("/dev/i2c-1", "/dev/", 1),
            ("i2c-0", "", 0),
            ("//dev/./i2c-12", "//dev/./", 12),
            ("/tmp/i2c-4294967295", "/tmp/", u32::MAX),
        ] {
            let expected = Some((folder.as_bytes(), number));
            assert_eq!(split(path.as_bytes()), expected, "{path}");
        }
        for name in ["i2c-", "i2c-1/", "i2c-01", "i2c-1x", "i2c-+1"] {
            let path = format!("/dev/{name}");
            assert_eq!(split(path.as_bytes()), None, "{path}");
        }
        for path in ["", "/dev/i2c-4294967296", "/dev/xi2c-1"] {
            assert_eq!(split(path.as_bytes()), None, "{path}");
        }
    }

    #[test]
    fn dev_is_known_by_its_text_alone() {
        for folder in ["/dev/", "/dev", "//dev//", "/./dev/./"] {
            assert!(is_dev(folder.as_bytes()), "{folder}");
        }
        for folder in ["", "dev/", "/", "/devx/", "/tmp/dev/", "/dev/../dev/"] {
            assert!(!is_dev(folder.as_bytes()), "{folder}");
        }
        let here = ["", "./", "././/", "../", "/"].map(|folder| is_here(folder.as_bytes()));
        assert_eq!(here, [true, true, true, false, false]);
    }
}
