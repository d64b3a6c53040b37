//! The direction and width of each pixel: its response is a Gaussian over the two angles from the optical axis.

use super::map::AMG88;
use super::normal::{NORMAL, Normal, REACH};
use crate::geometry::count;
use crate::model::{Optics, Sensor};
use glam::DVec2;

/// A Gaussian's full width at half height over its standard deviation: `2 √(2 ln 2)`.
const WIDTH_PER_SIGMA: f64 = 2.354_820_045_030_949_4;

/// The widest visible angle from the axis, radians.
const ANGLE_MAX_RAD: f64 = 1.483_529_864_195_180_2; // 85°

/// The response of one pixel: `exp(-½ ((left - at)² / σ² + (up - at)² / σ²))`, both angles in their own planes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Response {
    /// Radians to the left and up.
    pub(super) at: DVec2,
    pub(super) sigma: DVec2,
}

/// The responses of all pixels, row by row, and bounds to find those that see a direction.
#[derive(Debug, Clone)]
pub(super) struct Eye {
    pub(super) columns: usize,
    pub(super) responses: Vec<Response>,
    pub(super) normal: &'static Normal,
    /// The inverse of the share of each response within the field.
    pub(super) scales: Vec<f64>,
    /// The field of view to the left and up, radians from the axis; the same to the right and down.
    pub(super) field: DVec2,
    /// The angles to the left that each column's pixels see, and the angles upwards for each row.
    pub(super) columns_see: Vec<(f64, f64)>,
    pub(super) rows_see: Vec<(f64, f64)>,
}

impl Eye {
    pub(super) fn new(sensor: &Sensor) -> Self {
        let responses = responses(sensor);
        let normal: &Normal = &NORMAL;
        let field = responses.iter().fold(DVec2::ZERO, |field, response| {
            field.max(response.at.abs() + REACH * response.sigma)
        });
        let field = field.min(DVec2::splat(ANGLE_MAX_RAD));
        let scales = responses.iter().map(|response| {
            let in_field = |at: f64, sigma: f64, field: f64| {
                normal.below((field - at) / sigma) - normal.below((-field - at) / sigma)
            };
            1.0 / (in_field(response.at.x, response.sigma.x, field.x)
                * in_field(response.at.y, response.sigma.y, field.y))
        });
        let scales = scales.collect();
        let hull = |(low, high): (f64, f64), at: f64, sigma: f64| {
            (low.min(at - REACH * sigma), high.max(at + REACH * sigma))
        };
        let mut columns_see = vec![(f64::INFINITY, f64::NEG_INFINITY); sensor.columns];
        let mut rows_see = vec![(f64::INFINITY, f64::NEG_INFINITY); sensor.rows];
        for (row, of_row) in responses.chunks(sensor.columns.max(1)).enumerate() {
            for (column, response) in of_row.iter().enumerate() {
                columns_see[column] = hull(columns_see[column], response.at.x, response.sigma.x);
                rows_see[row] = hull(rows_see[row], response.at.y, response.sigma.y);
            }
        }
        Self {
            columns: sensor.columns,
            responses,
            normal,
            scales,
            field,
            columns_see,
            rows_see,
        }
    }

    pub(super) fn narrowest_up_rad(&self) -> f64 {
        let widths = self.responses.iter().map(|response| response.sigma.y);
        widths.fold(f64::INFINITY, f64::min) * WIDTH_PER_SIGMA
    }

    /// Calls `add` with each pixel's integral of its response times a value that rises by `steps` along a band.
    pub(super) fn add(
        &self,
        steps: &[(f64, f64)],
        weights: &mut Weights,
        mut add: impl FnMut(usize, f64),
    ) {
        let (Some(first), Some(last)) = (steps.first(), steps.last()) else {
            return;
        };
        let (low, high) = weights.ends;
        for (row, see) in self.rows_see.iter().enumerate() {
            if see.1 <= low || see.0 >= high {
                continue;
            }
            for (column, see) in self.columns_see.iter().enumerate() {
                if see.1 <= first.0 || see.0 >= last.0 {
                    continue;
                }
                let pixel = row * self.columns + column;
                let response = &self.responses[pixel];
                let weight = weights.of(pixel, response, self.normal);
                if weight > 0.0 {
                    let inverse = 1.0 / response.sigma.x;
                    let mut sum = 0.0;
                    for (angle, rise) in steps {
                        sum -= rise * self.normal.below((angle - response.at.x) * inverse);
                    }
                    add(pixel, weight * self.scales[pixel] * sum);
                }
            }
        }
    }
}

/// How much of each pixel's response is within a band; NaN until it is needed.
#[derive(Debug, Default)]
pub(super) struct Weights {
    ends: (f64, f64),
    of_pixels: Vec<f64>,
}

impl Weights {
    pub(super) fn begin(&mut self, ends: (f64, f64), eye: &Eye) {
        self.ends = ends;
        self.of_pixels.clear();
        self.of_pixels.resize(eye.responses.len(), f64::NAN);
    }

    fn of(&mut self, pixel: usize, response: &Response, normal: &Normal) -> f64 {
        let weight = &mut self.of_pixels[pixel];
        if weight.is_nan() {
            let below = |end: f64| normal.below((end - response.at.y) / response.sigma.y);
            *weight = below(self.ends.1) - below(self.ends.0);
        }
        *weight
    }
}

fn responses(sensor: &Sensor) -> Vec<Response> {
    let given = sensor.pixel_width_rad;
    let response = |at: DVec2, width: DVec2| {
        let width = given.unwrap_or(width);
        // The blur's point spread and the pixel's response are both Gaussians, so their squared widths add.
        let width = (width * width + sensor.blur_rad * sensor.blur_rad).map(f64::sqrt);
        Response {
            at,
            sigma: width / WIDTH_PER_SIGMA,
        }
    };
    match sensor.optics {
        Optics::Amg88 => AMG88
            .iter()
            .map(|[right, up, across, down]| {
                let radians = |x: f64, y: f64| DVec2::new(x.to_radians(), y.to_radians());
                response(radians(-right, *up), radians(*across, *down))
            })
            .collect(),
        Optics::Pinhole => {
            let left = steps(sensor.columns, sensor.field_of_view_rad.x);
            let up = steps(sensor.rows, sensor.field_of_view_rad.y);
            up.iter()
                .flat_map(|up| {
                    left.iter()
                        .map(|left| response(DVec2::new(left.0, up.0), DVec2::new(left.1, up.1)))
                })
                .collect()
        }
    }
}

/// The angles of a pinhole's pixels on one axis, decreasing, and the angle each spans from border to border.
fn steps(pixels: usize, field_of_view_rad: f64) -> Vec<(f64, f64)> {
    let half = 0.5 * count::float(pixels);
    let slope = libm::tan(0.5 * field_of_view_rad) / half;
    let angle = |border: f64| libm::atan((half - border) * slope);
    (0..pixels)
        .map(|pixel| {
            let at = count::float(pixel);
            (angle(at + 0.5), angle(at) - angle(at + 1.0))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_is_that_of_the_specification() {
        // Sums of the four columns and of all squares, computed from the digitized file by another program.
        let sums = AMG88.iter().fold([0.0; 4], |sums, of_pixel| {
            [0, 1, 2, 3].map(|index| sums[index] + of_pixel[index])
        });
        for (found, expected) in sums.into_iter().zip([-4.58, 6.14, 463.72, 549.72]) {
            assert!((found - expected).abs() < 5e-3, "{found} {expected}");
        }
        let squares: f64 = AMG88.iter().flatten().map(|value| value * value).sum();
        assert!((squares - 57_932.3).abs() < 0.05, "{squares}");
        for row in 0..8 {
            for column in 0..8 {
                let here = AMG88[row * 8 + column];
                let mirrored = AMG88[row * 8 + 7 - column];
                assert!((here[0] + mirrored[0]).abs() < 0.2 && (here[1] - mirrored[1]).abs() < 0.2);
                let upside_down = AMG88[(7 - row) * 8 + column];
                assert!((here[1] + upside_down[1]).abs() < 0.25);
                if column > 0 {
                    assert!(
                        here[0] > AMG88[row * 8 + column - 1][0] + 5.0,
                        "columns to the right"
                    );
                }
                if row > 0 {
                    assert!(
                        here[1] < AMG88[(row - 1) * 8 + column][1] - 5.0,
                        "rows downwards"
                    );
                }
            }
        }
    }
}
