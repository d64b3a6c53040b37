use crate::cuboid::Cuboid;
use glam::DVec3;

/// A surface of flat, convex faces in the room.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Solid {
    vertices_m: Vec<DVec3>,
    /// Indices into `vertices_m`, face after face, counter-clockwise as seen from outside.
    corners: Vec<usize>,
    /// Where each face's corners begin in `corners`; one more at the end.
    starts: Vec<usize>,
    /// Whether the faces enclose a space; only their outsides can be seen then.
    closed: bool,
}

/// The corners of a cuboid's faces, counter-clockwise as seen from outside, as `Cuboid::corners_in_world` counts them.
const CUBOID_FACES: [[usize; 4]; 6] = [
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 2, 3, 1],
    [4, 5, 7, 6],
];

impl Solid {
    /// The faces of a cuboid.
    pub(crate) fn of_cuboid(cuboid: &Cuboid) -> Self {
        Self {
            vertices_m: cuboid.corners_in_world().to_vec(),
            corners: CUBOID_FACES.concat(),
            starts: (0..=CUBOID_FACES.len()).map(|face| 4 * face).collect(),
            closed: true,
        }
    }

    pub(crate) fn vertices_m(&self) -> &[DVec3] {
        &self.vertices_m
    }

    pub(crate) const fn is_closed(&self) -> bool {
        self.closed
    }

    /// The faces, each as the indices of its corners.
    pub(crate) fn faces(&self) -> impl Iterator<Item = &[usize]> {
        self.starts
            .windows(2)
            .map(|pair| &self.corners[pair[0]..pair[1]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cuboids_faces_look_outwards() {
        let cuboid = Cuboid::new(DVec3::new(1.0, 2.0, 0.5), DVec3::new(2.0, 1.0, 3.0), 30.0);
        let middle = DVec3::new(1.0, 2.0, 2.0);
        let solid = Solid::of_cuboid(&cuboid);
        let mut area_m2 = 0.0;
        for face in solid.faces() {
            let at = |corner: usize| solid.vertices_m()[face[corner]];
            let normal = (at(1) - at(0)).cross(at(3) - at(0));
            assert!(normal.dot(at(0) - middle) > 0.0);
            assert!((at(0) + at(2) - at(1) - at(3)).length() < 1e-12, "flat");
            area_m2 += normal.length();
        }
        assert!((area_m2 - 22.0).abs() < 1e-12);
    }
}
