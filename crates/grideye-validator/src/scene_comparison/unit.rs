//! What a profile tells of a sensor's specimen.

use crate::thresholds::Thresholds;
use grideye_frame::PIXELS;
use grideye_scene::profile::Profile;

/// What is known of a sensor's specimen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownUnit {
    /// What each pixel shows too much, °C.
    pub pattern_c: [f64; PIXELS],
    /// Standard deviation of what all pixels do together from one recording to another, °C.
    pub wander_c: f64,
    /// What of the level is no chance and still not known: error at power-on, the depth of the five-frame cycle, °C.
    pub bias_c: f64,
    /// Standard deviation of what is not known of the pattern, °C.
    pub spread_c: f64,
}

impl KnownUnit {
    /// What a profile says.
    #[must_use]
    pub fn of(profile: &Profile) -> Self {
        let common = profile.common_mode;
        // The mean of the 64 draws of a specimen that is not drawn yet.
        let drawn_c = profile.fixed_pattern.spread_c / 8.0;
        Self {
            pattern_c: profile.fixed_pattern.offset_c,
            wander_c: common.sd_c.hypot(drawn_c),
            bias_c: common.cycle_depth_c + profile.warm_up.start_c.abs(),
            spread_c: profile.fixed_pattern.spread_c,
        }
    }

    /// The largest common offset that is no fault, °C.
    pub(crate) fn level_c(&self, thresholds: &Thresholds) -> f64 {
        thresholds.level_margin_c + 3.0 * self.wander_c + self.bias_c
    }
}
