//! Which bins entropies are counted in.

use serde::{Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// How temperatures are sorted into the bins that entropy counts. Written `grey256`, `step:WIDTH` and `levels:N`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Binning {
    /// 256 gray levels over the frame's own range, as an 8-bit picture has; fits the paper's published entropies.
    PaperGrey256,
    /// The nearest multiple of a width in degrees; the sensor's own step is the width that says most.
    Step {
        /// Width of a bin in degrees, above zero.
        width_c: f64,
    },
    /// `n` levels over the frame's own range, the lowest and the highest level at its ends.
    Levels {
        /// Number of levels; with 0 or 1 every pixel falls into the same bin.
        n: u16,
    },
}

/// A text that names no binning.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no binning\nhint: grey256, step:WIDTH with a width in °C above zero, for example step:0.5, or levels:N with N from 2 to 65535"
)]
pub struct BinningError(String);

impl Binning {
    /// In words: `256 grey levels over each frame's own range`, `steps of 0.25 °C`.
    #[must_use]
    pub fn in_words(&self) -> String {
        match self {
            Self::PaperGrey256 => "256 grey levels over each frame's own range".to_owned(),
            Self::Step { width_c } => format!("steps of {width_c} °C"),
            Self::Levels { n } => format!("{n} levels over each frame's own range"),
        }
    }
}

impl fmt::Display for Binning {
    /// As [`FromStr`] reads it.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PaperGrey256 => formatter.pad("grey256"),
            Self::Step { width_c } => write!(formatter, "step:{width_c}"),
            Self::Levels { n } => write!(formatter, "levels:{n}"),
        }
    }
}

impl Serialize for Binning {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl FromStr for Binning {
    type Err = BinningError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parsed = match text.split_once(':') {
            None => (text == "grey256").then_some(Self::PaperGrey256),
            Some(("step", width)) => width
                .parse()
                .ok()
                .filter(|width: &f64| width.is_finite() && *width > 0.0)
                .map(|width_c| Self::Step { width_c }),
            Some(("levels", n)) => n
                .parse()
                .ok()
                .filter(|&n| n >= 2)
                .map(|n| Self::Levels { n }),
            Some(_) => None,
        };
        parsed.ok_or_else(|| BinningError(text.to_owned()))
    }
}
