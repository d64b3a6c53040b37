//! How a dataset is divided, as for training and testing.

use crate::error::DatasetError;
use grideye_scene::count::{float, floor};
use std::str::FromStr;

/// Splits by name, each with its share of the clips.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Splits(Vec<(String, f64)>);

impl Splits {
    /// The frames of each split, in their order: whole clips, so that no situation is in two of them.
    pub(crate) fn frames(
        &self,
        frames: u64,
        clip: u64,
    ) -> Result<Vec<(String, u64)>, DatasetError> {
        let clips = frames / clip;
        let whole: f64 = self.0.iter().map(|(_, share)| share).sum();
        let (mut share, mut before) = (0.0, 0);
        let mut found = Vec::new();
        for (name, own) in &self.0 {
            share += own;
            let among = float(usize::try_from(clips).unwrap_or(usize::MAX));
            let end = u64::try_from(floor(among * share / whole + 0.5)).unwrap_or(u64::MAX);
            let end = end.min(clips);
            if end == before {
                return Err(DatasetError::Refused(format!(
                    "the split `{name}` gets none of {clips} clips\nhint: ask for more frames, or give it a larger share"
                )));
            }
            found.push((name.clone(), (end - before) * clip));
            before = end;
        }
        Ok(found)
    }
}

impl FromStr for Splits {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut splits: Vec<(String, f64)> = Vec::new();
        for split in text.split(',') {
            let (name, share) = split.split_once('=').unwrap_or((split, ""));
            let is_name = |name: &str| {
                let mut letters = name.chars();
                letters
                    .next()
                    .is_some_and(|letter| letter.is_ascii_alphabetic())
                    && letters.all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
            };
            let share = share.parse::<f64>().ok();
            let share = share.filter(|share| *share > 0.0 && share.is_finite());
            let is_new = splits.iter().all(|(other, _)| other != name);
            match share.filter(|_| is_name(name) && is_new) {
                Some(share) => splits.push((name.to_owned(), share)),
                None => {
                    return Err(format!(
                        "`{split}` is not a split: NAME=SHARE, each name once, of letters, digits and _\nhint: for example train=0.8,test=0.2"
                    ));
                }
            }
        }
        Ok(Self(splits))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(text: &str, frames: u64, clip: u64) -> Vec<u64> {
        let splits: Splits = text.parse().unwrap();
        let found = splits.frames(frames, clip).unwrap();
        found.into_iter().map(|(_, frames)| frames).collect()
    }

    #[test]
    fn shares_are_whole_clips_and_nothing_is_left() {
        assert_eq!(frames("train=0.8,test=0.2", 100, 1), [80, 20]);
        assert_eq!(frames("train=8,test=2", 100, 1), [80, 20]);
        assert_eq!(frames("a=1,b=1,c=1", 250, 25), [75, 100, 75]);
    }

    #[test]
    fn a_split_without_a_clip_is_refused() {
        let splits: Splits = "train=0.9,test=0.1".parse().unwrap();
        let error = splits.frames(150, 50).unwrap_err().to_string();
        assert!(error.contains("`test` gets none of 3 clips"), "{error}");
    }

    #[test]
    fn malformed_splits_are_refused() {
        for text in [
            "",
            "train",
            "train=0",
            "train=-1",
            "train=nan",
            "=1",
            "a=1,a=2",
            "a b=1",
            "a=1,",
        ] {
            assert!(
                text.parse::<Splits>()
                    .unwrap_err()
                    .contains("is not a split"),
                "{text}"
            );
        }
    }
}
