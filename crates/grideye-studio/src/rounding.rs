//! Numbers as the page is sent them.

/// Degrees, to the hundredth.
pub(crate) fn hundredths(number: f64) -> f64 {
    (number * 100.0).round() / 100.0
}

/// Metres, to the millimetre.
pub(crate) fn millimetres(metres: f64) -> f64 {
    (metres * 1000.0).round() / 1000.0
}

/// Points of the floor, in metres.
pub(crate) fn flat(points: impl Iterator<Item = (f64, f64)>) -> Vec<[f64; 2]> {
    points.map(|(x, y)| [x, y].map(millimetres)).collect()
}
