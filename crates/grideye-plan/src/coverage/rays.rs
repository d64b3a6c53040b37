//! Intersects straight lines with a room: whether a point is visible from another, and what is above a point of the
//! floor.

use crate::plane::Plane;
use glam::{DVec2, DVec3};
use grideye_scene::{Mesh, Scene};

#[derive(Debug, Clone)]
pub(crate) struct Blockers {
    meshes: Vec<Blocker>,
    /// The walls that jut into the room: they hide things, and nobody stands on them.
    walls: Option<Blocker>,
}

#[derive(Debug, Clone)]
struct Blocker {
    low: DVec3,
    high: DVec3,
    faces: Vec<Vec<DVec3>>,
    is_closed: bool,
}

impl Blockers {
    pub(crate) fn new(scene: &Scene) -> Self {
        let meshes = scene.objects().iter().map(|object| &object.mesh);
        Self {
            meshes: meshes.map(Blocker::new).collect(),
            walls: scene.screen().map(|walls| Blocker::new(&walls.mesh)),
        }
    }

    pub(crate) fn are_in_sight(&self, from_m: DVec3, to_m: DVec3) -> bool {
        let ray = Ray::new(from_m, to_m - from_m);
        // A line that starts or ends in a face only touches it.
        let is_between = |share: &f64| (1e-12..1.0 - 1e-12).contains(share);
        let mut all = self.meshes.iter().chain(&self.walls);
        all.all(|mesh| !mesh.crossings(&ray, 1.0).any(|share| is_between(&share)))
    }

    /// The intervals of height, in meters, that something occupies above a point of the floor, unordered.
    pub(crate) fn column(&self, at_m: DVec2) -> Vec<(f64, f64)> {
        let up = Ray::new(at_m.extend(0.0), DVec3::Z);
        let meshes = self.meshes.iter();
        meshes.flat_map(|mesh| mesh.column(&up)).collect()
    }

    pub(crate) fn contain(&self, point_m: DVec3) -> bool {
        let mut spans = self.column(point_m.truncate()).into_iter();
        spans.any(|(low, high)| low < point_m.z && point_m.z < high)
    }
}

impl Blocker {
    fn new(mesh: &Mesh) -> Self {
        let (low, high) = mesh.bounds_m();
        let vertices_m = mesh.vertices_m();
        let corners = |face: &[usize]| face.iter().map(|corner| vertices_m[*corner]).collect();
        Self {
            low,
            high,
            faces: mesh.faces().map(corners).collect(),
            is_closed: mesh.is_closed(),
        }
    }

    /// Where a ray crosses its faces, as shares of the ray's way; none if the part up to `end` misses the bounding box.
    fn crossings<'a>(&'a self, ray: &'a Ray, end: f64) -> impl Iterator<Item = f64> + 'a {
        let to_m = ray.from_m + end * ray.way_m;
        let (low, high) = (ray.from_m.min(to_m), ray.from_m.max(to_m));
        let misses = self.low.cmpgt(high).any() || self.high.cmplt(low).any();
        let faces = self.faces.iter().filter(move |_| !misses);
        faces.filter_map(|face| ray.crossing(face))
    }

    fn column(&self, up: &Ray) -> Vec<(f64, f64)> {
        let from_below = Ray {
            from_m: up.from_m.with_z(self.low.z),
            ..*up
        };
        let heights = self.crossings(&from_below, self.high.z - self.low.z);
        let mut heights: Vec<f64> = heights.map(|height| self.low.z + height).collect();
        heights.sort_by(f64::total_cmp);
        let size = if self.is_closed { 2 } else { 1 };
        let spans = heights.chunks_exact(size);
        spans.map(|span| (span[0], span[size - 1])).collect()
    }
}

/// A straight line from a point.
struct Ray {
    from_m: DVec3,
    way_m: DVec3,
    /// At right angles to it.
    across: (DVec3, DVec3),
}

impl Ray {
    fn new(from_m: DVec3, way_m: DVec3) -> Self {
        Self {
            from_m,
            way_m,
            across: way_m.normalize_or(DVec3::Z).any_orthonormal_pair(),
        }
    }

    /// Where it crosses a face, as a share of its way; on an edge that two faces share only one counts.
    fn crossing(&self, face: &[DVec3]) -> Option<f64> {
        let flat = |corner: &DVec3| {
            let away = *corner - self.from_m;
            DVec2::new(away.dot(self.across.0), away.dot(self.across.1))
        };
        let mut is_within = false;
        let mut from = flat(face.last()?);
        for corner in face {
            let to = flat(corner);
            if (from.y > 0.0) != (to.y > 0.0) {
                is_within ^= 0.0 < from.x - from.y / (to.y - from.y) * (to.x - from.x);
            }
            from = to;
        }
        let plane = Plane::of_face(face).filter(|_| is_within)?;
        let slope = plane.normal.dot(self.way_m);
        (slope != 0.0).then(|| -plane.height_m(self.from_m) / slope)
    }
}

pub(crate) fn edges(outline: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> {
    let next = outline.iter().cycle().skip(1);
    outline.iter().copied().zip(next.copied())
}
