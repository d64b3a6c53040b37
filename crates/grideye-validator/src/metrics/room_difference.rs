//! Finds what is warm in an empty room where the scene has nothing.
//!
//! It examines blocks of 2 x 2 pixels, less the slope of the room. A pixel may exceed the scene by the most that the scene
//! has there or one pixel away.

use crate::constants::{PATTERN_BLOCK_MAX, PLANE_KEPT, UNCLAIMED_MIN_C};
use crate::frames::types::{around, two_by_two};
use crate::metrics::surface::{PLANE, surface};
use crate::numbers::{common_offset, differences, median};
use grideye_frame::COLUMNS;

/// A place of 2 x 2 pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// How far their mean changes, or exceeds the room, °C.
    pub celsius: f64,
    /// Upper row, from 0.
    pub row: usize,
    /// Left column, from 0.
    pub column: usize,
}

pub(crate) struct RoomDifference {
    /// Learned less simulated room, row by row, common level removed, °C.
    pub(crate) left_c: Vec<f64>,
    /// Where the simulated room claims nothing warm.
    pub(crate) cold: Vec<bool>,
    /// The warmest place above the slope of the room, less what the simulated room has there or beside it.
    warmest: Option<Spot>,
}

impl RoomDifference {
    pub(crate) fn new(learned: &[f64], simulated: &[f64], ambient_c: f64) -> Self {
        let allowed_c = claimed_nearby(simulated, ambient_c);
        // Half of what makes a learned room warm: a claim needs no protection from noise.
        let is_cold = |&nearby_c: &f64| nearby_c <= UNCLAIMED_MIN_C / 2.0;
        let cold: Vec<bool> = allowed_c.iter().map(is_cold).collect();
        let level_c = common_offset(learned, simulated);
        let left_c: Vec<f64> = differences(simulated, learned)
            .map(|left_c| left_c - level_c)
            .collect();
        let flat = without_slope(&left_c, &cold);
        let above = two_by_two(&std::array::from_fn(|pixel| flat[pixel] - allowed_c[pixel]));
        let spots = above.into_iter().enumerate().map(|(place, celsius)| Spot {
            celsius,
            row: place / (COLUMNS - 1),
            column: place % (COLUMNS - 1),
        });
        Self {
            warmest: spots.max_by(|a, b| a.celsius.total_cmp(&b.celsius)),
            cold,
            left_c,
        }
    }

    /// The warmest place, if it is warmer than a unit's pattern makes one.
    pub(crate) fn beyond_pattern(&self, spread_c: f64) -> Option<Spot> {
        self.warmest
            .filter(|spot| spot.celsius > PATTERN_BLOCK_MAX * spread_c)
    }
}

/// Rounds of fitting the plane.
const PLANE_ROUNDS: usize = 4;
/// Rounding error of a pixel on the plane, °C.
const ROUNDING_C: f64 = 1e-9;

/// The image less the plane that fits the cold pixels best, fitted without pixels that stand out (a person is no slope).
fn without_slope(image: &[f64], cold: &[bool]) -> Vec<f64> {
    let mut used: Vec<usize> = (0..image.len()).filter(|&pixel| cold[pixel]).collect();
    let mut left = image.to_vec();
    for _ in 0..PLANE_ROUNDS {
        let plane = surface(image, &used, PLANE);
        left = differences(&plane, image).collect();
        let sizes: Vec<f64> = used.iter().map(|&pixel| left[pixel].abs()).collect();
        let usual_c = median(&sizes).unwrap_or(0.0);
        used.retain(|&pixel| left[pixel].abs() <= PLANE_KEPT * usual_c + ROUNDING_C);
    }
    left
}

/// For each pixel the most that is claimed above ambient there or in a touching pixel, at least 0.
fn claimed_nearby(claim: &[f64], ambient_c: f64) -> Vec<f64> {
    let above = |pixel: usize| claim[pixel] - ambient_c;
    let nearby = |pixel: usize| around(pixel).map(above).fold(0.0, f64::max);
    (0..claim.len()).map(nearby).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::{assert_near, count};

    /// A frame at 20 °C with some pixels at other temperatures.
    fn frame(pixels: &[(usize, f64)]) -> Vec<f64> {
        let mut frame = vec![20.0; 64];
        for &(pixel, celsius) in pixels {
            frame[pixel] = celsius;
        }
        frame
    }

    fn warmest(real: &[f64], scene: &[f64]) -> Spot {
        RoomDifference::new(real, scene, 20.0).warmest.unwrap()
    }

    /// Four pixels 3, 1, 2 and 2 °C above the claim: 2 °C on average.
    const FOUR: [(usize, f64); 4] = [(26, 23.0), (27, 21.0), (34, 22.0), (35, 22.0)];

    #[test]
    fn warmth_is_found_with_its_place() {
        let found = warmest(&frame(&FOUR), &[20.0; 64]);
        assert_eq!((found.row, found.column), (3, 2));
        assert_near(found.celsius, 2.0, 1e-9);
    }

    #[test]
    fn a_slope_and_a_level_are_not_a_person() {
        let sloped: Vec<f64> = (0..64)
            .map(|pixel| 23.0 + 0.1 * count(pixel / 8) + 0.2 * count(pixel % 8))
            .collect();
        assert_near(warmest(&sloped, &[20.0; 64]).celsius, 0.0, 1e-9);
    }

    #[test]
    fn pixels_next_to_warm_ones_of_the_scene_may_be_as_warm() {
        let near = warmest(&frame(&FOUR), &frame(&[(27, 23.0)]));
        assert!(near.celsius < 0.3, "{near:?}");
        assert_near(warmest(&[25.0; 64], &[25.0; 64]).celsius, -5.0, 1e-9);
    }

    /// A radiator warmer than in the scene is ignored; an object that the scene lacks is found.
    #[test]
    fn a_learned_room_is_compared_with_the_simulated_one() {
        let simulated = frame(&[(0, 25.0)]);
        let mut learned = frame(&[(0, 27.0), (60, 20.3)]);
        learned.iter_mut().for_each(|pixel| *pixel += 1.5);
        let map = RoomDifference::new(&learned, &simulated, 20.0);
        assert!((map.left_c[60] - 0.3).abs() < 1e-9 && map.left_c[30].abs() < 1e-9);
        assert!(!map.cold[0] && !map.cold[9] && map.cold[60]);
        assert!(map.warmest.unwrap().celsius < 0.1);
        let stove = frame(&[(0, 25.0), (26, 23.0), (27, 21.0), (34, 22.0), (35, 22.0)]);
        let map = RoomDifference::new(&stove, &simulated, 20.0);
        assert!(map.warmest.unwrap().celsius > 1.5);
    }
}
