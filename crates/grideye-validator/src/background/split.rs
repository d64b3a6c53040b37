//! Splits what an empty room shows into the unit's pattern and the room's background.

use crate::characterize::segment::smooth;
use crate::constants::PATTERN_BLOCK_MAX;
use crate::frames::types::{Pixels, two_by_two};
use crate::thresholds::Thresholds;
use grideye_frame::{COLUMNS, PIXELS};
use grideye_scene::profile::{FixedPattern, Profile};

/// One over the resolution of a profile's values.
const PROFILE_STEP: f64 = 1e4;
/// Fits of the surface, each without the objects that the one before found.
const ROUNDS: usize = 8;

/// Writes what the empty room shows beyond its scene (°C) into a profile, to 0.0001 °C.
///
/// The smooth part and objects, which are 2 x 2 pixels beyond what units do, become the background. The rest becomes
/// the unit's pattern. The sum is what was shown.
pub fn put_shown_into(profile: &mut Profile, shown_c: &[f64; PIXELS]) {
    let rounded = |celsius: f64| (celsius * PROFILE_STEP).round() / PROFILE_STEP + 0.0;
    let offset_c = pattern(shown_c).map(rounded);
    let background_c = |pixel: usize| rounded(shown_c[pixel] - offset_c[pixel]);
    profile.fixed_pattern = FixedPattern {
        offset_c,
        spread_c: 0.0,
    };
    profile.background_c = Some(std::array::from_fn(background_c));
}

fn pattern(shown_c: &Pixels) -> Pixels {
    let mut surface_c = smooth(shown_c);
    let mut is_object = [false; PIXELS];
    for _ in 0..ROUNDS {
        is_object = objects(&std::array::from_fn(|pixel| {
            shown_c[pixel] - surface_c[pixel]
        }));
        surface_c = smooth(&std::array::from_fn(|pixel| {
            if is_object[pixel] {
                surface_c[pixel]
            } else {
                shown_c[pixel]
            }
        }));
    }
    std::array::from_fn(|pixel| {
        if is_object[pixel] {
            0.0
        } else {
            shown_c[pixel] - surface_c[pixel]
        }
    })
}

/// The pixels of all 2 x 2 that are warmer or colder than a unit's pattern makes them.
fn objects(left_c: &Pixels) -> [bool; PIXELS] {
    let limit_c = PATTERN_BLOCK_MAX * Thresholds::default().pattern_spread_c;
    let mut is_object = [false; PIXELS];
    for (place, square) in two_by_two(left_c).into_iter().enumerate() {
        let corner = place / (COLUMNS - 1) * COLUMNS + place % (COLUMNS - 1);
        if square.abs() > limit_c {
            for pixel in [corner, corner + 1, corner + COLUMNS, corner + COLUMNS + 1] {
                is_object[pixel] = true;
            }
        }
    }
    is_object
}
