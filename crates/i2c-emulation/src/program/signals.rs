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
/// A signal that came before [`PROGRAM`] was known, or 0. A fork copies it: the program's process dies of it before exec.
static EARLY: AtomicI32 = AtomicI32::new(0);
/// The same, if only this process got it. The terminal signals the program's process too, as soon as there is one.
static UNSENT: AtomicI32 = AtomicI32::new(0);
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
        UNSENT.store(0, Ordering::SeqCst);
        Self {
            before: SIGNALS.into_iter().filter_map(take).collect(),
        }
    }

    /// Prepares what the program's process does before exec. The kernel sends SIGTERM to it if the thread that started it
    /// ends first, for whatever reason; and it dies of a signal that came before exec, as its program would have.
    pub(super) fn prepare(&self, command: &mut Command) {
        let parent = Some(getpid());
        let taken: Vec<libc::c_int> = self.before.iter().map(|(signal, _)| *signal).collect();
        let work = move || {
            set_parent_process_death_signal(Some(Signal::TERM))?;
            if getppid() != parent {
                return Err(Errno::CANCELED.into());
            }
            for signal in &taken {
                // SAFETY: this handler is what exec would set.
                unsafe { libc::signal(*signal, libc::SIG_DFL) };
            }
            // Without a handler of this process, nothing was stored for it.
            let early = EARLY.load(Ordering::SeqCst);
            if early != 0 && !taken.is_empty() {
                send(getpid().as_raw_pid(), early);
            }
            Ok(())
        };
        // SAFETY: `work` only makes system calls, which neither allocate nor lock.
        unsafe { command.pre_exec(work) };
    }

    pub(super) fn to(&self, pid: u32) {
        if !self.before.is_empty() {
            PROGRAM.store(i32::try_from(pid).unwrap_or(NOBODY_YET), Ordering::SeqCst);
            send_unsent();
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
    if pid > 0 {
        if !from_terminal {
            send(pid, signal);
        }
        return;
    }
    EARLY.store(signal, Ordering::SeqCst);
    if !from_terminal {
        UNSENT.store(signal, Ordering::SeqCst);
        send_unsent();
    }
}

/// Nothing until the program's number is known, which another thread may make known at this moment.
fn send_unsent() {
    let pid = PROGRAM.load(Ordering::SeqCst);
    if pid > 0 {
        let signal = UNSENT.swap(0, Ordering::SeqCst);
        if signal != 0 {
            send(pid, signal);
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufRead as _, BufReader, Write as _};
    use std::os::unix::process::ExitStatusExt as _;
    use std::process::Stdio;
    use std::sync::{Mutex, PoisonError};

    /// One run at a time handles signals.
    static ONE: Mutex<()> = Mutex::new(());

    /// As the kernel tells this process of Ctrl-C at its terminal; handled when this returns.
    fn from_the_terminal(signal: libc::c_int) {
        // SAFETY: all of its fields may be zero.
        let mut record: libc::siginfo_t = unsafe { mem::zeroed() };
        record.si_signo = signal;
        record.si_code = libc::SI_KERNEL;
        // SAFETY: the record outlives the call, which sends to this thread.
        let sent = unsafe {
            let thread = libc::gettid();
            let call = libc::SYS_rt_tgsigqueueinfo;
            libc::syscall(call, libc::getpid(), thread, signal, &raw const record)
        };
        assert_eq!(sent, 0);
    }

    #[test]
    fn ctrl_c_before_the_program_is_known_reaches_it_once() {
        let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
        let handed_on = HandedOn::begin(true);
        let mut command = Command::new("sh");
        let script = "trap 'echo INT' INT; trap 'echo TERM' TERM; echo ready; \
            until [ \"$line\" = end ]; do read -r line; done";
        command.args(["-c", script]);
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        handed_on.prepare(&mut command);
        let mut child = command.spawn().unwrap();
        let mut said = BufReader::new(child.stdout.take().unwrap()).lines();
        assert_eq!(said.next().unwrap().unwrap(), "ready");
        // The program runs, and this process has not been told its number. Another program signals this process alone.
        send(getpid().as_raw_pid(), libc::SIGTERM);
        while EARLY.load(Ordering::SeqCst) == 0 {
            std::thread::yield_now();
        }
        // The terminal signals both.
        from_the_terminal(libc::SIGINT);
        send(i32::try_from(child.id()).unwrap(), libc::SIGINT);
        assert_eq!(said.next().unwrap().unwrap(), "INT");
        handed_on.to(child.id());
        child.stdin.take().unwrap().write_all(b"end\n").unwrap();
        let rest: Vec<String> = said.map(Result::unwrap).collect();
        assert_eq!(rest, ["TERM"]);
        child.wait().unwrap();
    }

    #[test]
    fn ctrl_c_before_the_program_exists_ends_it() {
        let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
        let handed_on = HandedOn::begin(true);
        let mut command = Command::new("true");
        handed_on.prepare(&mut command);
        from_the_terminal(libc::SIGINT);
        let mut child = command.spawn().unwrap();
        handed_on.to(child.id());
        assert_eq!(child.wait().unwrap().signal(), Some(libc::SIGINT));
    }
}
