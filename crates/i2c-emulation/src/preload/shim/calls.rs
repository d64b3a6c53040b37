//! The intercepted functions of the C library, except those that read and write (`transfers`).

use super::super::protocol::Call;
use super::intercept::{failed, result};
use super::system::{self, EACCES, EEXIST, EMFILE, ENOTDIR, EOPNOTSUPP};
use super::{channel, descriptor, path, setting};
use core::ffi::{CStr, c_char, c_int, c_uint, c_ulong, c_void};

const AT_FDCWD: c_int = -100;
const AT_EMPTY_PATH: c_int = 0x1000;
const O_ACCMODE: c_int = 3;
const O_CREAT: c_int = 0o100;
const O_EXCL: c_int = 0o200;
const O_CLOEXEC: c_int = 0o2_000_000;
#[cfg(any(target_arch = "arm", target_arch = "aarch64"))]
const O_DIRECTORY: c_int = 0o40_000;
#[cfg(not(any(target_arch = "arm", target_arch = "aarch64")))]
const O_DIRECTORY: c_int = 0o200_000;
const F_DUPFD: c_int = 0;
const F_DUPFD_CLOEXEC: c_int = 1030;
/// Requests that the kernel answers for every kind of file: FIONCLEX, FIOCLEX, FIONBIO, FIOASYNC.
const REQUESTS_OF_EVERY_FILE: [u32; 4] = [0x5450, 0x5451, 0x5421, 0x5452];
const REQUESTS_OF_I2C: u32 = 0x07;
const X_OK: c_int = 1;
/// The file that provides the attributes of a device: a character device that always exists.
const LOOKS_LIKE: &CStr = c"/dev/null";

type Path = *const c_char;
macro_rules! opens {
    ($($open:ident $openat:ident $open_two:ident $openat_two:ident $stream:ident)*) => {$(intercept! {
        fn $open(path: Path, flags: c_int; ... _mode: c_uint) -> c_int {
            device(AT_FDCWD, path).map(|bus| open_device(bus, flags))
        }

        fn $openat(folder: c_int, path: Path, flags: c_int; ... _mode: c_uint) -> c_int {
            device(folder, path).map(|bus| open_device(bus, flags))
        }

        fn $open_two(path: Path, flags: c_int) -> c_int {
            device(AT_FDCWD, path).map(|bus| open_device(bus, flags))
        }

        fn $openat_two(folder: c_int, path: Path, flags: c_int) -> c_int {
            device(folder, path).map(|bus| open_device(bus, flags))
        }

        fn $stream(path: Path, _mode: Path) -> *mut c_void {
            // A stream reads and writes inside the C library, out of reach: an error is better than silence.
            device(AT_FDCWD, path).map(|_bus| failed(EOPNOTSUPP))
        }
    })*};
}

opens! {
    open openat __open_2 __openat_2 fopen
    open64 openat64 __open64_2 __openat64_2 fopen64
}

macro_rules! controls {
    ($($name:ident)*) => {$(intercept! {
        fn $name(file: c_int, request: c_ulong; ... argument: *mut c_void) -> c_int {
            let (token, request) = controlled(file, request)?;
            let argument = u64::try_from(argument.expose_provenance()).unwrap_or(0);
            let outcome = channel::perform(token, Call::Ioctl { request, argument });
            Some(c_int::try_from(result(outcome)).unwrap_or(c_int::MAX))
        }
    })*};
}

controls! { ioctl __ioctl_time64 }

macro_rules! file_controls {
    ($($name:ident)*) => {$(intercept! {
        fn $name(file: c_int, command: c_int; ... argument: *mut c_void) -> c_int {
            let duplicates = matches!(command, F_DUPFD | F_DUPFD_CLOEXEC);
            duplicated(duplicates.then_some(file)?, || pass_on(file, command, argument))
        }
    })*};
}

file_controls! { fcntl fcntl64 __fcntl_time64 }

intercept! {
    fn close(file: c_int) -> c_int {
        descriptor::unmark(file);
        None
    }

    fn dup(file: c_int) -> c_int {
        duplicated(file, || pass_on(file))
    }

    fn dup2(file: c_int, to: c_int) -> c_int {
        duplicated(file, || pass_on(file, to))
    }

    fn dup3(file: c_int, to: c_int, flags: c_int) -> c_int {
        duplicated(file, || pass_on(file, to, flags))
    }
}

macro_rules! stats {
    ($($name:ident)*) => {$(intercept! {
        fn $name(path: Path, attributes: *mut c_void) -> c_int {
            let bus = device(AT_FDCWD, path)?;
            look_like(bus, attributes, pass_on(LOOKS_LIKE.as_ptr(), attributes))
        }
    })*};
}

stats! { stat stat64 lstat lstat64 __stat64_time64 __lstat64_time64 }

macro_rules! stats_at {
    ($($name:ident)*) => {$(intercept! {
        fn $name(folder: c_int, path: Path, attributes: *mut c_void, flags: c_int) -> c_int {
            let bus = device_or_open(folder, path, flags)?;
            look_like(bus, attributes, pass_on(folder, LOOKS_LIKE.as_ptr(), attributes, flags))
        }
    })*};
}

stats_at! { fstatat fstatat64 __fstatat64_time64 }

macro_rules! stats_of_open {
    ($($name:ident by $by_path:ident)*) => {$(intercept! {
        fn $name(file: c_int, attributes: *mut c_void) -> c_int {
            descriptor::file_of(file)?;
            look_like(0, attributes, $by_path(LOOKS_LIKE.as_ptr(), attributes))
        }
    })*};
}

stats_of_open! { fstat by stat fstat64 by stat64 __fstat64_time64 by __stat64_time64 }

// For programs built with a glibc older than 2.33.
macro_rules! stats_of_old {
    ($($by_path:ident $by_link:ident $at:ident $of_open:ident)*) => {$(intercept! {
        fn $by_path(version: c_int, path: Path, attributes: *mut c_void) -> c_int {
            let bus = device(AT_FDCWD, path)?;
            look_like(bus, attributes, pass_on(version, LOOKS_LIKE.as_ptr(), attributes))
        }

        fn $by_link(version: c_int, path: Path, attributes: *mut c_void) -> c_int {
            let bus = device(AT_FDCWD, path)?;
            look_like(bus, attributes, pass_on(version, LOOKS_LIKE.as_ptr(), attributes))
        }

        fn $at(version: c_int, folder: c_int, path: Path, attributes: *mut c_void, flags: c_int) -> c_int {
            let bus = device_or_open(folder, path, flags)?;
            look_like(bus, attributes, pass_on(version, folder, LOOKS_LIKE.as_ptr(), attributes, flags))
        }

        fn $of_open(version: c_int, file: c_int, attributes: *mut c_void) -> c_int {
            descriptor::file_of(file)?;
            look_like(0, attributes, $by_path(version, LOOKS_LIKE.as_ptr(), attributes))
        }
    })*};
}

stats_of_old! {
    __xstat __lxstat __fxstatat __fxstat
    __xstat64 __lxstat64 __fxstatat64 __fxstat64
}

macro_rules! accesses {
    ($($name:ident)*) => {$(intercept! {
        fn $name(path: Path, wanted: c_int) -> c_int {
            device(AT_FDCWD, path).map(|_bus| permitted(wanted))
        }
    })*};
}

accesses! { access eaccess euidaccess }

intercept! {
    fn statx(folder: c_int, path: Path, flags: c_int, mask: c_uint, attributes: *mut c_void) -> c_int {
        let bus = device_or_open(folder, path, flags)?;
        let outcome = pass_on(folder, LOOKS_LIKE.as_ptr(), flags, mask, attributes);
        if outcome == 0 {
            attributes::of_statx(attributes, bus);
        }
        Some(outcome)
    }

    fn faccessat(folder: c_int, path: Path, wanted: c_int, _flags: c_int) -> c_int {
        device(folder, path).map(|_bus| permitted(wanted))
    }
}

/// Runs when the library is loaded, before the program's own code.
#[cfg(not(test))]
#[used]
#[unsafe(link_section = ".init_array")]
static AT_START: extern "C" fn() = at_start;

#[cfg(not(test))]
extern "C" fn at_start() {
    descriptor::adopt_inherited();
}

/// The emulated bus that a path names.
fn device(folder: c_int, path: Path) -> Option<u32> {
    let setting = setting::get()?;
    if path.is_null() {
        return None;
    }
    // SAFETY: the program passes this path to a function that reads it as a C string.
    let path = unsafe { CStr::from_ptr(path) }.to_bytes();
    let (front, bus) = path::split(path)?;
    let in_dev = path::is_dev(front) || path::is_here(front) && is_dev_folder(folder);
    (in_dev && setting.has(bus)).then_some(bus)
}

/// As [`device`]; also accepts an open file without a path.
fn device_or_open(folder: c_int, path: Path, flags: c_int) -> Option<u32> {
    let without_path = flags & AT_EMPTY_PATH != 0
        && (path.is_null()
            // SAFETY: the program passes this path to a function that reads at least its first byte.
            || unsafe { *path } == 0);
    if without_path {
        return descriptor::file_of(folder).map(|_file| 0);
    }
    device(folder, path)
}

/// Whether an open folder, or the working directory, is `/dev`.
fn is_dev_folder(folder: c_int) -> bool {
    const FRONT: &[u8] = b"/proc/self/fd/";
    let mut text = [0; FRONT.len() + 12];
    let link = if folder == AT_FDCWD {
        Some(c"/proc/self/cwd")
    } else {
        write_decimal(&mut text, FRONT, folder)
    };
    let mut target = [0; 64];
    let errno = system::errno();
    let found = link.and_then(|link| system::read_link(link, &mut target)) == Some(b"/dev");
    system::set_errno(errno);
    found
}

fn write_decimal<'a>(text: &'a mut [u8], front: &[u8], number: c_int) -> Option<&'a CStr> {
    let mut rest = u32::try_from(number).ok()?;
    let mut digits = [0u8; 10];
    let mut first = digits.len();
    while rest > 0 || first == digits.len() {
        first = first.checked_sub(1)?;
        let [digit, ..] = (rest % 10).to_le_bytes();
        *digits.get_mut(first)? = b'0' + digit;
        rest /= 10;
    }
    let digits = digits.get(first..)?;
    text.get_mut(..front.len())?.copy_from_slice(front);
    let end = front.len() + digits.len();
    text.get_mut(front.len()..end)?.copy_from_slice(digits);
    *text.get_mut(end)? = 0;
    CStr::from_bytes_with_nul(text.get(..=end)?).ok()
}

fn open_device(bus: u32, flags: c_int) -> c_int {
    if flags & (O_CREAT | O_EXCL) == O_CREAT | O_EXCL {
        return failed(EEXIST);
    }
    if flags & O_DIRECTORY != 0 {
        return failed(ENOTDIR);
    }
    let access = u32::try_from(flags & O_ACCMODE).unwrap_or(0);
    match channel::open(bus, access, flags & O_CLOEXEC != 0) {
        Ok(token) if descriptor::mark(token) => token,
        Ok(token) => {
            system::close(token);
            failed(EMFILE)
        }
        Err(errno) => failed(errno),
    }
}

/// The open file, and the request as the kernel reads it, if this ioctl is for the emulator.
fn controlled(file: c_int, request: c_ulong) -> Option<(u64, u32)> {
    // The kernel reads 32 bits, whatever the C library passes.
    let request = u32::try_from(request & 0xFFFF_FFFF).ok()?;
    if REQUESTS_OF_EVERY_FILE.contains(&request) {
        return None;
    }
    let mut token = descriptor::file_of(file);
    if request >> 8 == REQUESTS_OF_I2C {
        // A token may have arrived unseen, for example from another process.
        token = token.or_else(|| descriptor::adopt(file));
    }
    token.map(|token| (token, request))
}

/// Marks a token's duplicate. Another file that takes a token's number needs no update, since a token is known by its
/// name.
fn duplicated(file: c_int, duplicate: impl FnOnce() -> c_int) -> Option<c_int> {
    descriptor::file_of(file)?;
    let duplicate = duplicate();
    descriptor::mark(duplicate);
    Some(duplicate)
}

fn permitted(wanted: c_int) -> c_int {
    match wanted & X_OK {
        0 => 0,
        _ => failed(EACCES),
    }
}

fn look_like(bus: u32, attributes: *mut c_void, outcome: c_int) -> Option<c_int> {
    if outcome == 0 {
        attributes::of_stat(attributes, bus);
    }
    Some(outcome)
}

/// Turns the attributes of /dev/null into those of an i2c-dev device.
mod attributes {
    use core::ffi::c_void;

    const MAJOR: u32 = 89;

    /// The offset of the device number in `struct stat`.
    #[cfg(target_arch = "x86_64")]
    const NUMBER_AT: Option<usize> = Some(40);
    #[cfg(any(target_arch = "aarch64", target_arch = "riscv64"))]
    const NUMBER_AT: Option<usize> = Some(32);
    #[cfg(target_arch = "arm")]
    const NUMBER_AT: Option<usize> = None;

    /// `stx_rdev_major` of `struct statx`, followed by the minor number.
    const NUMBER_IN_STATX_AT: usize = 128;

    pub(super) fn of_stat(attributes: *mut c_void, bus: u32) {
        let Some(at) = NUMBER_AT else { return };
        // As in glibc's makedev().
        let (major, minor) = (u64::from(MAJOR), u64::from(bus));
        let number = major << 8 | minor & 0xFF | (minor & !0xFF) << 12;
        // SAFETY: the C library has just filled a `struct stat` there.
        let place = unsafe { attributes.byte_add(at) }.cast::<u64>();
        // SAFETY: as above.
        unsafe { place.write_unaligned(number) };
    }

    pub(super) fn of_statx(attributes: *mut c_void, bus: u32) {
        // SAFETY: the C library has just filled a `struct statx` there.
        unsafe {
            let at = attributes.byte_add(NUMBER_IN_STATX_AT).cast::<u32>();
            at.write_unaligned(MAJOR);
            at.add(1).write_unaligned(bus);
        }
    }
}
