//! The options of `grideye emulate`. The text of its help is laid out by hand, so that it fits on one screen.

use super::shared::{Choices, Method, one_of, positive, within};
use amg8833_emulator::{Address, CLOCK_ERROR_PPM_MAX};
use clap::{ArgGroup, Args};
use grideye_rig::{AtEnd, Placed, Replay, address_of, device};
use i2c_emulation::ioctl::AdapterMode;
use i2c_emulation::program::Via;
use std::net::SocketAddr;
use std::num::NonZeroU32;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// The sensor's highest bus clock is 400,000 Hz (AMG88 spec §4-6-2); adapters go to 1 MHz.
const SCL_HZ: RangeInclusive<u32> = 1_000..=1_000_000;
/// What the sensor's registers hold, °C (AMG88 spec §4-11-11: 12 bits of a quarter of a degree).
const CONSTANT_C: RangeInclusive<f32> = -512.0..=511.75;

/// Emulate sensors for another program: /dev/i2c-N, socket, USB/IP.
///
/// Example: grideye emulate --scene scenes/experiment-1.toml -- i2cdetect -y 1
#[derive(Debug, Args)]
#[command(override_help = include_str!("emulate.txt"), group(ArgGroup::new("shown").required(true)))]
pub(crate) struct Emulate {
    /// Scene that the sensors see.
    #[arg(long, value_name = "FILE", group = "shown")]
    pub(crate) scene: Option<PathBuf>,
    /// How the frames of a scene are made.
    #[arg(long, value_name = "grid|area", default_value = "grid", conflicts_with_all = ["recording", "constant"])]
    pub(crate) method: Method,
    /// Recording that the sensor replays.
    #[arg(long, value_name = "FILE", group = "shown")]
    pub(crate) recording: Option<PathBuf>,
    /// Temperature that every pixel sees, °C.
    #[arg(long, value_name = "C", group = "shown", value_parser = constant, allow_hyphen_values = true)]
    pub(crate) constant: Option<f32>,
    /// When a recording's frames come.
    #[arg(long, value_parser = one_of(REPLAY), value_name = "times|frames")]
    pub(crate) replay: Option<Replay>,
    /// What comes after the end of a walk or a recording.
    #[arg(long, value_parser = one_of(AT_END), value_name = "hold|loop|end",
        default_value = "hold", conflicts_with = "constant")]
    pub(crate) at_end: AtEnd,

    /// Sensor of the scene, and its place.
    #[arg(long = "sensor", value_name = "NAME[=PLACE]")]
    pub(crate) sensors: Vec<Placed>,
    /// Address of the one sensor.
    #[arg(long, value_name = "ADDR", value_parser = address_of)]
    pub(crate) address: Option<Address>,
    /// Device file of the one sensor's bus.
    #[arg(long, value_name = "PATH", value_parser = device)]
    pub(crate) device: Option<u32>,
    /// Sensor profile: a file, or ideal, datasheet or linaige.
    #[arg(long, value_name = "FILE|NAME")]
    pub(crate) profile: Option<PathBuf>,
    /// Script of faults.
    #[arg(long, value_name = "FILE")]
    pub(crate) faults: Option<PathBuf>,
    /// How far the sensors' clocks are off.
    #[arg(long, value_name = "PPM", value_parser = clock_error, allow_hyphen_values = true)]
    pub(crate) clock_error: Option<i32>,
    /// Whether the program meets sensors that are switched on this instant.
    #[arg(long)]
    pub(crate) power_on: bool,
    /// Emulated seconds in a real one.
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = positive, allow_negative_numbers = true)]
    pub(crate) speed: f64,
    /// Seed of noise and faults.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,

    /// Kind of adapter.
    #[arg(long, value_name = "KIND", default_value = "pi")]
    pub(crate) adapter: AdapterMode,
    /// Bus clock; without it transfers take no emulated time.
    #[arg(long, value_name = "HZ", value_parser = scl)]
    pub(crate) scl: Option<NonZeroU32>,
    /// Log of the buses.
    #[arg(long, value_name = "FILE")]
    pub(crate) trace: Option<PathBuf>,

    /// How the program's device is made.
    #[arg(
        long,
        value_name = "auto|fuse|preload",
        default_value = "auto",
        requires = "program",
        conflicts_with = "usbip"
    )]
    pub(crate) via: Via,
    /// Unix socket to serve.
    #[arg(long, value_name = "PATH")]
    pub(crate) socket: Option<PathBuf>,
    /// Attach an adapter to this kernel, or serve one over TCP.
    #[expect(
        clippy::option_option,
        reason = "clap's way of an option with an optional value"
    )]
    #[arg(long, value_name = "ADDR")]
    pub(crate) usbip: Option<Option<SocketAddr>>,
    /// End after this many seconds.
    #[arg(long, value_name = "N", conflicts_with = "program", value_parser = positive, allow_negative_numbers = true)]
    pub(crate) seconds: Option<f64>,
    /// Print JSON instead of prose.
    #[arg(long)]
    pub(crate) json: bool,
    /// Say nothing but errors.
    #[arg(long, short, conflicts_with = "json")]
    pub(crate) quiet: bool,
    /// The program and its arguments.
    #[arg(last = true, value_name = "PROGRAM")]
    pub(crate) program: Vec<String>,
}

const REPLAY: Choices<Replay> = (
    &[Replay::Times, Replay::Frames],
    "times At the times at which they were recorded
frames One with each frame of the sensor: none twice, none left out",
);

const AT_END: Choices<AtEnd> = (
    &[AtEnd::Hold, AtEnd::Loop, AtEnd::End],
    "hold The last picture stays
loop It begins again
end The bus is gone (ENODEV), and a server ends",
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

fn scl(text: &str) -> Result<NonZeroU32, String> {
    let (least, most) = (SCL_HZ.start(), SCL_HZ.end());
    let expected = format!("expected {least} to {most} Hz; usual are 100000 and 400000");
    let hz = within(text, &SCL_HZ, expected.as_str())?;
    NonZeroU32::new(hz).ok_or(expected)
}

#[cfg(test)]
mod tests {
    use crate::cli::Cli;
    use clap::CommandFactory as _;

    const HELP: &str = include_str!("emulate.txt");

    #[test]
    fn the_help_names_every_option_with_its_default_and_no_other() {
        let mut cli = Cli::command();
        cli.build();
        let emulate = cli.find_subcommand("emulate").unwrap();
        let mut known = vec!["--".to_owned(), "--help".to_owned(), "--version".to_owned()];
        let words = HELP.split(|at: char| at.is_whitespace() || "[](),;".contains(at));
        let words: Vec<&str> = words.filter(|word| word.starts_with("--")).collect();
        for option in emulate.get_arguments() {
            let Some(option_name) = option.get_long().map(|long| format!("--{long}")) else {
                continue;
            };
            let is_everywhere = known[1..3].contains(&option_name);
            assert!(
                is_everywhere || words.contains(&option_name.as_str()),
                "{option_name}"
            );
            let start = format!("{option_name} ");
            let mut lines = HELP.lines().map(str::trim_start);
            let line = lines
                .find(|line| line.starts_with(&start))
                .unwrap_or_default();
            let values = option.get_default_values().iter();
            for default in values.filter(|_| option.get_action().takes_values()) {
                let default = format!("[{}]", default.to_string_lossy());
                assert!(line.contains(&default), "{option_name} {default}");
            }
            known.push(option_name);
        }
        for word in words {
            assert!(
                known.iter().any(|option| option == word),
                "{word} is no option"
            );
        }
    }
}
