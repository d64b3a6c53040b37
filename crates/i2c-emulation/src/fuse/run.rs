//! Runs a program with its devices: mounts, starts, serves and waits.

use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread;

use super::caller::ProcessMemory;
use super::error::RunError;
use super::namespace::{Plan, Right, StepFailed};
use super::session::{Reply, Session, SharedBus};
use super::wire;
use crate::adapter::{EmulatedAdapter, Fault, Message, TransferError};
use crate::ended::Ended;
use crate::ioctl::{AdapterMode, CallerMemory, Errno};
use crate::sys;

/// Where the device appears and how it behaves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// The device's path in the program's eyes, usually `/dev/i2c-1`. If no such file exists it must lie directly in
    /// `/dev`; one that exists, a real adapter for instance, is covered for the program and untouched for all others.
    pub device: PathBuf,
    /// Which adapter to be like.
    pub mode: AdapterMode,
    /// The kernel's FUSE device, `/dev/fuse`.
    pub fuse_device: PathBuf,
}

impl Options {
    /// A device at `device` that behaves as a Raspberry Pi's.
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
/// The program, and whatever it starts, sees the device at [`Options::device`]; nothing else on the machine does. It is
/// served until the program ends, then nothing is left of it, also if this process or the program is killed. Signals are
/// left alone: on Ctrl-C a terminal signals both, and a caller that wants to outlive its program must ignore SIGINT itself.
///
/// The adapter is locked for one transfer at a time, so that the caller may use it meanwhile. A transfer that never
/// returns keeps the program and this function waiting.
///
/// # Errors
/// [`RunError`]: before the program starts, what this machine or this user lacks; after that, only
/// [`RunError::Serve`] and [`RunError::Wait`].
pub fn run<A: EmulatedAdapter + Send>(
    adapter: &Mutex<A>,
    options: &Options,
    command: &mut Command,
) -> Result<ExitStatus, RunError> {
    let device = Device {
        path: options.device.clone(),
        adapter,
    };
    let ended = run_devices(
        &[device],
        options.mode,
        &options.fuse_device,
        command,
        &|_pid| {},
    )?;
    Ok(ended.status)
}

/// One device of a program, and the bus behind it.
pub(crate) struct Device<'a> {
    pub(crate) path: PathBuf,
    pub(crate) adapter: &'a SharedBus<'a>,
}

/// As [`run`], with any number of devices; `started` is told the program's process number.
pub(crate) fn run_devices(
    devices: &[Device<'_>],
    mode: AdapterMode,
    fuse_device: &Path,
    command: &mut Command,
    started: &(dyn Fn(u32) + Sync),
) -> Result<Ended, RunError> {
    let paths: Vec<&Path> = devices.iter().map(|device| device.path.as_path()).collect();
    let setting = Setting {
        paths,
        fuse_device,
        started,
    };
    // Closing the one end wakes whoever waits for the other.
    let (wake, awake) = socket_pair()?;
    let (arrivals, mounted) = mpsc::sync_channel(1);
    thread::scope(|scope| {
        let program = scope.spawn(|| {
            let outcome = run_program(&setting, command, &arrivals);
            drop(awake);
            // Whoever waits for the mounts waits for this sender.
            drop(arrivals);
            outcome
        });
        let served = match mounted.recv() {
            Ok(mounted) => serve_all(mounted, wake.as_fd(), mode, devices),
            // The helper thread gave up before it had mounted anything; it knows why.
            Err(mpsc::RecvError) => Ok(0),
        };
        let status = join(program)?;
        served.map(|opens| Ended { status, opens })
    })
}

/// Tells whether [`run`] can work here, by running the program `true` with a device that nobody answers on.
///
/// # Errors
/// What [`run`] would say.
pub fn probe() -> Result<(), RunError> {
    probe_with(Path::new("/dev/fuse"))
}

/// As [`probe`], through the kernel's FUSE device at this path.
pub(crate) fn probe_with(fuse_device: &Path) -> Result<(), RunError> {
    let not_reached = |errno: Errno| RunError::NotPermitted {
        step: "reading another process's memory (process_vm_readv)".to_owned(),
        source: io::Error::from_raw_os_error(errno.raw()),
    };
    let witness = [0x5Au8; 1];
    let address = u64::try_from(witness.as_ptr().expose_provenance()).unwrap_or(0);
    ProcessMemory::of_this_process()
        .read(address, &mut [0; 1])
        .map_err(not_reached)?;
    run(
        &Mutex::new(EmptyBus),
        &Options {
            fuse_device: fuse_device.to_owned(),
            ..Options::new("/dev/i2c-emulation-probe")
        },
        &mut Command::new("true"),
    )
    .map(drop)
}

/// A bus without targets.
struct EmptyBus;

impl EmulatedAdapter for EmptyBus {
    fn transfer(&mut self, _messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        Err(TransferError {
            completed: 0,
            fault: Fault::NackAddress,
        })
    }
}

/// What to make, and whom to tell.
struct Setting<'a> {
    paths: Vec<&'a Path>,
    fuse_device: &'a Path,
    started: &'a (dyn Fn(u32) + Sync),
}

/// The devices are there; the requests for each will arrive at its own `fuses`.
struct Mounted {
    fuses: Vec<OwnedFd>,
    owner: (u32, u32),
}

/// One thread for each device, so that a bus that is held up holds up no other. Counts the opened files.
fn serve_all(
    mounted: Mounted,
    wake: BorrowedFd<'_>,
    mode: AdapterMode,
    devices: &[Device<'_>],
) -> Result<u64, RunError> {
    let (user, group) = mounted.owner;
    thread::scope(|scope| {
        let servers: Vec<_> = mounted
            .fuses
            .into_iter()
            .zip(devices)
            .map(|(fuse, device)| {
                scope.spawn(move || {
                    let mut session = Session::new(mode, user, group);
                    // The open /dev/fuse is closed with the thread: a device that nobody serves is dead, not mute.
                    serve(&fuse, wake, &mut session, device.adapter).map(|()| session.opens())
                })
            })
            .collect();
        servers.into_iter().map(join).sum()
    })
}

/// The outcome of a thread; its panic goes on in this one.
fn join<T>(thread: thread::ScopedJoinHandle<'_, T>) -> T {
    thread
        .join()
        .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// The helper thread: mounts, starts, waits. Its mount namespace ends with it and with the program.
fn run_program(
    setting: &Setting<'_>,
    command: &mut Command,
    arrivals: &mpsc::SyncSender<Mounted>,
) -> Result<ExitStatus, RunError> {
    let plan = Plan::new(&setting.paths, setting.fuse_device, Right::Own)?;
    let mut child = match plan.prepare() {
        Ok(()) => {
            let mounted = Mounted {
                fuses: plan.into_fuses(),
                owner: Right::Own.owner(),
            };
            // The receiver waits in `run_devices` for exactly this.
            let _ = arrivals.send(mounted);
            command
                .spawn()
                .map_err(|source| not_started(command, source))?
        }
        Err(StepFailed {
            step: 0,
            errno: libc::EPERM,
        }) => start_in_user_namespace(setting, command, arrivals)?,
        Err(failed) => return Err(plan.explain(failed, setting.fuse_device)),
    };
    (setting.started)(child.id());
    child.wait().map_err(|source| RunError::Wait {
        program: program_of(command),
        source,
    })
}

/// Starts the program in a process that makes its own user and mount namespaces before it becomes the program.
fn start_in_user_namespace(
    setting: &Setting<'_>,
    command: &mut Command,
    arrivals: &mpsc::SyncSender<Mounted>,
) -> Result<Child, RunError> {
    let (user, group) = sys::effective_ids();
    let right = Right::NewUserNamespace { user, group };
    let plan = Arc::new(Plan::new(&setting.paths, setting.fuse_device, right)?);
    let (ours, theirs) = socket_pair()?;
    let theirs = Arc::new(theirs);
    let armed = Arc::new(AtomicBool::new(true));
    arrange_in_child(command, &plan, &theirs, &armed);

    let (spawned, greeted) = thread::scope(|scope| {
        let greeting = scope.spawn(|| greet_child(&ours, &plan, right.owner(), arrivals));
        let spawned = command.spawn();
        // The child is past exec, or dead: wake the greeting if it still waits for it. A command that is run again must not repeat all this.
        armed.store(false, Ordering::SeqCst);
        let _ = theirs.shutdown(std::net::Shutdown::Both);
        (spawned, join(greeting))
    });
    match (greeted, spawned) {
        (Err(failed), _) => Err(plan.explain(failed, setting.fuse_device)),
        (Ok(()), Err(source)) => Err(not_started(command, source)),
        (Ok(()), Ok(child)) => Ok(child),
    }
}

/// What the child reports: the step that failed or 0, its errno or 0, its own number.
type Report = [i32; 3];
const REPORT_BYTES: usize = size_of::<Report>();

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
    let work = move || {
        if armed.load(Ordering::SeqCst) {
            arrange(&plan, &socket)
        } else {
            Ok(())
        }
    };
    // SAFETY: `arrange` makes system calls on what was laid out before the fork; it neither allocates nor locks.
    unsafe { sys::before_exec(command, work) };
}

/// Runs between fork and exec: prepares, reports, waits until the server has /dev/fuse, finishes.
fn arrange(plan: &Plan, socket: &UnixStream) -> io::Result<()> {
    let prepared = plan.prepare();
    let (step, errno) = match prepared {
        Ok(()) => (0, 0),
        Err(failed) => (i32::try_from(failed.step).unwrap_or(i32::MAX), failed.errno),
    };
    let mut bytes = [0; REPORT_BYTES];
    for (to, from) in bytes.chunks_exact_mut(4).zip([step, errno, sys::own_pid()]) {
        to.copy_from_slice(&from.to_ne_bytes());
    }
    sys::write(socket.as_fd(), &bytes)?;
    prepared.map_err(|failed| io::Error::from_raw_os_error(failed.errno))?;
    if sys::read(socket.as_fd(), &mut [0])? == 0 {
        return Err(io::Error::from_raw_os_error(libc::ECANCELED));
    }
    plan.finish()
        .map_err(|failed| io::Error::from_raw_os_error(failed.errno))
}

/// Takes over the child's /dev/fuse once it has mounted it, and lets it go on.
fn greet_child(
    socket: &UnixStream,
    plan: &Plan,
    owner: (u32, u32),
    arrivals: &mpsc::SyncSender<Mounted>,
) -> Result<(), StepFailed> {
    let mut bytes = [0; REPORT_BYTES];
    if !matches!(sys::read(socket.as_fd(), &mut bytes), Ok(REPORT_BYTES)) {
        // The child failed before it came to its namespaces; the error of spawn tells why.
        return Ok(());
    }
    let mut report: Report = [0; 3];
    for (to, from) in report.iter_mut().zip(bytes.chunks_exact(4)) {
        *to = from.first_chunk().copied().map_or(0, i32::from_ne_bytes);
    }
    let [step, errno, pid] = report;
    if errno != 0 {
        return Err(StepFailed {
            step: usize::try_from(step).unwrap_or(usize::MAX),
            errno,
        });
    }
    let fuses: io::Result<Vec<OwnedFd>> = plan
        .fuse_numbers()
        .map(|number| sys::take_descriptor_of(pid, number))
        .collect();
    let fuses = fuses.map_err(|error| StepFailed {
        step: usize::MAX,
        errno: error.raw_os_error().unwrap_or(libc::EIO),
    })?;
    let _ = arrivals.send(Mounted { fuses, owner });
    // If the child is gone by now, spawn tells.
    let _ = sys::write(socket.as_fd(), &[1]);
    Ok(())
}

/// Answers the kernel until the program has ended (`wake`), or until the kernel has taken the file system away.
fn serve(
    fuse: &OwnedFd,
    wake: BorrowedFd<'_>,
    session: &mut Session,
    adapter: &SharedBus<'_>,
) -> Result<(), RunError> {
    let failed = |source| RunError::Serve { source };
    let mut buffer = vec![0; wire::REQUEST_BYTES_MAX];
    loop {
        let [request, ended] = sys::wait_for_either(fuse.as_fd(), wake).map_err(failed)?;
        if ended {
            return Ok(());
        }
        if !request {
            continue;
        }
        let length = match sys::read(fuse.as_fd(), &mut buffer) {
            Ok(length) => length,
            Err(error) => match error.raw_os_error() {
                // ECONNABORTED instead where the program's end came while a request was being handed over.
                Some(libc::ENODEV | libc::ECONNABORTED) => return Ok(()),
                // The request was taken back, or another signal came first.
                Some(libc::ENOENT | libc::EINTR | libc::EAGAIN) => continue,
                _ => return Err(failed(error)),
            },
        };
        let mut memory_of =
            |pid, width| -> Box<dyn CallerMemory> { Box::new(ProcessMemory::new(pid, width)) };
        match session.answer(&buffer[..length], &mut memory_of, adapter) {
            Reply::Nothing => {}
            Reply::Bytes(bytes) => send(fuse, &bytes).map_err(failed)?,
            Reply::Incompatible { major, minor } => {
                return Err(RunError::FuseTooOld { major, minor });
            }
        }
    }
}

fn send(fuse: &OwnedFd, bytes: &[u8]) -> io::Result<()> {
    match sys::write(fuse.as_fd(), bytes) {
        // Who asked was killed meanwhile.
        Err(error) if error.raw_os_error() == Some(libc::ENOENT) => Ok(()),
        outcome => outcome,
    }
}

fn socket_pair() -> Result<(UnixStream, UnixStream), RunError> {
    UnixStream::pair().map_err(|source| RunError::Setup {
        step: "making a socket pair".to_owned(),
        source,
    })
}

fn not_started(command: &Command, source: io::Error) -> RunError {
    let program = program_of(command);
    if source.kind() == io::ErrorKind::NotFound {
        RunError::ProgramNotFound { program }
    } else {
        RunError::ProgramNotStarted { program, source }
    }
}

fn program_of(command: &Command) -> String {
    command.get_program().to_string_lossy().into_owned()
}
