//! Stretches of a recording, and how well a profile explains the empty room in them.

use crate::frames::sensor_step_c;
use crate::numbers::{common_offset, count};
use grideye_draw::text::fixed;
use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// Residuals of the empty stretches: RMS over the pixels, common level removed, °C.
#[derive(Debug, Clone, PartialEq)]
pub struct BackgroundFit {
    /// Against the scene without its people plus the profile's pattern.
    pub profile_c: f64,
    /// Each half of the frames against the mean of the other half.
    pub own_c: f64,
    /// The stretches, since the recording's first frame.
    pub stretches: Vec<Stretch>,
}

impl BackgroundFit {
    pub(crate) fn new(
        [first, second]: [&[f64]; 2],
        expected: &[f64],
        stretches: Vec<Stretch>,
    ) -> Self {
        Self {
            profile_c: left_c([(first, expected), (second, expected)]),
            own_c: left_c([(first, second), (second, first)]),
            stretches,
        }
    }

    /// Whether the profile leaves more than the recording's own stretches do, beyond rounding to the sensor's step.
    #[must_use]
    pub fn is_worse(&self) -> bool {
        self.profile_c.powi(2) > self.own_c.powi(2) + sensor_step_c().powi(2) / 12.0
    }

    /// For a profile with a background; `is_replaced` by that of the stretches.
    pub(crate) fn warning(&self, is_replaced: bool) -> Option<String> {
        let stretches: Vec<String> = self.stretches.iter().map(ToString::to_string).collect();
        let used = if is_replaced {
            "so the stretches' was used"
        } else {
            "but something warm stays in them, so the profile's was used"
        };
        self.is_worse().then(|| format!(
            "the profile leaves {} °C rms of the background unexplained, the recording's own empty stretches ({}) leave {} °C, {used}\nhint: measure the profile again in this room and mounting: `grideye characterize EMPTY.csv --profile FILE`",
            fixed(self.profile_c, 2),
            stretches.join(", "),
            fixed(self.own_c, 2)
        ))
    }
}

fn left_c(pairs: [(&[f64], &[f64]); 2]) -> f64 {
    let (mut squares, mut pixels) = (0.0, 0);
    for (image, expected) in pairs {
        let level_c = common_offset(image, expected);
        for (celsius, expected) in image.iter().zip(expected) {
            squares += (celsius - expected - level_c).powi(2);
            pixels += 1;
        }
    }
    (squares / count(pixels)).sqrt()
}

/// A part of a recording, since its first frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Stretch {
    pub from: Duration,
    pub to: Duration,
}

impl Stretch {
    /// Whether the stretch includes this time.
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

    /// Parses `12s..40s`; the units may be left out.
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

/// Where the room is empty.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Empty {
    /// Unknown: search for it.
    Find,
    /// In this stretch.
    Named(Stretch),
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: one of eight pixels is 0.4 °C off the profile and 0.2 °C off the other half; levels do not count.
    #[test]
    fn the_residual_is_a_root_mean_square() {
        let first = [20.4, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0];
        let second = [21.4, 21.2, 21.0, 21.0, 21.0, 21.0, 21.0, 21.0];
        let fit = BackgroundFit::new([&first, &second], &[17.0; 8], Vec::new());
        // Squares of 0.16 twice and 0.04 once, over 16 values.
        assert!((fit.profile_c - 0.15).abs() < 1e-9, "{fit:?}");
        // Squares of 0.04 twice, over 16 values.
        assert!((fit.own_c - 0.005_f64.sqrt()).abs() < 1e-9, "{fit:?}");
    }
}
