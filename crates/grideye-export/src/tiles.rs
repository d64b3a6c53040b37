//! Images of equal size in rows, on one color scale.

use crate::error::ExportError;
use grideye_draw::thermogram::{GAP, SCALE_WITH_NUMBERS, Scale, TEXT_HEIGHT, Thermogram};
use std::io::Write;

/// An image (°C, row by row from the top left) and what stands below it.
pub type Tile<'a> = (&'a [f64], String);

/// Writes rows of images as a PNG.
///
/// # Errors
/// If writing fails, or a temperature is not a number.
pub fn write(
    rows_of_tiles: &[Vec<Tile<'_>>],
    (columns, rows): (usize, usize),
    out: &mut dyn Write,
) -> Result<(), ExportError> {
    let all = || rows_of_tiles.iter().flatten();
    let scale = Scale::of(all().flat_map(|(image, _)| image.iter().copied()));
    let scale = scale.ok_or(ExportError::NotANumber)?;
    let most = rows_of_tiles.iter().map(Vec::len).max().unwrap_or(0);
    let tile_width = if rows_of_tiles.len() > 1 {
        SMALL_WIDTH
    } else {
        TILE_WIDTH
    };
    let cell = (tile_width / columns.max(rows)).clamp(1, 20);
    let tile = (columns * cell + GAP, rows * cell + TEXT_HEIGHT + 6 + GAP);
    let tall = rows_of_tiles.len() * tile.1;
    let height = GAP + tall.max(SCALE_HEIGHT_MIN + TEXT_HEIGHT + 6 + GAP);
    let mut picture = Thermogram::new(
        GAP + most * tile.0 + SCALE_WITH_NUMBERS + GAP,
        height,
        scale,
    );
    for (down, tiles) in rows_of_tiles.iter().enumerate() {
        for (across, (image, text)) in tiles.iter().enumerate() {
            let (left, top) = (GAP + across * tile.0, GAP + down * tile.1);
            picture.frame((left, top), image, columns, cell);
            picture.text((left, top + rows * cell + 6), text);
        }
    }
    let scale_height = height - TEXT_HEIGHT - 3 * GAP;
    picture.color_scale((GAP + most * tile.0, GAP), scale_height);
    Ok(picture.png(&[], out)?)
}

const TILE_WIDTH: usize = 234;
const SMALL_WIDTH: usize = 104;
const SCALE_HEIGHT_MIN: usize = 160;
