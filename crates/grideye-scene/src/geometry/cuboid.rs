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
    /// A box of `size_m` with the middle of its underside at `base_m`, turned counter-clockwise seen from above.
    #[must_use]
    pub fn new(base_m: DVec3, size_m: DVec3, yaw_deg: f64) -> Self {
        Self {
            base_m,
            size_m,
            world_from_box: rotation_z_deg(yaw_deg),
        }
    }

    /// The eight corners in the room; a corner's index has bit 0 for far x, bit 1 for far y, bit 2 for far z.
    #[must_use]
    pub fn corners_in_world(&self) -> [DVec3; 8] {
        let half = 0.5 * self.size_m;
        let center_m = self.base_m + DVec3::new(0.0, 0.0, 0.5 * self.size_m.z);
        let sign = |set: bool| if set { 1.0 } else { -1.0 };
        std::array::from_fn(|corner| {
            let corner_in_box = half
                * DVec3::new(
                    sign(corner & 1 != 0),
                    sign(corner & 2 != 0),
                    sign(corner & 4 != 0),
                );
            center_m + self.world_from_box * corner_in_box
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_swaps_the_sides() {
        let table = Cuboid::new(DVec3::new(2.0, 3.0, 0.5), DVec3::new(2.0, 1.0, 0.75), 90.0);
        let corners = table.corners_in_world();
        // Counter-clockwise: near left goes to near right.
        for (corner, expected) in [
            (0, [2.5, 2.0, 0.5]),
            (1, [2.5, 4.0, 0.5]),
            (2, [1.5, 2.0, 0.5]),
            (7, [1.5, 4.0, 1.25]),
        ] {
            assert_eq!(corners[corner], DVec3::from_array(expected), "{corner}");
        }
    }
}
