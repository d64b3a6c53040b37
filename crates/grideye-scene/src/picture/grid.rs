//! The paper's sampling grid, as simple as its text: the reference for [`super::area`], a hundred times as slow.
//!
//! Points on a plane in front of a pinhole, each with the nearest surface on its ray, resized to the sensor's pixels
//! (PeerJ CS 11:e3124, "Sensor model implementation").

use crate::geometry::{Pose, count, polygon::bounds};
use crate::model::Sensor;
use crate::picture::resample::resized;
use crate::picture::subject::{NOBODY, SeenFace, Subject};
use crate::radiometry::{Air, Glow};
use glam::{DVec2, DVec3, USizeVec2};
use std::ops::Range;

#[derive(Debug, Clone)]
pub(crate) struct Grid {
    pose: Pose,
    air: Air,
    points: USizeVec2,
    pixels: USizeVec2,
    /// Distance of the plane on each axis, in that axis's points.
    focal_points: DVec2,
    still: Vec<Face>,
}

#[derive(Debug, Clone)]
struct Face {
    seen: SeenFace,
    glow: Glow,
    owner: u32,
}

/// What a point shows: the inverse depth, °C above ambient, and the owner.
type Point = (f64, f64, u32);

/// Surfaces with a smaller relative difference of depth are at the same depth.
const SAME_DEPTH: f64 = 1e-9;

impl Grid {
    pub(crate) fn new(air: Air, sensor: &Sensor, standing: &[Subject<'_>]) -> Self {
        let points = sensor.grid_points;
        let half = 0.5 * DVec2::new(count::float(points.x), count::float(points.y));
        let mut grid = Self {
            pose: sensor.pose,
            air,
            points,
            pixels: USizeVec2::new(sensor.columns, sensor.rows),
            focal_points: half / sensor.view_slopes(),
            still: Vec::new(),
        };
        grid.still = grid.faces(standing);
        grid
    }

    /// The image, °C, and of each of so many agents the share of each pixel, seen and if nothing hid the agent.
    pub(crate) fn image(
        &self,
        moving: &[Subject<'_>],
        agents: usize,
    ) -> (Vec<f64>, Vec<[Vec<f64>; 2]>) {
        let moving = self.faces(moving);
        let points = self.cast(self.still.iter().chain(&moving));
        let excess: Vec<f64> = points.iter().map(|point| point.1).collect();
        let celsius = resized(&excess, self.points, self.pixels)
            .into_iter()
            .map(|excess_c| self.air.ambient_c() + excess_c);
        let of_owner = |owner: u32| {
            let alone = self.cast(moving.iter().filter(|face| face.owner == owner));
            [&points, &alone].map(|points| {
                let is_own = points
                    .iter()
                    .map(|(.., of)| f64::from(u8::from(*of == owner)));
                resized(&is_own.collect::<Vec<f64>>(), self.points, self.pixels)
            })
        };
        (
            celsius.collect(),
            (0..).take(agents).map(of_owner).collect(),
        )
    }

    fn faces(&self, subjects: &[Subject<'_>]) -> Vec<Face> {
        let faces = subjects.iter().flat_map(|subject| {
            let seen = subject.faces(&self.pose).into_owned().into_iter();
            seen.map(|seen| Face {
                glow: self.air.glow(subject.of_face(seen.face)),
                owner: subject.owner,
                seen,
            })
        });
        faces.collect()
    }

    /// The nearest face at each point, row by row; of faces at the same depth the warmer.
    fn cast<'a>(&self, faces: impl Iterator<Item = &'a Face>) -> Vec<Point> {
        let mut points = vec![(0.0, 0.0, NOBODY); self.points.element_product()];
        for face in faces {
            let sides: Vec<DVec3> = face.seen.sides().collect();
            let [columns, rows] = self.around(&face.seen.corners);
            for (row, column) in
                rows.flat_map(|row| columns.clone().map(move |column| (row, column)))
            {
                let ray = self.ray(row, column);
                if sides.iter().any(|side| side.dot(ray) < 0.0) {
                    continue;
                }
                let depth = face.seen.inverse_depth.dot(ray);
                let excess_c = self
                    .air
                    .excess(&face.glow, ray.length_squared() / (depth * depth));
                let point = &mut points[row * self.points.x + column];
                let margin = SAME_DEPTH * point.0;
                let as_near = depth >= point.0 - margin && excess_c > point.1;
                if depth > point.0 + margin || as_near {
                    *point = (depth, excess_c, face.owner);
                }
            }
        }
        points
    }

    /// The ray through a point: `(1, left, up)` in the sensor's axes.
    fn ray(&self, row: usize, column: usize) -> DVec3 {
        let half = 0.5 * DVec2::new(count::float(self.points.x), count::float(self.points.y));
        let at = DVec2::new(count::float(column), count::float(row)) + 0.5;
        let slopes = (half - at) / self.focal_points;
        DVec3::new(1.0, slopes.x, slopes.y)
    }

    /// The columns and rows that hold a face: all if a corner is not in front of the sensor.
    fn around(&self, corners: &[DVec3]) -> [Range<usize>; 2] {
        let half = 0.5 * DVec2::new(count::float(self.points.x), count::float(self.points.y));
        let in_points = corners.iter().map(|corner| {
            half - self.focal_points * DVec2::new(corner.y, corner.z) / corner.x.max(0.0)
        });
        let (low, high) = match corners.iter().all(|corner| corner.x > 0.0) {
            true => bounds(in_points),
            false => (DVec2::ZERO, 2.0 * half),
        };
        let range = |low: f64, high: f64, all: usize| {
            count::floor(low - 1.0)..count::floor(high + 2.0).min(all)
        };
        [
            range(low.x, high.x, self.points.x),
            range(low.y, high.y, self.points.y),
        ]
    }
}
