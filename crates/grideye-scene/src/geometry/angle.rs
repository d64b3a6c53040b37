//! Rotations about the axes of the room.

use glam::{DMat3, DVec3};

/// Sine and cosine of an angle in degrees, exact at every multiple of 90 and identical on every machine.
pub(crate) fn sin_cos_deg(angle_deg: f64) -> (f64, f64) {
    let quarter_turns = (angle_deg / 90.0).round();
    let (sin, cos) = libm::sincos((angle_deg - 90.0 * quarter_turns).to_radians());
    match quarter_turns.rem_euclid(4.0) {
        turns if turns < 0.5 => (sin, cos),
        turns if turns < 1.5 => (cos, -sin),
        turns if turns < 2.5 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Right-handed rotation about x: y turns towards z.
pub(crate) fn rotation_x_deg(angle_deg: f64) -> DMat3 {
    let (sin, cos) = sin_cos_deg(angle_deg);
    DMat3::from_cols(
        DVec3::X,
        DVec3::new(0.0, cos, sin),
        DVec3::new(0.0, -sin, cos),
    )
}

/// Right-handed rotation about y: z turns towards x, so x turns downwards.
pub(crate) fn rotation_y_deg(angle_deg: f64) -> DMat3 {
    let (sin, cos) = sin_cos_deg(angle_deg);
    DMat3::from_cols(
        DVec3::new(cos, 0.0, -sin),
        DVec3::Y,
        DVec3::new(sin, 0.0, cos),
    )
}

/// Right-handed rotation about z: x turns towards y, counter-clockwise as seen from above.
pub(crate) fn rotation_z_deg(angle_deg: f64) -> DMat3 {
    let (sin, cos) = sin_cos_deg(angle_deg);
    DMat3::from_cols(
        DVec3::new(cos, sin, 0.0),
        DVec3::new(-sin, cos, 0.0),
        DVec3::Z,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn right_angles_are_exact_and_the_rest_is_the_sine() {
        for (angle, expected) in [
            (0.0, (0.0, 1.0)),
            (90.0, (1.0, 0.0)),
            (180.0, (0.0, -1.0)),
            (270.0, (-1.0, 0.0)),
            (-90.0, (-1.0, 0.0)),
            (360.0, (0.0, 1.0)),
        ] {
            assert_eq!(sin_cos_deg(angle), expected, "{angle}");
        }
        for step in -720..=720 {
            let angle = f64::from(step) * 0.7;
            let (sin, cos) = sin_cos_deg(angle);
            let (sin_expected, cos_expected) = angle.to_radians().sin_cos();
            assert!((sin - sin_expected).abs() < 1e-14, "{angle}");
            assert!((cos - cos_expected).abs() < 1e-14, "{angle}");
        }
    }

    #[test]
    fn rotations_turn_the_right_way() {
        assert_eq!(rotation_x_deg(90.0) * DVec3::Y, DVec3::Z);
        assert_eq!(rotation_y_deg(90.0) * DVec3::X, -DVec3::Z);
        assert_eq!(rotation_z_deg(90.0) * DVec3::X, DVec3::Y);
    }
}
