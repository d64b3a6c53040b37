use super::Method;
use clap::Args;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;

/// Make labelled frames of a scene that varies, for training.
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
    #[arg(long = "format", value_enum, value_delimiter = ',', value_name = "KINDS", default_values_t = [Table::Parquet, Table::Npz])]
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

/// A kind of file that holds a part of a dataset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Table {
    /// Apache Parquet: a row for each frame.
    Parquet,
    /// Arrays for numpy.
    Npz,
}

impl Table {
    /// The end of the names of such files, and the word for the kind.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Parquet => "parquet",
            Self::Npz => "npz",
        }
    }
}

/// The i-th of n shares, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shard {
    pub(crate) number: u64,
    pub(crate) of: u64,
}

impl Shard {
    /// Whether the part of that number, from 0, belongs to the shard.
    pub(crate) const fn has(self, part: u64) -> bool {
        part % self.of == self.number - 1
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let whole = |text: &str| text.parse::<u64>().ok();
        let pair = text.split_once('/');
        let pair = pair.and_then(|(number, of)| whole(number).zip(whole(of)));
        match pair {
            Some((number, of)) if (1..=of).contains(&number) => Ok(Self { number, of }),
            Some((number, of)) => Err(format!(
                "there is no shard {number} of {of}\nhint: shards count from 1 to {of}; 1/4, 2/4, 3/4 and 4/4 are the whole"
            )),
            None => Err(format!(
                "no shard: {text}\nhint: I/N, as in 1/4, 2/4, 3/4 and 4/4 on four machines"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_belongs_to_exactly_one_shard() {
        for of in 1..=7 {
            let shards: Vec<Shard> = (1..=of)
                .map(|number| format!("{number}/{of}").parse().unwrap())
                .collect();
            for part in 0..50 {
                let owners = shards.iter().filter(|shard| shard.has(part)).count();
                assert_eq!(owners, 1, "part {part} of {of}");
            }
        }
    }

    #[test]
    fn what_is_no_shard_is_refused() {
        for (text, words) in [
            ("0/4", "no shard 0 of 4"),
            ("5/4", "count from 1 to 4"),
            ("1/0", "no shard 1 of 0"),
            ("2", "no shard: 2"),
            ("a/b", "I/N"),
            ("-1/4", "I/N"),
            ("1/4/2", "I/N"),
        ] {
            let error = text.parse::<Shard>().unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
