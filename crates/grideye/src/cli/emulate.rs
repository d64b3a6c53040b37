//! The options of `grideye emulate`.

use super::shared::{Choices, one_of, positive, within};
use amg8833_emulator::{Address, CLOCK_ERROR_PPM_MAX};
use clap::{ArgGroup, Args};
use grideye_rig::{AtEnd, Placed, Replay, SCL_HZ_RANGE, address_of, device};
use i2c_emulation::ioctl::AdapterMode;
use std::net::SocketAddr;
use std::num::NonZeroU32;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// From the slowest oscillator to beyond the fastest AVR (ATmega328P datasheet, speed grades).
const MCU_HZ: RangeInclusive<u32> = 32_000..=32_000_000;
/// What the sensor's registers hold, °C (AMG88 spec §4-11-11: 12 bits of a quarter of a degree).
const CONSTANT_C: RangeInclusive<f32> = -512.0..=511.75;

const FRAMES: &str = "Frames";
const SENSORS: &str = "Sensors";
const BUSES: &str = "Buses";
const SERVING: &str = "Serving";
const FIRMWARE: &str = "Firmware";

/// A bus clock in Hz, or none: transfers take no time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scl(pub(crate) Option<NonZeroU32>);

/// The way of a program to the buses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Via {
    Syscalls,
    Socket,
    Usbip,
}

/// A microcontroller.
#[derive(Debug, Clone)]
pub(crate) struct Mcu {
    pub(crate) name: String,
    pub(crate) hz: Option<u32>,
}

/// Emulate AMG8833 sensors for a program that reads /dev/i2c-N.
///
/// Choose what the sensors see: --scene, --recording or --constant. Choose how programs reach them: PROGRAM, --socket (also
/// beside a PROGRAM) or --usbip. Exits with the PROGRAM's code. crates/grideye/EMULATE.md has more.
///
/// Example: grideye emulate --scene scenes/experiment-1.toml -- i2cdetect -y 1
///
/// Example: grideye emulate --recording walk.csv --socket /tmp/amg.sock
#[derive(Debug, Args)]
#[command(
    override_usage = "grideye emulate <--scene|--recording|--constant> [OPTIONS] [-- PROGRAM]",
    group(ArgGroup::new("shown").required(true))
)]
pub(crate) struct Emulate {
    /// Scene to show (TOML).
    ///
    /// People in it start walking at the first transfer.
    #[arg(long, value_name = "FILE", group = "shown")]
    pub(crate) scene: Option<PathBuf>,
    /// Recording to replay.
    ///
    /// Any that `grideye convert` reads.
    #[arg(long, value_name = "FILE", group = "shown")]
    pub(crate) recording: Option<PathBuf>,
    /// Temperature of all pixels, -512 to 511.75 °C.
    ///
    /// The thermistor reads 4.5 °C more, because a real chip warms itself; with --profile, `thermistor.offset_c` more.
    #[arg(long, value_name = "C", group = "shown", value_parser = constant)]
    pub(crate) constant: Option<f32>,
    /// Sensor and place [default: the only one].
    ///
    /// Repeatable. PLACE is BUS:ADDR (1:0x69) or BUS:MUX.CHANNEL:ADDR (1:0x70.3:0x69). One sensor alone needs none: --device and
    /// --address place it.
    #[arg(long = "sensor", value_name = "NAME[=PLACE]")]
    pub(crate) sensors: Vec<Placed>,
    /// Address, 0x68 or 0x69 [default: 0x69].
    ///
    /// Applies if there is one sensor.
    #[arg(long, value_name = "ADDR", value_parser = address_of)]
    pub(crate) address: Option<Address>,
    /// Profile [default: the scene's noise, exact clock].
    ///
    /// A file, or built-in ideal, datasheet or linaige. Sets noise, pattern, clock error and thermistor offset. Without it,
    /// --constant has no noise, and the thermistor reads 4.5 °C above the room. Not with --recording, which has its own noise.
    #[arg(long, value_name = "FILE|NAME")]
    pub(crate) profile: Option<PathBuf>,
    /// Script of faults to inject (TOML).
    #[arg(long, value_name = "FILE")]
    pub(crate) faults: Option<PathBuf>,
    /// Unix socket to serve until Ctrl-C.
    #[arg(long, value_name = "PATH")]
    pub(crate) socket: Option<PathBuf>,
    /// Attach a real /dev/i2c-N (root), or serve at ADDR.
    ///
    /// Without ADDR, attaches an adapter to this kernel. With ADDR, serves USB/IP over TCP for another.
    #[expect(
        clippy::option_option,
        reason = "clap's way of an option with an optional value"
    )]
    #[arg(long, value_name = "ADDR")]
    pub(crate) usbip: Option<Option<SocketAddr>>,
    /// Program, which alone sees /dev/i2c-N, or firmware (.elf, .hex).
    ///
    /// An ELF or Intel HEX file of an AVR runs in simavr, with the sensors at its TWI.
    #[arg(last = true, value_name = "PROGRAM")]
    pub(crate) program: Vec<String>,

    /// Timing of a recording's frames [default: times].
    #[arg(long, value_parser = one_of(REPLAY), hide_short_help = true, help_heading = FRAMES)]
    pub(crate) replay: Option<Replay>,
    /// Behavior at the end of a walk or a recording.
    #[arg(long, value_parser = one_of(AT_END), default_value = "hold", conflicts_with = "constant", hide_short_help = true, help_heading = FRAMES)]
    pub(crate) at_end: AtEnd,
    /// Emulated seconds per real second [default: 1; firmware: as many as it can].
    ///
    /// 0: time stands, and only the socket's clients move it.
    #[arg(long, value_name = "X", value_parser = not_negative, hide_short_help = true, help_heading = FRAMES)]
    pub(crate) speed: Option<f64>,
    /// Seed of noise and faults.
    #[arg(long, value_name = "N", default_value_t = 1, hide_short_help = true, help_heading = FRAMES)]
    pub(crate) seed: u64,

    /// Bus of the sensor, if there is one sensor [default: /dev/i2c-1].
    #[arg(long, value_name = "PATH", value_parser = device, hide_short_help = true, help_heading = SENSORS)]
    pub(crate) device: Option<u32>,
    /// Error of the sensors' clocks in parts per million [default: the profile's, or 0].
    ///
    /// -43000 is 4.3 % slow.
    #[arg(long, value_name = "PPM", value_parser = clock_error, hide_short_help = true, help_heading = SENSORS)]
    pub(crate) clock_error: Option<i32>,
    /// Power the sensors on as the program starts.
    ///
    /// By default they have been on long enough to have a frame.
    #[arg(long, hide_short_help = true, help_heading = SENSORS)]
    pub(crate) power_on: bool,

    /// Kind of adapter: pi, pi5, usb, smbus-only, busy, gone or virtio.
    #[arg(long, value_name = "KIND", default_value = "pi", hide_short_help = true, help_heading = BUSES)]
    pub(crate) adapter: AdapterMode,
    /// Bus clock, 1000 to 1000000 Hz, or `instant` [default: 100000].
    ///
    /// At 100000 Hz a frame read takes 12.3 ms of emulated time, and a program that reads a frame in parts now and then mixes
    /// two, as on a board. With `instant`, transfers take no time and no way of reading mixes frames.
    #[arg(long, value_name = "HZ|instant", value_parser = scl, hide_short_help = true, help_heading = BUSES)]
    pub(crate) scl: Option<Scl>,
    /// Log of the buses to write: .csv for a spreadsheet, .vcd for PulseView.
    #[arg(long, value_name = "FILE", hide_short_help = true, help_heading = BUSES)]
    pub(crate) trace: Option<PathBuf>,

    /// Way of the program to the sensors.
    #[arg(
        long,
        value_parser = one_of(VIA),
        default_value = "syscalls",
        requires = "program",
        conflicts_with = "usbip",
        hide_short_help = true,
        help_heading = SERVING
    )]
    pub(crate) via: Via,
    /// Time to serve, or firmware's own time, in seconds [default: until Ctrl-C].
    #[arg(long, value_name = "N", value_parser = positive, hide_short_help = true, help_heading = SERVING)]
    pub(crate) seconds: Option<f64>,
    /// Output that ends firmware [default: none].
    ///
    /// If it does not come in time, the exit code is 124.
    #[arg(long, value_name = "TEXT", hide_short_help = true, help_heading = FIRMWARE)]
    pub(crate) until: Option<String>,
    /// Microcontroller, and its clock [default: the ELF file's, 16000000 Hz].
    ///
    /// A name of simavr, such as atmega328p or atmega2560@8000000.
    #[arg(long, value_name = "NAME[@HZ]", value_parser = mcu, hide_short_help = true, help_heading = FIRMWARE)]
    pub(crate) mcu: Option<Mcu>,
    /// Port pins at the INT pins of the sensors in turn, such as PD2,- [default: none].
    #[arg(long = "int", value_name = "PIN", value_delimiter = ',', allow_hyphen_values = true, hide_short_help = true, help_heading = FIRMWARE)]
    pub(crate) interrupts: Vec<String>,
    /// Print JSON: one line when ready, one at the end.
    #[arg(long, hide_short_help = true, help_heading = SERVING)]
    pub(crate) json: bool,
    /// Print errors only.
    #[arg(long, short, conflicts_with = "json", hide_short_help = true, help_heading = SERVING)]
    pub(crate) quiet: bool,
}

const VIA: Choices<Via> = (
    &[Via::Syscalls, Via::Socket, Via::Usbip],
    "syscalls A /dev/i2c-N that it alone sees: its system calls are answered
socket A Unix socket, named by GRIDEYE_I2C_SOCKET, and no device
usbip An adapter of this kernel, as --usbip",
);

const REPLAY: Choices<Replay> = (
    &[Replay::Times, Replay::Frames],
    "times At their recorded times
frames One per frame of the sensor: none twice, none skipped",
);

const AT_END: Choices<AtEnd> = (
    &[AtEnd::Hold, AtEnd::Loop, AtEnd::End],
    "hold Keep the last frame
loop Start again
end Remove the bus (ENODEV) and stop serving",
);

fn constant(text: &str) -> Result<f32, String> {
    let (least, most) = (CONSTANT_C.start(), CONSTANT_C.end());
    let expected = format!("expected degrees Celsius, {least} to {most}");
    within(text, &CONSTANT_C, expected)
}

fn clock_error(text: &str) -> Result<i32, String> {
    let expected = format!(
        "expected parts per million, -{CLOCK_ERROR_PPM_MAX} to {CLOCK_ERROR_PPM_MAX}; -43000 is 4.3 % slow"
    );
    within(
        text,
        &(-CLOCK_ERROR_PPM_MAX..=CLOCK_ERROR_PPM_MAX),
        expected,
    )
}

fn not_negative(text: &str) -> Result<f64, String> {
    within(text, &(0.0..=f64::MAX), "expected a number, 0 or above")
}

fn mcu(text: &str) -> Result<Mcu, String> {
    let Some((name, hz)) = text.split_once('@') else {
        let (name, hz) = (text.to_owned(), None);
        return Ok(Mcu { name, hz });
    };
    let (least, most) = (MCU_HZ.start(), MCU_HZ.end());
    let hz = within(
        hz,
        &MCU_HZ,
        format!("expected {least} to {most} Hz after the @"),
    )?;
    Ok(Mcu {
        name: name.to_owned(),
        hz: Some(hz),
    })
}

fn scl(text: &str) -> Result<Scl, String> {
    if text == "instant" {
        return Ok(Scl(None));
    }
    let (least, most) = (SCL_HZ_RANGE.start(), SCL_HZ_RANGE.end());
    let expected =
        format!("expected {least} to {most} Hz or `instant`; usual are 100000 and 400000");
    let hz = within(text, &SCL_HZ_RANGE, expected)?;
    Ok(Scl(NonZeroU32::new(hz)))
}
