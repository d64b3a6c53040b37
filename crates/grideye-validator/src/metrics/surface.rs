//! The smooth part of an image: the nearest sum of a few functions of the place.

use crate::frames::types::Pixels;
use crate::linear::{Matrix, cholesky, dot, solve, zeros};
use crate::numbers::{count, mean};
use grideye_frame::{COLUMNS, PIXELS, ROWS};

/// Functions of the place, pixels from the middle of the image.
pub(crate) type Functions<const N: usize> = fn(f64, f64) -> [f64; N];

/// A level and a slope.
pub(crate) const PLANE: Functions<3> = |x, y| [1.0, x, y];
/// A level, a slope and a bend.
pub(crate) const BENT: Functions<6> = |x, y| [1.0, x, y, x * y, x * x, y * y];

/// A pivot below this share of its diagonal is rounding: the pixels do not determine that function.
const PIVOT_MIN: f64 = 1e-9;

/// The surface that fits some pixels best; their mean if they do not determine one.
pub(crate) fn surface<const N: usize>(
    image: &[f64],
    used: &[usize],
    functions: Functions<N>,
) -> Pixels {
    let middle = |places: usize| (count(places) - 1.0) / 2.0;
    let at = |pixel: usize| {
        let (row, column) = (count(pixel / COLUMNS), count(pixel % COLUMNS));
        functions(column - middle(COLUMNS), row - middle(ROWS))
    };
    let (mut normal, mut sums) = (zeros(N), vec![0.0; N]);
    for &pixel in used {
        let values = at(pixel);
        for (row, value) in values.iter().enumerate() {
            sums[row] += value * image[pixel];
            for (entry, other) in normal[row].iter_mut().zip(values) {
                *entry += value * other;
            }
        }
    }
    let is_known = |lower: &Matrix| {
        let mut places = 0..N;
        places.all(|place| lower[place][place].powi(2) > PIVOT_MIN * normal[place][place])
    };
    let Some(lower) = cholesky(&normal).filter(is_known) else {
        let values: Vec<f64> = used.iter().map(|&pixel| image[pixel]).collect();
        return [mean(&values).unwrap_or(0.0); PIXELS];
    };
    let factors = solve(&lower, &sums);
    std::array::from_fn(|pixel| dot(&factors, &at(pixel)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::assert_near;

    #[test]
    fn a_bent_surface_is_its_own_fit_from_any_pixels_that_determine_it() {
        let bent: Pixels = std::array::from_fn(|pixel| {
            let (x, y) = (count(pixel % COLUMNS), count(pixel / COLUMNS));
            0.3 + 0.1 * x - 0.05 * y + 0.01 * x * y - 0.02 * x * x + 0.015 * y * y
        });
        let all: Vec<usize> = (0..PIXELS).collect();
        let some: Vec<usize> = (0..PIXELS).filter(|pixel| pixel % 3 > 0).collect();
        for used in [all, some] {
            for (bent, fitted) in bent.iter().zip(surface(&bent, &used, BENT)) {
                assert_near(fitted, *bent, 1e-11);
            }
        }
    }

    /// One row tells no slope across the rows, two pixels none at all.
    #[test]
    fn pixels_that_determine_no_plane_have_a_level() {
        let image: Pixels = std::array::from_fn(count);
        let row: Vec<usize> = (8..16).collect();
        assert_eq!(surface(&image, &row, PLANE), [11.5; PIXELS]);
        assert_eq!(surface(&image, &[3, 4], PLANE), [3.5; PIXELS]);
        assert_eq!(surface(&image, &[], PLANE), [0.0; PIXELS]);
    }
}
