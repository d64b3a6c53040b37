//! A PROGRAM that is the firmware of an AVR: it runs in a simulator that moves the machine's time.

use super::ways::Reached;
use super::ways::{SocketWay, Stop, Voice};
use crate::cli::{Emulate, Via};
use crate::exit::{Outcome, bad_input};
use anyhow::{Context as _, Result, anyhow};
use grideye_rig::Machine;
use i2c_emulation::avr::{Firmware, Options};
use i2c_emulation::ioctl::AdapterMode;
use std::path::Path;

/// The firmware that the command line names as its program, if that is what it names.
pub(super) fn named(options: &Emulate) -> Result<Option<Firmware>> {
    let program = options.program.first().map(Path::new);
    let firmware = program.map_or(Ok(None), Firmware::recognize);
    let firmware = firmware.map_err(bad_input)?;
    let other = |what: &str, hint: &str| Err(bad_input(anyhow!("{what}\nhint: {hint}")));
    if firmware.is_none() {
        let only = [
            ("--until", options.until.is_some()),
            ("--mcu", options.mcu.is_some()),
            ("--int", !options.interrupts.is_empty()),
            ("--seconds", options.seconds.is_some() && program.is_some()),
        ];
        let Some((option, _)) = only.iter().find(|(_, given)| *given) else {
            return Ok(None);
        };
        let named = program.map_or_else(
            || "there is no program".to_owned(),
            |path| format!("{} is no ELF or Intel HEX file of an AVR", path.display()),
        );
        return other(
            &format!("{option} is for firmware, and {named}"),
            "check the path and end with -- sketch.elf, or leave the option out",
        );
    }
    if options.program.len() > 1 {
        return other("firmware takes no arguments", "end with the file");
    }
    if options.scl.is_some() {
        return other(
            "--scl sets a bus clock, and firmware sets its own",
            "leave out --scl",
        );
    }
    if options.adapter != AdapterMode::default()
        || options.via != Via::Syscalls
        || options.usbip.is_some()
    {
        return other(
            "firmware has no adapter of Linux: its TWI is at the bus itself",
            "leave out --adapter, --via and --usbip",
        );
    }
    Ok(firmware)
}

/// Runs it to its end, in emulated time.
pub(super) fn run(
    firmware: &Firmware,
    options: &Emulate,
    machine: &Machine,
    voice: &Voice,
) -> Result<Outcome> {
    let stop = Stop::catch()?;
    let folder = tempfile::tempdir().context("cannot make a folder for the simulator")?;
    let socket = options.socket.clone();
    let socket = socket.unwrap_or_else(|| folder.path().join("bus"));
    let (mcu, hz) = options
        .mcu
        .clone()
        .map_or((None, None), |mcu| (Some(mcu.name), mcu.hz));
    let usual = Options::default();
    let rack = machine.rack();
    let first = rack.iter().next().map_or(usual.bus, |(number, _)| number);
    let how = Options {
        mcu,
        hz: hz.unwrap_or(usual.hz),
        bus: first,
        seconds: options.seconds,
        speed: options.speed.filter(|speed| *speed > 0.0),
        until: options.until.clone(),
        interrupts: options.interrupts.clone(),
    };
    let mut command = firmware
        .command(&how, &socket, folder.path())
        .map_err(bad_input)?;
    if options.quiet || options.json {
        command.env("GRIDEYE_QUIET", "1");
    }
    let mut reached = Reached::default();
    let _served = SocketWay::open(&socket, options.adapter, rack, &mut reached)?;
    if options.socket.is_none() {
        reached = Reached::default();
    }
    reached.add(
        "avr",
        &format!("bus {first}"),
        format!("the firmware's TWI is bus {first}"),
    );
    machine.start();
    voice.ready(&reached)?;
    let outcome = stop.run(&mut command)?;
    if machine.counts().transactions == 0 {
        voice.note("the firmware sent nothing by TWI");
    }
    Ok(outcome)
}
