//! Numbers as the page is sent them.

/// Degrees, to the hundredth.
pub(crate) fn hundredths(number: f64) -> f64 {
    (number * 100.0).round() / 100.0
}

/// Meters, to the millimeter.
pub(crate) fn millimeters(meters: f64) -> f64 {
    (meters * 1000.0).round() / 1000.0
}

/// Points of the floor, in meters.
pub(crate) fn flat(points: impl Iterator<Item = (f64, f64)>) -> Vec<[f64; 2]> {
    points.map(|(x, y)| [x, y].map(millimeters)).collect()
}
