//! Who makes which parts of a dataset, and in which kinds of files.

use std::str::FromStr;

/// The i-th of n shares, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Which share.
    pub number: u64,
    /// Of how many.
    pub of: u64,
}

impl Shard {
    /// Whether the part of that number, from 0, belongs to the shard.
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
                "there is no shard {number} of {of}\nhint: shards count from 1 to {of}; 1/4, 2/4, 3/4 and 4/4 are the whole"
            )),
            None => Err(format!(
                "no shard: {text}\nhint: I/N, as in 1/4, 2/4, 3/4 and 4/4 on four machines"
            )),
        }
    }
}

/// A kind of file that holds a part of a dataset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Table {
    /// Apache Parquet: a row for each frame.
    Parquet,
    /// Arrays for numpy.
    Npz,
}

impl Table {
    /// The end of the names of such files, and the word for the kind.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Parquet => "parquet",
            Self::Npz => "npz",
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
