//! One axis of an array: how pixels and cells overlap.

use grideye_scene::count;

const SAME_CELL: f64 = 1e-6;

/// One axis of the array.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Pixels of one sensor, the paper's R.
    pub pixels: usize,
    /// Cells per pixel, the paper's multiplication factor m.
    pub factor: usize,
    /// Sensors, the paper's n.
    pub sensors: usize,
    /// Distance between sensors in the scene, meters; 0 for one sensor.
    pub spacing_m: f64,
    /// The distance by Eq. 7, meters.
    pub spacing_by_eq_7_m: f64,
}

impl Axis {
    /// Cells in view of at least one sensor: `R m + n - 1`.
    #[must_use]
    pub const fn union_cells(&self) -> usize {
        self.pixels * self.factor + self.sensors - 1
    }

    /// Cells in view of every sensor: `R m - (n - 1)`.
    #[must_use]
    pub const fn covered_cells(&self) -> usize {
        (self.pixels * self.factor + 1).saturating_sub(self.sensors)
    }

    pub(super) fn pixel(&self, sensor: usize, cell: usize) -> Option<usize> {
        let pixel = cell.checked_sub(sensor)? / self.factor;
        (pixel < self.pixels).then_some(pixel)
    }

    pub(super) const fn samples(&self) -> usize {
        self.sensors * self.pixels
    }

    /// The center of a pixel, in cells from the first cell's edge.
    fn center(&self, sensor: usize, pixel: usize) -> f64 {
        count::float(sensor) + count::float(self.factor) * (count::float(pixel) + 0.5)
    }

    /// For each cell, the pixels with the nearest centers on either side, and their weights, which sum to 1.
    pub(super) fn interpolation(&self) -> Vec<Vec<(usize, f64)>> {
        let mut centers: Vec<(f64, usize)> = (0..self.sensors)
            .flat_map(|sensor| (0..self.pixels).map(move |pixel| (sensor, pixel)))
            .map(|(sensor, pixel)| (self.center(sensor, pixel), sensor * self.pixels + pixel))
            .collect();
        centers.sort_by(|one, other| one.0.total_cmp(&other.0));
        (0..self.union_cells())
            .map(|cell| neighbors(&centers, count::float(cell) + 0.5))
            .collect()
    }

    /// Each pixel's response to each cell: a triangle reaching to the next pixels' centers, mirrored at the border of
    /// the view.
    ///
    /// It is a sum of triangles two cells wide, so that blurring the virtual sensor's image gives exactly the sensor's.
    pub(super) fn blur(&self) -> Vec<Vec<(usize, f64)>> {
        let reach = count::float(self.factor);
        let width = self.pixels * self.factor;
        let mut rows = Vec::with_capacity(self.samples());
        for sensor in 0..self.sensors {
            for pixel in 0..self.pixels {
                let center = self.center(0, pixel);
                // Positions count from one pixel before this pixel's first cell.
                let taps = (0..3 * self.factor).map(|tap| {
                    let from_start = pixel * self.factor + tap;
                    let position = count::float(from_start) - reach + 0.5;
                    let weight = (1.0 - (position - center).abs() / reach).max(0.0);
                    let inside = match from_start.checked_sub(self.factor) {
                        None => self.factor - 1 - from_start,
                        Some(cell) if cell >= width => 2 * width - 1 - cell,
                        Some(cell) => cell,
                    };
                    (sensor + inside, weight / reach)
                });
                rows.push(taps.filter(|(_, weight)| *weight > 0.0).collect());
            }
        }
        rows
    }
}

fn neighbors(centers: &[(f64, usize)], at: f64) -> Vec<(usize, f64)> {
    let after = centers.partition_point(|(center, _)| *center < at - SAME_CELL);
    let before = if centers
        .get(after)
        .is_some_and(|(center, _)| *center <= at + SAME_CELL)
    {
        after
    } else {
        after.saturating_sub(1)
    };
    let after = after.min(centers.len().saturating_sub(1));
    let (low, high) = (centers[before].0, centers[after].0);
    let share = if high > low {
        ((at - low) / (high - low)).clamp(0.0, 1.0)
    } else {
        1.0
    };
    let mut weights = Vec::new();
    for (center, part) in [(low, 1.0 - share), (high, share)] {
        // Pixels of several sensors may share a center; their mean is used.
        let here: Vec<usize> = centers
            .iter()
            .filter(|(other, _)| (other - center).abs() < SAME_CELL)
            .map(|(_, pixel)| *pixel)
            .collect();
        if part > 0.0 {
            let each = part / count::float(here.len());
            weights.extend(here.into_iter().map(|pixel| (pixel, each)));
        }
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis_of(pixels: usize, factor: usize, sensors: usize) -> Axis {
        Axis {
            pixels,
            factor,
            sensors,
            spacing_m: 0.0,
            spacing_by_eq_7_m: 0.0,
        }
    }

    #[test]
    fn the_response_of_a_pixel_is_the_triangle_and_sums_to_1() {
        let blur = axis_of(3, 3, 2).blur();
        assert_eq!(blur.len(), 6);
        // The middle pixel of the first sensor: cells 2 to 6 by 1, 2, 3, 2, 1 ninths.
        let expected = [(2, 1.0), (3, 2.0), (4, 3.0), (5, 2.0), (6, 1.0)];
        for ((cell, weight), (expected_cell, ninths)) in blur[1].iter().zip(expected) {
            assert_eq!(*cell, expected_cell);
            assert!((weight - ninths / 9.0).abs() < 1e-15);
        }
        // The same pixel of the second sensor is one cell further.
        assert_eq!(blur[4][0].0, 3);
        for (sizes, rows) in [
            ((3, 3, 2), blur),
            ((4, 2, 3), axis_of(4, 2, 3).blur()),
            ((1, 5, 1), axis_of(1, 5, 1).blur()),
        ] {
            for row in rows {
                let total: f64 = row.iter().map(|(_, weight)| weight).sum();
                assert!((total - 1.0).abs() < 1e-12, "{sizes:?}: {row:?}");
            }
        }
    }

    #[test]
    fn the_edge_pixel_is_mirrored() {
        // One pixel of 2 cells: the triangle over cells -1 to 2 is 1, 3, 3, 1 eighths, folded 4, 4.
        let blur = axis_of(1, 2, 1).blur();
        let mut cells = [0.0; 2];
        for (cell, weight) in &blur[0] {
            cells[*cell] += weight;
        }
        assert_eq!(cells, [0.5, 0.5]);
    }

    #[test]
    fn interpolation_is_exact_on_centers_and_linear_between_them() {
        // Factor 3, 3 sensors: each inner cell is the center of one pixel.
        let axis = axis_of(2, 3, 3);
        let weights = axis.interpolation();
        assert_eq!(weights.len(), 8);
        for (cell, pixel) in [(1, 0), (2, 2), (3, 4), (4, 1), (5, 3), (6, 5)] {
            assert_eq!(weights[cell], [(pixel, 1.0)], "cell {cell}");
        }
        assert_eq!(weights[0], weights[1], "nothing lies beyond");
        // Factor 4, 1 sensor: centers at 2 and 6; the cell at 3.5 is 5/8 of the first and 3/8 of the second.
        let weights = axis_of(2, 4, 1).interpolation();
        assert_eq!(weights[3], [(0, 0.625), (1, 0.375)]);
    }
}
