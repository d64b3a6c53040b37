//! A contact sheet: frames side by side, each above its time, on one color scale.

use super::frames::Frames;
use super::rows::{Out, Rows};
use crate::error::ExportError;
use crate::tiles::{self, Tile};
use grideye_draw::number::{float, whole};

/// Maximum frames on one sheet; of more, every second, third … is shown.
const FRAMES_MAX: usize = 120;

/// Writes up to 120 frames side by side as a PNG.
pub(super) fn write(rows: Rows<'_>, out: &mut dyn Out) -> Result<String, ExportError> {
    let frames = Frames::of(rows)?;
    let step = frames.count().div_ceil(FRAMES_MAX);
    let shown = frames.every(step);
    let tile = tiles::tile(frames.size, FRAME_WIDTH);
    let widest = (WIDTH_MAX / tile.width).max(1);
    let square = float(shown.len()) * float(tile.height) / float(tile.width);
    let per_row = whole(square.sqrt().ceil() * 1.25).clamp(1, widest);
    let rows_of_tiles = shown.chunks(per_row).map(|frames| {
        let tiles = frames
            .iter()
            .map(|(image, text)| (&image[..], text.clone()));
        tiles.collect()
    });
    let rows_of_tiles: Vec<Vec<Tile<'_>>> = rows_of_tiles.collect();
    let picture = tiles::draw(&rows_of_tiles, frames.size, frames.scale()?, tile);
    picture.png(&[], out)?;
    let left_out = frames.left_out(step);
    Ok(format!("a sheet of {} frames{left_out}", shown.len()))
}

/// So that a frame is easy to see, in dots.
const FRAME_WIDTH: usize = 160;
const WIDTH_MAX: usize = 1_800;
