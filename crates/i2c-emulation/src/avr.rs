//! Way 5: the firmware of an AVR microcontroller, run cycle by cycle by libsimavr, with an emulated bus on its TWI.
//!
//! The simulator is a process of its own, compiled on the machine where it runs from [`CLIENT`] and libsimavr, and a client of
//! the [`socket`](crate::socket). Its cycles move the machine's time: see [`Surroundings`](crate::rack::Surroundings).

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The source of the simulator's program, in C.
pub const CLIENT: &str = include_str!("../avr/grideye_avr.c");

/// The clock of the usual boards, in hertz.
pub const HZ: u32 = 16_000_000;

/// The ELF header up to its flags.
const HEADER_BYTES: usize = 40;
const EM_AVR: u16 = 83;
const EF_AVR_MACH: u8 = 0x7F;

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
        "cannot tell for which microcontroller {0} was built\nhint: name it with --mcu; `simavr --list-cores` prints those it knows"
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
    /// This file, if it is an ELF file for AVR or Intel HEX.
    #[must_use]
    pub fn recognize(path: &Path) -> Option<Self> {
        let mut head = Vec::new();
        let file = File::open(path).ok()?;
        let bytes = u64::try_from(HEADER_BYTES).unwrap_or(u64::MAX);
        file.take(bytes).read_to_end(&mut head).ok()?;
        let path = path.to_owned();
        if head.starts_with(b"\x7fELF") {
            let machine = head.get(18..20)?;
            let family = head.get(36)? & EF_AVR_MACH;
            return (machine == EM_AVR.to_le_bytes()).then_some(Self {
                path,
                family: Some(family),
            });
        }
        let is_record = |bytes: &[u8]| {
            let (colon, digits) = bytes.split_first()?;
            (*colon == b':' && digits.iter().take(8).all(u8::is_ascii_hexdigit)).then_some(())
        };
        is_record(&head)?;
        Some(Self { path, family: None })
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
