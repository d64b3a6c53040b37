//! `grideye emulate`: another program with an emulated AMG8833 on its `/dev/i2c-N`.

use crate::cli::Emulate;
use crate::exit::{Outcome, bad_input};
use crate::{files, recordings, sensor};
use amg8833_emulator::{BusError, Clock};
use anyhow::{Result, anyhow};
use embedded_hal::i2c::{Error as _, ErrorKind, NoAcknowledgeSource};
use i2c_emulation::adapter::{Fault, HalAdapter};
use i2c_emulation::fuse;
use std::process::Command;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// The program meets a sensor that has been on for two frames: one that was switched on this instant reads zero.
const POWER_ON: Duration = Duration::from_millis(200);

/// Real time since the sensor was powered on.
struct RealClock(Instant);

impl Clock for RealClock {
    fn now(&self) -> Duration {
        self.0.elapsed()
    }
}

/// Runs the program, and ends with its exit code.
pub(crate) fn run(options: &Emulate) -> Result<Outcome> {
    let bus = sensor::bus(
        RealClock(Instant::now()),
        options.address,
        source(options)?,
        None,
    );
    let adapter = Mutex::new(HalAdapter::with_faults(bus, fault));
    let Some((program, arguments)) = options.program.split_first() else {
        return Err(bad_input(anyhow!(
            "no program to run\nhint: grideye emulate --scene S -- PROGRAM ARGS"
        )));
    };
    let mut command = Command::new(program);
    command.args(arguments);
    let device = fuse::Options {
        mode: options.adapter,
        ..fuse::Options::new(&options.device)
    };
    std::thread::sleep(POWER_ON);
    let status = fuse::run(&adapter, &device, &mut command)?;
    Ok(Outcome::Passed(passed_on(status)))
}

fn source(options: &Emulate) -> Result<sensor::Source> {
    if let Some(path) = &options.recording {
        return Ok(sensor::replay_source(&recordings::load_frames(path)?));
    }
    let scene = files::load_scene(options.scene.as_deref())?.scene;
    let simulator = files::simulator(&scene, options.sensor.as_deref())?;
    sensor::scene_source(&scene, simulator, options.seed)
}

/// What the adapter tells the kernel's callers of each fault of the emulated bus.
fn fault(error: &BusError) -> Fault {
    match error {
        BusError::Timeout => Fault::Timeout,
        BusError::Gone => Fault::Gone,
        other => match other.kind() {
            ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data) => Fault::NackData,
            ErrorKind::NoAcknowledge(_) => Fault::NackAddress,
            ErrorKind::ArbitrationLoss => Fault::ArbitrationLost,
            _ => Fault::Bus,
        },
    }
}

/// A program's exit code; a signal is 128 and its number, as a shell has it.
fn passed_on(status: std::process::ExitStatus) -> u8 {
    use std::os::unix::process::ExitStatusExt as _;
    let code = status
        .code()
        .or_else(|| status.signal().map(|signal| 128 + signal));
    code.and_then(|code| u8::try_from(code).ok()).unwrap_or(1)
}
