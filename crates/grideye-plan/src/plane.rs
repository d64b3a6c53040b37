//! Planes of flat faces.

use glam::DVec3;

/// A plane: the points with product `offset_m` with the unit vector `normal`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    pub(crate) normal: DVec3,
    pub(crate) offset_m: f64,
}

impl Plane {
    /// The plane of a flat face, by Newell's sum; `None` if it has no area. Its normal is on the side from which the corners
    /// run counter-clockwise.
    pub(crate) fn of_face(corners_m: &[DVec3]) -> Option<Self> {
        let (first, last) = (*corners_m.first()?, *corners_m.last()?);
        let mut previous = last;
        let mut sum = DVec3::ZERO;
        for corner in corners_m {
            sum += (previous - first).cross(*corner - first);
            previous = *corner;
        }
        let normal = sum.try_normalize()?;
        Some(Self {
            normal,
            offset_m: normal.dot(first),
        })
    }

    pub(crate) fn height_m(&self, point_m: DVec3) -> f64 {
        self.normal.dot(point_m) - self.offset_m
    }
}
