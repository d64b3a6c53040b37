//! A sensor's properties and mounting.

use crate::geometry::Pose;
use crate::profile::Profile;
use glam::{DVec2, USizeVec2};
use std::time::Duration;

/// How the directions of a sensor's pixels are defined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Optics {
    /// A pinhole: even steps on the image plane, each pixel as wide as its step.
    #[default]
    Pinhole,
    /// The 64 directions and widths of the AMG88 with the 60° lens, from its specification.
    Amg88,
}

/// A sensor's properties and mounting.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Sensor {
    /// Its name in the file.
    pub name: String,
    /// Pixels in a row.
    pub columns: usize,
    /// Pixels in a column.
    pub rows: usize,
    /// Full angle of view on each axis, radians, below π.
    pub field_of_view_rad: DVec2,
    /// Points of the paper's sampling grid on each axis: field of view times points per degree, at least 1.
    pub grid_points: USizeVec2,
    /// Standard deviation of the noise of one pixel in one frame, °C.
    pub noise_sigma: f64,
    /// Frames per second.
    pub sampling_hz: f64,
    /// Distance up to which the sensor is meant to work, meters; only the law's linear branch uses it.
    pub operating_distance_m: f64,
    /// The lowest and the highest temperature it reports, °C; `None` for no limit.
    pub detectable_range_c: Option<(f64, f64)>,
    /// Its position and orientation.
    pub pose: Pose,
    /// Pixel directions in the physical model.
    pub optics: Optics,
    /// Full width at half response of every pixel on each axis, radians; overrides the optics' in the physical model.
    pub pixel_width_rad: Option<DVec2>,
    /// Full width at half height of its point spread on each axis, radians, 0 for sharp; in the physical model.
    pub blur_rad: DVec2,
    /// The share of each pixel's response that its neighbors get, 0 to 1, and the standard deviation of how far, pixels:
    /// what lens and chip scatter beyond the response that the optics describe.
    pub spill: f64,
    /// See [`Self::spill`].
    pub spill_px: f64,
    /// The unit's profile, if any, which [`Simulator::noisy`](crate::Simulator::noisy) applies.
    pub profile: Option<Profile>,
    /// Noisy temperatures are multiples of this, °C; 0 for any.
    pub step_c: f64,
}

impl Sensor {
    /// The slopes at the edge of its view on each axis: the tangents of half its angles.
    #[must_use]
    pub fn view_slopes(&self) -> DVec2 {
        self.field_of_view_rad.map(|angle| libm::tan(0.5 * angle))
    }

    /// Limits a temperature to the detectable range.
    #[must_use]
    pub fn detected(&self, celsius: f64) -> f64 {
        self.detectable_range_c
            .map_or(celsius, |(low, high)| celsius.max(low).min(high))
    }

    /// The time of frame `index`, from 0: `index / sampling_hz`, to the nearest nanosecond.
    #[must_use]
    pub fn frame_time(&self, index: u32) -> Duration {
        Duration::try_from_secs_f64(f64::from(index) / self.sampling_hz).unwrap_or(Duration::MAX)
    }
}
