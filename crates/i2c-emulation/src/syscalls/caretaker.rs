//! What answers when the supervisor has ended and programs go on: without anybody, every call that the filter asks for
//! would return ENOSYS. A process of its own lets the kernel carry out all calls, except those on a device, which return
//! ENOTCONN. It ends with the last of these programs.
#![expect(
    unsafe_code,
    reason = "a process that only makes system calls is made by fork, and shares a page with its parent"
)]

use super::listener::{Answer, Listener};
use super::subject::Devices;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::mm::{MapFlags, ProtFlags, mmap_anonymous, munmap};
use rustix::pipe::{PipeFlags, pipe_with};
use std::io;
use std::os::fd::{AsRawFd, OwnedFd, RawFd};
use std::sync::atomic::{AtomicU64, Ordering};

/// The most threads of a supervisor: transfers that take their time at once, and one that waits.
pub(super) const THREADS: usize = 256;

/// The numbers of the questions that the supervisor is answering, in memory that the caretaker sees too; 0 is none.
pub(super) struct Unanswered(*mut [AtomicU64; THREADS]);

// SAFETY: the page lives until it is dropped, and holds only atomic numbers.
unsafe impl Sync for Unanswered {}

impl Unanswered {
    fn new() -> io::Result<Self> {
        let length = size_of::<[AtomicU64; THREADS]>();
        let (rights, flags) = (ProtFlags::READ | ProtFlags::WRITE, MapFlags::SHARED);
        // SAFETY: the kernel chooses the place.
        let page = unsafe { mmap_anonymous(std::ptr::null_mut(), length, rights, flags) }?;
        Ok(Self(page.cast()))
    }

    pub(super) const fn by_thread(&self) -> &[AtomicU64; THREADS] {
        // SAFETY: the page is aligned and zero, which is the number 0.
        unsafe { &*self.0 }
    }
}

impl Drop for Unanswered {
    fn drop(&mut self) {
        // SAFETY: nothing borrows from the page any more.
        let _ = unsafe { munmap(self.0.cast(), size_of::<[AtomicU64; THREADS]>()) };
    }
}

/// A process that waits for the end of this one, or of this value.
pub(super) struct Caretaker {
    process: libc::pid_t,
    pub(super) unanswered: Unanswered,
    /// The caretaker reads the end of it.
    alive: OwnedFd,
}

impl Caretaker {
    pub(super) fn start(listener: &Listener, devices: &Devices) -> io::Result<Self> {
        let unanswered = Unanswered::new()?;
        let (dead, alive) = pipe_with(PipeFlags::CLOEXEC)?;
        // SAFETY: the new process only makes system calls, which neither allocate nor lock, and then ends.
        let process = unsafe { libc::fork() };
        match process {
            -1 => return Err(io::Error::last_os_error()),
            0 => {
                take_care(listener, devices, &dead, &unanswered);
                // SAFETY: nothing is left to do here.
                unsafe { libc::_exit(0) };
            }
            _ => {}
        }
        Ok(Self {
            process,
            unanswered,
            alive,
        })
    }

    /// Lets it answer; returns once it has ended, unless programs are left.
    pub(super) fn take_over(self, listener: &Listener) {
        drop(self.alive);
        let mut left = [PollFd::new(listener, PollFlags::IN)];
        let _ = poll(&mut left, Some(&Timespec::default()));
        if left[0].revents().contains(PollFlags::HUP) {
            // SAFETY: there is no status to write.
            while unsafe { libc::waitpid(self.process, std::ptr::null_mut(), 0) } < 0
                && Errno::from_io_error(&io::Error::last_os_error()) == Some(Errno::INTR)
            {
            }
        }
    }
}

fn take_care(listener: &Listener, devices: &Devices, dead: &OwnedFd, unanswered: &Unanswered) {
    live_apart([listener.as_raw_fd(), dead.as_raw_fd()]);
    while rustix::io::read(dead, &mut [0]) == Err(Errno::INTR) {}
    for id in unanswered.by_thread() {
        listener.answer(id.load(Ordering::SeqCst), Answer::AsEver);
    }
    loop {
        let mut question = [PollFd::new(listener, PollFlags::IN)];
        match poll(&mut question, None) {
            Err(Errno::INTR) => continue,
            Err(_) => return,
            Ok(_) => {}
        }
        if !question[0].revents().contains(PollFlags::IN) {
            // The last program has ended.
            return;
        }
        match listener.receive() {
            Ok(Some(question)) => {
                let answer = match devices.subject_of(&question) {
                    Some(_) => Answer::Failed(Errno::NOTCONN),
                    None => Answer::AsEver,
                };
                listener.answer(question.id, answer);
            }
            Ok(None) => {}
            Err(_) => return,
        }
    }
}

/// No signal for the supervisor reaches this process, and it keeps nothing open but these files.
fn live_apart(mut kept: [RawFd; 2]) {
    // SAFETY: the set is filled before it is used.
    unsafe {
        let mut all: libc::sigset_t = std::mem::zeroed();
        libc::sigfillset(&raw mut all);
        libc::sigprocmask(libc::SIG_SETMASK, &raw const all, std::ptr::null_mut());
    }
    let _ = rustix::process::setsid();
    kept.sort_unstable();
    let [first, second] = kept;
    for (from, to) in [
        (0, first - 1),
        (first + 1, second - 1),
        (second + 1, RawFd::MAX),
    ] {
        if from <= to {
            // SAFETY: nothing uses these descriptors any more.
            unsafe { libc::syscall(libc::SYS_close_range, from, to, 0) };
        }
    }
}
