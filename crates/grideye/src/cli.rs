//! The command line: names, defaults and help of every command.

mod access;
mod align;
mod coverage;
mod dataset;
mod emulate;
mod mqtt;
pub(crate) mod place;

use clap::builder::TypedValueParser as _;
use clap::{Args, Parser, Subcommand};
use grideye_scene::{Scene, SceneError, Simulator};
use grideye_validator::background::Empty;
use grideye_validator::metrics::Binning;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

pub(crate) use access::{
    Collect, CollectorAddress, Enroll, LogFormat, PageScope, Scenes, TokenCommand, TokenList,
    TokenMake, TokenRevoke, TokenWhat,
};
pub(crate) use align::Align;
pub(crate) use coverage::{Coverage, Posture, Where};
pub(crate) use dataset::{Dataset, Shard, Table};
pub(crate) use emulate::Emulate;
pub(crate) use mqtt::{BridgeOptions, BrokerOptions, Forget, MqttCommand, MqttWhat};

/// Record and validate Panasonic Grid-EYE AMG8833 sensors, real and emulated.
#[derive(Debug, Parser)]
#[command(version, propagate_version = true, max_term_width = 100)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
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
    Compare(Compare),
    Convert(Convert),
    Calibrate(Calibrate),
    Characterize(Characterize),
    Audit(Audit),
    Migrate(Migrate),
    Mqtt(MqttCommand),
}

/// The whole loop on this computer: emulated sensor, agent, collector, live page, recording, comparison, report.
///
/// Example: grideye demo --once --out out
#[derive(Debug, Args)]
pub(crate) struct Demo {
    /// End with the verdict's exit code instead of serving the page until Ctrl-C.
    #[arg(long)]
    pub(crate) once: bool,
    /// Folder for the store, the recording and the report.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub(crate) out: PathBuf,
    /// Scene that the emulated sensor sees [default: the paper's experiment 1].
    #[arg(long, value_name = "FILE", conflicts_with = "replay")]
    pub(crate) scene: Option<PathBuf>,
    /// Sensor of the scene; needed when it has several.
    #[arg(long, value_name = "NAME", conflicts_with = "replay")]
    pub(crate) sensor: Option<String>,
    /// Recording to play through the emulated sensor's registers instead; every frame is counted and compared.
    #[arg(long, value_name = "RECORDING")]
    pub(crate) replay: Option<PathBuf>,
    /// Emulated seconds in a real one.
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = positive)]
    pub(crate) speed: f64,
    /// Address of the live page; port 0 takes a free one.
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:0")]
    pub(crate) listen: SocketAddr,
    /// Seed of the emulated sensor's noise; the comparison's simulation draws from another.
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
    /// Number of frames [default: the whole walk, or 10 of a scene that stands still].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) frames: Option<u32>,
    /// Seed of the noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// The model of the frames [default: the scene's own].
    #[arg(long, value_enum)]
    pub(crate) model: Option<Model>,
    /// The paper's grid of sampling points, or the exact area of what is seen in each pixel; the physical model has no
    /// grid.
    #[arg(long, value_enum, default_value_t = Method::Grid)]
    pub(crate) method: Method,
    /// Frames to write: .csv (a recording if the sensor has 8 x 8 pixels, else a table), .npz (numpy), .png (contact
    /// sheet), .gif (film); without it, the first frame is printed.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Drawing of the room to write (.svg), in perspective and from above.
    #[arg(long, value_name = "FILE.svg")]
    pub(crate) view: Option<PathBuf>,
}

/// What a frame is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Model {
    /// The paper's perceived temperature, resampled.
    Paper,
    /// Radiance, averaged over each pixel's response.
    Physical,
}

/// How a simulated frame is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Method {
    /// Rays through a grid of points, resampled to the sensor's pixels.
    Grid,
    /// The integral over each pixel's response, without a grid.
    Area,
}

impl Method {
    /// A simulator for the sensor of that name that makes its frames so.
    pub(crate) fn simulator(self, scene: &Scene, sensor: &str) -> Result<Simulator, SceneError> {
        match self {
            Self::Grid => Simulator::new(scene, sensor),
            Self::Area => Simulator::without_grid(scene, sensor),
        }
    }
}

/// Make one frame of more pixels from the sensors of a scene, and say how near it comes to the truth.
///
/// Example: grideye fuse scenes/scenario-a-3x3.toml --out fused.png
#[derive(Debug, Args)]
pub(crate) struct Fuse {
    /// Scene file; its sensors stand in a grid, and their operating distance is the plane that is meant.
    pub(crate) scene: PathBuf,
    /// Sensors of the array, with commas between them [default: all of the scene].
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub(crate) sensors: Vec<String>,
    /// Frames of each sensor that are averaged first.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) frames: u32,
    /// Seed of the noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Pictures to write (.png): one sensor, each method, and the truth.
    #[arg(long, value_name = "FILE.png")]
    pub(crate) out: Option<PathBuf>,
    /// The same content, and the cells, for programs; `-` is standard output.
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,
}

/// Say which sensors of a room tell situations apart above their noise.
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

/// A recording and the scene that it is held against.
#[derive(Debug, Args)]
pub(crate) struct Sides {
    /// Scene file.
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: PathBuf,
    /// Recording (this project's CSV, or a LINAIGE session).
    #[arg(long, value_name = "FILE")]
    pub(crate) recording: PathBuf,
    /// Sensor of the scene; needed when it has several.
    #[arg(long, value_name = "NAME")]
    pub(crate) sensor: Option<String>,
    /// What was found, for programs; `-` is standard output.
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,
}

/// Compare a recording with a simulation of its scene, and say whether they agree.
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
    /// Report to write as one self-contained HTML file.
    #[arg(long, value_name = "FILE.html")]
    pub(crate) report: Option<PathBuf>,
    /// The report as a PDF file, printed by Chromium, which has to be installed.
    #[arg(long, value_name = "FILE.pdf")]
    pub(crate) pdf: Option<PathBuf>,
    /// Each part of the verdict as a test case, for a server of continuous integration.
    #[arg(long, value_name = "FILE.xml")]
    pub(crate) junit: Option<PathBuf>,
    /// What the verdict is measured against, where it is not to be as shipped
    /// (crates/grideye-validator/thresholds.toml, which is also the example).
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) thresholds: Option<PathBuf>,
    /// Profile of the sensor's specimen: its pattern is added to the scene, and its level is no longer free by the
    /// datasheet's accuracy.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) profile: Option<PathBuf>,
    /// Seed of the simulation.
    #[arg(long, value_name = "N", default_value_t = crate::compare::SEED)]
    pub(crate) seed: u64,
    /// Second of the scene at which the recording begins.
    #[arg(long, allow_hyphen_values = true, value_name = "SECONDS", value_parser = seconds, default_value = "0")]
    pub(crate) start: Duration,
    /// Bins of the second set of entropies, beside the paper's 256 grey levels: `step:WIDTH` in °C, `levels:N` or
    /// `grey256`; by default the sensor's own steps.
    #[arg(long, value_name = "BINS")]
    pub(crate) binning: Option<Binning>,
    #[command(flatten)]
    pub(crate) align: Align,
}

/// Convert a recording into this project's CSV, or into what numpy, pandas, Foxglove and people read.
///
/// Read are this project's CSV, the LINAIGE layout, rows of 64 degrees as common Adafruit scripts write them, and numpy's
/// .npy of shape (N, 8, 8).
///
/// Example: grideye convert recordings/linaige/Session2_2021-07-01_RoomB_v2.csv session2.parquet
#[derive(Debug, Args)]
pub(crate) struct Convert {
    /// Recording to read.
    pub(crate) input: PathBuf,
    /// File to write: .csv, .npz, .parquet, .mcap, .png (a sheet of frames) or .gif (a film).
    pub(crate) output: PathBuf,
    /// Keep the rows of this sensor alone.
    #[arg(long, value_name = "[DEVICE/]SENSOR")]
    pub(crate) sensor: Option<String>,
    /// What the thermistor read, for rows of 64 degrees and .npy, which do not say it.
    #[arg(long, value_name = "CELSIUS")]
    pub(crate) thermistor: Option<f32>,
    /// Frames a second, for those that do not say when they were read.
    #[arg(long, value_name = "HZ", default_value_t = 10.0, value_parser = positive)]
    pub(crate) rate: f64,
}

/// Find the unknowns of a scene from a recording: poses, temperatures, emissivities, the time at which it begins.
///
/// The scene marks them, each with bounds: `[[fit]] key = "sensor.ceiling.elevation_deg", bounds = [80, 90]`. The search
/// starts from the numbers in it.
///
/// Exit code 3: the recording tells none of them.
///
/// Example: grideye calibrate --scene scenes/calibration.toml --recording walk.csv --out scenes/calibrated.toml
#[derive(Debug, Args)]
pub(crate) struct Calibrate {
    #[command(flatten)]
    pub(crate) sides: Sides,
    /// Scene to write: the old one with what was found, and a remark with its uncertainty at each `[[fit]]`.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) out: Option<PathBuf>,
    /// Profile of the sensor, if it is known: its pattern is taken off, its common mode is believed.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) profile: Option<PathBuf>,
    /// Profile to write: the recording's noise, and the pattern that the scene leaves over.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) write_profile: Option<PathBuf>,
    /// Frames to look at, 10 to 1000, chosen evenly [default: 200].
    #[arg(long, value_name = "N")]
    pub(crate) frames: Option<usize>,
    /// Places to start the search from, 1 to 100; the first is the scene as it stands.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u64).range(1..=100).map(|starts| usize::try_from(starts).unwrap_or(100)))]
    pub(crate) starts: usize,
    /// Seed of the other starts.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
}

/// Measure the sensor itself from a recording of a still room: noise, common mode, pattern, drift, clock, glitches.
///
/// Exit code 3: the recording is too short to say anything.
///
/// Example: grideye characterize empty-room.csv --profile my-sensor.toml
#[derive(Debug, Args)]
pub(crate) struct Characterize {
    /// Recording (this project's CSV, or a LINAIGE session).
    pub(crate) recording: PathBuf,
    /// Profile to write, for `grideye emulate --profile`.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) profile: Option<PathBuf>,
    /// Where nobody is: `auto`, or from and to in seconds since the first frame. The profile's pattern is then the whole
    /// background of the empty room, not only what is not smooth in it.
    #[arg(long, value_name = "auto|FROM..TO")]
    pub(crate) empty: Option<Nobody>,
    /// Scene of the recording: what its empty room shows is taken off the background.
    #[arg(long, value_name = "FILE", requires = "empty")]
    pub(crate) scene: Option<PathBuf>,
    /// Sensor of the scene; needed when it has several.
    #[arg(long, value_name = "NAME", requires = "scene")]
    pub(crate) sensor: Option<String>,
    /// Report to write as one self-contained HTML file: table, maps, Allan deviations.
    #[arg(long, value_name = "FILE.html")]
    pub(crate) report: Option<PathBuf>,
    /// The same content for programs; `-` is standard output.
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,
}

/// Where nobody is in a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Nobody(pub(crate) Empty);

impl std::str::FromStr for Nobody {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self(Empty::Find));
        }
        text.parse().map(|stretch| Self(Empty::Named(stretch)))
    }
}

/// Count every frame at a running collector: read = stored + dropped + spooled.
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

/// Move a store from an SQLite file into a PostgreSQL database, and hold each frame against the file afterwards.
///
/// The database must exist and hold no frames. When it is interrupted, the same command goes on where it was; until it
/// is done, no collector takes the database. The file stays as it is.
///
/// Exit code 1: the database does not hold what the file holds.
///
/// Example: grideye migrate frames.sqlite postgres://grideye@db.local/frames
#[derive(Debug, Args)]
pub(crate) struct Migrate {
    /// SQLite file that no collector is using.
    pub(crate) file: PathBuf,
    /// `postgres://USER[:PASSWORD]@HOST[:PORT]/DATABASE`; the password may stand in the file that PGPASSFILE names.
    pub(crate) url: String,
    /// Print the counts as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok().map(Duration::try_from_secs_f64);
    match seconds {
        Some(Ok(time)) => Ok(time),
        _ => Err("expected seconds, 0 or more".to_owned()),
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("expected a number above 0".to_owned()),
    }
}
