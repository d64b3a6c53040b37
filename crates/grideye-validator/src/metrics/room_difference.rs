//! Finds what is warm in an empty room where the scene has nothing.
//!
//! It examines blocks of 2 x 2 pixels, less the slope of the room. A pixel may exceed the scene by the most that the scene
//! has there or one pixel away.

use crate::frames::types::two_by_two;
use crate::metrics::surface::{PLANE, surface};
use crate::numbers::{common_offset, differences, median};
use grideye_frame::{COLUMNS, ROWS};

/// Warmth below this is none, °C: just above the sensor's step (AMG88 specification, 0.25 °C), which rounding can hide.
/// Chosen on the paper's experiment 2, where the person makes 2 x 2 pixels in a corner of the view 0.45 °C warmer.
pub(crate) const UNCLAIMED_MIN_C: f64 = 0.3;

#[derive(Debug, Clone, Copy)]
pub(crate) struct WarmLimits {
    ambient_c: f64,
    /// Limit above ambient for a noise-free claim: half a real frame's, as it needs no protection from noise.
    claimed_above_c: f64,
}

impl WarmLimits {
    pub(crate) fn new(ambient_c: f64, real_above_c: f64) -> Self {
        Self {
            ambient_c,
            claimed_above_c: real_above_c / 2.0,
        }
    }
}

struct AllowedWarmth {
    /// Pixels where neither they nor those that touch them are warm in the scene.
    cold: Vec<bool>,
    /// Allowed beyond the scene, °C.
    allowed_c: Vec<f64>,
}

pub(crate) struct RoomDifference {
    /// Learned less simulated room, row by row, common level removed, °C.
    pub(crate) left_c: Vec<f64>,
    /// Where the simulated room claims nothing warm.
    pub(crate) cold: Vec<bool>,
    /// The warmest 2 x 2 block, above the slope of the room.
    warmest: Option<WarmBlock>,
}

impl RoomDifference {
    pub(crate) fn new(learned: &[f64], simulated: &[f64], warmth: WarmLimits) -> Self {
        let places = AllowedWarmth::new(simulated, warmth);
        let level_c = common_offset(learned, simulated);
        let pixels = learned.iter().zip(simulated);
        let left_c: Vec<f64> = pixels.map(|(a, b)| a - b - level_c).collect();
        let warmest = places.warmest(&places.without_slope(&left_c));
        Self {
            warmest,
            cold: places.cold,
            left_c,
        }
    }

    /// The warmest block, if it is warmer than a unit's pattern makes one.
    pub(crate) fn beyond_pattern(&self, spread_c: f64) -> Option<WarmBlock> {
        self.warmest
            .filter(|block| block.celsius > PATTERN_BLOCK_MAX * spread_c)
    }
}

/// The warmest of 49 blocks exceeds this many standard deviations of a pixel in less than one pattern of 1,000
/// (Gumbel).
pub(crate) const PATTERN_BLOCK_MAX: f64 = 2.2;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WarmBlock {
    /// Mean of the four pixels beyond what is allowed, °C.
    pub(crate) celsius: f64,
    /// Row and column of its upper left pixel, from 0.
    pub(crate) row: usize,
    pub(crate) column: usize,
}

impl AllowedWarmth {
    fn new(simulated: &[f64], warmth: WarmLimits) -> Self {
        let allowed_c = claimed_nearby(simulated, warmth.ambient_c);
        Self {
            cold: allowed_c
                .iter()
                .map(|&nearby_c| nearby_c <= warmth.claimed_above_c)
                .collect(),
            allowed_c,
        }
    }

    fn warmest(&self, left: &[f64]) -> Option<WarmBlock> {
        let above = |pixel: usize| left[pixel] - self.allowed_c[pixel];
        let blocks = two_by_two(&std::array::from_fn(above)).into_iter();
        let blocks = blocks.enumerate().map(|(place, celsius)| WarmBlock {
            celsius,
            row: place / (COLUMNS - 1),
            column: place % (COLUMNS - 1),
        });
        blocks.max_by(|a, b| a.celsius.total_cmp(&b.celsius))
    }

    /// The image less the plane that fits the cold pixels best, fitted without pixels that stand out (a person is no
    /// slope).
    fn without_slope(&self, image: &[f64]) -> Vec<f64> {
        let mut used: Vec<usize> = (0..image.len()).filter(|&pixel| self.cold[pixel]).collect();
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
}

/// Rounds of fitting the plane, and the multiple of the median distance from it that excludes a pixel.
const PLANE_ROUNDS: usize = 4;
const PLANE_KEPT: f64 = 4.0;
/// Rounding error of a pixel on the plane, °C.
const ROUNDING_C: f64 = 1e-9;

/// For each pixel the most that is claimed above ambient there or in a touching pixel, at least 0.
fn claimed_nearby(claim: &[f64], ambient_c: f64) -> Vec<f64> {
    let nearby = |pixel: usize| {
        let (row, column) = (pixel / COLUMNS, pixel % COLUMNS);
        let mut most: f64 = 0.0;
        for row in row.saturating_sub(1)..(row + 2).min(ROWS) {
            for column in column.saturating_sub(1)..(column + 2).min(COLUMNS) {
                most = most.max(claim[row * COLUMNS + column] - ambient_c);
            }
        }
        most
    };
    (0..claim.len()).map(nearby).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::{assert_near, count};

    fn warmth() -> WarmLimits {
        WarmLimits::new(20.0, 1.0)
    }

    /// A frame at 20 °C with some pixels at other temperatures.
    fn frame(pixels: &[(usize, f64)]) -> Vec<f64> {
        let mut frame = vec![20.0; 64];
        for &(pixel, celsius) in pixels {
            frame[pixel] = celsius;
        }
        frame
    }

    fn warmest(real: &[f64], scene: &[f64]) -> WarmBlock {
        RoomDifference::new(real, scene, warmth()).warmest.unwrap()
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
        let map = RoomDifference::new(&learned, &simulated, warmth());
        assert!((map.left_c[60] - 0.3).abs() < 1e-9 && map.left_c[30].abs() < 1e-9);
        assert!(!map.cold[0] && !map.cold[9] && map.cold[60]);
        assert!(map.warmest.unwrap().celsius < 0.1);
        let stove = frame(&[(0, 25.0), (26, 23.0), (27, 21.0), (34, 22.0), (35, 22.0)]);
        let map = RoomDifference::new(&stove, &simulated, warmth());
        assert!(map.warmest.unwrap().celsius > 1.5);
    }
}
