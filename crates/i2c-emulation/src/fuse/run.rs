//! Runs a program with its devices: mounts, starts, serves and waits.

use super::caller::ProcessMemory;
use super::namespace::{Plan, Right, StepFailed};
use super::session::{Reply, Session, SharedBus};
use super::wire;
use crate::adapter::{ByFunction, EmulatedAdapter, Fault, Message, TransferError};
use crate::ioctl::{AdapterMode, CallerMemory};
use crate::run::{Ended, FUSE_NEEDS, RunError, Way, not_started, socket_pair, wait_for};
use rustix::event::{PollFd, PollFlags, poll};
use rustix::io::{Errno, retry_on_intr};
use rustix::process::{
    Pid, PidfdFlags, PidfdGetfdFlags, getegid, geteuid, getpid, pidfd_getfd, pidfd_open,
};
use std::io;
use std::net::Shutdown;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread;

/// Where the device appears and how it behaves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// The device's path in the program. Hides an existing file; a missing one must be directly in `/dev`.
    pub device: PathBuf,
    /// The adapter to imitate.
    pub mode: AdapterMode,
    /// The kernel's FUSE device, `/dev/fuse`.
    pub fuse_device: PathBuf,
}

impl Options {
    /// A device at `device` that behaves like a Raspberry Pi's.
    #[must_use]
    pub fn new(device: impl Into<PathBuf>) -> Self {
        Self {
            device: device.into(),
            mode: AdapterMode::default(),
            fuse_device: PathBuf::from("/dev/fuse"),
        }
    }
}

/// Runs `command` to its end with `adapter` as its device, and returns how it ended.
///
/// Only the program and whatever it starts see the device, and nothing of it remains, however they end. Signals are not
/// touched. The adapter is locked for one transfer at a time.
/// # Errors
/// What this machine or user lacks; once the program runs, only [`RunError::Serve`] and [`RunError::Wait`].
pub fn run<A: EmulatedAdapter + Send>(
    adapter: &Mutex<A>,
    options: &Options,
    command: &mut Command,
) -> Result<ExitStatus, RunError> {
    let path = options.device.clone();
    let devices = [Device { path, adapter }];
    let fuse_device = &options.fuse_device;
    run_devices(&devices, options.mode, fuse_device, command, &|_pid| {}).map(|ended| ended.status)
}

pub(crate) struct Device<'a> {
    pub(crate) path: PathBuf,
    pub(crate) adapter: &'a SharedBus<'a>,
}

/// As [`run`], with any number of devices; calls `started` with the program's process number.
pub(crate) fn run_devices(
    devices: &[Device<'_>],
    mode: AdapterMode,
    fuse_device: &Path,
    command: &mut Command,
    started: &(dyn Fn(u32) + Sync),
) -> Result<Ended, RunError> {
    let setting = Setting {
        paths: devices.iter().map(|device| device.path.as_path()).collect(),
        fuse_device,
        started,
    };
    // Closing one end wakes the reader of the other.
    let (wake, awake) = socket_pair(FUSE_NEEDS)?;
    let (arrivals, mounted) = mpsc::sync_channel(1);
    thread::scope(|scope| {
        let program = scope.spawn(|| {
            let outcome = run_program(&setting, command, &arrivals);
            drop(awake);
            // Dropping the sender wakes the receiver that waits for the mounts.
            drop(arrivals);
            outcome
        });
        let served = match mounted.recv() {
            Ok(mounted) => serve_all(mounted, wake.as_fd(), mode, devices),
            // The helper thread failed before mounting anything; its result has the reason.
            Err(mpsc::RecvError) => Ok(0),
        };
        let status = join(program)?;
        served.map(|opens| Ended {
            status,
            via: Way::Fuse,
            opens,
        })
    })
}

/// Checks whether [`run`] can work here: runs the program `true` with a device on which no target answers.
/// # Errors
/// Those of [`run`].
pub fn probe() -> Result<(), RunError> {
    probe_with(Path::new("/dev/fuse"))
}

pub(crate) fn probe_with(fuse_device: &Path) -> Result<(), RunError> {
    let not_reached = |errno: Errno| {
        let step = "reading another process's memory (process_vm_readv)";
        RunError::NotPermitted(step.to_owned(), errno.into())
    };
    let witness = [0x5Au8; 1];
    let address = u64::try_from(witness.as_ptr().expose_provenance()).unwrap_or(0);
    ProcessMemory::of_this_process()
        .read(address, &mut [0; 1])
        .map_err(not_reached)?;
    run(
        &Mutex::new(ByFunction(|_: &mut [Message<'_>]| {
            let (completed, fault) = (0, Fault::NackAddress);
            Err(TransferError { completed, fault })
        })),
        &Options {
            fuse_device: fuse_device.to_owned(),
            ..Options::new("/dev/i2c-emulation-probe")
        },
        &mut Command::new("true"),
    )
    .map(drop)
}

struct Setting<'a> {
    paths: Vec<&'a Path>,
    fuse_device: &'a Path,
    started: &'a (dyn Fn(u32) + Sync),
}

/// The mounted devices; each one's requests arrive at its own `fuses` entry.
struct Mounted {
    fuses: Vec<OwnedFd>,
    owner: (u32, u32),
}

/// Serves each device in its own thread, so that a blocked bus blocks no other. Returns the number of opened files.
fn serve_all(
    mounted: Mounted,
    wake: BorrowedFd<'_>,
    mode: AdapterMode,
    devices: &[Device<'_>],
) -> Result<u64, RunError> {
    thread::scope(|scope| {
        let pairs = mounted.fuses.into_iter().zip(devices);
        let servers = pairs.map(|(fuse, device)| {
            scope.spawn(move || {
                let mut session = Session::new(mode, mounted.owner);
                // The open /dev/fuse closes with the thread: a device without a server must fail, not hang.
                serve(&fuse, wake, &mut session, device.adapter).map(|()| session.opens())
            })
        });
        let servers: Vec<_> = servers.collect();
        servers.into_iter().map(join).sum()
    })
}

/// The result of a thread; passes its panic on.
fn join<T>(thread: thread::ScopedJoinHandle<'_, T>) -> T {
    let outcome = thread.join();
    outcome.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// The helper thread: mounts, starts, waits. Its mount namespace ends with it and the program.
fn run_program(
    setting: &Setting<'_>,
    command: &mut Command,
    arrivals: &mpsc::SyncSender<Mounted>,
) -> Result<ExitStatus, RunError> {
    let plan = Plan::new(&setting.paths, setting.fuse_device, Right::Own)?;
    let child = match plan.prepare() {
        Ok(()) => {
            let (fuses, owner) = (plan.into_fuses(), Right::Own.owner());
            // The receiver waits for this in `run_devices`.
            let _ = arrivals.send(Mounted { fuses, owner });
            let spawned = command.spawn();
            spawned.map_err(|source| not_started(command, source))?
        }
        Err(failed) if (failed.step, failed.errno) == (0, libc::EPERM) => {
            start_in_user_namespace(setting, command, arrivals)?
        }
        Err(failed) => return Err(plan.explain(failed, setting.fuse_device)),
    };
    wait_for(child, command, setting.started)
}

/// Starts the program in a process that makes its own user and mount namespaces first.
fn start_in_user_namespace(
    setting: &Setting<'_>,
    command: &mut Command,
    arrivals: &mpsc::SyncSender<Mounted>,
) -> Result<Child, RunError> {
    let right = Right::NewUserNamespace {
        user: geteuid().as_raw(),
        group: getegid().as_raw(),
    };
    let plan = Arc::new(Plan::new(&setting.paths, setting.fuse_device, right)?);
    let (ours, theirs) = socket_pair(FUSE_NEEDS)?;
    let theirs = Arc::new(theirs);
    let armed = Arc::new(AtomicBool::new(true));
    arrange_in_child(command, &plan, &theirs, &armed);

    let (spawned, greeted) = thread::scope(|scope| {
        let greeting = scope.spawn(|| greet_child(&ours, &plan, right.owner(), arrivals));
        let spawned = command.spawn();
        // The child is past exec, or dead: wake the greeting if it still waits. Running the command again must not
        // repeat all this.
        armed.store(false, Ordering::SeqCst);
        let _ = theirs.shutdown(Shutdown::Both);
        (spawned, join(greeting))
    });
    greeted.map_err(|failed| plan.explain(failed, setting.fuse_device))?;
    spawned.map_err(|source| not_started(command, source))
}

/// The child's report: the failed step or 0, its errno or 0, its own process number.
type Report = [[u8; 4]; 3];

#[expect(
    unsafe_code,
    reason = "the namespaces of an unprivileged program can only be made in its own process"
)]
fn arrange_in_child(
    command: &mut Command,
    plan: &Arc<Plan>,
    socket: &Arc<UnixStream>,
    armed: &Arc<AtomicBool>,
) {
    let (plan, socket, armed) = (Arc::clone(plan), Arc::clone(socket), Arc::clone(armed));
    let work = move || match armed.load(Ordering::SeqCst) {
        true => arrange(&plan, &socket),
        false => Ok(()),
    };
    // SAFETY: `arrange` only makes system calls on data prepared before the fork; it neither allocates nor locks.
    unsafe { command.pre_exec(work) };
}

/// Runs between fork and exec: prepares, reports, waits until the server has /dev/fuse, finishes.
fn arrange(plan: &Plan, socket: &UnixStream) -> io::Result<()> {
    let prepared = plan.prepare();
    let (step, errno) = match prepared {
        Ok(()) => (0, 0),
        Err(failed) => (i32::try_from(failed.step).unwrap_or(i32::MAX), failed.errno),
    };
    let report: Report = [step, errno, getpid().as_raw_pid()].map(i32::to_ne_bytes);
    rustix::io::write(socket, report.as_flattened())?;
    let failed = |failed: StepFailed| io::Error::from_raw_os_error(failed.errno);
    prepared.map_err(failed)?;
    if rustix::io::read(socket, &mut [0])? == 0 {
        return Err(Errno::CANCELED.into());
    }
    plan.finish().map_err(failed)
}

/// Takes over the child's /dev/fuse once mounted, and lets the child continue.
fn greet_child(
    socket: &UnixStream,
    plan: &Plan,
    owner: (u32, u32),
    arrivals: &mpsc::SyncSender<Mounted>,
) -> Result<(), StepFailed> {
    let mut report = Report::default();
    if rustix::io::read(socket, report.as_flattened_mut()) != Ok(size_of::<Report>()) {
        // The child failed before making its namespaces; the error of spawn has the reason.
        return Ok(());
    }
    let [step, errno, pid] = report.map(i32::from_ne_bytes);
    if errno != 0 {
        return Err(StepFailed {
            step: usize::try_from(step).unwrap_or(usize::MAX),
            errno,
        });
    }
    let take_all = || -> rustix::io::Result<Vec<OwnedFd>> {
        let child = Pid::from_raw(pid).ok_or(Errno::SRCH)?;
        let child = pidfd_open(child, PidfdFlags::empty())?;
        let take = |number| pidfd_getfd(&child, number, PidfdGetfdFlags::empty());
        plan.fuse_numbers().map(take).collect()
    };
    let fuses = take_all().map_err(|error| StepFailed {
        step: usize::MAX,
        errno: error.raw_os_error(),
    })?;
    let _ = arrivals.send(Mounted { fuses, owner });
    // If the child is gone by now, spawn reports it.
    let _ = rustix::io::write(socket, &[1]);
    Ok(())
}

/// Answers the kernel until the program ends (`wake`) or the kernel removes the file system.
fn serve(
    fuse: &OwnedFd,
    wake: BorrowedFd<'_>,
    session: &mut Session,
    adapter: &SharedBus<'_>,
) -> Result<(), RunError> {
    let failed = |error: Errno| RunError::Serve(error.into());
    let mut buffer = vec![0; wire::REQUEST_BYTES_MAX];
    loop {
        let mut either = [
            PollFd::new(fuse, PollFlags::IN),
            PollFd::new(&wake, PollFlags::IN),
        ];
        retry_on_intr(|| poll(&mut either, None)).map_err(failed)?;
        let [request, ended] = either.map(|entry| !entry.revents().is_empty());
        if ended {
            return Ok(());
        }
        if !request {
            continue;
        }
        let length = match rustix::io::read(fuse, buffer.as_mut_slice()) {
            Ok(length) => length,
            // ECONNABORTED if the program ended while the kernel handed over a request.
            Err(Errno::NODEV | Errno::CONNABORTED) => return Ok(()),
            // The kernel withdrew the request, or a signal came first.
            Err(Errno::NOENT | Errno::INTR | Errno::AGAIN) => continue,
            Err(error) => return Err(failed(error)),
        };
        match session.answer(&buffer[..length], ProcessMemory::new, adapter) {
            Reply::Nothing => {}
            Reply::Bytes(bytes) => match rustix::io::write(fuse, &bytes) {
                // ENOENT: the asking process was killed.
                Ok(_) | Err(Errno::NOENT) => {}
                Err(error) => return Err(failed(error)),
            },
            Reply::Incompatible { major, minor } => {
                return Err(RunError::FuseTooOld(major, minor));
            }
        }
    }
}
