//! Finds what is warm in an empty room where the scene has nothing.
//!
//! It examines blocks of 2 x 2 pixels, less the slope of the room. A pixel may exceed the scene by the most that the scene
//! has there or one pixel away.

use crate::metrics::gain::WarmLimits;
use crate::numbers::{common_offset, count, mean, median};

/// Warmth below this is none, °C: just above the sensor's step (AMG88 specification, 0.25 °C), which rounding can hide.
/// Chosen on the paper's experiment 2, where the person makes 2 x 2 pixels in a corner of the view 0.45 °C warmer.
pub(crate) const UNCLAIMED_MIN_C: f64 = 0.3;

struct AllowedWarmth {
    columns: usize,
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
    pub(crate) fn new(
        learned: &[f64],
        simulated: &[f64],
        columns: usize,
        warmth: WarmLimits,
    ) -> Self {
        let places = AllowedWarmth::new(simulated, columns, warmth);
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
    fn new(simulated: &[f64], columns: usize, warmth: WarmLimits) -> Self {
        let columns = columns.max(1);
        let allowed_c = claimed_nearby(simulated, columns, warmth.ambient_c);
        Self {
            columns,
            cold: allowed_c
                .iter()
                .map(|&nearby_c| nearby_c <= warmth.claimed_above_c)
                .collect(),
            allowed_c,
        }
    }

    fn warmest(&self, left: &[f64]) -> Option<WarmBlock> {
        let columns = self.columns;
        let corner =
            |&first: &usize| first % columns + 1 < columns && first + columns + 1 < left.len();
        (0..left.len())
            .filter(corner)
            .map(|first| WarmBlock {
                celsius: corners(first, columns)
                    .iter()
                    .map(|&pixel| left[pixel] - self.allowed_c[pixel])
                    .sum::<f64>()
                    / 4.0,
                row: first / columns,
                column: first % columns,
            })
            .max_by(|a, b| a.celsius.total_cmp(&b.celsius))
    }

    /// The image less the plane that fits the cold pixels best, fitted without pixels that stand out (a person is no
    /// slope).
    fn without_slope(&self, image: &[f64]) -> Vec<f64> {
        let mut used: Vec<usize> = (0..image.len()).filter(|&pixel| self.cold[pixel]).collect();
        let mut left = image.to_vec();
        for _ in 0..PLANE_ROUNDS {
            let plane = self.plane(image, &used);
            left = (0..image.len())
                .map(|pixel| image[pixel] - plane(pixel))
                .collect();
            let sizes: Vec<f64> = used.iter().map(|&pixel| left[pixel].abs()).collect();
            let usual_c = median(&sizes).unwrap_or(0.0);
            used.retain(|&pixel| left[pixel].abs() <= PLANE_KEPT * usual_c + ROUNDING_C);
        }
        left
    }

    fn plane(&self, image: &[f64], used: &[usize]) -> impl Fn(usize) -> f64 + use<> {
        let columns = self.columns;
        let place = move |pixel: usize| [count(pixel / columns), count(pixel % columns)];
        let mean_of = |value: &dyn Fn(usize) -> f64| {
            let all: Vec<f64> = used.iter().map(|&pixel| value(pixel)).collect();
            mean(&all).unwrap_or(0.0)
        };
        let level = mean_of(&|pixel| image[pixel]);
        let middle = [0, 1].map(|axis| mean_of(&|pixel| place(pixel)[axis]));
        let about = move |pixel: usize| {
            let [row, column] = place(pixel);
            [row - middle[0], column - middle[1]]
        };
        let [mut dd, mut rr, mut dr, mut dv, mut rv] = [0.0; 5];
        for &pixel in used {
            let ([down, right], value) = (about(pixel), image[pixel] - level);
            dd += down * down;
            rr += right * right;
            dr += down * right;
            dv += down * value;
            rv += right * value;
        }
        let determinant = dd * rr - dr * dr;
        let slope = if determinant > FLAT {
            [
                (dv * rr - rv * dr) / determinant,
                (rv * dd - dv * dr) / determinant,
            ]
        } else {
            [0.0, 0.0]
        };
        move |pixel| {
            let [down, right] = about(pixel);
            level + slope[0] * down + slope[1] * right
        }
    }
}

/// Rounds of fitting the plane, and the multiple of the median distance from it that excludes a pixel.
const PLANE_ROUNDS: usize = 4;
const PLANE_KEPT: f64 = 4.0;
/// Rounding error of a pixel on the plane, °C.
const ROUNDING_C: f64 = 1e-9;
/// Determinant below which the pixels define no slope: fewer than three, or all in a row.
const FLAT: f64 = 1e-9;

const fn corners(first: usize, columns: usize) -> [usize; 4] {
    [first, first + 1, first + columns, first + columns + 1]
}

/// For each pixel the most that is claimed above ambient there or in a touching pixel, at least 0.
fn claimed_nearby(claim: &[f64], columns: usize, ambient_c: f64) -> Vec<f64> {
    let rows = claim.len() / columns;
    let nearby = |pixel: usize| {
        let (row, column) = (pixel / columns, pixel % columns);
        let mut most: f64 = 0.0;
        for row in row.saturating_sub(1)..(row + 2).min(rows) {
            for column in column.saturating_sub(1)..(column + 2).min(columns) {
                most = most.max(claim[row * columns + column] - ambient_c);
            }
        }
        most
    };
    (0..claim.len()).map(nearby).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::assert_near;

    const COLUMNS: usize = 8;

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
        RoomDifference::new(real, scene, COLUMNS, warmth())
            .warmest
            .unwrap()
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
        let map = RoomDifference::new(&learned, &simulated, COLUMNS, warmth());
        assert!((map.left_c[60] - 0.3).abs() < 1e-9 && map.left_c[30].abs() < 1e-9);
        assert!(!map.cold[0] && !map.cold[9] && map.cold[60]);
        assert!(map.warmest.unwrap().celsius < 0.1);
        let stove = frame(&[(0, 25.0), (26, 23.0), (27, 21.0), (34, 22.0), (35, 22.0)]);
        let map = RoomDifference::new(&stove, &simulated, COLUMNS, warmth());
        assert!(map.warmest.unwrap().celsius > 1.5);
    }
}
