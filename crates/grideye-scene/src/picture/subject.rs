//! What a renderer draws: bodies as the sensor sees them.

use crate::geometry::{
    Contour, Ellipsoid, Enclosure, Mesh, Pose, area_vector, clipped, count, hull, range, winding,
};
use crate::model::Body;
use crate::radiometry::Surface;
use glam::{DMat3, DVec2, DVec3};
use std::borrow::Cow;

/// The owner of bodies that belong to no agent.
pub(crate) const NOBODY: u32 = u32::MAX;

/// A body at one time.
pub(crate) struct Subject<'a> {
    pub(crate) form: Form,
    pub(crate) surface: Surface,
    /// What the temperature of each face differs by; empty if of none.
    pub(crate) offsets_c: &'a [f64],
    /// The number of the agent whose body it is.
    pub(crate) owner: u32,
}

pub(crate) enum Form {
    Flat(Vec<SeenFace>),
    /// Faces that together hide nothing of one another.
    Convex(Vec<SeenFace>),
    Round(Ellipsoid),
}

impl<'a> Subject<'a> {
    pub(crate) fn new(
        (body, owner): (&'a Body, u32),
        form: Form,
        (ambient_c, time_s): (f64, f64),
    ) -> Self {
        Self {
            form,
            surface: Surface {
                celsius: body.celsius(ambient_c, time_s),
                ..body.surface
            },
            offsets_c: &body.thermal.offsets_c,
            owner,
        }
    }

    pub(crate) fn of_face(&self, face: usize) -> Surface {
        let offset_c = self.offsets_c.get(face).copied().unwrap_or(0.0);
        Surface {
            celsius: self.surface.celsius + offset_c,
            ..self.surface
        }
    }

    /// The outline of a round body as rays `(1, left, up)`, and the inverse depth of a plane as near as its surface is in
    /// the mean; `None` for others, or if part of it is not in front of the sensor.
    pub(crate) fn outline(&self, pose: &Pose) -> Option<(Vec<DVec3>, DVec3)> {
        match &self.form {
            Form::Flat(_) => None,
            Form::Convex(faces) if faces.len() < ROUND_FACES_MIN || !self.offsets_c.is_empty() => {
                None
            }
            Form::Convex(faces) => outline_of(faces),
            Form::Round(ellipsoid) => {
                let contour = ellipsoid.contour(pose)?;
                Some((contour.outline()?, contour.of_surface))
            }
        }
    }

    /// The outline of an ellipsoid; `None` for others, or if the sensor is inside.
    pub(crate) fn contour(&self, pose: &Pose) -> Option<Contour> {
        match &self.form {
            Form::Flat(_) | Form::Convex(_) => None,
            Form::Round(ellipsoid) => ellipsoid.contour(pose),
        }
    }

    /// The faces, of a round body as a mesh.
    pub(crate) fn faces(&self, pose: &Pose) -> Cow<'_, [SeenFace]> {
        match &self.form {
            Form::Flat(faces) | Form::Convex(faces) => Cow::Borrowed(faces),
            Form::Round(ellipsoid) => {
                Cow::Owned(SeenFace::all(pose, &ellipsoid.mesh(), DVec3::ZERO))
            }
        }
    }
}

#[derive(Debug, Clone)]
pub(crate) struct SeenFace {
    /// Its number in the mesh.
    pub(crate) face: usize,
    pub(crate) corners: Vec<DVec3>,
    /// Its product with a ray `(1, left, up)` is the inverse depth where the ray meets the face's plane.
    pub(crate) inverse_depth: DVec3,
    /// 1 if the corners run counter-clockwise as seen along the ray, -1 if clockwise.
    pub(crate) orientation: f64,
}

impl SeenFace {
    /// The faces that the sensor sees of a mesh, hidden by others or not.
    pub(crate) fn all(pose: &Pose, mesh: &Mesh, moved_m: DVec3) -> Vec<Self> {
        let in_sensor: Vec<DVec3> = mesh
            .vertices_m()
            .iter()
            .map(|vertex| pose.point_in_sensor(*vertex + moved_m))
            .collect();
        if let Some(touching) = enclosure(mesh, &in_sensor) {
            return Self::all_around(&touching).into_iter().collect();
        }
        let seen = |(index, face)| Self::new((index, face), &in_sensor, mesh.enclosure());
        mesh.faces().enumerate().filter_map(seen).collect()
    }

    /// What is seen from inside a mesh or on it: at no distance, without rays that leave through a touched face.
    fn all_around(touching: &[DVec3]) -> Option<Self> {
        let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
        let corners = corners.map(|(left, up)| DVec3::new(1.0, left * WIDE, up * WIDE));
        let mut corners = touching.iter().fold(corners.to_vec(), |inside, outward| {
            clipped(&inside, |ray| -outward.dot(ray))
        });
        drop_twins(&mut corners);
        (!corners.is_empty()).then_some(Self {
            face: NO_FACE,
            corners,
            inverse_depth: AT_NO_DISTANCE,
            orientation: 1.0,
        })
    }

    /// A ray `(1, left, up)` meets the face if its products with all of these are not negative.
    pub(crate) fn sides(&self) -> impl Iterator<Item = DVec3> {
        let next = self.corners.iter().cycle().skip(1);
        let sides = self.corners.iter().zip(next);
        sides
            .map(|(from, to)| from.cross(*to) * self.orientation)
            .chain([self.inverse_depth])
    }

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

/// A convex body that shows more faces is round.
const ROUND_FACES_MIN: usize = 24;

/// The outline of a convex body, and the plane closest to its faces: by least squares, of inverse depth over the image.
fn outline_of(faces: &[SeenFace]) -> Option<(Vec<DVec3>, DVec3)> {
    let corners = faces.iter().flat_map(|face| &face.corners);
    let (nearest_m, farthest_m) = range(corners.clone().map(|corner| corner.x));
    // Beside the sensor no plane is close to all faces.
    if nearest_m <= 0.1 * farthest_m {
        return None;
    }
    let corners = corners.map(|corner| DVec2::new(corner.y, corner.z) / corner.x);
    let outline = hull(corners.collect()).into_iter();
    let (mut squares, mut sum) = (DMat3::ZERO, DVec3::ZERO);
    for face in faces {
        let center = face.corners.iter().sum::<DVec3>() / count::float(face.corners.len());
        let ray = center / center.x;
        let area = area_vector(face.corners.iter().copied()).dot(ray).abs() / center.x.powi(2);
        let outer = DMat3::from_cols(ray * ray.x, ray * ray.y, ray * ray.z);
        squares += area * outer;
        sum += area * face.inverse_depth.dot(ray) * ray;
    }
    let plane = squares.inverse() * sum;
    let outline = outline.map(|at| DVec3::new(1.0, at.x, at.y)).collect();
    plane.is_finite().then_some((outline, plane))
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

const NO_FACE: usize = usize::MAX;

/// The slope of rays beyond every view.
const WIDE: f64 = 2e4;

/// The inverse depth of what is at the sensor: large enough to show a body at its own temperature, finite so that two can
/// be compared.
const AT_NO_DISTANCE: DVec3 = DVec3::new(1e12, 0.0, 0.0);

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
