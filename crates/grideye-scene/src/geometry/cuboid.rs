//! An upright box.

use crate::geometry::angle::rotation_z_deg;
use glam::{DMat3, DVec3};

/// An upright box, rotated about the vertical through the center of its base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cuboid {
    base_m: DVec3,
    size_m: DVec3,
    world_from_box: DMat3,
}

impl Cuboid {
    /// A box of `size_m` with the center of its base at `base_m`, rotated counter-clockwise as seen from above.
    #[must_use]
    pub fn new(base_m: DVec3, size_m: DVec3, yaw_deg: f64) -> Self {
        Self {
            base_m,
            size_m,
            world_from_box: rotation_z_deg(yaw_deg),
        }
    }

    /// The eight corners in the room. In a corner's index, bit 0 means far x, bit 1 far y, bit 2 far z.
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
        // Counter-clockwise: near left moves to near right.
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
