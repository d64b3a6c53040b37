//! Which process makes which parts of a dataset, and the kinds of part files.

use std::str::FromStr;

/// Share `number` of `of`, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Which share, from 1.
    pub number: u64,
    /// The number of shares.
    pub of: u64,
}

impl Shard {
    /// Whether the shard makes this part (from 0).
    #[must_use]
    pub const fn has(self, part: u64) -> bool {
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
                "there is no shard {number} of {of}\nhint: shards count from 1 to {of}; for four processes use 1/4, 2/4, 3/4 and 4/4"
            )),
            None => Err(format!(
                "not a shard: {text}\nhint: write I/N, as in 1/4, 2/4, 3/4 and 4/4 on four machines"
            )),
        }
    }
}

/// A file format for a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Table {
    /// Apache Parquet: one row per frame.
    Parquet,
    /// numpy arrays.
    Npz,
    /// One numpy array of records, for mapping into memory.
    Npy,
}

impl Table {
    /// The format's name, also its file extension.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Parquet => "parquet",
            Self::Npz => "npz",
            Self::Npy => "npy",
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
    fn malformed_shards_are_refused() {
        for (text, words) in [
            ("0/4", "no shard 0 of 4"),
            ("5/4", "count from 1 to 4"),
            ("1/0", "no shard 1 of 0"),
            ("2", "not a shard: 2"),
            ("a/b", "I/N"),
            ("-1/4", "I/N"),
            ("1/4/2", "I/N"),
        ] {
            let error = text.parse::<Shard>().unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
