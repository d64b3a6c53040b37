//! Lengths and places in millimeters, for messages.

use glam::DVec3;

pub(crate) const MM_PER_M: f64 = 1000.0;

pub(crate) fn reach((low, high): (DVec3, DVec3)) -> String {
    format!("from {} to {}", millimeters(low), millimeters(high))
}

pub(crate) fn millimeters(meters: DVec3) -> String {
    // Round to a thousandth of a millimeter, because rounding errors of rotations would only obscure the number.
    let micrometers = (meters * MM_PER_M * 1000.0).round();
    let [x, y, z] = micrometers.to_array().map(|number| number / 1000.0 + 0.0);
    format!("[{x}, {y}, {z}]")
}
