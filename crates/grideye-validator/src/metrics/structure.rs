//! Structural similarity (SSIM).

use crate::numbers::{comparable, count, mean};

/// SSIM's temperature range, °C: makes its second constant, 0.09 °C², about the square of the sensor's noise.
pub const SSIM_RANGE_C: f64 = 10.0;
const SIDE: usize = 3;

/// Structural similarity of each pixel's 3 x 3 neighborhood, -1 to 1, row by row (Wang et al. 2004, Eq. 13).
///
/// Uses temperatures above `ambient_c`, uniform windows, sample variances (n - 1), mirrored borders, K1 = 0.01, K2 =
/// 0.03 and range [`SSIM_RANGE_C`], like scikit-image with `win_size=3`. `None` below 3 x 3 pixels or for unequal rows.
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
    let size = (columns, rows);
    let (x, y) = (
        |index: usize| real[index] - ambient_c,
        |index: usize| simulated[index] - ambient_c,
    );
    let [xs, ys] = [window_sums(x, size), window_sums(y, size)];
    // Products around the frame's mean keep the squares small.
    let [mx, my] = [mean(real)? - ambient_c, mean(simulated)? - ambient_c];
    let xx = window_sums(|index| (x(index) - mx) * (x(index) - mx), size);
    let yy = window_sums(|index| (y(index) - my) * (y(index) - my), size);
    let xy = window_sums(|index| (x(index) - mx) * (y(index) - my), size);
    let window = |index: usize| {
        let sums = [xs[index], ys[index]];
        let moments = [xx[index], yy[index], xy[index]];
        similarity(sums, moments, [mx, my])
    };
    Some((0..real.len()).map(window).collect())
}

/// Mean of [`structure_map`] over the pixels with their whole neighborhood in the image, as its authors take it.
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

fn interior_mean(map: &[f64], columns: usize) -> Option<f64> {
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

/// Sum of the values around each pixel: rows first, then columns.
fn window_sums(values: impl Fn(usize) -> f64, (columns, rows): (usize, usize)) -> Vec<f64> {
    let mut along = vec![0.0; columns * rows];
    for row in 0..rows {
        let value = |column: usize| values(row * columns + column);
        for column in 0..columns {
            let (before, after) = (column.saturating_sub(1), (column + 1).min(columns - 1));
            along[row * columns + column] = value(before) + value(column) + value(after);
        }
    }
    let sum = |index: usize| {
        let (row, column) = (index / columns, index % columns);
        let (above, below) = (row.saturating_sub(1), (row + 1).min(rows - 1));
        along[above * columns + column] + along[index] + along[below * columns + column]
    };
    (0..along.len()).map(sum).collect()
}

/// From a window's sums, the sums of its products around `about`, and `about`.
fn similarity([x, y]: [f64; 2], [xx, yy, xy]: [f64; 3], about: [f64; 2]) -> f64 {
    let number = count(SIDE * SIDE);
    let sample = number - 1.0;
    let (x, y) = (x / number, y / number);
    let (dx, dy) = (x - about[0], y - about[1]);
    let [xx, yy] = [xx - number * dx * dx, yy - number * dy * dy].map(|squares| squares.max(0.0));
    let xy = xy - number * dx * dy;
    let (first, second) = ((0.01 * SSIM_RANGE_C).powi(2), (0.03 * SSIM_RANGE_C).powi(2));
    (2.0 * x * y + first) * (2.0 * xy / sample + second)
        / ((x * x + y * y + first) * ((xx + yy) / sample + second))
}
