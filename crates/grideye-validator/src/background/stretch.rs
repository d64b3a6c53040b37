//! A stretch of a recording, and whether it is named or to be found.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// A part of a recording, in time since its first frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stretch {
    /// Its first moment.
    pub from: Duration,
    /// Its last.
    pub to: Duration,
}

impl Stretch {
    /// Whether a moment lies in it.
    #[must_use]
    pub fn holds(&self, time: Duration) -> bool {
        (self.from..=self.to).contains(&time)
    }
}

impl fmt::Display for Stretch {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "{:.1}s..{:.1}s",
            self.from.as_secs_f64(),
            self.to.as_secs_f64()
        )
    }
}

impl FromStr for Stretch {
    type Err = String;

    /// `12s..40s`, or without the units.
    fn from_str(text: &str) -> Result<Self, String> {
        let seconds = |text: &str| -> Option<Duration> {
            let number = text.trim().trim_end_matches('s').parse().ok()?;
            Duration::try_from_secs_f64(number).ok()
        };
        text.split_once("..")
            .and_then(|(from, to)| Some(Self { from: seconds(from)?, to: seconds(to)? }))
            .filter(|stretch| stretch.from < stretch.to)
            .ok_or_else(|| format!("expected FROM..TO in seconds since the first frame, such as 12s..40s, not {text}"))
    }
}

/// Where nobody is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Empty {
    /// To be found.
    Find,
    /// In this stretch.
    Named(Stretch),
}
