//! Passes signals on while a program runs, and ends the program when this process dies.
#![expect(
    unsafe_code,
    reason = "signal handlers and work between fork and exec have no safe wrapper"
)]

use rustix::io::Errno;
use rustix::process::{Signal, getpid, getppid, set_parent_process_death_signal};
use std::mem;
use std::os::unix::process::CommandExt;
use std::process::Command;
use std::ptr;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};

const SIGNALS: [libc::c_int; 4] = [libc::SIGINT, libc::SIGQUIT, libc::SIGTERM, libc::SIGHUP];

/// The receiver of the signals: a process number or [`NOBODY_YET`].
static PROGRAM: AtomicI32 = AtomicI32::new(NOBODY_YET);
/// A signal that came before the program started, or 0.
static EARLY: AtomicI32 = AtomicI32::new(0);
const NOBODY_YET: i32 = 0;
/// Whether a run handles the signals; only one at a time does.
static TAKEN: AtomicBool = AtomicBool::new(false);

pub(super) struct HandedOn {
    before: Vec<(libc::c_int, libc::sigaction)>,
}

impl HandedOn {
    /// Takes over the signals, if `wanted` and no other run has them.
    pub(super) fn begin(wanted: bool) -> Self {
        if !wanted || TAKEN.swap(true, Ordering::SeqCst) {
            return Self { before: Vec::new() };
        }
        PROGRAM.store(NOBODY_YET, Ordering::SeqCst);
        EARLY.store(0, Ordering::SeqCst);
        Self {
            before: SIGNALS.into_iter().filter_map(take).collect(),
        }
    }

    pub(super) fn to(&self, pid: u32) {
        if self.before.is_empty() {
            return;
        }
        let pid = i32::try_from(pid).unwrap_or(NOBODY_YET);
        PROGRAM.store(pid, Ordering::SeqCst);
        let early = EARLY.swap(0, Ordering::SeqCst);
        if early != 0 && pid > 0 {
            send(pid, early);
        }
    }
}

impl Drop for HandedOn {
    fn drop(&mut self) {
        if self.before.is_empty() {
            return;
        }
        for (signal, action) in &self.before {
            // SAFETY: `action` is what the kernel returned for this signal.
            unsafe { libc::sigaction(*signal, action, ptr::null_mut()) };
        }
        TAKEN.store(false, Ordering::SeqCst);
    }
}

/// Makes the kernel send SIGTERM to the program if the thread that started it ends first, for whatever reason.
pub(super) fn end_with_this_process(command: &mut Command) {
    let parent = Some(getpid());
    let work = move || {
        set_parent_process_death_signal(Some(Signal::TERM))?;
        if getppid() == parent {
            Ok(())
        } else {
            Err(Errno::CANCELED.into())
        }
    };
    // SAFETY: `work` makes two system calls, which neither allocate nor lock.
    unsafe { command.pre_exec(work) };
}

/// An ignored signal stays ignored, for the program too (nohup).
fn take(signal: libc::c_int) -> Option<(libc::c_int, libc::sigaction)> {
    // SAFETY: all of its fields may be zero.
    let mut before: libc::sigaction = unsafe { mem::zeroed() };
    // SAFETY: the kernel fills `before`; there is no new action.
    let asked = unsafe { libc::sigaction(signal, ptr::null(), &raw mut before) };
    if asked < 0 || before.sa_sigaction == libc::SIG_IGN {
        return None;
    }
    let mut action = before;
    let handler: extern "C" fn(libc::c_int, *mut libc::siginfo_t, *mut libc::c_void) = hand_on;
    #[expect(
        clippy::as_conversions,
        reason = "only a cast makes an address of a function"
    )]
    let address = (handler as *const ()).expose_provenance();
    action.sa_sigaction = address;
    action.sa_flags = libc::SA_SIGINFO | libc::SA_RESTART;
    // SAFETY: the handler has the signature that SA_SIGINFO requires, and only makes system calls.
    let taken = unsafe { libc::sigaction(signal, &raw const action, ptr::null_mut()) };
    (taken == 0).then_some((signal, before))
}

extern "C" fn hand_on(signal: libc::c_int, origin: *mut libc::siginfo_t, _: *mut libc::c_void) {
    // SAFETY: with SA_SIGINFO, the kernel passes a valid record to the handler.
    let from_terminal = unsafe { (*origin).si_code } == libc::SI_KERNEL
        && matches!(signal, libc::SIGINT | libc::SIGQUIT);
    let pid = PROGRAM.load(Ordering::SeqCst);
    if pid <= 0 {
        EARLY.store(signal, Ordering::SeqCst);
    } else if !from_terminal {
        send(pid, signal);
    }
}

/// A program that has ended but not been waited for takes a signal without effect.
fn send(pid: libc::pid_t, signal: libc::c_int) {
    // SAFETY: errno's address is valid for the thread's life.
    let errno = unsafe { libc::__errno_location() };
    // SAFETY: as above; kill takes no pointers. errno is restored for the interrupted code.
    unsafe {
        let before = *errno;
        libc::kill(pid, signal);
        *errno = before;
    }
}
