//! Resizes a picture like MATLAB's bilinear `imresize` (PeerJ CS 11:e3124, "Interpolation").
//!
//! Shrinking widens the triangle kernel to the spacing of the output; growing uses the plain one. Weights are
//! normalized before the taps beyond the border are mirrored.

use crate::geometry::count;
use glam::USizeVec2;

/// A picture of `input` columns and rows, row by row, with `output` columns and rows.
pub(crate) fn resized(picture: &[f64], input: USizeVec2, output: USizeVec2) -> Vec<f64> {
    let across: Vec<_> = (0..output.x)
        .map(|column| taps(input.x, output.x, column))
        .collect();
    let mut pixels = Vec::with_capacity(output.element_product());
    for row in 0..output.y {
        let mut line = vec![0.0; input.x];
        for (from, weight) in taps(input.y, output.y, row) {
            for (sum, point) in line.iter_mut().zip(&picture[from * input.x..]) {
                *sum += weight * point;
            }
        }
        let of_taps = |taps: &Vec<(usize, f64)>| -> f64 {
            taps.iter().map(|(from, weight)| weight * line[*from]).sum()
        };
        pixels.extend(across.iter().map(of_taps));
    }
    pixels
}

/// The points, with their weights, that make one pixel of an axis.
fn taps(inputs: usize, outputs: usize, output: usize) -> Vec<(usize, f64)> {
    let scale = count::float(outputs) / count::float(inputs);
    let half_width = if scale < 1.0 { 1.0 / scale } else { 1.0 };
    // Positions count from 1, as in MATLAB, so that half-integers round the same way.
    let center = count::float(output + 1) / scale + 0.5 * (1.0 - 1.0 / scale);
    let first = (center - half_width).floor();
    let tap_count = count::floor((2.0 * half_width).ceil()) + 2;
    let weighted: Vec<(usize, f64)> = (0..tap_count)
        .map(|tap| {
            let position = first + count::float(tap);
            let weight = (1.0 - ((center - position) / half_width).abs()).max(0.0);
            (mirrored(position, inputs), weight)
        })
        .collect();
    let total: f64 = weighted.iter().map(|(_, weight)| weight).sum();
    let weighted = weighted.into_iter();
    weighted
        .map(|(input, weight)| (input, weight / total))
        .collect()
}

/// The index, from 0, of a position, from 1, in a grid mirrored at its borders with the edge point repeated.
fn mirrored(position: f64, inputs: usize) -> usize {
    let period = 2 * inputs;
    let index = count::floor((position - 1.0).rem_euclid(count::float(period)));
    if index < inputs {
        index
    } else {
        period - 1 - index.min(period - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 300;

    fn pixels((input, output): ((usize, usize), (usize, usize)), picture: &[f64]) -> Vec<f64> {
        super::resized(picture, input.into(), output.into())
    }

    fn resized(value: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let picture: Vec<f64> = (0..N * N)
            .map(|index| value(index / N + 1, index % N + 1))
            .collect();
        pixels(((N, N), (8, 8)), &picture)
    }

    fn assert_row(found: &[f64], expected: [f64; 8]) {
        for (found, expected) in found.iter().zip(expected) {
            assert!(
                (found - expected).abs() < 1e-6,
                "{found}, expected {expected}"
            );
        }
    }

    #[test]
    fn reference_vectors_of_ramp_and_steps() {
        let ramp = [
            20.813867, 56.750044, 94.249956, 131.750044, 169.249956, 206.750044, 244.249956,
            280.186133,
        ];
        let across = resized(|_, column| count::float(column));
        let down = resized(|row, _| count::float(row));
        for pixel_row in 0..8 {
            assert_row(&across[pixel_row * 8..][..8], ramp);
            assert_row(&down[pixel_row * 8..][..8], [ramp[pixel_row]; 8]);
        }
        let step = |edge: usize| resized(|_, column| if column > edge { 1.0 } else { 0.0 });
        assert_row(
            &step(150)[..8],
            [0.0, 0.0, 0.0, 0.124978, 0.875022, 1.0, 1.0, 1.0],
        );
        assert_row(
            &step(160)[56..],
            [0.0, 0.0, 0.0, 0.027200, 0.706133, 1.0, 1.0, 1.0],
        );
    }

    #[test]
    fn reference_vectors_of_points() {
        let point = |at_row, at_column| {
            resized(move |row, column| {
                if (row, column) == (at_row, at_column) {
                    90_000.0
                } else {
                    0.0
                }
            })
        };
        let inside = point(100, 120);
        assert_row(
            &inside[16..24],
            [0.0, 0.0, 16.978489, 37.208178, 0.0, 0.0, 0.0, 0.0],
        );
        assert!((inside.iter().sum::<f64>() - 64.0).abs() < 1e-6);
        assert!((point(5, 5)[0] - 64.0).abs() < 0.05);
    }

    #[test]
    fn a_uniform_picture_stays_uniform_at_every_size() {
        for sizes in [
            ((300, 300), (8, 8)),
            ((250, 250), (80, 60)),
            ((5, 3), (8, 8)),
            ((1, 1), (4, 2)),
            ((7, 9), (1, 1)),
        ] {
            let (input, output) = sizes;
            let pixels = pixels(sizes, &vec![3.5; input.0 * input.1]);
            assert_eq!(pixels.len(), output.0 * output.1);
            for pixel in pixels {
                assert!((pixel - 3.5).abs() < 1e-12, "{sizes:?}: {pixel}");
            }
        }
    }

    #[test]
    fn growing_is_plain_bilinear_with_mirrored_borders() {
        // imresize([0 4], [1 4], 'bilinear') of GNU Octave's image package: 0 1 3 4.
        assert_eq!(pixels(((2, 1), (4, 1)), &[0.0, 4.0]), [0.0, 1.0, 3.0, 4.0]);
        // The same size changes nothing.
        assert_eq!(pixels(((3, 1), (3, 1)), &[1.0, 5.0, 2.0]), [1.0, 5.0, 2.0]);
    }
}
