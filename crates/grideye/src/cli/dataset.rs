//! The options of `grideye dataset`.

use super::shared::{Choices, Method, one_of};
use clap::Args;
use grideye_dataset::{Shard, Table};
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Make labeled frames of a scene that varies, for training.
///
/// The scene differs from frame to frame. Run it again after an interruption, with the same options: it goes on where it was.
///
/// Example: grideye dataset scenes/experiment-1.toml --frames 200 --vary agent.person.position=floor --vary room.ambient_c=18..26 --out people
#[derive(Debug, Args)]
pub(crate) struct Dataset {
    /// Scene file.
    pub(crate) scene: PathBuf,
    /// What varies: KEY=LOW..HIGH; repeatable.
    ///
    /// KEY=LOW..HIGH, KEY=ONE,OTHER, or agent.NAME.position=floor.
    #[arg(long = "vary", value_name = "KEY=VALUES")]
    pub(crate) varied: Vec<String>,
    /// Number of frames of the whole dataset.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) frames: u64,
    /// Folder for the dataset; made if it is not there.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Seed of all that varies, and of the noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Every n-th part, from the i-th.
    ///
    /// The share of the work to be done here.
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    pub(crate) shard: Shard,
    /// Sensor of the scene; needed when it has several.
    #[arg(long, value_name = "NAME")]
    pub(crate) sensor: Option<String>,
    /// The paper's grid of points, or exact areas.
    #[arg(long, value_enum, default_value_t = Method::Grid)]
    pub(crate) method: Method,
    /// Kinds of files, with commas between them.
    #[arg(long = "format", value_parser = one_of(TABLES), value_delimiter = ',', value_name = "KINDS", default_values = ["parquet", "npz"])]
    pub(crate) formats: Vec<Table>,
    /// Frames of a file [default: 1000].
    ///
    /// By default 1000, or what 64 MiB hold.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub(crate) frames_per_part: Option<u64>,
    /// Parts made at a time [default: cores].
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// The kinds of files that hold a part of a dataset.
const TABLES: Choices<Table> = (
    &[Table::Parquet, Table::Npz],
    "parquet Apache Parquet: a row for each frame
npz Arrays for numpy",
);
