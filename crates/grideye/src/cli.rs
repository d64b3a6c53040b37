//! The command line: names, defaults and help of every command.

mod access;
mod align;
mod count;
mod coverage;
mod dataset;
mod emulate;
mod groups;
mod shared;
mod show;

use clap::builder::TypedValueParser as _;
use clap::{Args, CommandFactory as _, Parser, Subcommand};
use grideye_agent::cli::with_helps;
use grideye_agent::output;
use grideye_scene::Model;
use grideye_validator::background::Empty;
use grideye_validator::calibrate::Half;
use std::path::PathBuf;
use std::time::Duration;

pub(crate) use access::{
    BridgeOptions, BrokerOptions, Collect, CollectorAddress, Enroll, Forget, LogFormat,
    MqttCommand, MqttWhat, Record, Scenes, TokenCommand, TokenList, TokenMake, TokenRevoke,
    TokenWhat,
};
pub(crate) use align::Align;
pub(crate) use count::{Count, CountLive};
pub(crate) use coverage::Coverage;
pub(crate) use dataset::{Dataset, Preset};
pub(crate) use emulate::{Emulate, Scl, Via};
pub(crate) use shared::SEED;
use shared::{Choices, one_of, positive};
pub(crate) use show::{Demo, View};

/// Record and validate Panasonic Grid-EYE AMG8833 sensors, real and emulated.
///
/// Exit codes: 0 done, agrees; 1 failed, disagrees; 2 bad input; 3 no answer, loss
///
/// Example: grideye demo --once --out out
#[derive(Debug, Parser)]
#[command(name = "grideye", version, max_term_width = 100)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

impl Cli {
    /// The arguments of this program; exits if they are wrong or ask for help.
    pub(crate) fn of_the_program() -> Self {
        output::arguments(command())
    }
}

pub(crate) fn command() -> clap::Command {
    groups::listed(with_helps(Cli::command()))
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Demo(Demo),
    View(View),
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
    Count(Count),
    Audit(Audit),
    Migrate(Migrate),
    Backup(Backup),
    Restore(Restore),
    Mqtt(MqttCommand),
    Completions(Completions),
    Man(Man),
}

/// Compute the frames of a scene's sensor and draw the room.
///
/// Example: grideye simulate scenes/experiment-3.toml --out walk.gif --view room.svg
#[derive(Debug, Args)]
pub(crate) struct Simulate {
    /// Scene file (TOML).
    pub(crate) scene: PathBuf,
    /// Sensor of the scene [default: the only one].
    #[arg(long, value_name = "NAME")]
    pub(crate) sensor: Option<String>,
    /// Frames to compute [default: the whole walk, or 10].
    ///
    /// The default is 10 if nothing moves in the scene, because such a scene has no end.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) frames: Option<u32>,
    /// Seed of the noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Physics: paper, paper-grid or physical [default: the scene's].
    #[arg(long, value_parser = one_of(MODELS), hide_short_help = true)]
    pub(crate) model: Option<Model>,
    /// File of frames, as `convert` writes it [default: print].
    ///
    /// .csv, .npz, .parquet, .mcap, .png or .gif. .csv is in the sensor's steps, or a table of degrees if it has other than
    /// 8 x 8 pixels; .npz, .parquet and .mcap are not rounded; .png is a contact sheet, .gif a film. Without it, the first
    /// frame is printed.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Drawing of the room to write, in perspective and plan.
    #[arg(long, value_name = "FILE.svg")]
    pub(crate) view: Option<PathBuf>,
}

const MODELS: Choices<Model> = (
    &[Model::Paper, Model::PaperGrid, Model::Physical],
    "paper The paper's perceived temperature
paper-grid The same on the paper's grid of points, resampled: slow
physical Radiance, averaged over each pixel's response",
);

/// Merge the frames of several sensors into one of more pixels.
///
/// Prints how close each method comes to the true image.
///
/// Example: grideye fuse scenes/scenario-a-3x3.toml --out fused.png
#[derive(Debug, Args)]
pub(crate) struct Fuse {
    /// Scene with sensors in a grid (TOML).
    ///
    /// Their operating distance sets the plane of the merged frame.
    pub(crate) scene: PathBuf,
    /// Sensors to merge, comma-separated [default: all].
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub(crate) sensors: Vec<String>,
    /// Frames to average per sensor, 1 to 100000.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) frames: u32,
    /// Seed of the noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Images to write: one sensor, each method, the truth.
    #[arg(long, value_name = "FILE.png")]
    pub(crate) out: Option<PathBuf>,
    /// Results as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,
}

/// Find which sensors tell situations apart above their noise.
///
/// Each situation is one scene of the same room.
///
/// Exit code 1: all sensors together do not tell all situations apart
///
/// Example: grideye distinguish scenes/scenario-b-before.toml scenes/scenario-b-after.toml
#[derive(Debug, Args)]
pub(crate) struct Distinguish {
    /// Scene files, one per situation, with the same sensors.
    #[arg(required = true, num_args = 2..)]
    pub(crate) scenes: Vec<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Find how a sensor is mounted from a hand at its left and top.
///
/// Left and top are as you see them from behind the sensor, looking where it looks; for a sensor on the ceiling, as on a map
/// of the room. In a recording, the first thing seen after an empty view is the hand at the left, the second the hand at the
/// top. A person works as well as a hand.
///
/// Exit code 3: cannot tell
///
/// Example: grideye orient --sensor pi-1/i2c-1:0x69
#[derive(Debug, Args)]
pub(crate) struct Orient {
    /// Sensor to watch [default: the only one].
    ///
    /// Named as on the live page. If two devices have a sensor of that name, write DEVICE/SENSOR.
    #[arg(long, value_name = "SENSOR")]
    pub(crate) sensor: Option<String>,
    /// Recording to read instead of live frames.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["url", "token_file", "authority", "seconds"])]
    pub(crate) recording: Option<PathBuf>,
    /// Longest wait for each hand, 1 to 3600 s.
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..=3600))]
    pub(crate) seconds: u64,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) collector: CollectorAddress,
}

/// A recording and the scene to compare it with.
#[derive(Debug, Args)]
pub(crate) struct Sides {
    /// Scene file (TOML).
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: PathBuf,
    /// Recording of any format.
    #[arg(long, value_name = "FILE")]
    pub(crate) recording: PathBuf,
    /// Sensor of the scene [default: the only one].
    #[arg(long, value_name = "NAME")]
    pub(crate) sensor: Option<String>,
    /// Results as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,
}

/// Compare a recording with a simulation of its scene.
///
/// It agrees if it looks like simulated recordings of the scene, and like none of anything else: nobody, a person 0.5 m aside,
/// a mirrored image, another time. 1.5 % of right recordings disagree. Mark what you do not know exactly as `uncertain`.
/// `--align` matches the time for the scores; only `--align orientation` changes the verdict.
///
/// Exit code 0: agrees, 1: disagrees, 3: cannot tell
///
/// Example: grideye compare --scene scenes/experiment-1.toml --recording out/recording.csv
#[derive(Debug, Args)]
pub(crate) struct Compare {
    #[command(flatten)]
    pub(crate) sides: Sides,
    /// Report to write, one page for any browser.
    #[arg(long, value_name = "FILE.html")]
    pub(crate) report: Option<PathBuf>,
    /// Verdict as JUnit test cases, for CI.
    #[arg(long, value_name = "FILE.xml")]
    pub(crate) junit: Option<PathBuf>,
    /// Thresholds of the verdict [default: built in].
    ///
    /// crates/grideye-validator/thresholds.toml has the built-in values and is an example.
    #[arg(long, value_name = "FILE.toml", hide_short_help = true)]
    pub(crate) thresholds: Option<PathBuf>,
    /// Sensor profile, from `grideye characterize`.
    ///
    /// Adds this unit's pattern to the simulation. The level must then match, instead of being free within the datasheet's
    /// accuracy. Without a profile, 0.38 °C per pixel is unknown, as measured in other rooms. If that could hide a wrong scene,
    /// the verdict is "cannot tell".
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) profile: Option<PathBuf>,
    /// Seed of the simulated noise in the scores.
    #[arg(long, value_name = "N", default_value_t = SEED, hide_short_help = true)]
    pub(crate) seed: u64,
    /// Scene time at which the recording begins, in seconds [default: by UTC if trajectories have it, else 0].
    ///
    /// Below 0 if it begins before the scene: those frames are left out.
    #[arg(long, value_name = "SECONDS", value_parser = scene_seconds, hide_short_help = true)]
    pub(crate) start: Option<f64>,
    #[command(flatten)]
    pub(crate) align: Align,
}

/// Convert any recording for numpy, pandas, Foxglove or a viewer.
///
/// Reads CSV and other text, JSON, numpy's .npy and .npz, Parquet and .xlsx. Prints what it took for what; a file that breaks
/// off is read up to there. recordings/README.md lists the layouts.
///
/// Exit code 3: the file breaks off, or has damaged rows
///
/// Example: grideye convert frames.txt frames.parquet
#[derive(Debug, Args)]
pub(crate) struct Convert {
    /// Recording to read.
    pub(crate) input: PathBuf,
    /// File to write: .csv, .npz, .parquet, .mcap, .png or .gif.
    ///
    /// .png is a sheet of frames, .gif a film.
    pub(crate) output: PathBuf,
    /// Sensor to convert [default: all].
    ///
    /// SENSOR, or DEVICE/SENSOR if several devices have a sensor of that name.
    #[arg(long, value_name = "SENSOR")]
    pub(crate) sensor: Option<String>,
    /// Roles of the columns [default: guessed].
    ///
    /// ROLE=COLUMN,... where ROLE is time, pixels, thermistor, number, sensor, device, boot or label, and COLUMN a number from
    /// 1, a name or none: time=1,pixels=2-65. unit= is celsius, fahrenheit, kelvin, tenths, hundredths, words or
    /// words-sign-magnitude; zone=+01:00 is that of times without one; sheet=2 the second of a workbook.
    #[arg(long, value_name = "COLUMNS")]
    pub(crate) columns: Option<String>,
    /// Frame rate of a file without times.
    ///
    /// In frames per second.
    #[arg(long, value_name = "HZ", default_value_t = 10.0, value_parser = positive)]
    pub(crate) rate: f64,
    /// Add a column `people`: how many each frame shows.
    ///
    /// As `grideye count` counts them; empty where it is not known.
    #[arg(long)]
    pub(crate) count: bool,
}

/// Fit the unknowns of a scene to a recording.
///
/// Unknowns are poses, temperatures, emissivities, people and the start time. Mark each in the scene, with bounds:
/// `[[uncertain]] key = "sensor.ceiling.elevation_deg", bounds = [80, 90]`; add `sd` if you know how certain the value is. The
/// search starts from the scene's values.
///
/// Exit code 3: the recording determines none of them
///
/// Example: grideye calibrate --scene scenes/calibration.toml --recording walk.csv
#[derive(Debug, Args)]
pub(crate) struct Calibrate {
    #[command(flatten)]
    pub(crate) sides: Sides,
    /// Scene to write, with the fitted values.
    ///
    /// A copy of the scene with each value found and its uncertainty in a comment.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) out: Option<PathBuf>,
    /// Sensor profile, from `grideye characterize`.
    ///
    /// Its pattern is subtracted from the frames, and its common mode is assumed.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) profile: Option<PathBuf>,
    /// Profile to write: noise and residual pattern.
    ///
    /// The pattern is what the fitted scene does not explain.
    #[arg(long, value_name = "FILE")]
    pub(crate) write_profile: Option<PathBuf>,
    /// Fit to the first or second half [default: all].
    ///
    /// `grideye compare` never judges a scene by the frames it was fitted to: fit to one half, and the same recording
    /// can be judged by the other.
    #[arg(long, value_parser = one_of(HALVES), hide_possible_values = true)]
    pub(crate) half: Option<Half>,
    /// Frames to use, 10 to 1000 [default: 200].
    ///
    /// Evenly spaced over the recording.
    #[arg(long, value_name = "N")]
    pub(crate) frames: Option<usize>,
    /// Starting points, 1 to 100.
    ///
    /// The first is the scene as written, the others are random. If the first four all reach one end, there are no more.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u64).range(1..=100).map(|starts| usize::try_from(starts).unwrap_or(100)))]
    pub(crate) starts: usize,
    /// Seed of the random starting points.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
}

const HALVES: Choices<Half> = (
    &[Half::First, Half::Second],
    "first Leave the second half to be judged
second Leave the first half to be judged",
);

/// Measure a sensor's noise, pattern and drift in a still room.
///
/// Reads a recording and prints noise, common mode, pattern, drift, clock and glitches.
///
/// Exit code 3: recording too short, or unclear whether a person is in view
///
/// Example: grideye characterize empty-room.csv --profile my-sensor.toml
#[derive(Debug, Args)]
pub(crate) struct Characterize {
    /// Recording of any format.
    pub(crate) recording: PathBuf,
    /// Profile to write, for emulate and compare.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) profile: Option<PathBuf>,
    /// Empty time: yes/no/auto/FROM..TO [default: detect].
    ///
    /// `yes`: all of the recording. `auto`: stretches that the program finds. FROM..TO: this stretch, in seconds since the
    /// first frame. The profile then has the room's background, which `compare` and `calibrate` use;
    /// `compare` only if the recording does not contradict it.
    ///
    /// `no`: never. The profile then has only the unit's own pattern, which holds in any room.
    ///
    /// Default: `yes` if nothing moves and nothing warm is in view. If something moves, `auto` if ten seconds are empty and
    /// nothing stays warm in them, otherwise `no`. If something stays warm and nothing moves, no profile is written, unless
    /// `--scene` has it.
    #[arg(long, value_name = "WHEN", value_parser = nobody)]
    pub(crate) empty: Option<Nobody>,
    /// Scene of the empty room to subtract.
    ///
    /// The scene's simulated empty room is subtracted from the background. What is warm in it, such as a radiator, is no person.
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// Sensor of the scene [default: the only one].
    #[arg(long, value_name = "NAME", requires = "scene")]
    pub(crate) sensor: Option<String>,
    /// Report to write, one page for any browser.
    ///
    /// Has a table and maps.
    #[arg(long, value_name = "FILE.html")]
    pub(crate) report: Option<PathBuf>,
    /// Results as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Nobody {
    /// `yes`: in no frame is a person.
    Throughout,
    /// `no`: a person may be in any frame.
    Nowhere,
    /// `auto` or FROM..TO: no person in these stretches.
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

/// Account for every frame: read = stored + dropped + spooled.
///
/// Asks a running collector.
///
/// Exit code 0: balanced, nothing lost; 3: frames were lost
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

/// Move a store from an SQLite file to a PostgreSQL database.
///
/// The database must exist and hold no frames. After the copy, each frame is compared with the file. If interrupted, run the
/// same command again to continue; until it finishes, no collector accepts the database. The file does not change.
///
/// Exit code 1: database and file differ
///
/// Example: grideye migrate frames.sqlite postgres://grideye@db.local/frames
#[derive(Debug, Args)]
pub(crate) struct Migrate {
    /// SQLite file that no collector is using.
    pub(crate) file: PathBuf,
    /// `postgres://USER[:PASSWORD]@HOST[:PORT]/DATABASE`.
    ///
    /// The file that PGPASSFILE names may hold the password.
    pub(crate) url: String,
    /// Print the counts as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Copy a store to a new file, even while a collector writes to it.
///
/// OUT gets its name after the copy passes a check: every frame, the counts, the recordings. `grideye restore` puts it
/// back. A killed backup leaves OUT.partial, which the next one overwrites.
///
/// Do not copy a running collector's file with `cp`: the newest frames are in its log (FILE-wal), and a copy made during a
/// write is torn.
///
/// Example: grideye backup --store frames.sqlite monday.sqlite
#[derive(Debug, Args)]
pub(crate) struct Backup {
    /// Store to copy (SQLite file).
    #[arg(long, value_name = "FILE")]
    pub(crate) store: String,
    /// File to write; must not exist.
    pub(crate) out: PathBuf,
    /// Print the counts as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Put a backup in the place of a store.
///
/// Stop the collector first; while one uses the store, this is refused. The backup is copied and checked as `grideye backup`
/// does. The store that was there is kept as FILE.replaced-1, with its log.
///
/// Do not copy a backup over a store with `cp`: the log beside it (FILE-wal) belongs to the file that is overwritten.
///
/// Example: grideye restore monday.sqlite --store frames.sqlite
#[derive(Debug, Args)]
pub(crate) struct Restore {
    /// Backup to restore.
    pub(crate) backup: PathBuf,
    /// Store to replace (SQLite file).
    #[arg(long, value_name = "FILE")]
    pub(crate) store: String,
    /// Print the counts as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Print shell completions for either program.
///
/// Debian packages install them. Otherwise: `grideye completions bash > ~/.local/share/bash-completion/completions/grideye`.
///
/// Example: grideye completions bash
#[derive(Debug, Args)]
pub(crate) struct Completions {
    /// Shell.
    #[arg(value_enum)]
    pub(crate) shell: clap_complete::Shell,
    /// Program: grideye or grideye-agent.
    #[arg(long, value_parser = one_of(PROGRAMS), default_value = "grideye", hide_possible_values = true)]
    pub(crate) program: fn() -> clap::Command,
}

const PROGRAMS: Choices<fn() -> clap::Command> = (
    &[command, grideye_agent::cli::command],
    "grideye The command line on the PC
grideye-agent The program on the Raspberry Pi",
);

/// Write the man pages of both programs.
///
/// Debian packages install them. Otherwise: `grideye man ~/.local/share/man/man1`.
///
/// Example: grideye man man1
#[derive(Debug, Args)]
pub(crate) struct Man {
    /// Folder for the pages; created if missing.
    pub(crate) folder: PathBuf,
}

fn scene_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse::<f64>().ok();
    let seconds = seconds.filter(|seconds| Duration::try_from_secs_f64(seconds.abs()).is_ok());
    seconds.ok_or_else(|| "expected seconds, like 12.5 or -0.4".to_owned())
}
