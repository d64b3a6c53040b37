//! The distance between two convex bodies (Gilbert, Johnson and Keerthi 1988).

use glam::{DMat3, DVec3};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gap {
    /// Distance in meters; 0 if they meet.
    pub(crate) distance_m: f64,
    /// The midpoint of their nearest points; a common point if they meet.
    pub(crate) middle_m: DVec3,
}

/// A point of the difference of two hulls, and the point of each hull that yields it.
#[derive(Debug, Clone, Copy)]
struct Corner {
    difference: DVec3,
    one: DVec3,
    other: DVec3,
}

/// The gap between the hull of `one`, moved by `offset_m`, and the hull of `other`.
pub(crate) fn gap(one: &[DVec3], offset_m: DVec3, other: &[DVec3]) -> Gap {
    nearest((one, offset_m, other), PRECISION).gap()
}

/// Whether two hulls meet: a plane between them is found sooner than their distance.
pub(crate) fn meet(one: &[DVec3], other: &[DVec3]) -> bool {
    nearest((one, DVec3::ZERO, other), 1.0 - APART)
        .gap()
        .distance_m
        <= 0.0
}

/// The nearest points, to this share of the squared distance.
fn nearest((one, offset_m, other): (&[DVec3], DVec3, &[DVec3]), precision: f64) -> Nearest {
    let corner = |direction: DVec3| {
        let one = farthest(one, direction) + offset_m;
        let other = farthest(other, -direction);
        Corner {
            difference: one - other,
            one,
            other,
        }
    };
    let mut simplex = vec![corner(DVec3::X)];
    let mut nearest = Nearest::of(&simplex);
    for _ in 0..ROUNDS_MAX {
        let to_origin = nearest.point;
        let distance_m2 = to_origin.length_squared();
        if distance_m2 <= MEETING_M * MEETING_M {
            break;
        }
        let next = corner(-to_origin);
        // No point of the difference is nearer to the origin than the plane through `next`.
        if distance_m2 - to_origin.dot(next.difference) <= precision * distance_m2 {
            break;
        }
        simplex.push(next);
        let closer = Nearest::of(&simplex);
        if closer.point.length_squared() >= distance_m2 {
            // Only rounding remains to be gained.
            break;
        }
        simplex.clear();
        simplex.extend(closer.kept());
        nearest = closer;
    }
    nearest
}

const ROUNDS_MAX: usize = 64;
const MEETING_M: f64 = 1e-9;
const PRECISION: f64 = 1e-9;
/// A plane that keeps this share of the distance to both hulls is between them, whatever rounding does.
const APART: f64 = 1e-6;

#[derive(Debug, Clone, Copy)]
struct Nearest {
    point: DVec3,
    /// The corners around the point, and the weight of each; the first so many.
    corners: [Corner; 4],
    shares: [f64; 4],
    count: usize,
}

impl Nearest {
    fn of(simplex: &[Corner]) -> Self {
        let mut nearest = Self {
            point: DVec3::INFINITY,
            corners: [simplex[0]; 4],
            shares: [0.0; 4],
            count: 0,
        };
        let mut kept = 0;
        // Whole corners are copied once: of most parts the origin is farther away.
        for chosen in 1..1_u32 << simplex.len() {
            let (mut part, mut count) = ([DVec3::ZERO; 4], 0);
            for corner in of_part(simplex, chosen) {
                part[count] = corner.difference;
                count += 1;
            }
            let Some(shares) = shares(&part[..count]) else {
                continue;
            };
            let shared = part[..count].iter().zip(&shares);
            let point: DVec3 = shared.map(|(corner, share)| *corner * *share).sum();
            if point.length_squared() < nearest.point.length_squared() {
                (kept, nearest.point, nearest.shares) = (chosen, point, shares);
            }
        }
        for corner in of_part(simplex, kept) {
            nearest.corners[nearest.count] = *corner;
            nearest.count += 1;
        }
        nearest
    }

    fn kept(&self) -> &[Corner] {
        &self.corners[..self.count]
    }

    fn mix(&self, point: fn(&Corner) -> DVec3) -> DVec3 {
        let shared = self.kept().iter().zip(&self.shares);
        shared.map(|(corner, share)| point(corner) * *share).sum()
    }

    fn gap(&self) -> Gap {
        let distance_m = self.point.length();
        Gap {
            distance_m: if distance_m > MEETING_M {
                distance_m
            } else {
                0.0
            },
            middle_m: 0.5 * (self.mix(|corner| corner.one) + self.mix(|corner| corner.other)),
        }
    }
}

/// The corners of a simplex whose bits are set.
fn of_part(simplex: &[Corner], chosen: u32) -> impl Iterator<Item = &Corner> {
    let corners = simplex.iter().enumerate();
    let is_chosen = move |index: usize| chosen >> index & 1 == 1;
    corners.filter_map(move |(index, corner)| is_chosen(index).then_some(corner))
}

/// The corners' weights in the point of their hull's plane nearest to the origin; `None` if it lies outside the hull.
fn shares(part: &[DVec3]) -> Option<[f64; 4]> {
    let (anchor, rest) = part.split_first()?;
    let anchor = *anchor;
    let along = |index: usize| rest[index] - anchor;
    let rest_shares: [f64; 3] = match rest.len() {
        0 => [0.0; 3],
        1 => {
            let line = along(0);
            [-anchor.dot(line) / line.length_squared(), 0.0, 0.0]
        }
        2 => {
            let (one, other) = (along(0), along(1));
            let (one2, both, other2) = (one.dot(one), one.dot(other), other.dot(other));
            let determinant = one2 * other2 - both * both;
            let (to_one, to_other) = (-anchor.dot(one), -anchor.dot(other));
            [
                (to_one * other2 - to_other * both) / determinant,
                (to_other * one2 - to_one * both) / determinant,
                0.0,
            ]
        }
        _ => {
            let space = DMat3::from_cols(along(0), along(1), along(2));
            (space.inverse() * -anchor).to_array()
        }
    };
    let [one, two, three] = rest_shares;
    let shares = [1.0 - (one + two + three), one, two, three];
    // NaN, from corners on one line or plane, counts as outside.
    shares.iter().all(|share| *share >= 0.0).then_some(shares)
}

fn farthest(points: &[DVec3], direction: DVec3) -> DVec3 {
    let mut farthest = (f64::NEG_INFINITY, DVec3::ZERO);
    for point in points {
        let reach = point.dot(direction);
        if reach > farthest.0 {
            farthest = (reach, *point);
        }
    }
    farthest.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::cuboid::Cuboid;
    use crate::geometry::mesh::Mesh;

    fn cuboid(base: [f64; 3], size: [f64; 3], yaw_deg: f64) -> Vec<DVec3> {
        let cuboid = Cuboid::new(DVec3::from_array(base), DVec3::from_array(size), yaw_deg);
        cuboid.corners_in_world().to_vec()
    }

    fn assert_gap(one: &[DVec3], other: &[DVec3], expected_m: f64) {
        for (one, other) in [(one, other), (other, one)] {
            let found = gap(one, DVec3::ZERO, other).distance_m;
            assert!((found - expected_m).abs() < 1e-9, "{found} {expected_m}");
        }
    }

    #[test]
    fn boxes_face_to_face_edge_to_edge_and_corner_to_corner() {
        let one = cuboid([0.0, 0.0, 0.0], [2.0, 2.0, 2.0], 0.0);
        for (base, expected_m) in [
            ([3.0, 0.3, 0.1], 1.5),
            ([0.2, 0.1, 5.0], 3.0),
            ([2.5, 3.5, 0.0], f64::hypot(1.0, 2.0)),
            ([2.5, 3.5, 4.0], 3.0),
            ([1.4, 0.0, 0.0], 0.0),
            ([0.0, 0.0, 0.5], 0.0),
        ] {
            assert_gap(&one, &cuboid(base, [1.0, 1.0, 1.0], 0.0), expected_m);
        }
        // The corner of a rotated box against a face.
        let turned = cuboid([3.0, 0.0, 0.0], [1.0, 1.0, 1.0], 45.0);
        assert_gap(&one, &turned, 2.0 - 0.5_f64.sqrt());
    }

    #[test]
    fn the_middle_lies_between_the_nearest_points() {
        let one = cuboid([0.0, 0.0, 0.0], [2.0, 2.0, 2.0], 0.0);
        let point = [DVec3::new(0.0, 0.0, 0.0)];
        let found = gap(&point, DVec3::new(4.0, 0.25, 0.5), &one);
        assert!((found.distance_m - 3.0).abs() < 1e-9);
        assert!(found.middle_m.abs_diff_eq(DVec3::new(2.5, 0.25, 0.5), 1e-9));
    }

    #[test]
    fn round_bodies_and_flat_ones() {
        let ball = Mesh::ellipsoid(DVec3::splat(1.0));
        let other: Vec<DVec3> = ball
            .vertices_m()
            .iter()
            .map(|vertex| *vertex + DVec3::new(3.0, 0.0, 0.0))
            .collect();
        let found = gap(ball.vertices_m(), DVec3::ZERO, &other).distance_m;
        assert!((found - 2.0).abs() < 0.01, "{found}");
        let sheet = [
            DVec3::new(-1.0, -1.0, 2.0),
            DVec3::new(1.0, -1.0, 2.0),
            DVec3::new(0.0, 1.0, 2.0),
        ];
        assert_gap(ball.vertices_m(), &sheet, 1.0);
        assert_gap(&sheet, &[DVec3::new(0.0, 0.0, 2.0)], 0.0);
    }
}
