//! Structural similarity, pixel by pixel.

use super::{comparable, count, mean};

/// What SSIM takes as the range of temperatures, in degrees: the contrast of a warm thing indoors. Its second constant is
/// then `(0.03 * 10)^2 = 0.09` square degrees, about the variance of the sensor's noise, so that a patch in which nothing but
/// noise is seen is not asked for the same noise.
pub const SSIM_RANGE_C: f64 = 10.0;

const SIDE: usize = 3;

/// The structural similarity of each pixel's neighbourhood of 3 x 3, -1 to 1 (Wang et al. 2004, "Image quality assessment:
/// from error visibility to structural similarity", Eq. 13), row by row.
///
/// Temperatures are taken above `ambient_c`, so that the first factor, which compares means, sees what the scene adds
/// to the room. Windows are uniform, variances those of a sample (n - 1), the image is mirrored at its border, K1 = 0.01,
/// K2 = 0.03, the range is [`SSIM_RANGE_C`]: scikit-image's `structural_similarity` with `win_size=3`. `None` for less
/// than 3 x 3 pixels or rows of unequal length.
#[must_use]
pub fn structure_map(
    real: &[f64],
    simulated: &[f64],
    columns: usize,
    ambient_c: f64,
) -> Option<Vec<f64>> {
    comparable(real, simulated)?;
    let rows = real.len().checked_div(columns)?;
    if rows * columns != real.len() || rows < SIDE || columns < SIDE {
        return None;
    }
    let pixel = |index: usize| {
        let neighbours = neighbours(index, columns, rows);
        let window = |frame: &[f64]| neighbours.map(|index| frame[index] - ambient_c);
        similarity(&window(real), &window(simulated))
    };
    Some((0..real.len()).map(pixel).collect())
}

/// The mean of that map over the pixels whose neighbourhood lies within the image, as its authors take it.
#[must_use]
pub fn structural_similarity(
    real: &[f64],
    simulated: &[f64],
    columns: usize,
    ambient_c: f64,
) -> Option<f64> {
    let map = structure_map(real, simulated, columns, ambient_c)?;
    interior_mean(&map, columns)
}

pub(crate) fn interior_mean(map: &[f64], columns: usize) -> Option<f64> {
    let rows = map.len().checked_div(columns)?;
    let is_inside = |index: usize| {
        let (row, column) = (index / columns, index % columns);
        (1..rows - 1).contains(&row) && (1..columns - 1).contains(&column)
    };
    let inside: Vec<f64> = (0..map.len())
        .filter(|&index| is_inside(index))
        .map(|index| map[index])
        .collect();
    mean(&inside)
}

fn neighbours(index: usize, columns: usize, rows: usize) -> [usize; SIDE * SIDE] {
    let (row, column) = (index / columns, index % columns);
    std::array::from_fn(|place| {
        let row = (row + place / SIDE).saturating_sub(1).min(rows - 1);
        let column = (column + place % SIDE).saturating_sub(1).min(columns - 1);
        row * columns + column
    })
}

fn similarity(real: &[f64; SIDE * SIDE], simulated: &[f64; SIDE * SIDE]) -> f64 {
    let number = count(SIDE * SIDE);
    let mean = |window: &[f64; SIDE * SIDE]| window.iter().sum::<f64>() / number;
    let (x, y) = (mean(real), mean(simulated));
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (real, simulated) in real.iter().zip(simulated) {
        xx += (real - x) * (real - x);
        yy += (simulated - y) * (simulated - y);
        xy += (real - x) * (simulated - y);
    }
    let sample = number - 1.0;
    let (first, second) = ((0.01 * SSIM_RANGE_C).powi(2), (0.03 * SSIM_RANGE_C).powi(2));
    (2.0 * x * y + first) * (2.0 * xy / sample + second)
        / ((x * x + y * y + first) * ((xx + yy) / sample + second))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_like_itself_and_unlike_its_mirror() {
        let frame: Vec<f64> = (0..64_u32).map(|i| 20.0 + f64::from(i % 8)).collect();
        let mirrored: Vec<f64> = (0..64_u32).map(|i| 27.0 - f64::from(i % 8)).collect();
        assert_eq!(structural_similarity(&frame, &frame, 8, 20.0), Some(1.0));
        assert!(structural_similarity(&frame, &mirrored, 8, 20.0).unwrap() < 0.0);
    }

    /// One pixel of 3 degrees in a flat room against the flat room. In the window of nine: mean 1/3, squares 9 - 1, so
    /// the variance is 1. The rest is the formula.
    #[test]
    fn one_warm_pixel_by_hand() {
        let (mut one, flat) = ([20.0; 25], [20.0; 25]);
        one[12] = 23.0;
        let map = structure_map(&one, &flat, 5, 20.0).unwrap();
        let expected = 0.01 * 0.09 / ((1.0 / 9.0 + 0.01) * (1.0 + 0.09));
        assert!((map[12] - expected).abs() < 1e-12);
        assert!(
            (map[0] - 1.0).abs() < 1e-12,
            "nothing of it is seen from the corner"
        );
        assert!((interior_mean(&map, 5).unwrap() - expected).abs() < 1e-12);
    }

    #[test]
    fn borders_are_mirrored() {
        assert_eq!(neighbours(0, 4, 3), [0, 0, 1, 0, 0, 1, 4, 4, 5]);
        assert_eq!(neighbours(11, 4, 3), [6, 7, 7, 10, 11, 11, 10, 11, 11]);
    }

    #[test]
    fn frames_without_a_neighbourhood_have_none() {
        assert_eq!(structure_map(&[1.0; 4], &[1.0; 4], 2, 0.0), None);
        assert_eq!(structure_map(&[1.0; 10], &[1.0; 10], 3, 0.0), None);
        assert_eq!(structure_map(&[1.0; 9], &[1.0; 9], 0, 0.0), None);
        assert_eq!(
            structural_similarity(&[f64::NAN; 9], &[1.0; 9], 3, 0.0),
            None
        );
    }
}
