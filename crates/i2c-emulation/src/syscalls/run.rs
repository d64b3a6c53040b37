//! Starts a program under the filter, and answers it until it ends.
#![expect(
    unsafe_code,
    reason = "a filter is installed by the program's own process, between fork and exec"
)]

use super::call::Call;
use super::caretaker::Caretaker;
use super::filter::Filter;
use super::listener::{self, Listener, Question};
use super::memory::ProcessMemory;
use super::session::Session;
use crate::guests::lock;
use crate::ioctl::{AdapterMode, CallerMemory};
use crate::rack::Rack;
use crate::run::{Ended, RunError, not_started, setup_failed, wait_for};
use rustix::cmsg_space;
use rustix::event::{PollFd, PollFlags, poll};
use rustix::io::Errno;
use rustix::net::{
    RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, SendAncillaryBuffer,
    SendAncillaryMessage, SendFlags, recvmsg, sendmsg,
};
use std::io::{self, IoSlice, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;

/// Whether programs that gain rights when they start do so here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rights {
    Gained,
    NotGained,
}

/// Checks whether this kernel lets a process answer another's calls.
pub(crate) fn probe() -> Result<Rights, RunError> {
    let witness = [0x5Au8; 1];
    let address = u64::try_from(witness.as_ptr().expose_provenance()).unwrap_or(0);
    ProcessMemory::of_this_process()
        .read(address, &mut [0; 1])
        .map_err(|errno| RunError::NoMemory(errno.into()))?;
    if !cfg!(any(
        target_arch = "x86_64",
        target_arch = "aarch64",
        target_arch = "x86",
        target_arch = "arm"
    )) || !listener::fits()
    {
        return Err(RunError::NoNotification(Errno::NOSYS.into()));
    }
    // A filter is a thread's own: this one ends with its filter.
    let (made, keeps_rights) = thread::spawn(|| Filter::open().install())
        .join()
        .unwrap_or_else(|_panic| Err(Errno::NOSYS.into()))
        .map_err(not_installed)?;
    // Nobody has asked, which is what a kernel says that can add descriptors: Linux 5.9.
    match Listener::new(made.try_clone().map_err(not_installed)?).add(0, made.as_fd(), 0, true) {
        Err(Errno::NOENT) => Ok(match keeps_rights {
            true => Rights::Gained,
            false => Rights::NotGained,
        }),
        Err(errno) => Err(RunError::NoNotification(errno.into())),
        Ok(_) => Err(RunError::NoNotification(Errno::NOSYS.into())),
    }
}

fn not_installed(error: io::Error) -> RunError {
    match Errno::from_io_error(&error) {
        Some(Errno::BUSY) => RunError::AlreadySupervised,
        _ => RunError::NoNotification(error),
    }
}

/// Runs `command` to its end with the buses of `rack`; calls `started` with the program's process number.
pub(crate) fn run_rack(
    rack: &Rack,
    mode: AdapterMode,
    command: &mut Command,
    started: &(dyn Fn(u32) + Sync),
) -> Result<Ended, RunError> {
    let session = Session::new(rack, mode);
    let (mut child, listener) = start(command)?;
    let caretaker = match Caretaker::start(&listener, &session.devices) {
        Ok(caretaker) => caretaker,
        Err(source) => {
            // Nobody would answer it.
            let _ = child.kill();
            let _ = child.wait();
            return Err(setup_failed("starting the caretaker", source));
        }
    };
    let supervisor = Supervisor {
        listener,
        session,
        caretaker,
        turn: Mutex::new(()),
        threads: AtomicUsize::new(0),
        idle: AtomicUsize::new(0),
    };
    let (awake, wake) =
        UnixStream::pair().map_err(|source| setup_failed("making a socket pair", source))?;
    let status = thread::scope(|scope| {
        supervisor.add_thread(scope, wake.as_fd());
        let status = wait_for(child, command, started);
        drop(awake);
        status
    });
    let opens = supervisor.session.opens();
    supervisor.caretaker.take_over(&supervisor.listener);
    Ok(Ended {
        status: status?,
        opens,
    })
}

/// Starts the program's process, which installs the filter and sends its listener before exec.
fn start(command: &mut Command) -> Result<(Child, Listener), RunError> {
    let filter = Filter::new();
    let pair = UnixStream::pair();
    let (here, there) = pair.map_err(|source| setup_failed("making a socket pair", source))?;
    // The command keeps the work for its next run, which then must do nothing.
    let armed = Arc::new(AtomicBool::new(true));
    let work = {
        let armed = Arc::clone(&armed);
        move || match armed.load(Ordering::SeqCst) {
            true => install_and_send(&filter, &there),
            false => Ok(()),
        }
    };
    // SAFETY: `work` only makes system calls, which neither allocate nor lock.
    unsafe { command.pre_exec(work) };
    let spawned = command.spawn();
    armed.store(false, Ordering::SeqCst);
    // What was sent has arrived: spawn returns after exec.
    let _ = here.set_nonblocking(true);
    match (spawned, receive(&here)) {
        (Ok(child), Ok(listener)) => Ok((child, Listener::new(listener))),
        (Ok(mut child), Err(source)) => {
            let _ = child.kill();
            let _ = child.wait();
            Err(setup_failed("receiving the filter's listener", source))
        }
        // It came as far as exec.
        (Err(source), Ok(_)) => Err(not_started(command, source)),
        (Err(source), Err(_)) => Err(match source.raw_os_error() {
            Some(libc::ENOENT | libc::EACCES | libc::EPERM | libc::ENOTDIR) => {
                not_started(command, source)
            }
            _ => not_installed(source),
        }),
    }
}

fn install_and_send(filter: &Filter, socket: &UnixStream) -> io::Result<()> {
    let (listener, _keeps_rights) = filter.install()?;
    let mut room = [MaybeUninit::uninit(); cmsg_space!(ScmRights(1))];
    let mut ancillary = SendAncillaryBuffer::new(&mut room);
    let files = [listener.as_fd()];
    ancillary.push(SendAncillaryMessage::ScmRights(&files));
    sendmsg(
        socket,
        &[IoSlice::new(&[0])],
        &mut ancillary,
        SendFlags::NOSIGNAL,
    )?;
    Ok(())
}

fn receive(socket: &UnixStream) -> io::Result<OwnedFd> {
    let mut room = [MaybeUninit::uninit(); cmsg_space!(ScmRights(1))];
    let mut ancillary = RecvAncillaryBuffer::new(&mut room);
    let mut byte = [0];
    let parts = &mut [IoSliceMut::new(&mut byte)];
    recvmsg(socket, parts, &mut ancillary, RecvFlags::CMSG_CLOEXEC)?;
    let files = ancillary.drain().filter_map(|message| match message {
        RecvAncillaryMessage::ScmRights(files) => Some(files),
        _ => None,
    });
    let file = files.flatten().next();
    file.ok_or_else(|| io::ErrorKind::UnexpectedEof.into())
}

/// What the threads that answer share.
struct Supervisor<'a> {
    listener: Listener,
    session: Session<'a>,
    caretaker: Caretaker,
    /// Held by the thread that waits for the next question.
    turn: Mutex<()>,
    threads: AtomicUsize,
    /// Threads that wait for their turn.
    idle: AtomicUsize,
}

impl Supervisor<'_> {
    fn add_thread<'s>(&'s self, scope: &'s thread::Scope<'s, '_>, wake: BorrowedFd<'s>) {
        let number = self.threads.fetch_add(1, Ordering::Relaxed);
        if let Some(unanswered) = self.caretaker.unanswered.by_thread().get(number) {
            scope.spawn(move || self.serve(scope, wake, unanswered));
        }
    }

    /// Answers until `wake` is closed at its other end. While a bus takes its time, another thread waits for questions.
    fn serve<'s>(
        &'s self,
        scope: &'s thread::Scope<'s, '_>,
        wake: BorrowedFd<'s>,
        unanswered: &AtomicU64,
    ) {
        // Kept from one question to the next where nothing takes time.
        let mut kept = None;
        loop {
            let turn = kept.take().unwrap_or_else(|| {
                self.idle.fetch_add(1, Ordering::SeqCst);
                let turn = lock(&self.turn);
                self.idle.fetch_sub(1, Ordering::SeqCst);
                turn
            });
            let Some(question) = self.next(wake, unanswered) else {
                return;
            };
            if matches!(question.call, Call::Transfer(_) | Call::Ioctl) {
                if self.idle.load(Ordering::SeqCst) == 0 {
                    self.add_thread(scope, wake);
                }
                drop(turn);
            } else {
                kept = Some(turn);
            }
            let answer = self.session.answer(&question, &self.listener);
            self.listener.answer(question.id, answer);
            unanswered.store(0, Ordering::SeqCst);
        }
    }

    fn next(&self, wake: BorrowedFd<'_>, unanswered: &AtomicU64) -> Option<Question> {
        loop {
            let mut either = [
                PollFd::new(&self.listener, PollFlags::IN),
                PollFd::new(&wake, PollFlags::IN),
            ];
            match poll(&mut either, None) {
                Err(Errno::INTR) => continue,
                Err(_) => return None,
                Ok(_) => {}
            }
            let [asked, ended] = either.map(|entry| entry.revents());
            if !ended.is_empty() {
                return None;
            }
            if !asked.contains(PollFlags::IN) {
                // The last program has ended, and its end will be told soon.
                let mut wake = [PollFd::new(&wake, PollFlags::IN)];
                let _ = poll(&mut wake, None);
                return None;
            }
            match self.listener.receive() {
                Ok(Some(question)) => {
                    unanswered.store(question.id, Ordering::SeqCst);
                    return Some(question);
                }
                Ok(None) => {}
                Err(_) => return None,
            }
        }
    }
}
