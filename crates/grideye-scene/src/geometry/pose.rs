//! A sensor's position and orientation.

use crate::geometry::angle::{rotation_x_deg, rotation_y_deg, rotation_z_deg};
use glam::{DMat3, DVec3};

/// A sensor's position and orientation: `world_from_sensor = Rz(azimuth) Ry(elevation) Rx(roll)`, right-handed.
///
/// The sensor's axes are x forward, y to its left, z to the top of its image. Elevation 90° looks straight down, with
/// the image's top towards the azimuth: 0° is +x, 90° is +y. At the paper's -90° the room's right appears on the left
/// (PeerJ CS 11:e3124, scenario B): a rotation, never a mirror image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Position in the room, meters.
    pub position_m: DVec3,
    /// Angle of the optical axis below the horizontal, radians, -π/2 to π/2.
    pub elevation_rad: f64,
    /// Heading, radians counter-clockwise from +x as seen from above.
    pub azimuth_rad: f64,
    /// Turn about the optical axis, radians, clockwise as seen from behind the sensor.
    pub roll_rad: f64,
    sensor_from_world: DMat3,
}

impl Pose {
    /// From degrees, as in scene files. Multiples of 90° are exact.
    #[must_use]
    pub fn from_degrees(
        position_m: DVec3,
        elevation_deg: f64,
        azimuth_deg: f64,
        roll_deg: f64,
    ) -> Self {
        let world_from_sensor =
            rotation_z_deg(azimuth_deg) * rotation_y_deg(elevation_deg) * rotation_x_deg(roll_deg);
        Self {
            position_m,
            elevation_rad: elevation_deg.to_radians(),
            azimuth_rad: azimuth_deg.to_radians(),
            roll_rad: roll_deg.to_radians(),
            sensor_from_world: world_from_sensor.transpose(),
        }
    }

    /// The pose turned about the vertical, degrees counter-clockwise as seen from above.
    #[must_use]
    pub fn turned(self, by_deg: f64) -> Self {
        let turned = rotation_z_deg(by_deg) * self.world_from_sensor();
        Self {
            azimuth_rad: self.azimuth_rad + by_deg.to_radians(),
            sensor_from_world: turned.transpose(),
            ..self
        }
    }

    /// The pose after its view turns in its own image: toward the right, then toward the bottom. At every pose these are
    /// two directions, where elevation and azimuth have only one at the zenith and nadir. The angles are those of the
    /// result.
    #[must_use]
    pub fn tilted(self, right_deg: f64, down_deg: f64) -> Self {
        if right_deg == 0.0 && down_deg == 0.0 {
            return self;
        }
        let turned =
            self.world_from_sensor() * rotation_z_deg(-right_deg) * rotation_y_deg(down_deg);
        let forward = turned.x_axis;
        let level = forward.truncate();
        let elevation_rad = libm::atan2(-forward.z, level.length());
        // Straight up or down, azimuth and roll are the same turn: keep the azimuth.
        let azimuth_rad = if level.length() > 1e-12 {
            libm::atan2(forward.y, forward.x)
        } else {
            self.azimuth_rad
        };
        let upright =
            rotation_z_deg(azimuth_rad.to_degrees()) * rotation_y_deg(elevation_rad.to_degrees());
        let left = upright.transpose() * turned.y_axis;
        Self {
            elevation_rad,
            azimuth_rad,
            roll_rad: libm::atan2(left.z, left.y),
            sensor_from_world: turned.transpose(),
            ..self
        }
    }

    /// The rotation from sensor to room coordinates.
    #[must_use]
    pub fn world_from_sensor(&self) -> DMat3 {
        self.sensor_from_world.transpose()
    }

    /// A point of the room in the sensor's coordinates: meters forward, left and up.
    #[must_use]
    pub fn point_in_sensor(&self, point_in_world_m: DVec3) -> DVec3 {
        self.sensor_from_world * (point_in_world_m - self.position_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes(elevation_deg: f64, azimuth_deg: f64, roll_deg: f64) -> (DVec3, DVec3, DVec3) {
        let world_from_sensor =
            Pose::from_degrees(DVec3::ZERO, elevation_deg, azimuth_deg, roll_deg)
                .world_from_sensor();
        let (forward, left, up) = (
            world_from_sensor.x_axis,
            world_from_sensor.y_axis,
            world_from_sensor.z_axis,
        );
        (forward, -left, up)
    }

    #[test]
    fn orientations_match_the_documentation() {
        let (right, back, up) = (DVec3::X, DVec3::Y, DVec3::Z);
        assert_eq!(axes(0.0, 0.0, 0.0), (right, -back, up));
        assert_eq!(axes(90.0, 0.0, 0.0), (-up, -back, right));
        assert_eq!(
            axes(90.0, -90.0, 0.0),
            (-up, -right, -back),
            "front at the top, right at the left"
        );
        assert_eq!(axes(90.0, 90.0, 0.0), (-up, right, back), "as on a map");
        assert_eq!(axes(-90.0, 0.0, 0.0), (up, -back, -right));
        assert_eq!(axes(0.0, -90.0, 0.0).0, -back);
        assert_eq!(axes(0.0, 180.0, 0.0).0, -right);
        assert_eq!(
            axes(0.0, 0.0, 90.0),
            (right, -up, -back),
            "the top leans to the sensor's right"
        );
        let (forward, ..) = axes(45.0, -90.0, 0.0);
        assert!((forward - DVec3::new(0.0, -0.5_f64.sqrt(), -0.5_f64.sqrt())).length() < 1e-15);
    }

    /// The angles of a tilted pose make the same rotation, and the tilt goes where the image says.
    #[test]
    fn a_tilt_moves_the_view_in_the_image_at_every_pose() {
        for (elevation_deg, azimuth_deg, roll_deg) in [
            (90.0, -90.0, 0.0),
            (-90.0, 20.0, 0.0),
            (0.0, 0.0, 0.0),
            (37.0, 110.0, -25.0),
        ] {
            let pose = Pose::from_degrees(DVec3::ZERO, elevation_deg, azimuth_deg, roll_deg);
            let tilted = pose.tilted(3.0, -2.0);
            let (right, bottom) = (
                -pose.world_from_sensor().y_axis,
                -pose.world_from_sensor().z_axis,
            );
            let forward = tilted.world_from_sensor().x_axis;
            let (three, two) = (3.0_f64.to_radians(), 2.0_f64.to_radians());
            assert!((forward.dot(right) - three.sin() * two.cos()).abs() < 1e-12);
            assert!((forward.dot(bottom) + two.sin()).abs() < 1e-12);
            let again = Pose::from_degrees(
                DVec3::ZERO,
                tilted.elevation_rad.to_degrees(),
                tilted.azimuth_rad.to_degrees(),
                tilted.roll_rad.to_degrees(),
            );
            let apart = again.world_from_sensor() - tilted.world_from_sensor();
            assert!(
                apart.to_cols_array().iter().all(|part| part.abs() < 1e-12),
                "{apart}"
            );
            assert_eq!(pose.tilted(0.0, 0.0), pose);
        }
    }
}
