//! Lengths as messages have them: millimetres.

use glam::DVec3;

pub(crate) const MM_PER_M: f64 = 1000.0;

pub(crate) fn reach((low, high): (DVec3, DVec3)) -> String {
    format!("from {} to {}", millimetres(low), millimetres(high))
}

pub(crate) fn millimetres(metres: DVec3) -> String {
    // To a thousandth: what is left of a rotation's rounding would only hide the number.
    let [x, y, z] = (metres * MM_PER_M * 1000.0)
        .round()
        .to_array()
        .map(|micrometres| micrometres / 1000.0 + 0.0);
    format!("[{x}, {y}, {z}]")
}
