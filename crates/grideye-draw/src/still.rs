//! One frame as an image of the present moment: raw pixels beside their color scale.

use crate::thermogram::{GAP, SCALE_WITH_NUMBERS, Scale, TEXT_HEIGHT, Thermogram};
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use std::io;

/// Dots per side of a pixel.
const CELL: usize = 40;
/// As on the live page; a narrower scale would show the sensor's noise as if it were heat.
const SPAN_MIN_C: f64 = 4.0;

/// A PNG of the frame with pixel 1 at the top left. Its text chunks hold both ends of the scale in °C and the frame's
/// `seq`.
///
/// # Errors
/// None known, because it writes to memory.
pub fn png(celsius: &[f32; PIXELS], seq: u64) -> io::Result<Vec<u8>> {
    let celsius = celsius.map(f64::from);
    let scale = scale(&celsius);
    let (width, height) = (COLUMNS * CELL, ROWS * CELL);
    let mut picture = Thermogram::new(
        width + SCALE_WITH_NUMBERS + 3 * GAP,
        height + 2 * GAP,
        scale,
    );
    picture.frame((GAP, GAP), &celsius, COLUMNS, CELL);
    picture.color_scale((width + 2 * GAP, GAP), height - TEXT_HEIGHT - GAP);
    let about = [
        ("low_celsius", scale.low_c.to_string()),
        ("high_celsius", scale.high_c.to_string()),
        ("seq", seq.to_string()),
    ];
    let mut png = Vec::new();
    picture.png(&about, &mut png)?;
    Ok(png)
}

/// Whole degrees around all pixels, so that noise alone rarely moves the scale.
fn scale(celsius: &[f64]) -> Scale {
    let each = || celsius.iter().copied();
    let mut low_c = each().fold(f64::INFINITY, f64::min).floor();
    let mut high_c = each().fold(f64::NEG_INFINITY, f64::max).ceil();
    while high_c - low_c < SPAN_MIN_C {
        high_c += 1.0;
        if high_c - low_c < SPAN_MIN_C {
            low_c -= 1.0;
        }
    }
    Scale { low_c, high_c }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_is_whole_degrees_and_never_narrow() {
        for (low, high, expected) in [
            (20.25, 20.5, (19.0, 23.0)),
            (18.0, 30.25, (18.0, 31.0)),
            (-3.75, -0.25, (-4.0, 0.0)),
        ] {
            let Scale { low_c, high_c } = scale(&[low, high]);
            assert_eq!((low_c, high_c), expected, "{low} to {high}");
        }
    }
}
