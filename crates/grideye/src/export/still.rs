//! One frame as a picture for who looks at it now: raw cells and the scale of their colours.

use super::picture::{GAP, Picture, SCALE_WITH_NUMBERS, Scale, TEXT_HEIGHT, palette};
use anyhow::Result;
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use grideye_scene::Image;

/// Dots of a pixel's side.
const CELL: usize = 40;
/// As on the live page: less would show the sensor's noise as if it were heat.
const SPAN_MIN_C: f64 = 4.0;

/// A PNG of the frame with pixel 1 at the top left; its text chunks are the scale's ends in °C and the frame's number.
pub(crate) fn png(celsius: &[f32; PIXELS], seq: u64) -> Result<Vec<u8>> {
    let image = Image {
        columns: COLUMNS,
        rows: ROWS,
        celsius: celsius.iter().copied().map(f64::from).collect(),
    };
    let scale = scale(&image.celsius);
    let (width, height) = (COLUMNS * CELL, ROWS * CELL);
    let mut picture = Picture::new(width + SCALE_WITH_NUMBERS + 3 * GAP, height + 2 * GAP);
    picture.frame((GAP, GAP), &image, CELL, scale);
    let scale_height = height - TEXT_HEIGHT - GAP;
    picture.color_scale((width + 2 * GAP, GAP), scale_height, scale);
    let mut png = Vec::new();
    let (width, height) = (
        u32::try_from(picture.width)?,
        u32::try_from(picture.height)?,
    );
    let mut encoder = png::Encoder::new(&mut png, width, height);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette());
    encoder.add_text_chunk("low_celsius".to_owned(), scale.low_c.to_string())?;
    encoder.add_text_chunk("high_celsius".to_owned(), scale.high_c.to_string())?;
    encoder.add_text_chunk("seq".to_owned(), seq.to_string())?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&picture.dots)?;
    writer.finish()?;
    Ok(png)
}

/// Whole degrees around all pixels, so that the scale holds still while the noise does not.
fn scale(celsius: &[f64]) -> Scale {
    let mut low_c = celsius
        .iter()
        .copied()
        .fold(f64::INFINITY, f64::min)
        .floor();
    let mut high_c = celsius
        .iter()
        .copied()
        .fold(f64::NEG_INFINITY, f64::max)
        .ceil();
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
