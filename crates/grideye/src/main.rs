//! `grideye`: demonstrate, simulate, emulate, collect, record, compare, convert, characterize and audit, from one command
//! line.
//!
//! ```text
//! grideye demo                                   the whole loop, without hardware
//! grideye view FILE                              any recording, played in a browser
//! grideye collect            (PC)  ◀── HTTP ──   grideye-agent run            (Raspberry Pi)
//! grideye enroll DEVICE                          the line to paste on the device: its agent joins this collector
//! grideye record NAME                            name what arrives
//! grideye orient                                 how is the sensor mounted? Wave a hand
//! grideye compare --scene S --recording R        agrees (0), disagrees (1), cannot tell (3)
//! grideye calibrate --scene S --recording R      the scene's unknowns, with their uncertainties
//! grideye emulate --scene S -- PROGRAM           any AMG8833 program, without hardware
//! ```

mod access;
mod audit;
mod backup;
mod calibrate;
mod characterize;
mod cli;
mod client;
mod collect;
mod compare;
mod completions;
mod convert;
mod count;
mod coverage;
mod dataset;
mod demo;
mod distinguish;
mod dropped;
mod emulate;
mod exit;
mod export;
mod files;
mod fuse;
mod man;
mod migrate;
mod mqtt;
mod orient;
mod output;
mod own;
mod progress;
mod record;
mod recordings;
mod simulate;
mod stage;
mod view;

use cli::{Cli, Command, MqttWhat};
use std::process::ExitCode;

/// Faster for the collector, which allocates many small pieces.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let result = match Cli::of_the_program().command {
        Command::Demo(options) => demo::run(&options),
        Command::View(options) => view::run(&options),
        Command::Simulate(options) => simulate::run(&options),
        Command::Fuse(options) => fuse::run(&options),
        Command::Dataset(options) => dataset::run(&options),
        Command::Distinguish(options) => distinguish::run(&options),
        Command::Coverage(options) => coverage::run(&options),
        Command::Emulate(options) => emulate::run(&options),
        Command::Collect(options) => collect::run(&options),
        Command::Enroll(options) => access::enroll(&options),
        Command::Token(options) => access::token(&options.command),
        Command::Record(options) => record::run(&options),
        Command::Count(options) => count::run(&options),
        Command::Orient(options) => orient::run(&options),
        Command::Compare(options) => compare::run(&options),
        Command::Convert(options) => convert::run(&options),
        Command::Calibrate(options) => calibrate::run(&options),
        Command::Characterize(options) => characterize::run(&options),
        Command::Audit(options) => audit::run(&options),
        Command::Migrate(options) => migrate::run(&options),
        Command::Backup(options) => backup::run(&options),
        Command::Restore(options) => backup::restore_to(&options),
        Command::Mqtt(options) => match &options.command {
            MqttWhat::Forget(options) => mqtt::forget(options),
        },
        Command::Completions(options) => completions::run(&options),
        Command::Man(options) => man::run(&options),
    };
    match result {
        Ok(outcome) => outcome.into(),
        Err(error) => exit::report(&error),
    }
}
