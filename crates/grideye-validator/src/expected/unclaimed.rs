//! What is warm in a recording where its claim is not.
//!
//! Looked for in blocks of two by two pixels, which noise and pattern reach half as far as single pixels, and a pixel away
//! from all that is claimed to be warm: how well that is met, other scores ask. Once in what stays, with the slope that
//! rooms have taken out, and once in what comes and goes.

use super::mean_frame;
use crate::metrics::{count, mean};
use crate::union::{Warmth, offset};

/// Where the claim is not warm.
pub(super) struct Places {
    columns: usize,
    /// By the mean claim.
    still: Vec<bool>,
    /// By each frame's claim.
    moving: Vec<Vec<bool>>,
}

/// The warmest unclaimed block, °C; `None` where the claim is warm everywhere.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Unclaimed {
    /// In the mean over all frames, above the claim and the slope of the room.
    pub(crate) still: Option<Block>,
    /// In any frame, above the claim and the mean.
    pub(crate) moving: Option<Block>,
}

/// What a learned room has beside the simulated one.
pub(crate) struct RoomMap {
    /// Row by row, °C, its level taken out.
    pub(crate) left_c: Vec<f64>,
    /// Where the simulated room claims nothing warm.
    pub(crate) cold: Vec<bool>,
    /// The warmest block of two by two of these pixels, above the slope of the room, °C.
    pub(crate) warmest_c: Option<f64>,
}

impl RoomMap {
    pub(crate) fn new(learned: &[f64], simulated: &[f64], columns: usize, warmth: Warmth) -> Self {
        let places = Places::new(&[simulated], columns, warmth);
        let level_c = offset(learned, simulated);
        let pixels = learned.iter().zip(simulated);
        let left_c: Vec<f64> = pixels.map(|(a, b)| a - b - level_c).collect();
        let warmest = places.warmest(&places.without_slope(&left_c), &places.still, None);
        Self {
            warmest_c: warmest.map(|block| block.celsius),
            cold: places.still,
            left_c,
        }
    }
}

/// A block of two by two pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Block {
    /// Mean of the four.
    pub(crate) celsius: f64,
    /// Row and column of its first pixel, counted from 0.
    pub(crate) row: usize,
    pub(crate) column: usize,
    /// The frame, if it is one frame's.
    pub(crate) frame: Option<usize>,
}

impl Places {
    pub(super) fn new(claims: &[&[f64]], columns: usize, warmth: Warmth) -> Self {
        let cold = |claim: &[f64]| away_from_warm(claim, columns.max(1), warmth);
        let owned: Vec<Vec<f64>> = claims.iter().map(|claim| claim.to_vec()).collect();
        Self {
            columns: columns.max(1),
            still: cold(&mean_frame(&owned)),
            moving: claims.iter().map(|claim| cold(claim)).collect(),
        }
    }

    /// `claims` holds the claim beside each real frame.
    pub(super) fn of(&self, real: &[Vec<f64>], claims: &[&[f64]]) -> Unclaimed {
        let left: Vec<Vec<f64>> = real
            .iter()
            .zip(claims)
            .map(|(real, claim)| {
                let level_c = offset(real, claim);
                let left = real.iter().zip(*claim);
                left.map(|(real, claim)| real - claim - level_c).collect()
            })
            .collect();
        let mean = mean_frame(&left);
        let still = self.warmest(&self.without_slope(&mean), &self.still, None);
        let moving = left.iter().enumerate().filter_map(|(index, frame)| {
            let moving: Vec<f64> = frame
                .iter()
                .zip(&mean)
                .map(|(now, mean)| now - mean)
                .collect();
            let cold = self.moving.get(index).or(self.moving.last())?;
            self.warmest(&moving, cold, Some(index))
        });
        Unclaimed {
            still,
            moving: moving.max_by(|a, b| a.celsius.total_cmp(&b.celsius)),
        }
    }

    fn warmest(&self, left: &[f64], cold: &[bool], frame: Option<usize>) -> Option<Block> {
        let columns = self.columns;
        let corner = |&first: &usize| {
            let is_whole = first % columns + 1 < columns && first + columns + 1 < left.len();
            is_whole && corners(first, columns).iter().all(|&pixel| cold[pixel])
        };
        (0..left.len())
            .filter(corner)
            .map(|first| Block {
                celsius: corners(first, columns)
                    .iter()
                    .map(|&pixel| left[pixel])
                    .sum::<f64>()
                    / 4.0,
                row: first / columns,
                column: first % columns,
                frame,
            })
            .max_by(|a, b| a.celsius.total_cmp(&b.celsius))
    }

    /// Less the plane that fits the pixels away from what is claimed to be warm best (least squares).
    fn without_slope(&self, image: &[f64]) -> Vec<f64> {
        let place = |pixel: usize| [count(pixel / self.columns), count(pixel % self.columns)];
        let cold: Vec<usize> = (0..image.len())
            .filter(|&pixel| self.still[pixel])
            .collect();
        let middle = |values: &dyn Fn(usize) -> f64| {
            let all: Vec<f64> = cold.iter().map(|&pixel| values(pixel)).collect();
            mean(&all).unwrap_or(0.0)
        };
        let [row, column] = [0, 1].map(|axis| middle(&|pixel| place(pixel)[axis]));
        let level = middle(&|pixel| image[pixel]);
        let about = |pixel: usize| [place(pixel)[0] - row, place(pixel)[1] - column];
        let product = |a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64| -> f64 {
            cold.iter().map(|&pixel| a(pixel) * b(pixel)).sum()
        };
        let (down, right) = (
            |pixel: usize| about(pixel)[0],
            |pixel: usize| about(pixel)[1],
        );
        let value = |pixel: usize| image[pixel] - level;
        let (dd, rr, dr) = (
            product(&down, &down),
            product(&right, &right),
            product(&down, &right),
        );
        let (dv, rv) = (product(&down, &value), product(&right, &value));
        let determinant = dd * rr - dr * dr;
        let slope = if determinant > 1e-9 {
            [
                (dv * rr - rv * dr) / determinant,
                (rv * dd - dv * dr) / determinant,
            ]
        } else {
            [0.0, 0.0]
        };
        (0..image.len())
            .map(|pixel| {
                image[pixel] - level - slope[0] * about(pixel)[0] - slope[1] * about(pixel)[1]
            })
            .collect()
    }
}

/// The four pixels of the block that begins there.
const fn corners(first: usize, columns: usize) -> [usize; 4] {
    [first, first + 1, first + columns, first + columns + 1]
}

/// Pixels that neither are claimed to be warm nor touch one that is.
fn away_from_warm(claim: &[f64], columns: usize, warmth: Warmth) -> Vec<bool> {
    let is_warm = |pixel: usize| claim[pixel] - warmth.ambient_c > warmth.claimed_above_c;
    let touches = |pixel: usize, other: usize| {
        (pixel / columns).abs_diff(other / columns) <= 1
            && (pixel % columns).abs_diff(other % columns) <= 1
    };
    let warm: Vec<usize> = (0..claim.len()).filter(|&pixel| is_warm(pixel)).collect();
    (0..claim.len())
        .map(|pixel| !warm.iter().any(|&other| touches(pixel, other)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLUMNS: usize = 8;

    fn warmth() -> Warmth {
        Warmth::new(20.0, 1.0)
    }

    /// A frame at 20 °C with some pixels at other temperatures.
    fn frame(pixels: &[(usize, f64)]) -> Vec<f64> {
        let mut frame = vec![20.0; 64];
        for &(pixel, celsius) in pixels {
            frame[pixel] = celsius;
        }
        frame
    }

    fn found(real: &[Vec<f64>], claim: &[f64]) -> Unclaimed {
        let claims = vec![claim; real.len()];
        Places::new(&claims, COLUMNS, warmth()).of(real, &claims)
    }

    /// Four pixels of 3, 1, 2 and 2 °C above the claim: 2 °C on the mean.
    const FOUR: [(usize, f64); 4] = [(26, 23.0), (27, 21.0), (34, 22.0), (35, 22.0)];

    #[test]
    fn what_stands_is_found_with_its_place() {
        let real = frame(&FOUR);
        let still = found(&[real.clone(), real], &[20.0; 64]).still.unwrap();
        assert_eq!((still.row, still.column, still.frame), (3, 2, None));
        // The slope that is taken out of all pixels takes a little of it.
        assert!((1.6..2.0).contains(&still.celsius), "{still:?}");
    }

    #[test]
    fn what_comes_and_goes_is_found_in_its_frame() {
        let mut real = vec![frame(&[]); 9];
        real.push(frame(&FOUR));
        let moving = found(&real, &[20.0; 64]).moving.unwrap();
        assert_eq!((moving.row, moving.column, moving.frame), (3, 2, Some(9)));
        // A tenth of it is in the mean.
        assert!((moving.celsius - 1.8).abs() < 1e-9, "{moving:?}");
    }

    #[test]
    fn a_slope_of_the_room_and_a_level_are_nobody() {
        let sloped: Vec<f64> = (0..64)
            .map(|pixel| 23.0 + 0.1 * count(pixel / 8) + 0.2 * count(pixel % 8))
            .collect();
        let still = found(&[sloped.clone(), sloped], &[20.0; 64]).still.unwrap();
        assert!(still.celsius.abs() < 1e-9, "{still:?}");
    }

    /// A person half a pixel from where it is claimed to be is not warmth that nobody claims.
    #[test]
    fn what_touches_claimed_warmth_is_not_looked_at() {
        let claim = frame(&[(27, 23.0)]);
        let real = frame(&FOUR);
        let near = found(&[real.clone(), real], &claim).still.unwrap();
        assert!(near.celsius < 0.3, "{near:?}");
        let everywhere = found(&[vec![25.0; 64], vec![25.0; 64]], &[25.0; 64]);
        assert_eq!(everywhere, Unclaimed::default());
    }

    /// A radiator that is warmer than the scene has it is left alone, what it does not have is named.
    #[test]
    fn a_learned_room_is_what_it_has_beside_the_simulated_one() {
        let simulated = frame(&[(0, 25.0)]);
        let mut learned = frame(&[(0, 27.0), (60, 20.3)]);
        learned.iter_mut().for_each(|pixel| *pixel += 1.5);
        let map = RoomMap::new(&learned, &simulated, COLUMNS, warmth());
        assert!((map.left_c[60] - 0.3).abs() < 1e-9 && map.left_c[30].abs() < 1e-9);
        assert!(!map.cold[0] && !map.cold[9] && map.cold[60]);
        assert!(map.warmest_c.unwrap() < 0.1);
        let stove = frame(&[(0, 25.0), (26, 23.0), (27, 21.0), (34, 22.0), (35, 22.0)]);
        let map = RoomMap::new(&stove, &simulated, COLUMNS, warmth());
        assert!(map.warmest_c.unwrap() > 1.5);
    }
}
