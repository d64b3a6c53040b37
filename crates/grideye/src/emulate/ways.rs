//! The ways to the emulated buses: opened before anybody is told of them, closed before the program ends; and what is
//! said of them: one line when they can be used, one of what went over the buses.

use super::parts::Prepared;
use crate::cli::{Emulate, Via};
use crate::exit::{Outcome, bad_input};
use crate::output::outln;
use crate::progress;
use anyhow::{Context as _, Result, anyhow};
use grideye_rig::{Counts, Machine, Planned};
use i2c_emulation::ioctl::AdapterMode;
use i2c_emulation::program::{self, RunError};
use i2c_emulation::rack::Rack;
use i2c_emulation::{socket, usbip};
use rustix::process::{Pid, Signal, getpgrp, kill_process};
use rustix::termios::tcgetpgrp;
use serde_json::{Value, json};
use std::net::SocketAddr;
use std::path::Path;
use std::process::{Command, ExitStatus};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tokio::signal::unix::{SignalKind, signal};

const LOOK_EVERY: Duration = Duration::from_millis(100);

/// The Python client's default socket.
const SOCKET_VARIABLE: &str = "GRIDEYE_I2C_SOCKET";

pub(super) fn serve(options: &Emulate, machine: &Machine, voice: &Voice) -> Result<Outcome> {
    let stop = Stop::catch()?;
    let mut reached = Reached::default();
    let folder = (options.via == Via::Socket && options.socket.is_none()).then(tempfile::tempdir);
    let folder = folder
        .transpose()
        .context("cannot make a folder for the socket")?;
    let path = folder.as_ref().map(|folder| folder.path().join("bus"));
    let path = options.socket.clone().or(path);
    let is_supervised =
        !options.program.is_empty() && options.via == Via::Syscalls && options.usbip.is_none();
    if path.is_some() || !is_supervised {
        // Before anybody can connect, who would find a sensor without power.
        machine.start();
    }
    let socket = path.as_deref();
    let socket =
        socket.map(|path| SocketWay::open(path, options.adapter, machine.rack(), &mut reached));
    let socket = socket.transpose()?;
    let usb = options
        .usbip
        .or((options.via == Via::Usbip).then_some(None));
    let usb = usb.map(|address| UsbWay::open(address, machine, &mut reached));
    let usb = usb.transpose()?;
    let program = options.program.split_first().map(|(name, arguments)| {
        let mut command = Command::new(name);
        command.args(arguments);
        if let Some(socket) = &path {
            command.env(SOCKET_VARIABLE, socket);
        }
        command
    });
    let outcome = match (program, &usb) {
        (Some(command), None) if options.via == Via::Syscalls => match stop.pending() {
            Some(signal) => ended_by(signal),
            None => run_program(command, options, machine, voice, reached)?,
        },
        (Some(mut command), _) => {
            voice.ready(&reached)?;
            stop.run(&mut command)?
        }
        (None, usb) => {
            voice.ready(&reached)?;
            let is_over = || machine.has_ended() || usb.as_ref().is_some_and(UsbWay::is_unplugged);
            stop.wait(options.seconds, is_over)
        }
    };
    if let Some(usb) = usb {
        usb.close()?;
    }
    drop(socket);
    Ok(outcome)
}

fn run_program(
    mut command: Command,
    options: &Emulate,
    machine: &Machine,
    voice: &Voice,
    mut reached: Reached,
) -> Result<Outcome> {
    let rack = machine.rack();
    let how = program::Options {
        mode: options.adapter,
        ..program::Options::default()
    };
    program::check(&rack, &command).map_err(refused)?;
    reached.ways.push("syscalls");
    let buses = rack.iter();
    let devices: Vec<String> = buses
        .map(|(number, _)| format!("/dev/i2c-{number}"))
        .collect();
    reached.at.extend(devices.iter().cloned());
    reached.text.insert(0, devices.join(", "));
    voice.ready(&reached)?;
    machine.start();
    let ended = program::run(&rack, &how, &mut command).map_err(refused)?;
    if ended.opens == 0 && options.socket.is_none() {
        let name = command.get_program().to_string_lossy();
        voice.note(&format!("{name} never opened {}", devices.join(" or ")));
    }
    Ok(Outcome::Passed(passed_on(ended.status)))
}

/// What is missing before the program runs is bad input; what fails later is not.
fn refused(error: RunError) -> anyhow::Error {
    match error {
        RunError::Setup { .. } | RunError::Wait(..) => error.into(),
        other => bad_input(other),
    }
}

/// A program's exit code; for a signal 128 plus its number, as in a shell.
fn passed_on(status: ExitStatus) -> u8 {
    use std::os::unix::process::ExitStatusExt as _;
    let code = status.code().or_else(|| Some(128 + status.signal()?));
    code.and_then(|code| code.try_into().ok()).unwrap_or(1)
}

fn ended_by(signal: Signal) -> Outcome {
    Outcome::Passed(u8::try_from(128 + signal.as_raw()).unwrap_or(1))
}

pub(super) struct SocketWay {
    stop: socket::StopHandle,
    thread: Option<JoinHandle<()>>,
}

impl SocketWay {
    pub(super) fn open(
        path: &Path,
        mode: AdapterMode,
        rack: Rack,
        reached: &mut Reached,
    ) -> Result<Self> {
        let how = socket::Options {
            mode,
            ..socket::Options::default()
        };
        let server = socket::Server::bind(path, rack, how).map_err(bad_input)?;
        let stop = server.stop_handle();
        let shown = path.display();
        reached.add("socket", &shown, format!("socket {shown}"));
        let thread = std::thread::spawn(move || server.serve());
        let thread = Some(thread);
        Ok(Self { stop, thread })
    }
}

impl Drop for SocketWay {
    fn drop(&mut self) {
        self.stop.stop();
        if let Some(thread) = self.thread.take() {
            // The thread has reported its panic.
            let _ = thread.join();
        }
    }
}

/// Adapters of this kernel, or of a client over TCP.
enum UsbWay {
    Attached(usbip::Attached),
    Offered(usbip::Server),
}

impl UsbWay {
    fn open(address: Option<SocketAddr>, machine: &Machine, reached: &mut Reached) -> Result<Self> {
        let rack = machine.rack();
        let Some(address) = address else {
            // The kernel queries the adapter during attachment; the sensors wait for the first transfer.
            let attached = usbip::attach(&rack, &usbip::Options::default()).map_err(bad_input)?;
            reached.ways.push("usbip");
            for bus in attached.buses() {
                let (device, bus) = (bus.device.display(), bus.bus);
                reached.at.push(device.to_string());
                reached
                    .text
                    .push(format!("{device} of this kernel is bus {bus}"));
            }
            return Ok(Self::Attached(attached));
        };
        let server = usbip::Server::bind(address, &rack).map_err(bad_input)?;
        let at = server.address();
        let (port, host) = (at.port(), at.ip());
        let attach = |id| format!("usbip --tcp-port {port} attach -r {host} -b {id}");
        let lines: Vec<String> = server.bus_ids().map(|(_, id)| attach(id)).collect();
        reached.add("usbip-tcp", &at, lines.join(" && "));
        Ok(Self::Offered(server))
    }

    /// Whether every adapter was detached, for example by `usbip detach`.
    fn is_unplugged(&self) -> bool {
        match self {
            Self::Attached(attached) => attached.buses().iter().all(|bus| !bus.device.exists()),
            Self::Offered(_) => false,
        }
    }

    fn close(self) -> Result<()> {
        match self {
            Self::Attached(attached) => attached.stop()?,
            Self::Offered(server) => server.stop(),
        }
        Ok(())
    }
}

pub(super) struct Stop(Receiver<Signal>);

impl Stop {
    /// From here on a signal does not end the process at once, so that nothing is left behind.
    pub(super) fn catch() -> Result<Self> {
        let runtime = progress::runtime();
        let runtime = runtime.context("cannot start the thread that waits for Ctrl-C")?;
        let (mut interrupted, mut terminated) = {
            let _within = runtime.enter();
            let caught = |kind| signal(kind).context("cannot catch Ctrl-C");
            (
                caught(SignalKind::interrupt())?,
                caught(SignalKind::terminate())?,
            )
        };
        let (tell, told) = mpsc::channel();
        std::thread::spawn(move || {
            runtime.block_on(async {
                loop {
                    let signal = tokio::select! {
                        _signal = interrupted.recv() => Signal::INT,
                        _signal = terminated.recv() => Signal::TERM,
                    };
                    // Once the time is up, no receiver is left.
                    if tell.send(signal).is_err() {
                        return;
                    }
                }
            });
        });
        Ok(Self(told))
    }

    fn pending(&self) -> Option<Signal> {
        self.0.try_recv().ok()
    }

    fn wait(&self, seconds: Option<f64>, is_over: impl Fn() -> bool) -> Outcome {
        let started = Instant::now();
        let limit =
            seconds.map(|seconds| Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX));
        loop {
            let left = limit.map(|limit| limit.saturating_sub(started.elapsed()));
            let wait = left.map_or(LOOK_EVERY, |left| left.min(LOOK_EVERY));
            let signaled = self.0.recv_timeout(wait) != Err(RecvTimeoutError::Timeout);
            if signaled || left.is_some_and(|left| left.is_zero()) || is_over() {
                return Outcome::Done;
            }
        }
    }

    /// Runs a program without a device of its own. Passes signals on, except a Ctrl-C at the terminal, which reaches it
    /// anyway.
    pub(super) fn run(&self, command: &mut Command) -> Result<Outcome> {
        let name = command.get_program().to_string_lossy().into_owned();
        let mut child = command.spawn().map_err(|error| {
            bad_input(anyhow!(
                "cannot start {name}: {error}\nhint: check the spelling and PATH"
            ))
        })?;
        loop {
            let ended = child.try_wait();
            if let Some(status) = ended.with_context(|| format!("cannot wait for {name}"))? {
                return Ok(Outcome::Passed(passed_on(status)));
            }
            let Ok(signal) = self.0.recv_timeout(LOOK_EVERY) else {
                continue;
            };
            if signal == Signal::INT && is_at_the_terminal() {
                continue;
            }
            let pid = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
            if let Some(pid) = pid {
                // Fails if the program has just ended; the next check notices that.
                let _ = kill_process(pid, signal);
            }
        }
    }
}

/// Whether a Ctrl-C at the terminal reaches this process and its children.
fn is_at_the_terminal() -> bool {
    tcgetpgrp(std::io::stdin()).is_ok_and(|foreground| foreground == getpgrp())
}

pub(super) struct Voice {
    json: bool,
    quiet: bool,
    /// Standard output is the program's, if there is one.
    has_program: bool,
    shown: String,
    /// The sensors, for programs and for people.
    sensors: Vec<Value>,
    places: String,
}

#[derive(Default)]
pub(super) struct Reached {
    /// syscalls, socket, usbip or usbip-tcp.
    pub(super) ways: Vec<&'static str>,
    pub(super) at: Vec<String>,
    pub(super) text: Vec<String>,
}

impl Reached {
    pub(super) fn add(&mut self, way: &'static str, at: &impl ToString, text: String) {
        self.ways.push(way);
        self.at.push(at.to_string());
        self.text.push(text);
    }
}

impl Voice {
    pub(super) fn new(options: &Emulate, prepared: &Prepared) -> Self {
        let planned = || prepared.parts.iter().map(|part| &part.planned);
        let places = planned().map(|Planned { name, place }| format!("{name} at {place}"));
        Self {
            json: options.json,
            quiet: options.quiet,
            has_program: !options.program.is_empty(),
            shown: prepared.shown.clone(),
            sensors: planned().map(sensor).collect(),
            places: places.collect::<Vec<_>>().join(", "),
        }
    }

    pub(super) fn ready(&self, reached: &Reached) -> Result<()> {
        if self.json {
            return self.print_json(&json!({
                "event": "ready",
                "ways": reached.ways,
                "at": reached.at,
                "shows": self.shown,
                "sensors": self.sensors,
            }));
        }
        if !self.quiet {
            let reached = reached.text.join(" and ");
            progress::say(&format!(
                "{reached}: {}, showing {}",
                self.places, self.shown
            ));
        }
        if !self.has_program {
            for place in &reached.at {
                outln!("{place}")?;
            }
        }
        Ok(())
    }

    pub(super) fn note(&self, text: &str) {
        if !self.quiet && !self.json {
            progress::say(text);
        }
    }

    pub(super) fn end(&self, counts: &Counts, outcome: Outcome) -> Result<()> {
        if self.json {
            let code = match outcome {
                Outcome::Passed(code) => Some(code),
                _ => None,
            };
            return self.print_json(&json!({
                "event": "end",
                "counts": counts,
                "program_exit_code": code,
            }));
        }
        self.note(&counts.to_string());
        Ok(())
    }

    fn print_json(&self, value: &Value) -> Result<()> {
        if self.has_program {
            progress::say(&value.to_string());
        } else {
            outln!("{value}")?;
        }
        Ok(())
    }
}

fn sensor(planned: &Planned) -> Value {
    let Planned { name, place } = planned;
    let mut sensor = json!({ "name": name, "bus": place.bus, "address": place.address.bits() });
    if let Some(branch) = place.branch {
        sensor["multiplexer"] = branch.mux.bits().into();
        sensor["channel"] = branch.channel.into();
    }
    sensor
}
