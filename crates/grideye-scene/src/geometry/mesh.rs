//! Surfaces of flat faces: cuboids, pyramids, any polyhedron, and round bodies as polyhedra of many faces.

use super::cuboid::Cuboid;
use super::polygon::{CUTTING_STEPS_MAX, FLAT, convex_pieces};
use super::{count, polygon};
use glam::{DMat3, DVec3};
use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::{Arc, LazyLock};

/// A surface of flat, convex faces.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    vertices_m: Vec<DVec3>,
    /// Shared, because scenes have many meshes that differ only in their vertices.
    faces: Arc<Faces>,
    enclosure: Enclosure,
}

#[derive(Debug, Clone, PartialEq)]
struct Faces {
    /// Indices into the vertices, face after face, counter-clockwise as seen from outside.
    corners: Vec<usize>,
    /// Where each face's corners start in `corners`, then the length of `corners`.
    starts: Vec<usize>,
    /// For each face, the index of the original face that it is or is part of.
    given: Vec<usize>,
}

/// The kind of space that the faces enclose. A closed surface is visible only from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Enclosure {
    /// None: a sheet, visible from both sides.
    Open,
    /// A space that may have dents or holes.
    Closed,
    /// A space without dents or holes.
    Convex,
}

/// Rings of a round body; each has twice as many faces.
const RINGS: usize = 16;

/// The corners of a cuboid's faces, counter-clockwise as seen from outside, numbered as in `Cuboid::corners_in_world`.
const CUBOID_FACES: [[usize; 4]; 6] = [
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 2, 3, 1],
    [4, 5, 7, 6],
];

impl Mesh {
    /// The faces of a cuboid in place.
    #[must_use]
    pub fn of_cuboid(cuboid: &Cuboid) -> Self {
        static FACES: LazyLock<Arc<Faces>> = LazyLock::new(|| {
            Arc::new(Faces {
                corners: CUBOID_FACES.concat(),
                starts: (0..=CUBOID_FACES.len()).map(|face| 4 * face).collect(),
                given: (0..CUBOID_FACES.len()).collect(),
            })
        });
        Self {
            vertices_m: cuboid.corners_in_world().to_vec(),
            faces: Arc::clone(&FACES),
            enclosure: Enclosure::Convex,
        }
    }

    /// A pyramid with its base centered on the origin; `size_m` is the base's sides and the height.
    #[must_use]
    pub fn pyramid(size_m: DVec3) -> Self {
        let (x, y) = (0.5 * size_m.x, 0.5 * size_m.y);
        let base = [(-x, -y), (x, -y), (x, y), (-x, y)];
        let mut vertices_m = base.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
        vertices_m.push(DVec3::new(0.0, 0.0, size_m.z));
        let faces = Faces {
            corners: vec![0, 3, 2, 1, 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4],
            starts: vec![0, 4, 7, 10, 13, 16],
            given: (0..5).collect(),
        };
        Self {
            vertices_m,
            faces: Arc::new(faces),
            enclosure: Enclosure::Convex,
        }
    }

    /// An ellipsoid with diameters `size_m`, standing on the origin: 512 faces with the same area as the ellipse from
    /// above.
    #[must_use]
    pub fn ellipsoid(size_m: DVec3) -> Self {
        Self::stack(size_m, 0.0, RINGS)
    }

    /// An upright cylinder with half an ellipsoid at each end, standing on the origin; `size_m` is the overall size.
    #[must_use]
    pub fn capsule(size_m: DVec3) -> Self {
        let ends_m = size_m.x.min(size_m.y).min(size_m.z);
        Self::stack(size_m.with_z(ends_m), size_m.z - ends_m, RINGS)
    }

    /// A surface from vertices and faces by index. Open or inconsistently oriented ones are visible from both sides;
    /// dented faces are cut.
    ///
    /// # Errors
    /// Why they form no surface.
    pub fn new(vertices_m: Vec<DVec3>, faces: &[Vec<i64>]) -> Result<Self, String> {
        let mut mesh = Self::without_faces(vertices_m, Enclosure::Open);
        let mut steps = CUTTING_STEPS_MAX;
        for (face, corners) in faces.iter().enumerate() {
            let (number, vertices) = (corners.len(), mesh.vertices_m.len());
            if number < 3 {
                return Err(format!(
                    "face {face} has {number} corners, expected at least 3"
                ));
            }
            let known = |corner: &i64| {
                let index = usize::try_from(*corner).ok();
                index.filter(|index| *index < vertices).ok_or_else(|| {
                    let last = count::float(vertices) - 1.0;
                    format!("face {face} names vertex {corner}, expected 0 to {last}")
                })
            };
            let corners = corners.iter().map(known).collect::<Result<Vec<_>, _>>()?;
            let pieces = convex_pieces(&mesh.vertices_m, &corners, &mut steps);
            let pieces = pieces.ok_or_else(|| format!(
                "face {face} is not convex and has {number} corners: the squares of such faces' corners are more than {CUTTING_STEPS_MAX} together, cut them into triangles"
            ))?;
            if pieces.is_empty() {
                return Err(format!("face {face} has no area"));
            }
            for piece in pieces {
                mesh.push(&piece, face);
            }
        }
        if mesh.given().is_empty() {
            return Err("no faces".to_owned());
        }
        mesh.close();
        Ok(mesh)
    }

    /// The surface rotated about the origin, then moved.
    #[must_use]
    pub fn placed(mut self, rotation: DMat3, offset_m: DVec3) -> Self {
        for vertex in &mut self.vertices_m {
            *vertex = rotation * *vertex + offset_m;
        }
        self
    }

    /// A copy, rotated about the origin, then moved.
    pub(crate) fn copied(&self, rotation: DMat3, offset_m: DVec3) -> Self {
        let vertices_m = self.vertices_m.iter();
        Self {
            vertices_m: vertices_m
                .map(|vertex| rotation * *vertex + offset_m)
                .collect(),
            faces: Arc::clone(&self.faces),
            enclosure: self.enclosure,
        }
    }

    pub(crate) fn move_by(&mut self, offset_m: DVec3) {
        for vertex in &mut self.vertices_m {
            *vertex += offset_m;
        }
    }

    /// Its vertices, meters.
    #[must_use]
    pub fn vertices_m(&self) -> &[DVec3] {
        &self.vertices_m
    }

    /// The faces, each as vertex indices counter-clockwise as seen from outside.
    pub fn faces(&self) -> impl Iterator<Item = &[usize]> {
        let Faces {
            starts, corners, ..
        } = &*self.faces;
        starts.windows(2).map(|pair| &corners[pair[0]..pair[1]])
    }

    pub(crate) fn given(&self) -> &[usize] {
        &self.faces.given
    }

    /// The surface with its faces cut into `parts`, and the value of each part with an area.
    pub(crate) fn cut(
        &self,
        parts: impl Fn(usize, &[DVec3]) -> Vec<(Vec<DVec3>, f64)>,
    ) -> (Self, Vec<f64>) {
        let mut cut = Self::without_faces(Vec::new(), self.enclosure);
        let mut values = Vec::new();
        for (face, corners) in self.faces().enumerate() {
            let corners: Vec<DVec3> = corners
                .iter()
                .map(|corner| self.vertices_m[*corner])
                .collect();
            for (part, value) in parts(face, &corners) {
                let indices: Vec<usize> = (0..part.len()).collect();
                let pieces = || convex_pieces(&part, &indices, &mut 0);
                if part.len() < 3 || pieces().is_some_and(|pieces| pieces.is_empty()) {
                    continue;
                }
                let first = cut.vertices_m.len();
                cut.vertices_m.extend(part);
                let corners: Vec<usize> = (first..cut.vertices_m.len()).collect();
                cut.push(&corners, self.given()[face]);
                values.push(value);
            }
        }
        (cut, values)
    }

    /// The lowest and the highest corner of the axis-aligned bounding box.
    #[must_use]
    pub fn bounds_m(&self) -> (DVec3, DVec3) {
        let first = self.vertices_m.first().copied().unwrap_or(DVec3::ZERO);
        self.vertices_m
            .iter()
            .fold((first, first), |(low, high), vertex| {
                (low.min(*vertex), high.max(*vertex))
            })
    }

    /// Whether its faces enclose a space, so that only their outsides are visible.
    #[must_use]
    pub const fn is_closed(&self) -> bool {
        !matches!(self.enclosure, Enclosure::Open)
    }

    pub(crate) const fn enclosure(&self) -> Enclosure {
        self.enclosure
    }

    /// A stack of rings: an ellipsoid of these diameters with a cylinder of height `cylinder_m` inserted at its middle.
    pub(super) fn stack(size_m: DVec3, cylinder_m: f64, rings: usize) -> Self {
        let segments = 2 * rings;
        let half = 0.5 * size_m;
        let turn = 2.0 * PI / count::float(segments);
        // At this radius a regular polygon has the area of the unit circle.
        let outside = (turn / libm::sin(turn)).sqrt();
        let mut mesh = Self::without_faces(vec![DVec3::ZERO], Enclosure::Convex);
        for ring in 1..rings {
            let (sin, cos) = libm::sincos(PI * count::float(ring) / count::float(rings));
            let rises = if 2 * ring == rings && cylinder_m > 0.0 {
                vec![0.0, cylinder_m]
            } else if 2 * ring > rings {
                vec![cylinder_m]
            } else {
                vec![0.0]
            };
            for rise in rises {
                let height = half.z * (1.0 - cos) + rise;
                mesh.vertices_m.extend((0..segments).map(|segment| {
                    let (across, along) = libm::sincos(turn * count::float(segment));
                    let radius = outside * sin;
                    DVec3::new(half.x * radius * along, half.y * radius * across, height)
                }));
            }
        }
        mesh.vertices_m
            .push(DVec3::new(0.0, 0.0, size_m.z + cylinder_m));
        mesh.join_rings(segments);
        mesh
    }

    /// Adds the faces between rings of `segments` vertices each, with one vertex below and one above them all.
    fn join_rings(&mut self, segments: usize) {
        let top = self.vertices_m.len() - 1;
        let rings = (top - 1) / segments;
        let at = |ring: usize, segment: usize| 1 + ring * segments + segment % segments;
        for segment in 0..segments {
            let mut push = |corners: &[usize]| self.push(corners, self.given().len());
            push(&[0, at(0, segment + 1), at(0, segment)]);
            for ring in 1..rings {
                push(&[
                    at(ring - 1, segment),
                    at(ring - 1, segment + 1),
                    at(ring, segment + 1),
                    at(ring, segment),
                ]);
            }
            push(&[top, at(rings - 1, segment), at(rings - 1, segment + 1)]);
        }
    }

    fn without_faces(vertices_m: Vec<DVec3>, enclosure: Enclosure) -> Self {
        let faces = Faces {
            corners: Vec::new(),
            starts: vec![0],
            given: Vec::new(),
        };
        Self {
            vertices_m,
            faces: Arc::new(faces),
            enclosure,
        }
    }

    fn push(&mut self, corners: &[usize], given: usize) {
        let faces = Arc::make_mut(&mut self.faces);
        faces.corners.extend_from_slice(corners);
        faces.starts.push(faces.corners.len());
        faces.given.push(given);
    }

    /// Determines what the faces enclose, and turns the faces of a closed surface outwards.
    fn close(&mut self) {
        // The faces of a closed surface traverse every edge once in each direction.
        let mut walks: HashMap<(usize, usize), i32> = HashMap::new();
        for face in self.faces() {
            for (from, to) in face.iter().zip(face.iter().cycle().skip(1)) {
                *walks.entry((*from, *to)).or_default() += 1;
            }
        }
        let is_closed = walks
            .iter()
            .all(|((from, to), walked)| *walked == 1 && walks.get(&(*to, *from)) == Some(&1));
        if !is_closed {
            return;
        }
        let middle = self.vertices_m.iter().sum::<DVec3>() / count::float(self.vertices_m.len());
        let volume: f64 = self
            .faces()
            .map(|face| area_vector(&self.vertices_m, face).dot(self.vertices_m[face[0]] - middle))
            .sum();
        if volume < 0.0 {
            let Faces {
                starts, corners, ..
            } = Arc::make_mut(&mut self.faces);
            for face in starts.windows(2) {
                corners[face[0]..face[1]].reverse();
            }
        }
        self.enclosure = if self.is_convex() {
            Enclosure::Convex
        } else {
            Enclosure::Closed
        };
    }

    fn is_convex(&self) -> bool {
        // Nothing but speed is lost by not knowing it of a body with more.
        if self.given().len().saturating_mul(self.vertices_m.len()) > CONVEX_CHECKS_MAX {
            return false;
        }
        let (low, high) = self.bounds_m();
        let slack_m = FLAT * (high - low).length();
        self.faces().all(|face| {
            let outward = area_vector(&self.vertices_m, face).normalize_or_zero();
            let anchor = self.vertices_m[face[0]];
            self.vertices_m
                .iter()
                .all(|vertex| outward.dot(*vertex - anchor) <= slack_m)
        })
    }
}

/// Vertices times faces of a body that is checked for dents.
const CONVEX_CHECKS_MAX: usize = 1 << 26;

fn area_vector(vertices_m: &[DVec3], face: &[usize]) -> DVec3 {
    polygon::area_vector(face.iter().map(|corner| vertices_m[*corner]))
}

/// How often a closed surface winds around the sensor: 1 inside, 0 outside (Van Oosterom and Strackee 1983).
pub(crate) fn winding(mesh: &Mesh, in_sensor: &[DVec3]) -> f64 {
    let mut solid_angle = 0.0;
    for face in mesh.faces() {
        for pair in face.windows(2).skip(1) {
            let [a, b, c] = [face[0], pair[0], pair[1]].map(|corner| in_sensor[corner]);
            let (a_m, b_m, c_m) = (a.length(), b.length(), c.length());
            let below = a_m * b_m * c_m + a.dot(b) * c_m + b.dot(c) * a_m + c.dot(a) * b_m;
            solid_angle += 2.0 * libm::atan2(a.dot(b.cross(c)), below);
        }
    }
    solid_angle / (4.0 * PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume by the divergence theorem, and the area of all faces.
    fn measure(mesh: &Mesh) -> (f64, f64) {
        let mut measured = (0.0, 0.0);
        for face in mesh.faces() {
            let area = area_vector(&mesh.vertices_m, face);
            measured.0 += area.dot(mesh.vertices_m[face[0]]) / 6.0;
            measured.1 += 0.5 * area.length();
        }
        measured
    }

    fn close_to(found: f64, expected: f64, part: f64) -> bool {
        (found - expected).abs() <= part * expected.abs()
    }

    #[test]
    fn a_cuboid_has_its_volume_and_area() {
        let cuboid = Cuboid::new(DVec3::new(1.0, 2.0, 0.5), DVec3::new(2.0, 1.0, 3.0), 30.0);
        let (volume_m3, area_m2) = measure(&Mesh::of_cuboid(&cuboid));
        assert!(close_to(volume_m3, 6.0, 1e-12), "{volume_m3}");
        assert!(close_to(area_m2, 22.0, 1e-12), "{area_m2}");
    }

    #[test]
    fn a_pyramid_has_a_third_of_its_box() {
        let pyramid = Mesh::pyramid(DVec3::new(2.0, 3.0, 1.5));
        let (volume_m3, _) = measure(&pyramid);
        assert!(close_to(volume_m3, 3.0, 1e-12), "{volume_m3}");
        assert_eq!(pyramid.faces().count(), 5);
    }

    #[test]
    fn round_bodies_have_nearly_their_volume_and_height() {
        let ellipsoid = Mesh::ellipsoid(DVec3::new(0.2, 0.3, 0.4));
        let expected = 4.0 / 3.0 * PI * 0.1 * 0.15 * 0.2;
        assert!(close_to(measure(&ellipsoid).0, expected, 0.01));
        assert_eq!(ellipsoid.bounds_m().1.z, 0.4);
        assert_eq!(ellipsoid.bounds_m().0.z, 0.0);

        let capsule = Mesh::capsule(DVec3::new(0.2, 0.2, 1.0));
        let expected = PI * 0.01 * 0.8 + 4.0 / 3.0 * PI * 0.001;
        assert!(close_to(measure(&capsule).0, expected, 0.01));
        assert_eq!(capsule.bounds_m().1.z, 1.0);
        for mesh in [ellipsoid, capsule] {
            assert!(mesh.is_convex());
        }
    }

    fn cube() -> (Vec<DVec3>, Vec<Vec<i64>>) {
        let mesh = Mesh::of_cuboid(&Cuboid::new(DVec3::ZERO, DVec3::ONE, 0.0));
        let faces =
            CUBOID_FACES.map(|face| face.map(|corner| i64::try_from(corner).unwrap()).to_vec());
        (mesh.vertices_m, faces.to_vec())
    }

    #[test]
    fn a_closed_surface_is_turned_outwards() {
        let (vertices, mut faces) = cube();
        for face in &mut faces {
            face.reverse();
        }
        let mesh = Mesh::new(vertices, &faces).unwrap();
        assert_eq!(mesh.enclosure(), Enclosure::Convex);
        assert!(close_to(measure(&mesh).0, 1.0, 1e-12));
    }

    #[test]
    fn a_surface_with_a_hole_or_a_face_the_wrong_way_is_open() {
        let (vertices, mut faces) = cube();
        faces[2].reverse();
        let twisted = Mesh::new(vertices.clone(), &faces).unwrap();
        assert_eq!(twisted.enclosure(), Enclosure::Open);
        faces.remove(2);
        let holed = Mesh::new(vertices, &faces).unwrap();
        assert_eq!(holed.enclosure(), Enclosure::Open);
    }

    #[test]
    fn a_dented_face_is_cut_into_triangles() {
        // An L: six corners, one of them a dent; area 3.
        let outline = [
            (0.0, 0.0),
            (2.0, 0.0),
            (2.0, 1.0),
            (1.0, 1.0),
            (1.0, 2.0),
            (0.0, 2.0),
        ];
        let vertices: Vec<DVec3> = outline
            .iter()
            .map(|(x, y)| DVec3::new(*x, *y, 0.7))
            .collect();
        for corners in [vec![0, 1, 2, 3, 4, 5], vec![3, 2, 1, 0, 5, 4]] {
            let sheet = Mesh::new(vertices.clone(), &[corners]).unwrap();
            assert!(close_to(measure(&sheet).1, 3.0, 1e-12));
            assert_eq!(sheet.faces().count(), 4);
        }
    }

    #[test]
    fn malformed_surfaces_are_refused() {
        let (vertices, _) = cube();
        let refused = |faces: &[Vec<i64>]| Mesh::new(vertices.clone(), faces).unwrap_err();
        assert_eq!(refused(&[]), "no faces");
        assert_eq!(
            refused(&[vec![0, 1]]),
            "face 0 has 2 corners, expected at least 3"
        );
        assert_eq!(
            refused(&[vec![0, 1, 3], vec![0, 1, -1]]),
            "face 1 names vertex -1, expected 0 to 7"
        );
        assert_eq!(
            refused(&[vec![0, 1, 8]]),
            "face 0 names vertex 8, expected 0 to 7"
        );
        assert_eq!(refused(&[vec![0, 1, 0]]), "face 0 has no area");
    }
}
