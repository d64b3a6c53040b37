//! Projects the room onto the page, in perspective or from straight above.

use crate::plane::Plane;
use glam::{DVec2, DVec3};
use grideye_scene::polygon::bounds;

#[derive(Debug, Clone, Copy)]
pub(crate) struct Panel {
    pub(crate) corner: DVec2,
    pub(crate) size: DVec2,
}

impl Panel {
    pub(crate) const fn new(left: f64, top: f64, width: f64, height: f64) -> Self {
        Self {
            corner: DVec2::new(left, top),
            size: DVec2::new(width, height),
        }
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Camera {
    eye_m: Option<DVec3>,
    target_m: DVec3,
    /// To the right and up on the page, and from the page to the eye.
    right: DVec3,
    up: DVec3,
    towards_eye: DVec3,
    scale: f64,
    offset: DVec2,
}

impl Camera {
    /// From the front left, above, like the paper's figures.
    pub(crate) fn perspective(bounds_m: (DVec3, DVec3), panel: &Panel) -> Self {
        let (sin_turn, cos_turn) = libm::sincos(TURN_RAD);
        let (sin_rise, cos_rise) = libm::sincos(RISE_RAD);
        let towards_eye = DVec3::new(-sin_turn * cos_rise, -cos_turn * cos_rise, sin_rise);
        let right = DVec3::new(cos_turn, -sin_turn, 0.0);
        let target_m = 0.5 * (bounds_m.0 + bounds_m.1);
        let away_m = AWAY * bounds_m.0.distance(bounds_m.1);
        Self {
            eye_m: Some(target_m + away_m * towards_eye),
            target_m,
            right,
            up: towards_eye.cross(right),
            towards_eye,
            scale: 1.0,
            offset: DVec2::ZERO,
        }
        .fitted(bounds_m, panel)
    }

    /// Like a map: right is right, back is up.
    pub(crate) fn from_above(bounds_m: (DVec3, DVec3), panel: &Panel) -> Self {
        Self {
            eye_m: None,
            target_m: 0.5 * (bounds_m.0 + bounds_m.1),
            right: DVec3::X,
            up: DVec3::Y,
            towards_eye: DVec3::Z,
            scale: 1.0,
            offset: DVec2::ZERO,
        }
        .fitted(bounds_m, panel)
    }

    pub(crate) fn project(&self, point_m: DVec3) -> DVec2 {
        let from_target_m = point_m - self.target_m;
        let shrink = self.eye_m.map_or(1.0, |eye_m| {
            let away_m = eye_m.distance(self.target_m);
            away_m / (away_m - from_target_m.dot(self.towards_eye))
        });
        let across = from_target_m.dot(self.right) * shrink;
        let down = -from_target_m.dot(self.up) * shrink;
        self.offset + self.scale * DVec2::new(across, down)
    }

    /// Positive if the eye is on the side that the plane's normal points to.
    pub(crate) fn side_of(&self, plane: &Plane) -> f64 {
        self.eye_m.map_or_else(
            || plane.normal.dot(self.towards_eye),
            |eye_m| plane.height_m(eye_m),
        )
    }

    /// Whether the eye is on the side from which a face's corners run counter-clockwise.
    pub(crate) fn sees(&self, face: &[DVec3]) -> bool {
        Plane::of_face(face).is_some_and(|plane| self.side_of(&plane) > 1e-9)
    }

    pub(crate) fn depth_m(&self, point_m: DVec3) -> f64 {
        let eye_m = self.eye_m.unwrap_or(self.target_m);
        (eye_m - point_m).dot(self.towards_eye)
    }

    /// The direction from a point to the eye.
    pub(crate) fn towards_eye_from(&self, point_m: DVec3) -> DVec3 {
        self.eye_m
            .map_or(self.towards_eye, |eye_m| (eye_m - point_m).normalize())
    }

    fn fitted(mut self, (low_m, high_m): (DVec3, DVec3), panel: &Panel) -> Self {
        let corners = (0..8_u8).map(|corner| {
            let pick = |bit: u8, low: f64, high: f64| if corner & bit == 0 { low } else { high };
            self.project(DVec3::new(
                pick(1, low_m.x, high_m.x),
                pick(2, low_m.y, high_m.y),
                pick(4, low_m.z, high_m.z),
            ))
        });
        let (low, high) = bounds(corners);
        let room = panel.size - 2.0 * MARGIN;
        self.scale = (room / (high - low).max(DVec2::splat(1e-9))).min_element();
        let middle = panel.corner + 0.5 * panel.size;
        self.offset = middle - self.scale * 0.5 * (low + high);
        self
    }
}

/// The eye is this far to the left of the front, 33 degrees …
const TURN_RAD: f64 = 0.58;
/// … and this far above horizontal, 26 degrees.
const RISE_RAD: f64 = 0.45;
const AWAY: f64 = 2.0;
const MARGIN: f64 = 36.0;

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS_M: (DVec3, DVec3) = (DVec3::ZERO, DVec3::new(4.0, 6.0, 2.7));
    const PANEL: Panel = Panel::new(100.0, 50.0, 500.0, 400.0);

    #[test]
    fn the_map_has_right_at_the_right_and_back_at_the_top_at_one_scale() {
        let camera = Camera::from_above(BOUNDS_M, &PANEL);
        let origin = camera.project(DVec3::ZERO);
        let right = camera.project(DVec3::new(1.0, 0.0, 2.0)) - origin;
        let back = camera.project(DVec3::new(0.0, 1.0, 0.5)) - origin;
        assert!((right - DVec2::new(camera.scale, 0.0)).length() < 1e-9);
        assert!((back - DVec2::new(0.0, -camera.scale)).length() < 1e-9);
        // 6 m fill the height between the margins.
        assert!((camera.scale - (400.0 - 2.0 * MARGIN) / 6.0).abs() < 1e-9);
        assert!(
            (camera.project(DVec3::new(2.0, 3.0, 0.0)) - DVec2::new(350.0, 250.0)).length() < 1e-9
        );
    }

    #[test]
    fn in_perspective_near_is_larger_up_is_up_and_the_room_fits() {
        let camera = Camera::perspective(BOUNDS_M, &PANEL);
        let length = |from: DVec3, to: DVec3| camera.project(from).distance(camera.project(to));
        let up = DVec3::Z;
        let (near, far) = (DVec3::ZERO, DVec3::new(4.0, 6.0, 0.0));
        assert!(length(near, near + up) > 1.2 * length(far, far + up));
        assert!(camera.project(up).y < camera.project(DVec3::ZERO).y);
        assert!(camera.project(DVec3::X).x > camera.project(DVec3::ZERO).x);
        let margin = DVec2::splat(MARGIN - 1e-9);
        let (right, left) = (DVec3::new(4.0, 0.0, 2.7), DVec3::new(0.0, 6.0, 2.7));
        for corner in [near, far, right, left] {
            let from_corner = camera.project(corner) - PANEL.corner;
            let inside = from_corner.clamp(margin, PANEL.size - margin);
            assert_eq!(from_corner, inside, "{corner}");
        }
        // A straight line stays straight.
        let (from, to) = (DVec3::new(0.5, 1.0, 0.2), DVec3::new(3.0, 5.0, 2.0));
        let [a, b, c] = [from, 0.5 * (from + to), to].map(|point| camera.project(point));
        assert!((b - a).perp_dot(c - a).abs() < 1e-6);
    }

    fn side(camera: &Camera, normal: DVec3, offset_m: f64) -> f64 {
        camera.side_of(&Plane { normal, offset_m })
    }

    #[test]
    fn the_eye_is_above_the_floor_and_in_front_of_the_room() {
        for camera in [
            Camera::perspective(BOUNDS_M, &PANEL),
            Camera::from_above(BOUNDS_M, &PANEL),
        ] {
            assert!(side(&camera, DVec3::Z, 0.0) > 0.0);
        }
        let camera = Camera::perspective(BOUNDS_M, &PANEL);
        assert!(side(&camera, -DVec3::Y, 0.0) > 0.0);
        // The eye is left of the room's center, but not infinitely far: it is on the right side of a plane farther
        // left.
        assert!(side(&camera, -DVec3::X, 1000.0) < 0.0);
    }
}
