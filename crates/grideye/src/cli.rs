//! The command line: names, defaults and help of every command.

mod access;
mod align;
mod coverage;
mod dataset;
mod emulate;
mod shared;

use clap::builder::TypedValueParser as _;
use clap::{Args, CommandFactory as _, FromArgMatches as _, Parser, Subcommand};
use grideye_agent::cli::on_a_screen;
use grideye_scene::Model;
use grideye_validator::background::Empty;
use grideye_validator::metrics::Binning;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

pub(crate) use access::{
    BridgeOptions, BrokerOptions, Collect, CollectorAddress, Enroll, Forget, LogFormat,
    MqttCommand, MqttWhat, Scenes, TokenCommand, TokenList, TokenMake, TokenRevoke, TokenWhat,
};
pub(crate) use align::Align;
pub(crate) use coverage::Coverage;
pub(crate) use dataset::Dataset;
pub(crate) use emulate::Emulate;
use shared::{Choices, one_of, positive};
pub(crate) use shared::{Method, SEED};

/// Record and validate Panasonic Grid-EYE AMG8833 sensors, real and emulated.
///
/// Exit codes: 0 done, or agrees; 1 failed, or disagrees; 2 bad usage or input; 3 no answer, or data lost.
///
/// Example: grideye demo --once --out out
#[derive(Debug, Parser)]
#[command(name = "grideye", version, max_term_width = 100)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

impl Cli {
    /// The command line that the program was started with; ends the program where it is not understood, or asks for help.
    pub(crate) fn of_the_program() -> Self {
        Self::from_arg_matches(&command().get_matches()).unwrap_or_else(|error| error.exit())
    }
}

pub(crate) fn command() -> clap::Command {
    on_a_screen(Cli::command())
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Demo(Demo),
    Simulate(Simulate),
    Dataset(Dataset),
    Fuse(Fuse),
    Distinguish(Distinguish),
    Coverage(Coverage),
    Emulate(Emulate),
    Collect(Collect),
    Enroll(Enroll),
    Token(TokenCommand),
    Record(Record),
    Orient(Orient),
    Compare(Compare),
    Convert(Convert),
    Calibrate(Calibrate),
    Characterize(Characterize),
    Audit(Audit),
    Migrate(Migrate),
    Backup(Backup),
    Mqtt(MqttCommand),
    Completions(Completions),
    Man(Man),
}

/// Show the whole loop on this computer, without hardware.
///
/// Emulated sensor, agent, collector, live page, recording, comparison, report. The page opens with the sensor beside its scene.
///
/// Example: grideye demo --once --out out
#[derive(Debug, Args)]
pub(crate) struct Demo {
    /// Exit with the verdict's code after the recording.
    ///
    /// Without it the page is served until Ctrl-C.
    #[arg(long)]
    pub(crate) once: bool,
    /// Folder for the store, the recording and the report.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub(crate) out: PathBuf,
    /// Scene to show [default: experiment 1].
    ///
    /// The default is experiment 1 of the paper.
    #[arg(long, value_name = "FILE", conflicts_with = "replay")]
    pub(crate) scene: Option<PathBuf>,
    /// Sensor of the scene; required when it has several.
    #[arg(long, value_name = "NAME", conflicts_with = "replay")]
    pub(crate) sensor: Option<String>,
    /// Play a recording through the sensor instead.
    ///
    /// The frames pass the emulated sensor's registers; each is counted and compared.
    #[arg(long, value_name = "RECORDING")]
    pub(crate) replay: Option<PathBuf>,
    /// Emulated seconds per real second.
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = positive)]
    pub(crate) speed: f64,
    /// Address of the live page; port 0 takes a free one.
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:0")]
    pub(crate) listen: SocketAddr,
    /// Open the live page in a browser.
    ///
    /// Calls `xdg-open`, or `open` on macOS.
    #[arg(long)]
    pub(crate) open: bool,
    /// Seed of the emulated sensor's noise.
    ///
    /// The comparison draws its simulated noise from another seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) scenes: Scenes,
}

/// Simulate what a sensor of a scene measures, and draw the room.
///
/// Example: grideye simulate scenes/experiment-3.toml --out walk.gif --view room.svg
#[derive(Debug, Args)]
pub(crate) struct Simulate {
    /// Scene file.
    pub(crate) scene: PathBuf,
    /// Sensor of the scene; needed when it has several.
    #[arg(long, value_name = "NAME")]
    pub(crate) sensor: Option<String>,
    /// Number of frames [default: the whole walk, or 10].
    ///
    /// A scene that stands still has no end: 10 are made.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) frames: Option<u32>,
    /// Seed of the noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// The model of the frames [default: the scene's own].
    #[arg(long, value_parser = one_of(MODELS))]
    pub(crate) model: Option<Model>,
    /// The paper's grid of points, or exact areas.
    ///
    /// The exact area of what is seen in each pixel takes the place of the sampling points; the physical model has no grid.
    #[arg(long, value_enum, default_value_t = Method::Grid)]
    pub(crate) method: Method,
    /// Frames to write: .csv, .npz, .png or .gif.
    ///
    /// A table is a recording if the sensor has 8 x 8 pixels; .npz is for numpy, .png a contact sheet, .gif a film. Without
    /// it, the first frame is printed.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Drawing of the room, in perspective and plan.
    #[arg(long, value_name = "FILE.svg")]
    pub(crate) view: Option<PathBuf>,
}

const MODELS: Choices<Model> = (
    &[Model::Paper, Model::Physical],
    "paper The paper's perceived temperature, resampled
physical Radiance, averaged over each pixel's response",
);

/// Make one frame of more pixels from the sensors of a scene.
///
/// Says how near each way of doing so comes to the truth.
///
/// Example: grideye fuse scenes/scenario-a-3x3.toml --out fused.png
#[derive(Debug, Args)]
pub(crate) struct Fuse {
    /// Scene file.
    ///
    /// Its sensors stand in a grid, and their operating distance is the plane that is meant.
    pub(crate) scene: PathBuf,
    /// Sensors of the array, with commas [default: all].
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub(crate) sensors: Vec<String>,
    /// Frames of each sensor that are averaged first.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) frames: u32,
    /// Seed of the noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Pictures: one sensor, each method, the truth.
    #[arg(long, value_name = "FILE.png")]
    pub(crate) out: Option<PathBuf>,
    /// The same for programs; `-` is standard output.
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,
}

/// Say which sensors tell situations apart above their noise.
///
/// Each situation is a scene of the same room.
///
/// Exit code 1: all sensors together do not tell all situations apart.
///
/// Example: grideye distinguish scenes/scenario-b-before.toml scenes/scenario-b-after.toml
#[derive(Debug, Args)]
pub(crate) struct Distinguish {
    /// Scene files, one for each situation, with the same sensors.
    #[arg(required = true, num_args = 2..)]
    pub(crate) scenes: Vec<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Record what arrives at a running collector under a name.
///
/// Example: grideye record empty-room --seconds 60 --out empty-room.csv
#[derive(Debug, Args)]
pub(crate) struct Record {
    /// Name of the recording.
    pub(crate) name: String,
    /// Length in seconds; without it, until Ctrl-C.
    #[arg(long, value_name = "N")]
    pub(crate) seconds: Option<u64>,
    /// Also write the recording to this file.
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) collector: CollectorAddress,
}

/// Find out how a sensor is mounted, by a hand at the left and one at the top.
///
/// Left and top are those of somebody behind the sensor who looks where it looks; below a ceiling they are those of a map
/// of the room. In a recording the first to be seen after an empty view is the hand at the left, the second the one at the
/// top. A person does as well as a hand.
///
/// Exit code 3: it cannot tell.
///
/// Example: grideye orient --sensor pi-1/i2c-1:0x69
#[derive(Debug, Args)]
pub(crate) struct Orient {
    /// The sensor, where there are several.
    ///
    /// As the page names it, with its device and a slash before it where two devices have a sensor of that name.
    #[arg(long, value_name = "SENSOR")]
    pub(crate) sensor: Option<String>,
    /// Look at a recording, not at live frames.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["url", "token_file", "authority", "seconds"])]
    pub(crate) recording: Option<PathBuf>,
    /// Longest wait for each hand, in seconds.
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..=3600))]
    pub(crate) seconds: u64,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) collector: CollectorAddress,
}

/// A recording and the scene that it is held against.
#[derive(Debug, Args)]
pub(crate) struct Sides {
    /// Scene file.
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: PathBuf,
    /// Recording: this project's CSV, or LINAIGE's.
    #[arg(long, value_name = "FILE")]
    pub(crate) recording: PathBuf,
    /// Sensor of the scene, if it has several.
    #[arg(long, value_name = "NAME")]
    pub(crate) sensor: Option<String>,
    /// The same for programs; `-` is standard output.
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,
}

/// Say whether a recording agrees with a simulation of its scene.
///
/// Time is aligned within stated bounds where something moves, unless that is no better than chance; what was found
/// is printed. An image that lies otherwise than the scene's is reported as a fault, and turned only if asked for.
///
/// Exit code 0: agrees, 1: disagrees, 3: cannot tell.
///
/// Example: grideye compare --scene scenes/experiment-1.toml --recording out/recording.csv --report report.html
#[derive(Debug, Args)]
pub(crate) struct Compare {
    #[command(flatten)]
    pub(crate) sides: Sides,
    /// Report to write, one file for any browser.
    #[arg(long, value_name = "FILE.html")]
    pub(crate) report: Option<PathBuf>,
    /// Each part of the verdict as a test case.
    ///
    /// For a server of continuous integration.
    #[arg(long, value_name = "FILE.xml")]
    pub(crate) junit: Option<PathBuf>,
    /// What the verdict is measured against.
    ///
    /// Where it is not to be as shipped: crates/grideye-validator/thresholds.toml, which is also the example.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) thresholds: Option<PathBuf>,
    /// Profile of the sensor (`grideye characterize`).
    ///
    /// The specimen's pattern is added to the scene, and its level is no longer free by the datasheet's accuracy.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) profile: Option<PathBuf>,
    /// Seed of the simulation.
    #[arg(long, value_name = "N", default_value_t = SEED)]
    pub(crate) seed: u64,
    /// Second of the scene at which it begins.
    #[arg(long, allow_hyphen_values = true, value_name = "SECONDS", value_parser = seconds, default_value = "0")]
    pub(crate) start: Duration,
    /// step:WIDTH (°C), levels:N or grey256.
    ///
    /// Bins of the second set of entropies, beside the paper's 256 grey levels; by default the sensor's own steps.
    #[arg(long, value_name = "BINS")]
    pub(crate) binning: Option<Binning>,
    #[command(flatten)]
    pub(crate) align: Align,
}

/// Convert a recording for numpy, pandas, Foxglove and people.
///
/// Read are this project's CSV, the LINAIGE layout, rows of 64 degrees as common Adafruit scripts write them, and numpy's
/// .npy of shape (N, 8, 8).
///
/// Example: grideye convert recordings/linaige/Session2_2021-07-01_RoomB_v2.csv session2.parquet
#[derive(Debug, Args)]
pub(crate) struct Convert {
    /// Recording to read.
    pub(crate) input: PathBuf,
    /// File to write: .csv, .npz, .parquet, .mcap, .png or .gif.
    ///
    /// .png is a sheet of frames, .gif a film.
    pub(crate) output: PathBuf,
    /// Keep the rows of this sensor alone.
    #[arg(long, value_name = "[DEVICE/]SENSOR")]
    pub(crate) sensor: Option<String>,
    /// What the thermistor read, if the file lacks it.
    ///
    /// Rows of 64 degrees and .npy do not say it.
    #[arg(long, value_name = "CELSIUS")]
    pub(crate) thermistor: Option<f32>,
    /// Frames a second, if the file lacks times.
    ///
    /// Rows of 64 degrees and .npy do not say when they were read.
    #[arg(long, value_name = "HZ", default_value_t = 10.0, value_parser = positive)]
    pub(crate) rate: f64,
}

/// Find the unknowns of a scene from a recording.
///
/// Poses, temperatures, emissivities, the time at which it begins. The scene marks them, each with bounds: `[[fit]] key = "sensor.ceiling.elevation_deg", bounds = [80, 90]`. The search
/// starts from the numbers in it.
///
/// Exit code 3: the recording tells none of them.
///
/// Example: grideye calibrate --scene scenes/calibration.toml --recording walk.csv --out scenes/calibrated.toml
#[derive(Debug, Args)]
pub(crate) struct Calibrate {
    #[command(flatten)]
    pub(crate) sides: Sides,
    /// Scene to write, with what was found.
    ///
    /// It is the old one, with a remark of its uncertainty at each `[[fit]]`.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) out: Option<PathBuf>,
    /// Profile of the sensor, if it is known.
    ///
    /// Its pattern is taken off, its common mode is believed.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) profile: Option<PathBuf>,
    /// Profile to write: noise, and what is left over.
    ///
    /// The recording's noise, and the pattern that the scene leaves over.
    #[arg(long, value_name = "FILE")]
    pub(crate) write_profile: Option<PathBuf>,
    /// Frames to look at, 10 to 1000 [default: 200].
    ///
    /// They are chosen evenly.
    #[arg(long, value_name = "N")]
    pub(crate) frames: Option<usize>,
    /// Places to start from, 1 to 100.
    ///
    /// The first is the scene as it stands.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u64).range(1..=100).map(|starts| usize::try_from(starts).unwrap_or(100)))]
    pub(crate) starts: usize,
    /// Seed of the other starts.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
}

/// Measure the sensor itself from a recording of a still room.
///
/// Noise, common mode, pattern, drift, clock, glitches.
///
/// Exit code 3: the recording is too short, or leaves open whether somebody is in view.
///
/// Example: grideye characterize empty-room.csv --profile my-sensor.toml
#[derive(Debug, Args)]
pub(crate) struct Characterize {
    /// Recording: this project's CSV, or LINAIGE's.
    pub(crate) recording: PathBuf,
    /// Profile to write, for emulate and compare.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) profile: Option<PathBuf>,
    /// Where nobody is in view: yes, no, auto or FROM..TO [default: the recording decides].
    ///
    /// `yes`: throughout. `auto`: in stretches that are looked for. FROM..TO: in that one, in seconds since the first frame.
    /// The profile's pattern is then the whole background of the empty room. `no`: nowhere; the pattern is only what is not
    /// smooth in the background, which holds in another room too. Without the option it is `yes` where nothing moves and
    /// nothing warm stands, `no` where something moves; where neither is sure, no profile is written.
    #[arg(long, value_name = "WHERE", value_parser = nobody)]
    pub(crate) empty: Option<Nobody>,
    /// Scene whose empty room is taken off.
    ///
    /// What the scene's empty room shows is taken off the background.
    #[arg(long, value_name = "FILE", requires = "empty")]
    pub(crate) scene: Option<PathBuf>,
    /// Sensor of the scene; needed when it has several.
    #[arg(long, value_name = "NAME", requires = "scene")]
    pub(crate) sensor: Option<String>,
    /// Report to write, one file for any browser.
    ///
    /// Table, maps, Allan deviations.
    #[arg(long, value_name = "FILE.html")]
    pub(crate) report: Option<PathBuf>,
    /// The same for programs; `-` is standard output.
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Nobody {
    /// In all of it.
    Throughout,
    /// In none of it, or in none that matters.
    Nowhere,
    /// In stretches.
    In(Empty),
}

fn nobody(text: &str) -> Result<Nobody, String> {
    Ok(match text {
        "yes" => Nobody::Throughout,
        "no" => Nobody::Nowhere,
        "auto" => Nobody::In(Empty::Find),
        _ => Nobody::In(Empty::Named(text.parse().map_err(|expected: String| {
            let expected = expected.trim_start_matches("expected ");
            format!("expected yes, no or auto, or {expected}")
        })?)),
    })
}

/// Count every frame: read = stored + dropped + spooled.
///
/// At a running collector.
///
/// Exit code 0: balanced and nothing lost, 3: frames were lost.
///
/// Example: grideye audit --json
#[derive(Debug, Args)]
pub(crate) struct Audit {
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) collector: CollectorAddress,
}

/// Move a store from an SQLite file into a PostgreSQL database.
///
/// Each frame is held against the file afterwards. The database must exist and hold no frames. When it is interrupted, the same command goes on where it was; until it
/// is done, no collector takes the database. The file stays as it is.
///
/// Exit code 1: the database does not hold what the file holds.
///
/// Example: grideye migrate frames.sqlite postgres://grideye@db.local/frames
#[derive(Debug, Args)]
pub(crate) struct Migrate {
    /// SQLite file that no collector is using.
    pub(crate) file: PathBuf,
    /// `postgres://USER[:PASSWORD]@HOST[:PORT]/DATABASE`.
    ///
    /// The password may stand in the file that PGPASSFILE names.
    pub(crate) url: String,
    /// Print the counts as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Copy a store to a new file, also while a collector writes to it.
///
/// The copy is checked against the store before it gets its name: every frame, the counts, the recordings. To restore it,
/// name it: `grideye collect --store OUT`. A run that is killed leaves OUT.partial, which the next one overwrites.
///
/// Do not copy the file of a running collector with `cp`: the newest frames are in its log (FILE-wal), and a copy made during a write is torn.
///
/// Example: grideye backup --store frames.sqlite monday.sqlite
#[derive(Debug, Args)]
pub(crate) struct Backup {
    /// Store to copy: the SQLite file.
    #[arg(long, value_name = "FILE")]
    pub(crate) store: String,
    /// File to write; must not exist.
    pub(crate) out: PathBuf,
    /// Print the counts as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Print the completions of a shell for either program.
///
/// Debian's packages bring them. Otherwise: `grideye completions bash > ~/.local/share/bash-completion/completions/grideye`.
///
/// Example: grideye completions bash
#[derive(Debug, Args)]
pub(crate) struct Completions {
    /// Whose.
    #[arg(value_enum)]
    pub(crate) shell: clap_complete::Shell,
    /// The program that is completed.
    #[arg(long, value_parser = one_of(PROGRAMS), default_value = "grideye")]
    pub(crate) program: fn() -> clap::Command,
}

const PROGRAMS: Choices<fn() -> clap::Command> = (
    &[command, grideye_agent::cli::command],
    "grideye The command line on the PC
grideye-agent The program on the Raspberry Pi",
);

/// Write the man pages of both programs into a folder.
///
/// Debian's packages bring them. Otherwise: `grideye man ~/.local/share/man/man1`.
///
/// Example: grideye man man1
#[derive(Debug, Args)]
pub(crate) struct Man {
    /// Folder for the pages; made if it is not there.
    pub(crate) folder: PathBuf,
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok();
    let time = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    time.ok_or_else(|| "expected seconds, 0 or more".to_owned())
}
