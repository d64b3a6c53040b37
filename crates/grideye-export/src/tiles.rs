//! Images of equal size side by side, on one color scale.

use crate::error::ExportError;
use grideye_draw::thermogram::{GAP, SCALE_WITH_NUMBERS, Scale, TEXT_HEIGHT, Thermogram};
use std::io::Write;

/// Writes the images (°C, row by row from the top left) in one row, numbered from 1, as a PNG.
///
/// # Errors
/// If writing fails, or a temperature is not a number.
pub fn write(
    images: &[&[f64]],
    (columns, rows): (usize, usize),
    out: &mut dyn Write,
) -> Result<(), ExportError> {
    let celsius = images.iter().flat_map(|image| image.iter().copied());
    let scale = Scale::of(celsius).ok_or(ExportError::NotANumber)?;
    let cell = (TILE_WIDTH / columns.max(rows)).clamp(1, 20);
    let tile = columns * cell + GAP;
    let height = (rows * cell).max(SCALE_HEIGHT_MIN) + TEXT_HEIGHT + 3 * GAP;
    let mut picture = Thermogram::new(
        GAP + images.len() * tile + SCALE_WITH_NUMBERS + GAP,
        height,
        scale,
    );
    for (index, image) in images.iter().enumerate() {
        let left = GAP + index * tile;
        picture.frame((left, GAP), image, columns, cell);
        picture.text((left, GAP + rows * cell + 6), &format!("{}", index + 1));
    }
    let scale_height = (rows * cell).max(SCALE_HEIGHT_MIN);
    picture.color_scale((GAP + images.len() * tile, GAP), scale_height);
    Ok(picture.png(&[], out)?)
}

const TILE_WIDTH: usize = 234;
const SCALE_HEIGHT_MIN: usize = 160;
