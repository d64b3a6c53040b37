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
    size: (usize, usize),
    out: &mut dyn Write,
) -> Result<(), ExportError> {
    let all = rows_of_tiles.iter().flatten();
    let scale = Scale::of(all.flat_map(|(image, _)| image.iter().copied()));
    let scale = scale.ok_or(ExportError::NotANumber)?;
    let width = if rows_of_tiles.len() > 1 { 104 } else { 234 };
    let picture = draw(rows_of_tiles, size, scale, tile(size, width));
    Ok(picture.png(&[], out)?)
}

/// The side of a sensor pixel in dots, and width and height of a tile.
#[derive(Clone, Copy)]
pub(crate) struct Sides {
    cell: usize,
    pub(crate) width: usize,
    pub(crate) height: usize,
}

/// The sides of a tile whose image is about this wide.
pub(crate) fn tile((columns, rows): (usize, usize), image_width: usize) -> Sides {
    let cell = (image_width / columns.max(rows)).clamp(1, 20);
    Sides {
        cell,
        width: (columns * cell).max(TEXT_WIDTH) + GAP,
        height: rows * cell + TEXT_HEIGHT + 6 + GAP,
    }
}

pub(crate) fn draw(
    rows_of_tiles: &[Vec<Tile<'_>>],
    (columns, rows): (usize, usize),
    scale: Scale,
    tile: Sides,
) -> Thermogram {
    let most = rows_of_tiles.iter().map(Vec::len).max().unwrap_or(0);
    let tall = GAP + rows_of_tiles.len() * tile.height;
    let height = tall.max(SCALE_HEIGHT_MIN + TEXT_HEIGHT + 3 * GAP);
    let width = GAP + most * tile.width + SCALE_WITH_NUMBERS + GAP;
    let mut picture = Thermogram::new(width, height, scale);
    for (down, tiles) in rows_of_tiles.iter().enumerate() {
        for (across, (image, text)) in tiles.iter().enumerate() {
            let (left, top) = (GAP + across * tile.width, GAP + down * tile.height);
            picture.frame((left, top), image, columns, tile.cell);
            picture.text((left, top + rows * tile.cell + 6), text);
        }
    }
    let scale_height = (height - TEXT_HEIGHT - 3 * GAP).min(SCALE_HEIGHT_MAX);
    picture.color_scale((GAP + most * tile.width, GAP), scale_height);
    picture
}

/// Of a time such as `123.45 s`.
const TEXT_WIDTH: usize = 7 * 12;
const SCALE_HEIGHT_MIN: usize = 160;
const SCALE_HEIGHT_MAX: usize = 480;
