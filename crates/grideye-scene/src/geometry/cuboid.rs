//! A box that stands upright.

use crate::geometry::angle::rotation_z_deg;
use glam::{DMat3, DVec3};

/// A box that stands upright, turned about the vertical through the middle of its underside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cuboid {
    base_m: DVec3,
    size_m: DVec3,
    world_from_box: DMat3,
}

impl Cuboid {
    /// A box of `size_m` whose underside has its middle at `base_m`, turned counter-clockwise by `yaw_deg` as seen
    /// from above.
    #[must_use]
    pub fn new(base_m: DVec3, size_m: DVec3, yaw_deg: f64) -> Self {
        Self {
            base_m,
            size_m,
            world_from_box: rotation_z_deg(yaw_deg),
        }
    }

    /// The middle of the underside, metres.
    #[must_use]
    pub const fn base_m(&self) -> DVec3 {
        self.base_m
    }

    /// Length along the box's own x, y and z, metres.
    #[must_use]
    pub const fn size_m(&self) -> DVec3 {
        self.size_m
    }

    /// The same box elsewhere.
    #[must_use]
    pub const fn moved_to(&self, base_m: DVec3) -> Self {
        Self { base_m, ..*self }
    }

    /// The eight corners in the room; a corner's index has bit 0 for far x, bit 1 for far y, bit 2 for far z.
    #[must_use]
    pub fn corners_in_world(&self) -> [DVec3; 8] {
        let half = self.half_m();
        let sign = |set: bool| if set { 1.0 } else { -1.0 };
        std::array::from_fn(|corner| {
            let corner_in_box = half
                * DVec3::new(
                    sign(corner & 1 != 0),
                    sign(corner & 2 != 0),
                    sign(corner & 4 != 0),
                );
            self.centre_m() + self.world_from_box * corner_in_box
        })
    }

    /// The lowest and the highest corner of the upright box, along the room's axes, that holds this one.
    #[must_use]
    pub fn bounds_in_world(&self) -> (DVec3, DVec3) {
        let corners = self.corners_in_world();
        corners
            .iter()
            .fold((corners[0], corners[0]), |(low, high), corner| {
                (low.min(*corner), high.max(*corner))
            })
    }

    pub(crate) fn half_m(&self) -> DVec3 {
        0.5 * self.size_m
    }

    pub(crate) fn centre_m(&self) -> DVec3 {
        self.base_m + DVec3::new(0.0, 0.0, 0.5 * self.size_m.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_swaps_the_sides() {
        let table = Cuboid::new(DVec3::new(2.0, 3.0, 0.5), DVec3::new(2.0, 1.0, 0.75), 90.0);
        assert_eq!(
            table.bounds_in_world(),
            (DVec3::new(1.5, 2.0, 0.5), DVec3::new(2.5, 4.0, 1.25))
        );
        let near_left_bottom = table.corners_in_world()[0];
        assert_eq!(
            near_left_bottom,
            DVec3::new(2.5, 2.0, 0.5),
            "counter-clockwise: near left goes to near right"
        );
    }
}
