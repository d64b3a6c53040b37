//! Runs a program with a chip of 256 registers at address 0x50 of its `/dev/i2c-1`:
//! `cargo run -p i2c-emulation --example with_a_chip -- i2cdump -y 1 0x50 b`

use std::error::Error;
use std::process::{Command, ExitCode};

use embedded_hal::i2c::{
    ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation, SevenBitAddress,
};
use i2c_emulation::adapter::HalAdapter;
use i2c_emulation::program::{self, Options};
use i2c_emulation::rack::{Rack, SharedAdapter};

/// The first byte of a write is a register number; the others go to that register and the following ones. A read
/// continues where the last access ended.
struct Chip {
    registers: [u8; 256],
    pointer: u8,
}

impl Chip {
    fn register(&mut self) -> &mut u8 {
        let pointer = self.pointer;
        self.pointer = pointer.wrapping_add(1);
        &mut self.registers[usize::from(pointer)]
    }
}

impl ErrorType for Chip {
    type Error = ErrorKind;
}

impl I2c for Chip {
    fn transaction(
        &mut self,
        address: SevenBitAddress,
        operations: &mut [Operation<'_>],
    ) -> Result<(), ErrorKind> {
        if address != 0x50 {
            return Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address));
        }
        for operation in operations {
            match operation {
                Operation::Write([]) => {}
                Operation::Write([pointer, bytes @ ..]) => {
                    self.pointer = *pointer;
                    bytes.iter().for_each(|byte| *self.register() = *byte);
                }
                Operation::Read(buffer) => {
                    buffer.iter_mut().for_each(|byte| *byte = *self.register());
                }
            }
        }
        Ok(())
    }
}

fn main() -> ExitCode {
    run().unwrap_or_else(|error| {
        eprintln!("error: {error}");
        ExitCode::from(2)
    })
}

fn run() -> Result<ExitCode, Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1);
    let mut command = Command::new(arguments.next().ok_or("usage: PROGRAM ARGS…")?);
    command.args(arguments);

    let chip = Chip {
        registers: std::array::from_fn(|register| register.to_le_bytes()[0]),
        pointer: 0,
    };
    let mut rack = Rack::new();
    rack.insert(1, SharedAdapter::new(HalAdapter::new(chip)));
    let ended = program::run(&rack, &Options::default(), &mut command)?;
    Ok(ended
        .status
        .code()
        .and_then(|code| u8::try_from(code).ok())
        .map_or(ExitCode::FAILURE, ExitCode::from))
}
