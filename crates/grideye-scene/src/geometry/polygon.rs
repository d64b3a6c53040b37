//! Flat outlines in the room: cut, turned towards and measured; and how often a closed surface goes around a point.

use super::mesh::Mesh;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// The part of a convex polygon where `side` is not below zero.
#[must_use]
pub fn clipped(outline: &[DVec3], side: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(outline.len() + 1);
    let Some(last) = outline.last() else {
        return kept;
    };
    let mut before = (*last, side(*last));
    for point in outline {
        let here = (*point, side(*point));
        if (before.1 < 0.0) != (here.1 < 0.0) {
            kept.push(before.0.lerp(here.0, before.1 / (before.1 - here.1)));
        }
        if here.1 >= 0.0 {
            kept.push(here.0);
        }
        before = here;
    }
    kept
}

/// The direction from which a flat outline's corners run counter-clockwise, of length 1.
pub(crate) fn normal(side: &[DVec3]) -> DVec3 {
    let anchor = side[0];
    let pairs = side.windows(2);
    let doubled: DVec3 = pairs
        .map(|pair| (pair[0] - anchor).cross(pair[1] - anchor))
        .sum();
    doubled.normalize_or_zero()
}

/// Area of a plan; negative if its corners run clockwise.
pub(crate) fn area_m2(plan_m: &[DVec2]) -> f64 {
    let next = plan_m.iter().cycle().skip(1);
    let anchor = plan_m.first().copied().unwrap_or_default();
    let doubled: f64 = plan_m
        .iter()
        .zip(next)
        .map(|(from, to)| (*from - anchor).perp_dot(*to - anchor))
        .sum();
    0.5 * doubled
}

/// How often a closed surface goes around the sensor: 1 inside, 0 outside.
///
/// The sum of the solid angles of its triangles (Van Oosterom and Strackee 1983), with their signs.
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
