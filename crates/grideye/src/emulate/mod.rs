//! `grideye emulate`: another program with emulated AMG8833 sensors on its `/dev/i2c-N`, on a socket, or over USB/IP.
//!
//! ```text
//!  parts: scene, recording, profile ─▶ machine: buses in real time ─▶ Rack ─▶ ways: fuse, preload, socket, usbip
//!  plan: which sensor where ─────────┘   clock, faults, trace, counts
//! ```

mod clock;
mod machine;
mod parts;
mod plan;
mod say;
mod show;
mod trace;
mod ways;
mod wires;

use crate::cli::Emulate;
use crate::exit::{Outcome, bad_input};
use crate::files;
use anyhow::{Result, anyhow};
use clock::Timebase;
use machine::Machine;
use say::Voice;
use show::World;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

pub(crate) use show::{AtEnd, Replay};

/// The program meets a sensor that has been on for two frames: one that was switched on this instant reads zero.
const ON_BEFORE: Duration = Duration::from_millis(250);
/// How often sensors that nobody asks measure what has fallen due.
const KEEP_UP_EVERY: Duration = Duration::from_secs(1);

/// Builds the machine, opens the ways to it, and serves until the program, the time or the user ends it.
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
    let world = World::new();
    let prepared = parts::prepare(options, &world)?;
    let ahead = if options.power_on {
        Duration::ZERO
    } else {
        ON_BEFORE
    };
    let wiring = parts::wiring(options, &prepared)?;
    let voice = Voice::new(options, &prepared);
    let base = Timebase::new(ahead, options.speed);
    let machine = Machine::new(base, &world, prepared.parts, &wiring);
    let outcome = keeping_up(&machine, || ways::serve(options, &machine, &voice));
    if let (Err(_), Some(trace)) = (&outcome, &wiring.trace) {
        trace.keep_unless_empty();
    }
    let outcome = outcome?;
    if let Some(trace) = &wiring.trace {
        voice.note(&trace.finish()?);
    }
    voice.end(&machine.counts(), outcome)?;
    Ok(outcome)
}

/// Does this while the sensors go on measuring.
fn keeping_up(machine: &Machine, serve: impl FnOnce() -> Result<Outcome>) -> Result<Outcome> {
    let (done, is_done) = mpsc::channel::<()>();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            while is_done.recv_timeout(KEEP_UP_EVERY) == Err(RecvTimeoutError::Timeout) {
                machine.keep_up();
            }
        });
        let outcome = serve();
        drop(done);
        outcome
    })
}
