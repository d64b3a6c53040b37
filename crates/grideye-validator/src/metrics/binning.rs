//! The bins in which entropies are counted.

use serde::{Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// How temperatures are sorted into bins. Written `grey256`, `step:WIDTH` or `levels:N`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Binning {
    /// Multiples of a width, to the nearest.
    Step {
        /// Bin width, °C, above zero.
        width_c: f64,
    },
    /// `n` levels over the frame's own range, the lowest and highest at its ends.
    Levels {
        /// Number of levels; 0 or 1 puts every pixel into one bin.
        n: u16,
    },
}

/// A text that is not a binning.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is not a binning\nhint: use grey256, step:WIDTH (in °C, above zero, such as step:0.5) or levels:N (N from 2 to 65535)"
)]
pub struct BinningError(String);

impl Binning {
    /// 256 gray levels over the frame's own range, like an 8-bit image: the paper names no binning, this fits its entropies.
    pub const GREY_256: Self = Self::Levels { n: 256 };
}

impl fmt::Display for Binning {
    /// The form that [`FromStr`] reads.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Levels { n: 256 } => formatter.pad("grey256"),
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
            None => (text == "grey256").then_some(Self::GREY_256),
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
