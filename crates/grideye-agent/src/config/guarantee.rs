//! What a loss of power can cost with a configuration.

use super::types::{Config, SpoolMode};
use crate::limits::{LOOK_EVERY, SYNC_MAX};
use std::fmt;

/// What a loss of power, or of the process, can cost on a disk that takes at most [`SYNC_MAX`] to sync. A slower one costs
/// what was read while it was at it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guarantee {
    /// Frames of all sensors together that may be lost at most.
    pub frames: u64,
    /// The time in which they were read, and not acknowledged, before the loss.
    pub seconds: f64,
    /// Whether it is the disk that keeps them.
    pub needs_disk: bool,
}

/// The fastest clock of a sensor against its nominal rate.
const FASTEST_CLOCK: f64 = 1.06;

impl fmt::Display for Guarantee {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "a loss of power or a killed agent costs at most the {} frames that were read in the last {:.2} s and are not acknowledged",
            self.frames, self.seconds
        )?;
        if self.needs_disk {
            write!(
                formatter,
                ", while the disk syncs within {:.3} s",
                SYNC_MAX.as_secs_f64()
            )?;
        }
        Ok(())
    }
}

impl Config {
    /// What a loss of power can cost while the disk works, and syncs within [`SYNC_MAX`]. Without it, and in mode `ram`, it is the whole ring.
    #[must_use]
    pub fn guarantee(&self) -> Guarantee {
        let rate_hz = f64::from(self.rate_hz()) * FASTEST_CLOCK;
        let ring_frames = u32::try_from(self.ring_frames).unwrap_or(u32::MAX);
        let seconds = match self.spool.mode {
            SpoolMode::Ram => f64::from(ring_frames) / rate_hz.max(1.0),
            SpoolMode::Outage { after } => (after + LOOK_EVERY + SYNC_MAX).as_secs_f64(),
            SpoolMode::Always { sync_every } => (sync_every + LOOK_EVERY + SYNC_MAX).as_secs_f64(),
        };
        let frames = (seconds * rate_hz).ceil().min(f64::from(ring_frames));
        Guarantee {
            #[expect(
                clippy::as_conversions,
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "whole, positive, and at most the size of the ring"
            )]
            frames: frames as u64,
            seconds,
            needs_disk: self.spool.mode != SpoolMode::Ram,
        }
    }
}
