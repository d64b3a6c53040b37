//! Who gets the signals while a program runs, and what becomes of the program when this process dies.
#![expect(
    unsafe_code,
    reason = "signal handlers and prctl have no wrapper in std"
)]

use std::io;
use std::mem::MaybeUninit;
use std::process::Command;
use std::ptr;
use std::sync::Mutex;
use std::sync::atomic::{AtomicI32, Ordering};

use crate::sys;

/// The signals that are the program's while it runs.
const SIGNALS: [libc::c_int; 4] = [libc::SIGINT, libc::SIGQUIT, libc::SIGTERM, libc::SIGHUP];

/// Who gets the signals: a process number or [`NOBODY_YET`].
static PROGRAM: AtomicI32 = AtomicI32::new(NOBODY_YET);
/// A signal that came before there was a program, or 0.
static EARLY: AtomicI32 = AtomicI32::new(0);
const NOBODY_YET: i32 = 0;
/// One run at a time has the signals.
static ONE_AT_A_TIME: Mutex<bool> = Mutex::new(false);

/// Signals are handed on for as long as this lives.
pub(super) struct HandedOn {
    before: Vec<(libc::c_int, libc::sigaction)>,
}

impl HandedOn {
    /// Takes the signals, if that is wanted and no other run has them.
    pub(super) fn begin(wanted: bool) -> Self {
        let mut taken = lock();
        if !wanted || *taken {
            return Self { before: Vec::new() };
        }
        *taken = true;
        PROGRAM.store(NOBODY_YET, Ordering::SeqCst);
        EARLY.store(0, Ordering::SeqCst);
        Self {
            before: SIGNALS.into_iter().filter_map(take).collect(),
        }
    }

    /// From here on they go to this process.
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
            // SAFETY: `action` is what the kernel handed out for this signal.
            unsafe { libc::sigaction(*signal, action, ptr::null_mut()) };
        }
        *lock() = false;
    }
}

/// Lets the kernel send SIGTERM to the program when the thread that started it ends before it, for whatever reason.
pub(super) fn end_with_this_process(command: &mut Command) {
    let parent = sys::own_pid();
    let work = move || {
        // SAFETY: no pointers are involved.
        if unsafe { libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGTERM) } < 0 {
            return Err(io::Error::last_os_error());
        }
        // SAFETY: the call takes nothing and cannot fail.
        if unsafe { libc::getppid() } != parent {
            return Err(io::Error::from_raw_os_error(libc::ECANCELED));
        }
        Ok(())
    };
    // SAFETY: `work` makes two system calls, and neither allocates nor locks.
    unsafe { sys::before_exec(command, work) };
}

fn lock() -> std::sync::MutexGuard<'static, bool> {
    ONE_AT_A_TIME
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// A signal that this process was told to ignore stays ignored, for the program as well (nohup).
fn take(signal: libc::c_int) -> Option<(libc::c_int, libc::sigaction)> {
    let mut before = MaybeUninit::<libc::sigaction>::uninit();
    // SAFETY: the kernel fills `before`; no new action is given.
    if unsafe { libc::sigaction(signal, ptr::null(), before.as_mut_ptr()) } < 0 {
        return None;
    }
    // SAFETY: the call succeeded, so it was filled.
    let before = unsafe { before.assume_init() };
    if before.sa_sigaction == libc::SIG_IGN {
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
    // SAFETY: the handler has the signature that SA_SIGINFO asks for, and only makes system calls.
    let taken = unsafe { libc::sigaction(signal, &raw const action, ptr::null_mut()) };
    (taken == 0).then_some((signal, before))
}

extern "C" fn hand_on(
    signal: libc::c_int,
    origin: *mut libc::siginfo_t,
    _context: *mut libc::c_void,
) {
    // SAFETY: the kernel hands a valid record to a handler with SA_SIGINFO.
    let from_terminal = unsafe { (*origin).si_code } == libc::SI_KERNEL
        && matches!(signal, libc::SIGINT | libc::SIGQUIT);
    let pid = PROGRAM.load(Ordering::SeqCst);
    if pid > 0 {
        if !from_terminal {
            send(pid, signal);
        }
    } else {
        EARLY.store(signal, Ordering::SeqCst);
    }
}

/// A program that has ended but was not waited for yet takes a signal without effect.
fn send(pid: libc::pid_t, signal: libc::c_int) {
    // SAFETY: errno belongs to the interrupted code, and its address is valid for the thread's life.
    let errno = unsafe { libc::__errno_location() };
    // SAFETY: as above; kill takes no pointers.
    unsafe {
        let before = *errno;
        libc::kill(pid, signal);
        *errno = before;
    }
}
