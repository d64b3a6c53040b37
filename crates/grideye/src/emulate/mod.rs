//! `grideye emulate`: another program with emulated AMG8833 sensors on its `/dev/i2c-N`, on a socket, or over USB/IP;
//! or the firmware of a microcontroller.
//!
//! ```text
//!  parts: scene, recording, profile ─▶ grideye-rig: the machine ─▶ ways: syscalls, socket, usbip, firmware
//!  and which sensor where ───────────┘   trace
//! ```

mod firmware;
mod parts;
mod trace;
mod ways;

use crate::cli::{Emulate, Scl};
use crate::exit::{Outcome, bad_input};
use crate::files;
use amg8833_emulator::SCL_HZ;
use anyhow::{Result, anyhow};
use grideye_rig::{Machine, ON_BEFORE, Timebase, Wiring, World, buses};
use std::time::Duration;
use trace::TraceFile;
use ways::Voice;

pub(crate) fn run(options: &Emulate) -> Result<Outcome> {
    if options.program.is_empty() && options.socket.is_none() && options.usbip.is_none() {
        return Err(bad_input(anyhow!(
            "nothing is to reach the sensors\nhint: end with -- PROGRAM ARGS, or give --socket PATH or --usbip"
        )));
    }
    let inputs = options.scene.iter().chain(&options.recording);
    files::keep_apart(
        inputs.chain(&options.profile).chain(&options.faults),
        &options.trace,
    )?;
    let firmware = firmware::named(options)?;
    let world = World::new();
    let prepared = parts::prepare(options, &world)?;
    let ahead = match options.power_on {
        true => Duration::ZERO,
        false => ON_BEFORE,
    };
    let script = parts::faults(options)?;
    let trace = options.trace.as_deref();
    let trace = trace
        .map(|path| TraceFile::create(path, buses(&prepared.parts)))
        .transpose()?;
    let observer_of = trace.as_ref().map(|trace| |bus| trace.observer(bus));
    let wiring = Wiring {
        scl_hz: match options.scl {
            Some(Scl(asked)) => asked,
            // Its TWI takes the time of each byte.
            None if firmware.is_some() => None,
            None => Some(SCL_HZ),
        },
        script,
        trace: match &observer_of {
            Some(observer_of) => Some(observer_of),
            None => None,
        },
    };
    let voice = Voice::new(options, &prepared);
    let base = match options.speed.unwrap_or(1.0) {
        _ if firmware.is_some() => Timebase::by_hand(ahead),
        0.0 => Timebase::by_hand(ahead),
        speed => Timebase::new(ahead, speed),
    };
    let machine = Machine::new(base, &world, prepared.parts, &wiring).map_err(bad_input)?;
    let outcome = machine.keeping_up(|| match &firmware {
        Some(firmware) => firmware::run(firmware, options, &machine, &voice),
        None => ways::serve(options, &machine, &voice),
    });
    if let (Err(_), Some(trace)) = (&outcome, &trace) {
        trace.keep_unless_empty();
    }
    let outcome = outcome?;
    if let Some(trace) = &trace {
        voice.note(&trace.finish()?);
    }
    voice.end(&machine.counts(), outcome)?;
    Ok(outcome)
}
