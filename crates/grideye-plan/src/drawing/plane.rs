//! A plane in the room.

use glam::DVec3;

/// A plane: the points whose product with `normal`, of length 1, is `offset_m`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    pub(super) normal: DVec3,
    pub(super) offset_m: f64,
}

impl Plane {
    /// The plane of a flat face, by Newell's sum; `None` if it has no area.
    pub(super) fn of_face(points_m: &[DVec3]) -> Option<Self> {
        let (first, last) = (*points_m.first()?, *points_m.last()?);
        let mut previous = last;
        let mut sum = DVec3::ZERO;
        for point in points_m {
            sum += (previous - first).cross(*point - first);
            previous = *point;
        }
        let normal = sum.try_normalize()?;
        Some(Self {
            normal,
            offset_m: normal.dot(first),
        })
    }

    pub(super) fn height_m(&self, point_m: DVec3) -> f64 {
        self.normal.dot(point_m) - self.offset_m
    }
}
