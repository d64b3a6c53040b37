//! Finds the cells that explain all pixels, by conjugate gradients.

use super::error::STEPS_MAX;

pub(super) struct System {
    pub(super) across: Vec<Vec<(usize, f64)>>,
    pub(super) down: Vec<Vec<(usize, f64)>>,
    pub(super) columns: usize,
    /// Weights of the step from each cell to the next, and to the one below.
    pub(super) to_right: Vec<f64>,
    pub(super) to_below: Vec<f64>,
}

impl System {
    /// Conjugate gradients, starting from the given cells.
    pub(super) fn solve(&self, pixels: &[f64], cells: &mut [f64]) {
        let wanted = self.spread_back(pixels);
        let applied = self.apply(cells);
        let mut rest: Vec<f64> = wanted.iter().zip(&applied).map(|(a, b)| a - b).collect();
        let mut direction = rest.clone();
        let mut left = dot(&rest, &rest);
        let enough = 1e-24 * dot(&wanted, &wanted);
        for _ in 0..STEPS_MAX {
            if left <= enough {
                break;
            }
            let image = self.apply(&direction);
            let step = left / dot(&direction, &image);
            add_scaled(cells, step, &direction);
            add_scaled(&mut rest, -step, &image);
            let before = left;
            left = dot(&rest, &rest);
            for (part, rest) in direction.iter_mut().zip(&rest) {
                *part = rest + left / before * *part;
            }
        }
    }

    fn apply(&self, cells: &[f64]) -> Vec<f64> {
        let mut sum = self.spread_back(&self.seen(cells));
        for (apart, weights) in [(1, &self.to_right), (self.columns, &self.to_below)] {
            for (here, weight) in weights.iter().enumerate() {
                // The last cell of a row has no neighbor to the right.
                if apart == 1 && (here + 1) % self.columns == 0 {
                    continue;
                }
                let slope = weight * (cells[here] - cells[here + apart]);
                sum[here] += slope;
                sum[here + apart] -= slope;
            }
        }
        sum
    }

    fn seen(&self, cells: &[f64]) -> Vec<f64> {
        let mut pixels = Vec::with_capacity(self.down.len() * self.across.len());
        for down in &self.down {
            let mut line = vec![0.0; self.columns];
            for (row, weight) in down {
                add_scaled(
                    &mut line,
                    *weight,
                    &cells[row * self.columns..][..self.columns],
                );
            }
            let pixel = |across: &Vec<(usize, f64)>| {
                across
                    .iter()
                    .map(|(column, weight)| weight * line[*column])
                    .sum::<f64>()
            };
            pixels.extend(self.across.iter().map(pixel));
        }
        pixels
    }

    /// The transpose of [`System::seen`].
    fn spread_back(&self, pixels: &[f64]) -> Vec<f64> {
        let rows = 1 + self
            .down
            .iter()
            .flatten()
            .map(|(row, _)| *row)
            .max()
            .unwrap_or(0);
        let mut cells = vec![0.0; rows * self.columns];
        for (down, line) in self.down.iter().zip(pixels.chunks_exact(self.across.len())) {
            let mut spread = vec![0.0; self.columns];
            for (across, pixel) in self.across.iter().zip(line) {
                for (column, weight) in across {
                    spread[*column] += weight * pixel;
                }
            }
            for (row, weight) in down {
                add_scaled(
                    &mut cells[row * self.columns..][..self.columns],
                    *weight,
                    &spread,
                );
            }
        }
        cells
    }
}

/// The difference between each cell and the one `apart` further on.
pub(super) fn steps(cells: &[f64], apart: usize) -> impl Iterator<Item = f64> {
    let further = cells.iter().skip(apart);
    cells.iter().zip(further).map(|(one, other)| one - other)
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}

fn add_scaled(sum: &mut [f64], scale: f64, parts: &[f64]) {
    for (sum, part) in sum.iter_mut().zip(parts) {
        *sum += scale * part;
    }
}
