//! Flat outlines: clipping, hulls, areas, normals, and what is cut into triangles.

use glam::{DVec2, DVec3};
use std::ops::{Add, Mul};

/// The part of a convex polygon where `side` is not negative.
#[must_use]
pub fn clipped<P>(outline: &[P], side: impl Fn(P) -> f64) -> Vec<P>
where
    P: Copy + Add<Output = P> + Mul<f64, Output = P>,
{
    let mut kept = Vec::with_capacity(outline.len() + 1);
    let Some(last) = outline.last() else {
        return kept;
    };
    let mut before = (*last, side(*last));
    for point in outline {
        let here = (*point, side(*point));
        if (before.1 < 0.0) != (here.1 < 0.0) {
            let share = before.1 / (before.1 - here.1);
            kept.push(before.0 * (1.0 - share) + here.0 * share);
        }
        if here.1 >= 0.0 {
            kept.push(here.0);
        }
        before = here;
    }
    kept
}

/// The convex hull of points, counter-clockwise (Andrew 1979).
#[must_use]
pub fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|one, other| one.x.total_cmp(&other.x).then(one.y.total_cmp(&other.y)));
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for point in points {
            while let [.., before, last] = chain.as_slice() {
                if (*last - *before).perp_dot(point - *last) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}

/// The lowest and the highest corner of the bounding rectangle.
#[must_use]
pub fn bounds(points: impl Iterator<Item = DVec2>) -> (DVec2, DVec2) {
    let nothing = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    points.fold(nothing, |(low, high), at| (low.min(at), high.max(at)))
}

/// Twice the area of a flat outline, as a vector towards the side from which its corners run counter-clockwise.
pub(crate) fn area_vector(corners: impl Iterator<Item = DVec3> + Clone) -> DVec3 {
    let anchor = corners.clone().next().unwrap_or(DVec3::ZERO);
    let next = corners.clone().skip(1);
    let pairs = corners.zip(next);
    pairs
        .map(|(from, to)| (from - anchor).cross(to - anchor))
        .sum()
}

/// The unit vector towards the side from which a flat outline's corners run counter-clockwise.
pub(crate) fn normal(side: &[DVec3]) -> DVec3 {
    area_vector(side.iter().copied()).normalize_or_zero()
}

pub(crate) fn area_m2(plan_m: &[DVec2]) -> f64 {
    let anchor = plan_m.first().copied().unwrap_or_default();
    let walls = plan_m.iter().zip(plan_m.iter().cycle().skip(1));
    let doubled = walls.map(|(from, to)| (*from - anchor).perp_dot(*to - anchor));
    0.5 * doubled.sum::<f64>()
}

/// The tolerance for flat faces and convex surfaces, relative to their extent.
pub(super) const FLAT: f64 = 1e-9;

/// The squares of the corners of one surface's faces that are cut into triangles, which takes as long.
pub(super) const CUTTING_STEPS_MAX: usize = 1 << 26;

/// The face unchanged if it is flat and convex, otherwise cut into triangles; nothing for a face without area, and `None` if
/// cutting takes more than the steps that are left.
pub(super) fn convex_pieces(
    vertices_m: &[DVec3],
    face: &[usize],
    steps: &mut usize,
) -> Option<Vec<Vec<usize>>> {
    let normal = area_vector(face.iter().map(|corner| vertices_m[*corner]));
    let anchor = vertices_m[face[0]];
    let extent_m = face
        .iter()
        .map(|corner| vertices_m[*corner].distance(anchor))
        .fold(0.0, f64::max);
    if normal.length() <= FLAT * extent_m * extent_m {
        return Some(Vec::new());
    }
    let outward = normal.normalize();
    let is_flat = face
        .iter()
        .all(|corner| outward.dot(vertices_m[*corner] - anchor).abs() <= FLAT * extent_m);
    let turns_left = |index: usize| turn(vertices_m, face, outward, index) >= 0.0;
    if is_flat && (0..face.len()).all(turns_left) {
        return Some(vec![face.to_vec()]);
    }
    *steps = steps.checked_sub(face.len().saturating_mul(face.len()))?;
    Some(ears(vertices_m, face, outward))
}

/// How much the outline turns left at a corner, seen against `outward`: twice the area of the triangle there.
fn turn(vertices_m: &[DVec3], face: &[usize], outward: DVec3, index: usize) -> f64 {
    let at = |offset: usize| vertices_m[face[(index + offset) % face.len()]];
    let (before, here, after) = (at(face.len() - 1), at(0), at(1));
    outward.dot((here - before).cross(after - here))
}

/// Cuts a face into triangles by ear clipping: only the corners beside an ear change by cutting it off.
fn ears(vertices_m: &[DVec3], face: &[usize], outward: DVec3) -> Vec<Vec<usize>> {
    let around = |rest: &[usize], index: usize| {
        [rest.len() - 1, 0, 1].map(|offset| rest[(index + offset) % rest.len()])
    };
    let is_ear = |rest: &[usize], index: usize| {
        let corners = around(rest, index);
        turn(vertices_m, rest, outward, index) > 0.0
            && rest
                .iter()
                .filter(|corner| !corners.contains(corner))
                .all(|corner| !is_within(vertices_m, corners, outward, *corner))
    };
    let mut rest = face.to_vec();
    let mut ears: Vec<bool> = (0..rest.len()).map(|index| is_ear(&rest, index)).collect();
    let mut triangles = Vec::new();
    while rest.len() > 3 {
        // A simple polygon has at least two ears; a self-crossing one is cut somewhere.
        let ear = ears.iter().position(|is_ear| *is_ear).unwrap_or(0);
        if turn(vertices_m, &rest, outward, ear).abs() > 0.0 {
            triangles.push(around(&rest, ear).to_vec());
        }
        rest.remove(ear);
        ears.remove(ear);
        for beside in [ear + rest.len() - 1, ear] {
            ears[beside % rest.len()] = is_ear(&rest, beside % rest.len());
        }
    }
    triangles.push(rest);
    triangles
}

fn is_within(vertices_m: &[DVec3], triangle: [usize; 3], outward: DVec3, corner: usize) -> bool {
    let point = vertices_m[corner];
    let side = |from: usize, to: usize| {
        outward.dot(
            (vertices_m[triangle[to]] - vertices_m[triangle[from]])
                .cross(point - vertices_m[triangle[from]]),
        )
    };
    side(0, 1) >= 0.0 && side(1, 2) >= 0.0 && side(2, 0) >= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_square_with_a_point_in_it_is_the_square() {
        let square = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)].map(DVec2::from);
        let within = [(1.0, 1.0), (1.0, 0.0)].map(DVec2::from);
        assert_eq!(hull([&square[..], &within].concat()), square);
    }
}
