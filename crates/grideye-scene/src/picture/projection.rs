//! Projects the corners and faces of a mesh through a pinhole onto a grid of points.

use crate::geometry::{Enclosure, Mesh, Pose, area_vector, count, winding};
use crate::model::Sensor;
use glam::DVec3;
use std::ops::Range;

/// The most cells that any processor shades at once; rows are padded by this many.
pub(crate) const LANES_MAX: usize = 8;

/// A plane of points in front of a pinhole, `focal_points` away (PeerJ CS 11:e3124, "Sensor model implementation").
///
/// The ray of a cell is `(1, left, up)` in the sensor's axes. Depth, in meters forward, identifies a place on it.
#[derive(Debug, Clone)]
pub(crate) struct SamplingGrid {
    columns: usize,
    /// Slope to the left of each column of points, meters per meter forward; decreasing, and padded beyond the grid.
    slopes_left: Vec<f64>,
    /// Its square.
    slopes_left2: Vec<f64>,
    /// Slope upwards of each row of points, decreasing.
    slopes_up: Vec<f64>,
    /// Distance of the plane on each axis, in that axis's points.
    focal_points: [f64; 2],
}

impl SamplingGrid {
    pub(crate) fn new(sensor: &Sensor) -> Self {
        let focal =
            |points: usize, angle_rad: f64| 0.5 * count::float(points) / libm::tan(0.5 * angle_rad);
        let focal_points = [
            focal(sensor.grid_points.x, sensor.field_of_view_rad.x),
            focal(sensor.grid_points.y, sensor.field_of_view_rad.y),
        ];
        let columns = sensor.grid_points.x;
        let slopes_left = slopes(columns, columns + LANES_MAX, focal_points[0]);
        Self {
            columns,
            slopes_left2: slopes_left.iter().map(|slope| slope * slope).collect(),
            slopes_left,
            slopes_up: slopes(sensor.grid_points.y, sensor.grid_points.y, focal_points[1]),
            focal_points,
        }
    }

    #[inline(always)]
    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    pub(crate) fn rows(&self) -> usize {
        self.slopes_up.len()
    }

    /// The slopes to the left of these columns, and their squares; [`LANES_MAX`] more exist than columns.
    #[inline(always)]
    pub(crate) fn slopes_left(&self, columns: Range<usize>) -> (&[f64], &[f64]) {
        (
            &self.slopes_left[columns.clone()],
            &self.slopes_left2[columns],
        )
    }

    #[inline(always)]
    pub(crate) fn slope_up(&self, row: usize) -> f64 {
        self.slopes_up[row]
    }

    pub(crate) fn patches(&self, sight: &Sight) -> Vec<Patch> {
        match sight {
            Sight::Inside(touching) => vec![self.patch_all_around(touching)],
            Sight::Outside(faces) => faces.iter().filter_map(|face| self.patch(face)).collect(),
        }
    }

    fn patch(&self, face: &SeenFace) -> Option<Patch> {
        let corners = || face.corners.iter().copied();
        let rows = self.rows_of(corners())?;
        let next = corners().cycle().skip(1);
        let sides = corners()
            .zip(next)
            .map(|(from, to)| from.cross(to) * face.orientation)
            .chain([face.inverse_depth]);
        Some(Patch {
            rows,
            bounds: self.bounds(sides),
            inverse_depth: face.inverse_depth,
            face: face.face,
            // A flat face is farthest away at a corner, and no point of it is nearer than its smallest depth.
            distances_m: (
                corners().fold(f64::INFINITY, |depth_m, corner| depth_m.min(corner.x)),
                corners().fold(0.0, |distance_m, corner| distance_m.max(corner.length())),
            ),
        })
    }

    fn rows_of(&self, corners: impl Iterator<Item = DVec3>) -> Option<Range<usize>> {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for corner in corners {
            if corner.x <= 0.0 {
                return Some(0..self.rows());
            }
            let row = 0.5 * count::float(self.rows()) - self.focal_points[1] * corner.z / corner.x;
            (low, high) = (low.min(row), high.max(row));
        }
        // One more row on each side against rounding, but none beyond the grid.
        let rows = count::floor(low - 1.5)..count::floor(high + 1.5).min(self.rows());
        (!rows.is_empty()).then_some(rows)
    }

    /// For each row, the columns where no `side · (1, left, up)` is negative.
    fn bounds(&self, sides: impl Iterator<Item = DVec3>) -> Bounds {
        let columns_half = 0.5 * count::float(self.columns());
        let column_of = |left: f64| columns_half - self.focal_points[0] * left - 0.5;
        let mut bounds = Bounds::default();
        for side in sides {
            if side.y == 0.0 {
                bounds.along_rows.push(Line {
                    start: side.x,
                    step: side.z,
                });
                continue;
            }
            let line = Line {
                start: column_of(-side.x / side.y),
                step: self.focal_points[0] * side.z / side.y,
            };
            // Columns run to the right, slopes to the left.
            if side.y > 0.0 {
                bounds.last.push(line);
            } else {
                bounds.first.push(line);
            }
        }
        bounds
    }

    /// The patch of a mesh around the sensor, at zero distance, without rays that leave through a touched face.
    fn patch_all_around(&self, touching: &[DVec3]) -> Patch {
        Patch {
            rows: 0..self.rows(),
            bounds: self.bounds(touching.iter().map(|normal| -*normal)),
            inverse_depth: AT_NO_DISTANCE,
            face: NO_FACE,
            distances_m: (0.0, f64::INFINITY),
        }
    }
}

#[derive(Debug, Clone)]
pub(crate) enum Sight {
    /// Inside the mesh or on it, touching faces with these outward normals: only directions out of one of these do not
    /// see it.
    Inside(Vec<DVec3>),
    /// The faces seen from outside.
    Outside(Vec<SeenFace>),
}

#[derive(Debug, Clone)]
pub(crate) struct SeenFace {
    pub(crate) face: usize,
    pub(crate) corners: Vec<DVec3>,
    /// Its product with a ray `(1, left, up)` is the inverse depth where the ray meets the face's plane.
    pub(crate) inverse_depth: DVec3,
    /// 1 if the corners run counter-clockwise as seen along the ray, -1 if clockwise.
    pub(crate) orientation: f64,
}

impl Sight {
    pub(crate) fn new(pose: &Pose, mesh: &Mesh, moved_m: DVec3) -> Self {
        let in_sensor: Vec<DVec3> = mesh
            .vertices_m()
            .iter()
            .map(|vertex| pose.point_in_sensor(*vertex + moved_m))
            .collect();
        if let Some(touching) = enclosure(mesh, &in_sensor) {
            return Self::Inside(touching);
        }
        let seen = |(index, face)| SeenFace::new((index, face), &in_sensor, mesh.enclosure());
        Self::Outside(mesh.faces().enumerate().filter_map(seen).collect())
    }
}

impl SeenFace {
    /// `None` if the face is seen from inside or edge-on.
    fn new(
        (index, face): (usize, &[usize]),
        in_sensor: &[DVec3],
        enclosure: Enclosure,
    ) -> Option<Self> {
        let mut corners: Vec<DVec3> = face.iter().map(|corner| in_sensor[*corner]).collect();
        drop_twins(&mut corners);
        let anchor = *corners.first()?;
        let normal = area_vector(corners.iter().copied());
        let offset = normal.dot(anchor);
        let faces_the_sensor = match enclosure {
            Enclosure::Open => offset != 0.0,
            Enclosure::Closed | Enclosure::Convex => offset < 0.0,
        };
        faces_the_sensor.then(|| Self {
            face: index,
            corners,
            inverse_depth: normal / offset,
            orientation: offset.signum(),
        })
    }
}

/// Drops corners that coincide with the previous one, because rounding alone would direct the side between them.
fn drop_twins(corners: &mut Vec<DVec3>) {
    corners.dedup_by(|corner, before| corner.distance_squared(*before) <= TWINS_M * TWINS_M);
    while let [first, .., last] = corners[..] {
        if first.distance_squared(last) > TWINS_M * TWINS_M {
            break;
        }
        corners.pop();
    }
}

/// Corners this close coincide, meters: as [`TOUCH_M`], far below what any sensor resolves.
const TWINS_M: f64 = 1e-9;

/// A flat, convex face as seen by the sensor: the cells it covers, and its depth in each.
#[derive(Debug, Clone)]
pub(crate) struct Patch {
    rows: Range<usize>,
    bounds: Bounds,
    /// Its product with a ray is the inverse depth where the ray meets the face's plane.
    inverse_depth: DVec3,
    /// Bounds on the distance of its points.
    distances_m: (f64, f64),
    face: usize,
}

/// The lines across the grid that bound a patch, grouped by side.
#[derive(Debug, Clone, Default)]
struct Bounds {
    /// Columns from the line on.
    first: Vec<Line>,
    /// Columns up to the line.
    last: Vec<Line>,
    /// Lines along the rows: all columns where the sum is not negative.
    along_rows: Vec<Line>,
}

/// `start + step * up` is the column where it crosses a row.
#[derive(Debug, Clone, Copy)]
struct Line {
    start: f64,
    step: f64,
}

impl Line {
    #[inline(always)]
    fn at(&self, up: f64) -> f64 {
        self.start + self.step * up
    }
}

impl Patch {
    pub(crate) fn rows(&self) -> Range<usize> {
        self.rows.clone()
    }

    #[inline(always)]
    pub(crate) fn columns(&self, up: f64, count: usize) -> Range<usize> {
        if self.bounds.along_rows.iter().any(|line| line.at(up) < 0.0) {
            return 0..0;
        }
        let (mut first, mut last) = (0.0, count::float(count) - 1.0);
        for line in &self.bounds.first {
            let at = line.at(up);
            first = if at > first { at } else { first };
        }
        for line in &self.bounds.last {
            let at = line.at(up);
            last = if at < last { at } else { last };
        }
        if first > last {
            return 0..0;
        }
        count::floor(first.ceil())..count::floor(last) + 1
    }

    /// The inverse depth in a row: its value at zero slope to the left, and its change per unit of slope.
    #[inline(always)]
    pub(crate) fn inverse_depth(&self, up: f64) -> (f64, f64) {
        (
            self.inverse_depth.x + self.inverse_depth.z * up,
            self.inverse_depth.y,
        )
    }

    pub(crate) fn face(&self) -> usize {
        self.face
    }

    pub(crate) fn distances_m(&self) -> (f64, f64) {
        self.distances_m
    }
}

const NO_FACE: usize = usize::MAX;

/// The inverse of zero depth: large enough to show a body at its own temperature, finite so that two can be compared.
const AT_NO_DISTANCE: DVec3 = DVec3::new(1e30, 0.0, 0.0);

const TOUCH_M: f64 = 1e-9;

/// If the sensor is inside a closed mesh or on a convex one: the outward normals of the faces it touches.
fn enclosure(mesh: &Mesh, in_sensor: &[DVec3]) -> Option<Vec<DVec3>> {
    match mesh.enclosure() {
        Enclosure::Open => return None,
        Enclosure::Closed => return (winding(mesh, in_sensor) > 0.5).then(Vec::new),
        Enclosure::Convex => {}
    }
    let mut touching = Vec::new();
    for face in mesh.faces() {
        let corners = || face.iter().map(|corner| in_sensor[*corner]);
        let anchor = corners().next()?;
        let outward = area_vector(corners()).normalize_or_zero();
        let outside_m = -outward.dot(anchor);
        if outside_m > TOUCH_M {
            return None;
        }
        if outside_m > -TOUCH_M {
            touching.push(outward);
        }
    }
    Some(touching)
}

fn slopes(points: usize, count: usize, focal_points: f64) -> Vec<f64> {
    (0..count)
        .map(|index| (0.5 * count::float(points) - (count::float(index) + 0.5)) / focal_points)
        .collect()
}
