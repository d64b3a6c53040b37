//! Intersects straight lines with a room: whether a point is visible from another, and what is above a point of the
//! floor.

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
        let mut all = self.meshes.iter().chain(&self.walls);
        all.all(|mesh| !mesh.is_met(from_m, to_m))
    }

    /// The intervals of height, in meters, that something occupies above a point of the floor, unordered.
    pub(crate) fn column(&self, at_m: DVec2) -> Vec<(f64, f64)> {
        let meshes = self.meshes.iter();
        meshes.flat_map(|mesh| mesh.column(at_m)).collect()
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

    fn is_met(&self, from_m: DVec3, to_m: DVec3) -> bool {
        // A line that misses the bounding box misses the mesh.
        let (low, high) = (from_m.min(to_m), from_m.max(to_m));
        if self.low.cmpgt(high).any() || self.high.cmplt(low).any() {
            return false;
        }
        self.faces.iter().any(|face| meets(face, from_m, to_m))
    }

    fn column(&self, at_m: DVec2) -> Vec<(f64, f64)> {
        let misses =
            at_m.cmplt(self.low.truncate()).any() || at_m.cmpgt(self.high.truncate()).any();
        if misses {
            return Vec::new();
        }
        let faces = self.faces.iter();
        let mut heights: Vec<f64> = faces.filter_map(|face| height(face, at_m)).collect();
        heights.sort_by(f64::total_cmp);
        if self.is_closed {
            heights
                .chunks_exact(2)
                .map(|pair| (pair[0], pair[1]))
                .collect()
        } else {
            heights.into_iter().map(|height| (height, height)).collect()
        }
    }
}

fn meets(face: &[DVec3], from_m: DVec3, to_m: DVec3) -> bool {
    let [first, second, third, ..] = face else {
        return false;
    };
    let normal = (*second - *first).cross(*third - *first);
    let (before, behind) = (normal.dot(from_m - *first), normal.dot(to_m - *first));
    // A line that starts or ends in the face only touches it.
    if before * behind >= 0.0 {
        return false;
    }
    let point = from_m.lerp(to_m, before / (before - behind));
    let next = face.iter().cycle().skip(1);
    let mut sides = face
        .iter()
        .zip(next)
        .map(|(from, to)| normal.dot((*to - *from).cross(point - *from)));
    sides.all(|side| side >= 0.0)
}

/// The height where the vertical through a point meets a face; on a shared edge only one face counts.
fn height(face: &[DVec3], at_m: DVec2) -> Option<f64> {
    let next = face.iter().cycle().skip(1);
    let mut is_within = false;
    for (from, to) in face.iter().zip(next) {
        if (from.y > at_m.y) != (to.y > at_m.y) {
            let share = (at_m.y - from.y) / (to.y - from.y);
            is_within ^= at_m.x < from.x + share * (to.x - from.x);
        }
    }
    let (first, rest) = face.split_first()?;
    let normal: DVec3 = rest
        .windows(2)
        .map(|pair| (pair[0] - *first).cross(pair[1] - *first))
        .sum();
    (is_within && normal.z != 0.0)
        .then(|| first.z - normal.truncate().dot(at_m - first.truncate()) / normal.z)
}

pub(crate) fn edges(outline: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> {
    let next = outline.iter().cycle().skip(1);
    outline.iter().copied().zip(next.copied())
}
