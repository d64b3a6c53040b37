//! Rounds numbers for the page.

/// Degrees, to the hundredth.
pub(crate) fn hundredths(number: f64) -> f64 {
    (number * 100.0).round() / 100.0
}

/// Meters, to the millimeter.
fn millimeters(meters: f64) -> f64 {
    (meters * 1000.0).round() / 1000.0
}

/// A point of the room, in meters.
pub(crate) fn point(at: impl Into<[f64; 3]>) -> [f64; 3] {
    at.into().map(millimeters)
}

/// Points of the floor, in meters.
pub(crate) fn flat(points: impl IntoIterator<Item: Into<[f64; 2]>>) -> Vec<[f64; 2]> {
    let points = points.into_iter();
    points.map(|at| at.into().map(millimeters)).collect()
}
