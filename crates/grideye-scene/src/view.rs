use crate::count;
use crate::cuboid::Cuboid;
use crate::pose::Pose;
use crate::scene::Sensor;
use glam::{DMat3, DVec3};
use std::ops::Range;

/// A sensor's sampling grid: a plane of points before a pinhole, `focal_points` away from it, each the middle of a
/// cell (PeerJ CS 11:e3124, "Sensor model implementation": 300 x 300 points at 259.81 for 60° and 5 points a degree).
#[derive(Debug, Clone)]
pub(crate) struct View {
    pose: Pose,
    /// Slope to the left of each column of points, metres for each metre forward.
    slopes_left: Vec<f64>,
    /// Slope upwards of each row of points.
    slopes_up: Vec<f64>,
    /// Distance of the plane on each axis, in that axis's points.
    focal_points: [f64; 2],
}

/// The cells that a shape may cover.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Window {
    pub(crate) columns: Range<usize>,
    pub(crate) rows: Range<usize>,
}

/// A ray's first meeting with a shape.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hit {
    /// Metres forward along the optical axis; along one ray it orders surfaces as their distance does.
    pub(crate) depth_m: f64,
    /// Square of the distance from the sensor.
    pub(crate) distance_m2: f64,
}

impl View {
    pub(crate) fn new(sensor: &Sensor) -> Self {
        let focal =
            |points: usize, angle_rad: f64| 0.5 * count::float(points) / libm::tan(0.5 * angle_rad);
        let focal_points = [
            focal(sensor.grid_points.x, sensor.field_of_view_rad.x),
            focal(sensor.grid_points.y, sensor.field_of_view_rad.y),
        ];
        Self {
            pose: sensor.pose,
            slopes_left: slopes(sensor.grid_points.x, focal_points[0]),
            slopes_up: slopes(sensor.grid_points.y, focal_points[1]),
            focal_points,
        }
    }

    pub(crate) fn columns(&self) -> usize {
        self.slopes_left.len()
    }

    pub(crate) fn rows(&self) -> usize {
        self.slopes_up.len()
    }

    /// The cells that the shape may cover, or `None` if it is behind the sensor or beside its view.
    pub(crate) fn window(&self, shape: &Cuboid) -> Option<Window> {
        let corners = shape
            .corners_in_world()
            .map(|corner_in_world| self.pose.point_in_sensor(corner_in_world));
        if self.is_close(shape) {
            return Some(Window {
                columns: 0..self.columns(),
                rows: 0..self.rows(),
            });
        }
        let mut bounds = Bounds::default();
        for corner in corners.iter().filter(|corner| corner.x >= NEAR_PLANE_M) {
            bounds.add(self.point_on_plane(*corner));
        }
        for (from, to) in edges() {
            if let Some(crossing_in_sensor) = crossing(corners[from], corners[to]) {
                bounds.add(self.point_on_plane(crossing_in_sensor));
            }
        }
        let window = Window {
            columns: bounds.cells(0, self.columns()),
            rows: bounds.cells(1, self.rows()),
        };
        (!window.columns.is_empty() && !window.rows.is_empty()).then_some(window)
    }

    /// The rays of one row against one shape: a function from column to the first meeting.
    ///
    /// A sensor inside the shape meets it at once, at distance 0; a ray that runs in the plane of a face misses it.
    pub(crate) fn row_of_rays<'a>(
        &'a self,
        shape: &Cuboid,
        row: usize,
    ) -> impl Fn(usize) -> Option<Hit> + 'a {
        let box_from_world = shape.box_from_world();
        let origin_in_box = box_from_world * (self.pose.position_m - shape.centre_m());
        let box_from_sensor: DMat3 = box_from_world * self.pose.world_from_sensor();
        let half_m = shape.half_m();
        let up = self.slopes_up[row];
        let row_direction = box_from_sensor.x_axis + up * box_from_sensor.z_axis;
        move |column| {
            let left = self.slopes_left[column];
            let depth_m = slab_entry(
                half_m,
                origin_in_box,
                row_direction + left * box_from_sensor.y_axis,
            )?;
            let distance_m2 = depth_m * depth_m * (1.0 + left * left + up * up);
            Some(Hit {
                depth_m,
                distance_m2,
            })
        }
    }

    /// Whether the sensor is in the shape, or so close that a corner ray could meet it before the near plane.
    fn is_close(&self, shape: &Cuboid) -> bool {
        let widest = |slopes: &[f64]| slopes.first().map_or(0.0, |slope| slope.abs());
        let (left, up) = (widest(&self.slopes_left), widest(&self.slopes_up));
        let margin_m = 2.0 * NEAR_PLANE_M * (1.0 + left * left + up * up).sqrt();
        let origin_in_box = shape.box_from_world() * (self.pose.position_m - shape.centre_m());
        origin_in_box.abs().cmple(shape.half_m() + margin_m).all()
    }

    /// Column and row on the plane, as numbers with a fraction: cell n lies between n and n + 1.
    fn point_on_plane(&self, point_in_sensor: DVec3) -> [f64; 2] {
        [
            0.5 * count::float(self.columns())
                - self.focal_points[0] * point_in_sensor.y / point_in_sensor.x,
            0.5 * count::float(self.rows())
                - self.focal_points[1] * point_in_sensor.z / point_in_sensor.x,
        ]
    }
}

/// What is nearer than this along the axis is not projected, but handled by [`View::is_close`].
const NEAR_PLANE_M: f64 = 1e-6;

fn slopes(points: usize, focal_points: f64) -> Vec<f64> {
    (0..points)
        .map(|index| (0.5 * count::float(points) - (count::float(index) + 0.5)) / focal_points)
        .collect()
}

/// The twelve edges of a cuboid, as pairs of corner indices that differ in one bit.
fn edges() -> impl Iterator<Item = (usize, usize)> {
    (0..8)
        .flat_map(|from| [1, 2, 4].map(|bit| (from, from | bit)))
        .filter(|(from, to)| from != to)
}

/// Where an edge passes through the near plane.
fn crossing(from: DVec3, to: DVec3) -> Option<DVec3> {
    if (from.x >= NEAR_PLANE_M) == (to.x >= NEAR_PLANE_M) {
        return None;
    }
    let share = ((NEAR_PLANE_M - from.x) / (to.x - from.x)).clamp(0.0, 1.0);
    Some(from.lerp(to, share).with_x(NEAR_PLANE_M))
}

struct Bounds {
    low: [f64; 2],
    high: [f64; 2],
}

impl Default for Bounds {
    fn default() -> Self {
        Self {
            low: [f64::INFINITY; 2],
            high: [f64::NEG_INFINITY; 2],
        }
    }
}

impl Bounds {
    fn add(&mut self, point: [f64; 2]) {
        for (axis, coordinate) in point.into_iter().enumerate() {
            self.low[axis] = self.low[axis].min(coordinate);
            self.high[axis] = self.high[axis].max(coordinate);
        }
    }

    /// The cells between the bounds, one more on either side against rounding, none beyond the grid.
    fn cells(&self, axis: usize, count: usize) -> Range<usize> {
        if self.low[axis] > self.high[axis] {
            return 0..0;
        }
        count::floor(self.low[axis] - 1.0)..count::floor(self.high[axis] + 2.0).min(count)
    }
}

/// Forward depth of the first meeting of a ray with a box around the origin of its own axes.
fn slab_entry(half: DVec3, origin: DVec3, direction: DVec3) -> Option<f64> {
    let inverse = direction.recip();
    // In the plane of a face 0 * inf is not-a-number; min and max take the other value, which makes it a miss.
    let (one, other) = ((-half - origin) * inverse, (half - origin) * inverse);
    let near = one
        .x
        .min(other.x)
        .max(one.y.min(other.y))
        .max(one.z.min(other.z))
        .max(0.0);
    let far = one
        .x
        .max(other.x)
        .min(one.y.max(other.y))
        .min(one.z.max(other.z));
    (near <= far && far > 0.0).then_some(near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slabs_are_entered_from_outside_inside_and_not_from_behind() {
        let half = DVec3::ONE;
        assert_eq!(
            slab_entry(half, DVec3::new(-3.0, 0.5, 0.5), DVec3::X),
            Some(2.0)
        );
        assert_eq!(slab_entry(half, DVec3::new(3.0, 0.5, 0.5), DVec3::X), None);
        assert_eq!(
            slab_entry(half, DVec3::new(0.5, 0.5, 0.5), DVec3::X),
            Some(0.0)
        );
        assert_eq!(slab_entry(half, DVec3::new(-3.0, 1.5, 0.0), DVec3::X), None);
        assert_eq!(
            slab_entry(half, DVec3::new(1.0, 0.0, 0.0), DVec3::X),
            None,
            "mounted on the face, looking away"
        );
        assert_eq!(
            slab_entry(half, DVec3::new(-1.0, 0.0, 0.0), DVec3::X),
            Some(0.0),
            "at the face, looking in"
        );
        assert_eq!(
            slab_entry(half, DVec3::new(-3.0, 1.0, 0.0), DVec3::X),
            None,
            "in the plane of a face"
        );
    }

    #[test]
    fn there_are_twelve_edges() {
        let edges: Vec<_> = edges().collect();
        assert_eq!(edges.len(), 12);
        assert!(edges.iter().all(|(from, to)| (from ^ to).count_ones() == 1));
    }
}
