//! What each pixel of a sensor covers of the room and of what stands in it.

use super::bodies::Bodies;
use super::limits::FOOTPRINT_PIXELS_MAX;
use super::tree::{Face, Footprint, Round, Tree};
use crate::plane::Plane;
use glam::{DVec2, DVec3};
use grideye_scene::polygon::{clipped, hull};
use grideye_scene::{Sensor, count};
use std::collections::BTreeMap;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Surface {
    Side(usize),
    /// A node of the tree, and one of its faces.
    Face(usize, usize),
    Round(usize),
}

/// Adds what each pixel of some sensors sees; their numbers are those in the scene.
pub(super) fn of<'a>(
    mut bodies: Bodies,
    sensors: impl Iterator<Item = (usize, &'a Sensor)>,
) -> Bodies {
    for (number, sensor) in sensors {
        add(&mut bodies, number, sensor);
    }
    bodies
}

/// Adds the footprints of a sensor to the surfaces of a room; none of a sensor with very many pixels.
///
/// Each pixel has evenly spread rays. Those that meet one surface first bound its footprint there, so what hides something
/// has edges as fine as the rays.
fn add(bodies: &mut Bodies, number: usize, sensor: &Sensor) {
    let (columns, rows) = (sensor.columns, sensor.rows);
    if columns * rows > FOOTPRINT_PIXELS_MAX {
        return;
    }
    let (from_m, turn) = (sensor.pose.position_m, sensor.pose.world_from_sensor());
    let image = DVec2::new(count::float(columns), count::float(rows));
    // Through a place of the image, counted in pixels from its top left.
    let ray = |at: DVec2| {
        let slopes = sensor.view_slopes() * (DVec2::ONE - 2.0 * at / image);
        turn * DVec3::new(1.0, slopes.x, slopes.y)
    };
    let place = |index: usize, across: usize| {
        DVec2::new(count::float(index % across), count::float(index / across))
    };
    let parts = (RAYS_ACROSS / columns.max(rows)).max(1);
    let size = 1.0 / count::float(parts);
    for pixel in 0..columns * rows {
        let mut seen: BTreeMap<Surface, Vec<DVec2>> = BTreeMap::new();
        for part in 0..parts * parts {
            let low = place(pixel, columns) + size * place(part, parts);
            let corners = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE];
            if let Some(surface) = first_met(bodies, from_m, ray(low + 0.5 * size)) {
                let corners = corners.map(|corner| low + size * corner);
                seen.entry(surface).or_default().extend(corners);
            }
        }
        for (surface, points) in seen {
            let rays: Vec<DVec3> = hull(points).into_iter().map(&ray).collect();
            let (corners_m, footprints) = match surface {
                Surface::Side(side) => {
                    let side = &mut bodies.sides[side];
                    (within(&side.corners_m, from_m, &rays), &mut side.footprints)
                }
                Surface::Face(node, face) => {
                    let face = &mut bodies.tree.nodes[node].faces[face];
                    (within(&face.corners_m, from_m, &rays), &mut face.footprints)
                }
                Surface::Round(round) => {
                    let round = &mut bodies.rounds[round];
                    let met = rays.iter().rev().map(|ray| reach(round, from_m, *ray).1);
                    (met.collect(), &mut round.footprints)
                }
            };
            if corners_m.len() > 2 {
                footprints.push(Footprint {
                    sensor: number,
                    pixel,
                    corners_m,
                });
            }
        }
    }
}

fn first_met(bodies: &Bodies, from_m: DVec3, ray: DVec3) -> Option<Surface> {
    let face = face_met(&bodies.tree, from_m, ray);
    let rounds = bodies
        .rounds
        .iter()
        .enumerate()
        .filter_map(|(index, round)| {
            let (far, _) = reach(round, from_m, ray);
            far.map(|far| (far, Surface::Round(index)))
        });
    let nearest = |one: &(f64, Surface), other: &(f64, Surface)| one.0.total_cmp(&other.0);
    if let Some((_, surface)) = rounds.chain(face).min_by(nearest) {
        return Some(surface);
    }
    let sides = bodies.sides.iter().enumerate().filter_map(|(index, side)| {
        let plane = Plane::of_face(&side.corners_m)?;
        let far = -plane.height_m(from_m) / plane.normal.dot(ray);
        let is_met =
            plane.normal.dot(ray) < 0.0 && covers(&side.corners_m, &plane, from_m + far * ray);
        is_met.then_some((far, Surface::Side(index)))
    });
    sides.min_by(nearest).map(|(_, surface)| surface)
}

/// The first face that a ray meets: the tree's sides are visited from near to far.
fn face_met(tree: &Tree, from_m: DVec3, ray: DVec3) -> Option<(f64, Surface)> {
    let mut tasks = vec![((!tree.nodes.is_empty()).then_some(0), false)];
    while let Some((node, is_plane)) = tasks.pop() {
        let Some(number) = node else { continue };
        let node = &tree.nodes[number];
        let (height, towards) = (node.plane.height_m(from_m), node.plane.normal.dot(ray));
        let far = -height / towards;
        if is_plane {
            let at_m = from_m + far * ray;
            let covers = |face: &Face| covers(&face.corners_m, &node.plane, at_m);
            if let Some(face) = node.faces.iter().position(covers) {
                return Some((far, Surface::Face(number, face)));
            }
            continue;
        }
        // From within the plane, a ray stays on the side that it leads to.
        let near = usize::from(if height.abs() < ON_PLANE_M {
            towards > 0.0
        } else {
            height > 0.0
        });
        if far.is_finite() && far > 0.0 && height.abs() >= ON_PLANE_M {
            tasks.extend([(node.sides[1 - near], false), (Some(number), true)]);
        }
        tasks.push((node.sides[near], false));
    }
    None
}

/// How far along a ray an ellipsoid is met, and where; a ray that passes it gets the point that is nearest to it.
fn reach(round: &Round, from_m: DVec3, ray: DVec3) -> (Option<f64>, DVec3) {
    let inverse = round.axes_m.inverse();
    let (from, along) = (inverse * (from_m - round.center_m), inverse * ray);
    let middle = -from.dot(along) / along.length_squared();
    let nearest = from + middle * along;
    let inside = (1.0 - nearest.length_squared()) / along.length_squared();
    let far = middle - inside.max(0.0).sqrt();
    let at = (from + far * along).normalize_or_zero();
    (
        (inside > 0.0 && far > 0.0).then_some(far),
        round.center_m + round.axes_m * at,
    )
}

/// Whether a point of its plane is on a face, which need not be convex.
fn covers(corners_m: &[DVec3], plane: &Plane, at_m: DVec3) -> bool {
    let (across, up) = plane.normal.any_orthonormal_pair();
    let flat = |corner: &DVec3| DVec2::new((*corner - at_m).dot(across), (*corner - at_m).dot(up));
    let corners = corners_m.iter().map(flat);
    let next = corners_m.iter().cycle().skip(1).map(flat);
    let crossings = corners.zip(next).filter(|(from, to)| {
        (from.y > 0.0) != (to.y > 0.0) && from.x - from.y * (to.x - from.x) / (to.y - from.y) > 0.0
    });
    crossings.count() % 2 == 1
}

/// The part of a surface between rays that are the edges of a pyramid.
fn within(surface_m: &[DVec3], from_m: DVec3, rays: &[DVec3]) -> Vec<DVec3> {
    let ahead: DVec3 = rays.iter().sum();
    let next = rays.iter().cycle().skip(1);
    rays.iter()
        .zip(next)
        .fold(surface_m.to_vec(), |rest, (one, other)| {
            let border = one.cross(*other);
            let inwards = border * border.dot(ahead).signum();
            clipped(&rest, |corner| inwards.dot(corner - from_m))
        })
}

const RAYS_ACROSS: usize = 32;
const ON_PLANE_M: f64 = 1e-9;
