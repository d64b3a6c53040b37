//! What `grideye compare` may align.

use super::shared::{Choices, one_of, within};
use anyhow::{Result, bail};
use clap::Args;
use grideye_validator::{AlignOptions, TimeAlignment};
use std::time::Duration;

/// What `grideye compare` may align.
#[derive(Debug, Args)]
pub(crate) struct Align {
    /// Alignment of time and image.
    ///
    /// Comma-separated. Time, one of: none; shift, a constant delay; rate, a delay and a fast or slow clock.
    ///
    /// Image: orientation, to correct a mirrored, rotated or transposed image; pose, to correct an offset of up to half a
    /// pixel. Without them, a deviation is reported, not corrected.
    #[arg(long = "align", value_name = "WHAT", value_parser = one_of(WHAT), value_delimiter = ',',
        default_value = "rate", hide_possible_values = true)]
    what: Vec<What>,
    /// Largest delay in either direction, 0 to 60 s.
    #[arg(long, value_name = "SECONDS", hide_short_help = true, default_value_t = 0.5, value_parser = seconds)]
    max_shift: f64,
    /// Largest error of the sensor's clock, 0 to 20 %.
    #[arg(long, value_name = "PERCENT", hide_short_help = true, default_value_t = 6.0, value_parser = percent)]
    max_rate: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum What {
    Time(TimeAlignment),
    Orientation,
    Pose,
}

const WHAT: Choices<What> = (
    &[
        What::Time(TimeAlignment::None),
        What::Time(TimeAlignment::Shift),
        What::Time(TimeAlignment::Rate),
        What::Orientation,
        What::Pose,
    ],
    "none No time alignment
shift A constant delay
rate A delay and a fast or slow clock
orientation Correct a mirrored, rotated or transposed image
pose Correct an image offset of up to half a pixel",
);

impl Align {
    /// The same for the validator; time is aligned by delay and rate if only the image is named.
    pub(crate) fn options(&self) -> Result<AlignOptions> {
        let time = |what: &What| match what {
            What::Time(time) => Some(*time),
            What::Orientation | What::Pose => None,
        };
        let times: Vec<TimeAlignment> = self.what.iter().filter_map(time).collect();
        if times.len() > 1 {
            bail!(
                "--align names {} ways to align time\nhint: name one of none, shift and rate",
                times.len()
            );
        }
        let defaults = AlignOptions::default();
        Ok(AlignOptions {
            time: times.first().copied().unwrap_or(defaults.time),
            orientation: self.what.contains(&What::Orientation),
            pose: self.what.contains(&What::Pose),
            shift_max: Duration::from_secs_f64(self.max_shift),
            rate_max: self.max_rate / 100.0,
        })
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    within(text, &(0.0..=60.0), "expected 0 to 60 seconds")
}

fn percent(text: &str) -> Result<f64, String> {
    within(text, &(0.0..=20.0), "expected 0 to 20 %")
}
