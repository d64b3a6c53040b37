//! The options of `grideye dataset`.

use super::shared::{Choices, one_of, within};
use clap::Args;
use grideye_dataset::{CountsFrom, Shard, Splits, Table};
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Make labeled frames of a scene that varies, for training.
///
/// The scene varies from frame to frame. If interrupted, run the same command again to continue.
///
/// Example: grideye dataset --preset counting --frames 10000 --out people
#[derive(Debug, Args)]
pub(crate) struct Dataset {
    /// Scene file (TOML).
    #[arg(required_unless_present = "preset")]
    pub(crate) scene: Option<PathBuf>,
    /// Built-in scene: counting or falls [default: none].
    ///
    /// counting: 0 to 3 people below a ceiling sensor. falls: people who walk, sit, lie and fall, for --clip.
    #[arg(long, value_parser = one_of(PRESETS), value_name = "NAME", conflicts_with = "scene", hide_possible_values = true)]
    pub(crate) preset: Option<Preset>,
    /// Print the built-in scene, to copy and change.
    #[arg(long, requires = "preset", hide_short_help = true, conflicts_with_all = ["frames", "out", "preview"])]
    pub(crate) print: bool,
    /// Sensor profile in place of the scene's.
    #[arg(long, value_name = "FILE.toml", hide_short_help = true)]
    pub(crate) profile: Option<PathBuf>,
    /// Recording of an own sensor, to be like it.
    ///
    /// Noise, pattern, background, level and frame rate are the recording's, of an empty room or with people in it. Give
    /// the sensor's height and the room with --vary, as in sensor.ceiling.position_mm.z=2500.
    #[arg(long, value_name = "RECORDING", conflicts_with = "profile")]
    pub(crate) like: Option<PathBuf>,
    /// Values to draw from: KEY=LOW..HIGH; repeatable.
    ///
    /// KEY=LOW..HIGH, KEY=MEAN+-SD, KEY=ONE,OTHER, agent.NAME.position=floor, or KEY alone for its `uncertain` table.
    /// Adds to the scene's `vary` tables, and replaces those of the same key. scenes/VARIES.md lists the keys.
    #[arg(long = "vary", value_name = "KEY=VALUES")]
    pub(crate) varied: Vec<String>,
    /// Frames in the whole dataset [default: none].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), required_unless_present = "print")]
    pub(crate) frames: Option<u64>,
    /// Consecutive frames per clip.
    ///
    /// 1 to 100000 frames of one situation at the sensor's rate. A clip is never in two files; --frames must be a
    /// multiple.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000), default_value_t = 1)]
    pub(crate) clip: u64,
    /// Folder for the dataset [default: only --preview].
    ///
    /// It is created if missing.
    #[arg(long, value_name = "DIR", required_unless_present_any = ["preview", "print"])]
    pub(crate) out: Option<PathBuf>,
    /// Picture of some frames by class, to look at first.
    ///
    /// Of each class, the first 12 frames in columns; of clips, the first 8 clips and those with what no other has, 12
    /// frames each. Nothing else is made without --out.
    #[arg(long, value_name = "FILE.png")]
    pub(crate) preview: Option<PathBuf>,
    /// Seed of the variation and the noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Share of the work: part I of N.
    ///
    /// Makes every N-th part, starting with the I-th.
    #[arg(
        long,
        value_name = "I/N",
        default_value = "1/1",
        hide_short_help = true
    )]
    pub(crate) shard: Shard,
    /// Sensor of the scene [default: the only one].
    #[arg(long, value_name = "NAME")]
    pub(crate) sensor: Option<String>,
    /// File formats, comma-separated.
    #[arg(long = "format", value_parser = one_of(TABLES), value_delimiter = ',', value_name = "FORMATS",
        default_values = ["parquet", "npz"], hide_short_help = true)]
    pub(crate) formats: Vec<Table>,
    /// Frames per file, 1 to 1000000 [default: 1000, fewer if they exceed 64 MiB].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000), hide_short_help = true)]
    pub(crate) frames_per_part: Option<u64>,
    /// Splits by name and share, as train=0.8,test=0.2 [default: all for training].
    ///
    /// Whole clips, so that no situation is in two splits. Files are named by their split.
    #[arg(long = "split", value_name = "SPLITS", hide_short_help = true)]
    pub(crate) splits: Option<Splits>,
    /// Pixels from which on somebody counts as in view.
    #[arg(long, value_name = "PIXELS", default_value_t = CountsFrom::default().pixels, value_parser = at_least_zero, hide_short_help = true)]
    pub(crate) count_pixels: f64,
    /// Contrast from which on somebody counts, °C.
    ///
    /// What the person changes in one pixel, without noise. Both limits must be reached.
    #[arg(long = "count-contrast", value_name = "C", default_value_t = CountsFrom::default().contrast_c, value_parser = at_least_zero, hide_short_help = true)]
    pub(crate) count_contrast_c: f64,
    /// Weights of 0, 1, 2 … people in view [default: as drawn].
    ///
    /// With 1,1,1,1 as many frames have 0 as 1, 2 and 3. A draw with another number is drawn again. For single frames.
    #[arg(long, value_name = "WEIGHTS", value_delimiter = ',', value_parser = at_least_zero, hide_short_help = true)]
    pub(crate) in_view: Vec<f64>,
    /// Threads [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// A scene that the program holds, with what varies in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Preset {
    Counting,
    Falls,
}

const PRESETS: Choices<Preset> = (
    &[Preset::Counting, Preset::Falls],
    "counting 0 to 3 people
falls walk, sit, lie and fall",
);

/// The file formats of a dataset.
const TABLES: Choices<Table> = (
    &[Table::Parquet, Table::Npz, Table::Npy],
    "parquet Apache Parquet, one row per frame
npz Arrays for numpy
npy One array of records, for mapping into memory",
);

fn at_least_zero(text: &str) -> Result<f64, String> {
    within(text, &(0.0..=f64::MAX), "expected a number from 0 on")
}
