//! The firmware of an AVR microcontroller, run cycle by cycle by libsimavr, with an emulated bus on its TWI.
//!
//! The simulator is a process of its own, compiled on the machine where it runs from [`CLIENT`] and libsimavr, and a client of
//! the [`socket`](crate::socket). Its cycles move the machine's time: see [`Surroundings`](crate::rack::Surroundings). simavr
//! is GPL 3; its user installs it, and nothing of it is linked or shipped here.
//!
//! The client mends what would be seen of simavr 1.6 (Debian 12): the length of a byte, TWINT for firmware that polls it, and
//! the status of an address for writing. What is left: START and STOP take no time; on a held bus time goes on and the
//! address is not acknowledged; a second START to write becomes STOP and START, and one to read goes on with the first.

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The source of the simulator's program, in C.
pub const CLIENT: &str = include_str!("../avr/grideye_avr.c");

/// The clock of the usual boards, in hertz.
pub const HZ: u32 = 16_000_000;

/// The ELF header and its table of segments.
const HEAD_BYTES: u64 = 4096;
const EM_AVR: u16 = 83;
const EF_AVR_MACH: u8 = 0x7F;
const ELFCLASS32: u8 = 1;
/// Other processors with firmware of 32 bits: their number in ELF, their name in Rust, and microcontrollers.
const OTHERS: [(u16, &str, &str); 3] = [
    (40, "arm", "ARM (RP2040, STM32, SAMD)"),
    (94, "xtensa", "Xtensa (ESP8266, ESP32)"),
    (243, "riscv32", "RISC-V (ESP32-C3)"),
];

/// A file with the firmware of an AVR.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Firmware {
    path: PathBuf,
    /// The family for which an ELF file was linked.
    family: Option<u8>,
}

/// How to run it.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The microcontroller's name in simavr; without it the file decides between ATmega328P and ATmega2560.
    pub mcu: Option<String>,
    /// The clock, unless the file names one.
    pub hz: u32,
    /// The bus at its TWI.
    pub bus: u32,
    /// When it ends, in seconds of the microcontroller.
    pub seconds: Option<f64>,
    /// The most emulated seconds in a real one.
    pub speed: Option<f64>,
    /// The output that ends it.
    pub until: Option<String>,
    /// The port pin at each target's interrupt pin, such as `PD2`, in the machine's order; `-` for none.
    pub interrupts: Vec<String>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            mcu: None,
            hz: HZ,
            bus: 1,
            seconds: None,
            speed: None,
            until: None,
            interrupts: Vec::new(),
        }
    }
}

/// Why firmware cannot run.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what each is")]
pub enum AvrError {
    #[error(
        "{0} is firmware for {1}, and the simulator here is of AVR (ATmega328P, ATmega2560)\nhint: an RP2040's runs in rp2040js (crates/i2c-emulation/README.md); a library can be compiled for this computer (tests/examples/firmware-ci/README.md)"
    )]
    OtherChip(PathBuf, &'static str),
    #[error(
        "cannot tell for which microcontroller {0} was built\nhint: name it with --mcu; `simavr --list-cores` (package simavr) prints those it knows"
    )]
    UnknownMcu(PathBuf),
    #[error(
        "the simulator of the AVR cannot be compiled: {0}\nhint: install a C compiler and simavr's library: apt-get install gcc libsimavr-dev"
    )]
    NoCompiler(#[source] io::Error),
    #[error(
        "simavr is missing: {0}\nhint: install its library (GPL 3; it runs in a process of its own): apt-get install gcc libsimavr-dev"
    )]
    NoSimulator(String),
    #[error(
        "cannot write the simulator of the AVR to {0}: {1}\nhint: set TMPDIR to a folder that can be written"
    )]
    NoRoom(PathBuf, #[source] io::Error),
}

impl Firmware {
    /// This file, if it is an ELF file for AVR or Intel HEX; `None` for a program of this computer.
    /// # Errors
    /// It is an ELF file for another microcontroller.
    pub fn recognize(path: &Path) -> Result<Option<Self>, AvrError> {
        let mut head = Vec::new();
        // What cannot be read is left to who starts programs.
        let read = File::open(path).map(|file| file.take(HEAD_BYTES).read_to_end(&mut head));
        if !matches!(read, Ok(Ok(_))) {
            return Ok(None);
        }
        let path = path.to_owned();
        let Some(ident) = head.strip_prefix(b"\x7fELF") else {
            let is_hex = head.first() == Some(&b':')
                && head.iter().skip(1).take(8).all(u8::is_ascii_hexdigit);
            return Ok(is_hex.then_some(Self { path, family: None }));
        };
        let word = |at: usize| {
            let bytes = head.get(at..at + 2)?.try_into().ok()?;
            Some(u16::from_le_bytes(bytes))
        };
        match (word(18), head.get(36)) {
            (Some(EM_AVR), Some(flags)) => Ok(Some(Self {
                path,
                family: Some(flags & EF_AVR_MACH),
            })),
            (Some(machine), _) if ident.first() == Some(&ELFCLASS32) && !has_loader(&head) => {
                let other = OTHERS.iter().find(|(number, arch, _)| {
                    *number == machine && *arch != std::env::consts::ARCH
                });
                other.map_or(Ok(None), |(_, _, chips)| {
                    Err(AvrError::OtherChip(path, chips))
                })
            }
            _ => Ok(None),
        }
    }

    /// The command that runs it with the buses behind `socket`, after its simulator was compiled into `folder`.
    /// # Errors
    /// The microcontroller is not known, there is no compiler or no simavr, or the folder cannot be written.
    pub fn command(
        &self,
        options: &Options,
        socket: &Path,
        folder: &Path,
    ) -> Result<Command, AvrError> {
        let unknown = || AvrError::UnknownMcu(self.path.clone());
        let named = options.mcu.as_deref();
        let mcu = named.or_else(|| self.mcu()).ok_or_else(unknown)?;
        let mut command = Command::new(compile(folder)?);
        command.arg(socket).arg(&self.path).arg(mcu);
        command.arg(options.hz.to_string());
        command.arg(options.bus.to_string());
        command.arg(options.seconds.unwrap_or(0.0).to_string());
        command.arg(options.speed.unwrap_or(0.0).to_string());
        command.arg(options.until.as_deref().unwrap_or_default());
        command.args(&options.interrupts);
        Ok(command)
    }

    /// The usual microcontroller of the family. Intel HEX does not say for what it is: most boards have an ATmega328P.
    fn mcu(&self) -> Option<&'static str> {
        match self.family {
            None | Some(5) => Some("atmega328p"),
            Some(6) => Some("atmega2560"),
            Some(_) => None,
        }
    }
}

/// Whether a 32-bit ELF file asks for a program loader (PT_INTERP), as programs of an operating system do.
fn has_loader(head: &[u8]) -> bool {
    const PT_INTERP: [u8; 4] = [3, 0, 0, 0];
    let number = |at: usize, bytes: usize| {
        let bytes = head.get(at..at + bytes)?;
        let value = bytes
            .iter()
            .rev()
            .fold(0, |sum, byte| sum << 8 | u64::from(*byte));
        usize::try_from(value).ok()
    };
    let (Some(table), Some(size), Some(count)) = (number(28, 4), number(42, 2), number(44, 2))
    else {
        return false;
    };
    let mut starts = (0..count).map(|index| table.saturating_add(index * size));
    starts.any(|at| head.get(at..at.saturating_add(4)) == Some(&PT_INTERP))
}

/// Compiles the simulator's program; returns its path.
fn compile(folder: &Path) -> Result<PathBuf, AvrError> {
    let (source, program) = (folder.join("grideye_avr.c"), folder.join("grideye_avr"));
    let no_room = |error| AvrError::NoRoom(folder.to_owned(), error);
    fs::write(&source, CLIENT).map_err(no_room)?;
    let mut compiler = Command::new("cc");
    compiler.arg("-O2").arg("-o").arg(&program).arg(&source);
    let ended = compiler
        .arg("-lsimavr")
        .output()
        .map_err(AvrError::NoCompiler)?;
    if ended.status.success() {
        return Ok(program);
    }
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    let first = said.lines().find(|line| line.contains("simavr"));
    Err(AvrError::NoSimulator(
        first.unwrap_or(&said).trim().to_owned(),
    ))
}
