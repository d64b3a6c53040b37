//! The open files that the program gets: made here, known by their names, and put where no other file is.

use super::filter::ASKED_FROM;
use super::listener::Listener;
use super::subject::{FILE_NAME, FileName};
use rustix::fs::{MemfdFlags, Mode, OFlags, memfd_create, open};
use rustix::io::Errno;
use std::fs;
use std::os::fd::{AsFd, AsRawFd, OwnedFd};
use std::sync::atomic::{AtomicU64, Ordering};

/// The first number to try: select() takes it (below 1024), and a program with few files does not reach it.
const FIRST: u32 = 900;
/// The most descriptors of a process (the kernel's `fs.nr_open`).
const DESCRIPTORS_MAX: u32 = 1 << 20;

/// A new open file, with a name that no other of this process has.
pub(super) fn make(server: u32, bus: u32) -> Result<(FileName, OwnedFd), Errno> {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    let token = NEXT.fetch_add(1, Ordering::Relaxed);
    let name = format!("{FILE_NAME}:{server}:{token}:{bus}");
    let file = memfd_create(name, MemfdFlags::CLOEXEC)?;
    let path = format!("/proc/self/fd/{}", file.as_raw_fd());
    Ok((FileName { token, bus }, open_for_ioctl(&path)?))
}

/// A second open file of the same name as a thread's.
pub(super) fn copy(thread: u32, descriptor: u32) -> Result<OwnedFd, Errno> {
    open_for_ioctl(&format!("/proc/{thread}/fd/{descriptor}"))
}

/// Access mode 3 of open(2): read() and write() return EBADF where the filter does not ask, and so are never silent.
fn open_for_ioctl(path: &str) -> Result<OwnedFd, Errno> {
    open(path, OFlags::RWMODE | OFlags::CLOEXEC, Mode::empty())
}

/// Gives the caller the file under the first free number, and returns that.
pub(super) fn give(
    listener: &Listener,
    id: u64,
    thread: u32,
    file: &OwnedFd,
    close_on_exec: bool,
) -> Result<i64, Errno> {
    let is_free =
        |number: &u32| fs::symlink_metadata(format!("/proc/{thread}/fd/{number}")).is_err();
    // The program's limit ends the first range, and then the second.
    for mut range in [FIRST..DESCRIPTORS_MAX, ASKED_FROM..FIRST] {
        let Some(number) = range.find(is_free) else {
            continue;
        };
        match listener.add(id, file.as_fd(), number, close_on_exec) {
            Err(Errno::BADF) => {}
            outcome => return outcome,
        }
    }
    Err(Errno::MFILE)
}

/// The open files that any process has, as /proc shows them.
pub(super) fn in_use(is_ours: impl Fn(u32, u32) -> Option<FileName>) -> Vec<FileName> {
    let entries = |path: String| fs::read_dir(path).into_iter().flatten().flatten();
    let number = |entry: fs::DirEntry| entry.file_name().to_str()?.parse::<u32>().ok();
    let mut found = Vec::new();
    for process in entries("/proc".to_owned()).filter_map(number) {
        let descriptors = entries(format!("/proc/{process}/fd")).filter_map(number);
        found.extend(descriptors.filter_map(|descriptor| is_ours(process, descriptor)));
    }
    found
}
