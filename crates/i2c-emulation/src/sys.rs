//! The system calls that std has no wrapper for, each one line of unsafe.
//!
//! None of them allocates or locks, so that they may run between fork and exec.
#![expect(
    unsafe_code,
    reason = "mounts, namespaces, poll and passed descriptors have no wrapper in std"
)]

use std::ffi::CStr;
use std::io;
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, FromRawFd, OwnedFd, RawFd};
use std::os::unix::process::CommandExt;
use std::process::Command;
use std::ptr;

/// Gives the calling thread namespaces of its own.
pub(crate) fn unshare(flags: libc::c_int) -> io::Result<()> {
    // SAFETY: no pointers are involved; the thread shares no state with Rust that the namespaces hold.
    check(unsafe { libc::unshare(flags) })
}

/// mount(2).
pub(crate) fn mount(
    source: Option<&CStr>,
    target: &CStr,
    kind: Option<&CStr>,
    flags: libc::c_ulong,
    data: Option<&CStr>,
) -> io::Result<()> {
    let or_null = |text: Option<&CStr>| text.map_or(ptr::null(), CStr::as_ptr);
    // SAFETY: every pointer is null, where mount allows it, or a C string that outlives the call.
    check(unsafe {
        libc::mount(
            or_null(source),
            target.as_ptr(),
            or_null(kind),
            flags,
            or_null(data).cast(),
        )
    })
}

/// mkdir(2), for everyone to look into.
pub(crate) fn make_folder(path: &CStr) -> io::Result<()> {
    // SAFETY: `path` is a C string that outlives the call.
    check(unsafe { libc::mkdir(path.as_ptr(), 0o755) })
}

/// symlink(2).
pub(crate) fn make_link(text: &CStr, path: &CStr) -> io::Result<()> {
    // SAFETY: both are C strings that outlive the call.
    check(unsafe { libc::symlink(text.as_ptr(), path.as_ptr()) })
}

/// open(2), closed on exec. A file that is created may be read and written by everyone.
pub(crate) fn open(path: &CStr, flags: libc::c_int) -> io::Result<OwnedFd> {
    let mode: libc::c_uint = 0o666;
    // SAFETY: `path` is a C string that outlives the call.
    let descriptor = unsafe { libc::open(path.as_ptr(), flags | libc::O_CLOEXEC, mode) };
    check(descriptor)?;
    // SAFETY: the descriptor was opened just now, and nothing else owns it.
    Ok(unsafe { OwnedFd::from_raw_fd(descriptor) })
}

/// Makes the number `to` stand for what `from` stands for.
pub(crate) fn put_at(from: &OwnedFd, to: RawFd) -> io::Result<()> {
    // SAFETY: no pointers are involved. `to` is a number that the caller reserved, so no other owner loses its file.
    check(unsafe { libc::dup3(from.as_raw_fd(), to, libc::O_CLOEXEC) })
}

/// Writes one piece of text to a file that exists.
pub(crate) fn write_file(path: &CStr, text: &[u8]) -> io::Result<()> {
    write(open(path, libc::O_WRONLY)?.as_fd(), text)
}

/// What to wait for: a descriptor that has something to say.
pub(crate) fn readable(descriptor: BorrowedFd<'_>) -> libc::pollfd {
    libc::pollfd {
        fd: descriptor.as_raw_fd(),
        events: libc::POLLIN,
        revents: 0,
    }
}

/// Waits until one of the descriptors has something to say, forever or for so many milliseconds; `revents` tells which.
pub(crate) fn wait_for_any(
    descriptors: &mut [libc::pollfd],
    timeout_ms: Option<u16>,
) -> io::Result<()> {
    let count = libc::nfds_t::try_from(descriptors.len()).map_err(io::Error::other)?;
    let timeout = timeout_ms.map_or(-1, libc::c_int::from);
    loop {
        // SAFETY: pointer and count describe `descriptors`, which is borrowed for the whole call.
        match check(unsafe { libc::poll(descriptors.as_mut_ptr(), count, timeout) }) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            outcome => return outcome,
        }
    }
}

/// Waits until one of two descriptors has something to say, and tells which.
pub(crate) fn wait_for_either(
    first: BorrowedFd<'_>,
    second: BorrowedFd<'_>,
) -> io::Result<[bool; 2]> {
    let mut both = [readable(first), readable(second)];
    wait_for_any(&mut both, None)?;
    Ok(both.map(|entry| entry.revents != 0))
}

/// The numeric user and group that this process acts as.
pub(crate) fn effective_ids() -> (u32, u32) {
    // SAFETY: both calls take nothing and cannot fail.
    unsafe { (libc::geteuid(), libc::getegid()) }
}

/// Asks the file system for a file's attributes, and forgets them.
pub(crate) fn look_at(path: &CStr) -> io::Result<()> {
    let mut attributes = MaybeUninit::<libc::stat>::uninit();
    // SAFETY: `path` is a C string that outlives the call, and `attributes` has room for what is written.
    check(unsafe { libc::stat(path.as_ptr(), attributes.as_mut_ptr()) })
}

/// The process number of the caller; unlike std's it is right also between fork and exec.
pub(crate) fn own_pid() -> libc::pid_t {
    // SAFETY: the call takes nothing and cannot fail.
    unsafe { libc::getpid() }
}

/// Takes a duplicate of another process's open file.
pub(crate) fn take_descriptor_of(pid: libc::pid_t, number: RawFd) -> io::Result<OwnedFd> {
    const NO_FLAGS: libc::c_uint = 0;
    // SAFETY: no pointers are involved.
    let process = new_descriptor(unsafe { libc::syscall(libc::SYS_pidfd_open, pid, NO_FLAGS) })?;
    // SAFETY: no pointers are involved; `process` is open for the whole call.
    new_descriptor(unsafe {
        libc::syscall(libc::SYS_pidfd_getfd, process.as_raw_fd(), number, NO_FLAGS)
    })
}

/// Reads what has arrived, without waiting for more than the descriptor itself makes it wait.
pub(crate) fn read(from: BorrowedFd<'_>, into: &mut [u8]) -> io::Result<usize> {
    // SAFETY: pointer and length describe `into`, which is borrowed for the whole call.
    let arrived = unsafe { libc::read(from.as_raw_fd(), into.as_mut_ptr().cast(), into.len()) };
    usize::try_from(arrived).map_err(|_negative| io::Error::last_os_error())
}

/// Writes all in one go, as /dev/fuse demands.
pub(crate) fn write(to: BorrowedFd<'_>, bytes: &[u8]) -> io::Result<()> {
    // SAFETY: pointer and length describe `bytes`, which outlives the call.
    let written = unsafe { libc::write(to.as_raw_fd(), bytes.as_ptr().cast(), bytes.len()) };
    if written < 0 {
        Err(io::Error::last_os_error())
    } else {
        Ok(())
    }
}

/// Lets `work` run in the child of `command`, between fork and exec.
///
/// # Safety
/// `work` must neither allocate, nor take a lock, nor touch what another thread may have left half done.
pub(crate) unsafe fn before_exec(
    command: &mut Command,
    work: impl FnMut() -> io::Result<()> + Send + Sync + 'static,
) {
    // SAFETY: the caller vouches for `work`.
    unsafe { command.pre_exec(work) };
}

/// A file in memory with these bytes, which nobody can change any more; closed on exec.
pub(crate) fn memory_file(name: &CStr, bytes: &[u8]) -> io::Result<OwnedFd> {
    const SEALS: libc::c_int =
        libc::F_SEAL_WRITE | libc::F_SEAL_SHRINK | libc::F_SEAL_GROW | libc::F_SEAL_SEAL;
    let flags = libc::MFD_CLOEXEC | libc::MFD_ALLOW_SEALING;
    // SAFETY: `name` is a C string that outlives the call.
    let number = unsafe { libc::memfd_create(name.as_ptr(), flags) };
    check(number)?;
    // SAFETY: the kernel opened the descriptor just now, and nothing else owns it.
    let mut file = std::fs::File::from(unsafe { OwnedFd::from_raw_fd(number) });
    io::Write::write_all(&mut file, bytes)?;
    // SAFETY: no pointers are involved.
    check(unsafe { libc::fcntl(file.as_raw_fd(), libc::F_ADD_SEALS, SEALS) })?;
    Ok(file.into())
}

/// The same open file under a number from `lowest` on, closed on exec; under its old one if that many are not allowed.
pub(crate) fn move_up(descriptor: OwnedFd, lowest: RawFd) -> OwnedFd {
    // SAFETY: no pointers are involved.
    let number = unsafe { libc::fcntl(descriptor.as_raw_fd(), libc::F_DUPFD_CLOEXEC, lowest) };
    if number < 0 {
        return descriptor;
    }
    // SAFETY: the kernel made the descriptor just now, and nothing else owns it.
    unsafe { OwnedFd::from_raw_fd(number) }
}

/// Whether a file has an extended attribute of this name.
pub(crate) fn has_attribute(path: &CStr, name: &CStr) -> bool {
    // SAFETY: both are C strings that outlive the call; with a size of 0 nothing is written.
    unsafe { libc::getxattr(path.as_ptr(), name.as_ptr(), ptr::null_mut(), 0) > 0 }
}

fn new_descriptor(number: libc::c_long) -> io::Result<OwnedFd> {
    let number = RawFd::try_from(number).map_err(io::Error::other)?;
    check(number)?;
    // SAFETY: the kernel opened the descriptor just now, and nothing else owns it.
    Ok(unsafe { OwnedFd::from_raw_fd(number) })
}

fn check(result: libc::c_int) -> io::Result<()> {
    if result < 0 {
        Err(io::Error::last_os_error())
    } else {
        Ok(())
    }
}
