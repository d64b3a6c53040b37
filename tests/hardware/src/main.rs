//! Checks the sensor that a device file names, one promise of the datasheet after another.

mod checks;
mod device;
mod sensor;

use device::Device;
use sensor::{Fault, Sensor};
use std::process::ExitCode;

const FAILED: u8 = 1;
const WRONG_USE: u8 = 2;
const PAUSED: u8 = 3;

fn main() -> ExitCode {
    let device = match Device::of_the_command_line() {
        Ok(device) => device,
        Err(error) => {
            eprintln!("error: {error:#}");
            return ExitCode::from(WRONG_USE);
        }
    };
    let kind = if device.emulated { "emulated" } else { "real" };
    println!(
        "{} ({kind}), address {:#04x} on {}",
        device.what,
        device.address.get(),
        device.bus.display()
    );
    match Sensor::open(&device).and_then(|mut sensor| run(&mut sensor)) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(failed) => {
            eprintln!("error: {failed} checks failed");
            ExitCode::from(FAILED)
        }
        Err(Fault::Paused(pause)) => {
            eprintln!(
                "error: this computer paused for {} ms, longer than a frame\nhint: run it again",
                pause.as_millis()
            );
            ExitCode::from(PAUSED)
        }
        Err(Fault::Bus(error)) => {
            eprintln!(
                "error: {}: {error}\nhint: `grideye-agent check --bus BUS` finds out why",
                device.bus.display()
            );
            ExitCode::from(FAILED)
        }
    }
}

/// How many checks failed.
fn run(sensor: &mut Sensor) -> Result<usize, Fault> {
    let mut failed = 0;
    for (name, check) in checks::ALL {
        let outcome = check(sensor)?;
        let word = if outcome.passed { "ok  " } else { "FAIL" };
        println!("{word}  {name}: {}", outcome.measured);
        failed += usize::from(!outcome.passed);
    }
    for (question, look) in checks::QUESTIONS {
        println!("seen  {question}: {}", look(sensor)?);
    }
    Ok(failed)
}
