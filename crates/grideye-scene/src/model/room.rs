//! The room: a box, an extruded floor plan, or a closed mesh; tests what is inside, and finds the walls that hide
//! something.

use crate::geometry::{Enclosure, Mesh, area_m2, normal, winding};
use crate::model::body::Body;
use crate::radiometry::Surface;
use crate::text::millimeters;
use glam::{DVec2, DVec3};

/// The room: a cuboid from the origin, unless the file gives a floor plan or a mesh.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Room {
    /// Size of its bounding box: width to the right (x), depth to the back (y), height (z), meters.
    pub size_m: DVec3,
    /// Temperature of walls and air, °C.
    pub ambient_c: f64,
    /// The lowest corner of the bounding box.
    low_m: DVec3,
    /// Its shape, if not that box.
    hull: Option<Hull>,
}

#[derive(Debug, Clone, PartialEq)]
struct Hull {
    /// Closed, its faces looking out of the room.
    mesh: Mesh,
    /// Counter-clockwise from above.
    outline_m: Vec<DVec2>,
    /// Floor, ceiling and walls as drawn, looking into the room.
    sides_m: Vec<Vec<DVec3>>,
}

impl Room {
    pub(crate) const fn of_box(size_m: DVec3, ambient_c: f64) -> Self {
        Self {
            size_m,
            ambient_c,
            low_m: DVec3::ZERO,
            hull: None,
        }
    }

    /// The room above a simple floor plan, with corners in either direction; `None` if it has no volume.
    pub(crate) fn of_plan(plan_m: &[DVec2], height_m: f64, ambient_c: f64) -> Option<Self> {
        let mut outline_m = plan_m.to_vec();
        if area_m2(&outline_m) < 0.0 {
            outline_m.reverse();
        }
        let count = outline_m.len();
        let floor: Vec<i64> = (0..i64::try_from(count).ok()?).collect();
        let count = i64::try_from(count).ok()?;
        let mut faces: Vec<Vec<i64>> = vec![floor.iter().rev().copied().collect()];
        faces.push(floor.iter().map(|corner| corner + count).collect());
        faces.extend(floor.iter().map(|corner| {
            let next = (corner + 1) % count;
            vec![*corner, next, next + count, corner + count]
        }));
        let levels_m = [0.0, height_m];
        let vertices_m: Vec<DVec3> = levels_m
            .iter()
            .flat_map(|level_m| outline_m.iter().map(|corner| corner.extend(*level_m)))
            .collect();
        let side_m = |face: &Vec<i64>| -> Vec<DVec3> {
            let corners = face.iter().rev();
            corners
                .filter_map(|corner| vertices_m.get(usize::try_from(*corner).ok()?).copied())
                .collect()
        };
        let sides_m = faces.iter().map(side_m).collect();
        let mesh = Mesh::new(vertices_m, &faces).ok()?;
        Self::of_hull(mesh, (outline_m, sides_m), ambient_c)
    }

    pub(crate) fn of_mesh(mesh: Mesh, ambient_c: f64) -> Option<Self> {
        let inward = |face: &[usize]| -> Vec<DVec3> {
            let corners = face.iter().rev();
            corners.map(|corner| mesh.vertices_m()[*corner]).collect()
        };
        let sides_m: Vec<Vec<DVec3>> = mesh.faces().map(inward).collect();
        let (low_m, high_m) = mesh.bounds_m();
        let outline_m = outline_of_floor(&sides_m)
            .unwrap_or_else(|| rectangle(low_m.truncate(), high_m.truncate()));
        Self::of_hull(mesh, (outline_m, sides_m), ambient_c)
    }

    fn of_hull(
        mesh: Mesh,
        (outline_m, sides_m): (Vec<DVec2>, Vec<Vec<DVec3>>),
        ambient_c: f64,
    ) -> Option<Self> {
        let (low_m, high_m) = mesh.bounds_m();
        mesh.is_closed().then_some(Self {
            size_m: high_m - low_m,
            ambient_c,
            low_m,
            hull: Some(Hull {
                mesh,
                outline_m,
                sides_m,
            }),
        })
    }

    /// The lowest and the highest corner of the bounding box, meters.
    #[must_use]
    pub fn bounds_m(&self) -> (DVec3, DVec3) {
        (self.low_m, self.low_m + self.size_m)
    }

    /// Whether it fills its bounding box.
    #[must_use]
    pub const fn is_box(&self) -> bool {
        self.hull.is_none()
    }

    /// The outline of its floor from above, counter-clockwise, meters; for a mesh, of the faces that look up.
    #[must_use]
    pub fn outline_m(&self) -> Vec<DVec2> {
        let (low_m, high_m) = self.bounds_m();
        self.hull.as_ref().map_or_else(
            || rectangle(low_m.truncate(), high_m.truncate()),
            |hull| hull.outline_m.clone(),
        )
    }

    /// Whether a point is in the room or on its walls, to a nanometer.
    #[must_use]
    pub fn contains(&self, point_m: DVec3) -> bool {
        let (low_m, high_m) = self.bounds_m();
        let in_bounds =
            point_m.cmpge(low_m - SLACK_M).all() && point_m.cmple(high_m + SLACK_M).all();
        let Some(hull) = &self.hull else {
            return in_bounds;
        };
        in_bounds && (hull.is_around(point_m) || hull.touches(point_m))
    }

    /// Whether all corners of a surface are in the room; the body may still cross a wall that juts in.
    pub(crate) fn holds_corners_of(&self, mesh: &Mesh) -> bool {
        if self.is_box() {
            let (low_m, high_m) = mesh.bounds_m();
            return self.contains(low_m) && self.contains(high_m);
        }
        mesh.vertices_m()
            .iter()
            .all(|vertex| self.contains(*vertex))
    }

    /// Floor, ceiling and walls, meters, each as an outline counter-clockwise as seen from within.
    #[must_use]
    pub fn sides_m(&self) -> Vec<Vec<DVec3>> {
        if let Some(hull) = &self.hull {
            return hull.sides_m.clone();
        }
        let (low_m, high_m) = self.bounds_m();
        let plan = rectangle(low_m.truncate(), high_m.truncate());
        let level = |z_m: f64| -> Vec<DVec3> { plan.iter().map(|at| at.extend(z_m)).collect() };
        let (floor, ceiling) = (level(low_m.z), level(high_m.z));
        let mut sides: Vec<Vec<DVec3>> = (0..plan.len())
            .map(|corner| {
                let next = (corner + 1) % plan.len();
                vec![ceiling[corner], ceiling[next], floor[next], floor[corner]]
            })
            .collect();
        sides.push(floor);
        sides.push(ceiling.into_iter().rev().collect());
        sides
    }

    /// [`Self::sides_m`] cut into convex faces.
    #[must_use]
    pub fn convex_sides_m(&self) -> Vec<Vec<DVec3>> {
        let Some(hull) = &self.hull else {
            return self.sides_m();
        };
        let corner_m = |corner: &usize| hull.mesh.vertices_m()[*corner];
        let faces = hull.mesh.faces();
        faces
            .map(|face| face.iter().rev().map(corner_m).collect())
            .collect()
    }

    /// The walls that jut into the room, as convex faces; none in a convex room.
    #[must_use]
    pub fn jutting_m(&self) -> Vec<Vec<DVec3>> {
        let Some(hull) = &self.hull else {
            return Vec::new();
        };
        if hull.mesh.enclosure() == Enclosure::Convex {
            return Vec::new();
        }
        let corners = hull.mesh.vertices_m();
        let juts = |face: &Vec<DVec3>| {
            let (inward, anchor) = (normal(face), face[0]);
            let behind = |corner: &DVec3| inward.dot(*corner - anchor) < -JUTTING_M;
            corners.iter().any(behind)
        };
        let sides = self.convex_sides_m();
        sides.into_iter().filter(juts).collect()
    }

    /// The walls that jut into the room, set back so that objects and sensors on them are in front.
    pub(crate) fn screen(&self) -> Option<Body> {
        let mut vertices_m = Vec::new();
        let mut faces = Vec::new();
        for side in self.jutting_m() {
            let first = i64::try_from(vertices_m.len()).ok()?;
            let behind_m = -SCREEN_M * normal(&side);
            vertices_m.extend(side.iter().map(|corner| *corner + behind_m));
            let end = i64::try_from(vertices_m.len()).ok()?;
            faces.push((first..end).collect());
        }
        let surface = Surface {
            celsius: self.ambient_c,
            emissivity: 1.0,
        };
        let mesh = Mesh::new(vertices_m, &faces).ok()?;
        Some(Body::new("walls", self.low_m, mesh, surface))
    }

    pub(crate) fn described(&self) -> String {
        let (low_m, high_m) = self.bounds_m();
        self.hull.as_ref().map_or_else(
            || millimeters(self.size_m),
            |hull| {
                let sides = hull.sides_m.len();
                let (low, high) = (millimeters(low_m), millimeters(high_m));
                format!("{sides} sides within {low} to {high}")
            },
        )
    }
}

impl Hull {
    fn is_around(&self, point_m: DVec3) -> bool {
        let vertices = self.mesh.vertices_m().iter();
        let from_point: Vec<DVec3> = vertices.map(|vertex| *vertex - point_m).collect();
        winding(&self.mesh, &from_point) > 0.5
    }

    fn touches(&self, point_m: DVec3) -> bool {
        let corner_m = |corner: &usize| self.mesh.vertices_m()[*corner];
        self.mesh.faces().any(|face| {
            let face: Vec<DVec3> = face.iter().map(corner_m).collect();
            let outward = normal(&face);
            let next = face.iter().cycle().skip(1);
            outward.dot(point_m - face[0]).abs() <= SLACK_M
                && face.iter().zip(next).all(|(from, to)| {
                    let along = (*to - *from).normalize_or_zero();
                    outward.cross(along).dot(point_m - *from) >= -SLACK_M
                })
        })
    }
}

fn rectangle(low_m: DVec2, high_m: DVec2) -> Vec<DVec2> {
    vec![
        low_m,
        DVec2::new(high_m.x, low_m.y),
        high_m,
        DVec2::new(low_m.x, high_m.y),
    ]
}

/// Seen from above, the largest loop of edges that belong to only one upward side.
fn outline_of_floor(sides_m: &[Vec<DVec3>]) -> Option<Vec<DVec2>> {
    // Compare to the micrometer, so that adjoining steps form one floor.
    let mark = |corner: &DVec3| {
        let at = (corner.truncate() * 1e6).round() + 0.0;
        (at.x.to_bits(), at.y.to_bits())
    };
    let mut edges: Vec<[DVec3; 2]> = Vec::new();
    for side in sides_m.iter().filter(|side| normal(side).z > UPWARD) {
        for (from, to) in side.iter().zip(side.iter().cycle().skip(1)) {
            let back =
                |edge: &[DVec3; 2]| mark(&edge[0]) == mark(to) && mark(&edge[1]) == mark(from);
            match edges.iter().position(back) {
                Some(index) => drop(edges.swap_remove(index)),
                None if mark(from) == mark(to) => {}
                None => edges.push([*from, *to]),
            }
        }
    }
    let mut largest: Option<Vec<DVec2>> = None;
    while let Some([first, mut tip]) = edges.pop() {
        let mut outline = vec![first.truncate()];
        while mark(&tip) != mark(&first) {
            outline.push(tip.truncate());
            let next = edges.iter().position(|edge| mark(&edge[0]) == mark(&tip))?;
            tip = edges.swap_remove(next)[1];
        }
        if largest
            .as_ref()
            .is_none_or(|largest| area_m2(&outline) > area_m2(largest))
        {
            largest = Some(outline);
        }
    }
    largest.filter(|outline| area_m2(outline) > 0.0)
}

/// Rounding tolerance for positions that touch a wall: a nanometer.
const SLACK_M: f64 = 1e-9;
/// A wall juts into the room if corners of the room are at least this far behind it.
const JUTTING_M: f64 = 1e-6;
/// How far the screen is set back behind a wall: more than rounding, less than any sensor resolves.
const SCREEN_M: f64 = 1e-5;
/// Steeper sides, nearly upright, are not floor.
const UPWARD: f64 = 1e-6;
