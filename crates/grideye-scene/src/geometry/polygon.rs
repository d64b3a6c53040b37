//! Flat outlines: clipping, hulls, areas and normals.

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
