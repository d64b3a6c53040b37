//! Pictures of one size side by side, on one scale of colours.

use super::picture::{GAP, Picture, SCALE_WITH_NUMBERS, Scale, TEXT_HEIGHT, palette};
use anyhow::Result;
use grideye_scene::Image;
use std::io::Write;

/// Writes the images in one row, numbered from 1, as a PNG.
pub(super) fn write(images: &[&Image], out: &mut dyn Write) -> Result<()> {
    let scale = Scale::of_images(images.iter().copied())?;
    let (columns, rows) = images
        .first()
        .map_or((1, 1), |image| (image.columns, image.rows));
    let cell = (TILE_WIDTH / columns.max(rows)).clamp(1, 20);
    let tile = columns * cell + GAP;
    let height = (rows * cell).max(SCALE_HEIGHT_MIN) + TEXT_HEIGHT + 3 * GAP;
    let mut picture = Picture::new(GAP + images.len() * tile + SCALE_WITH_NUMBERS + GAP, height);
    for (index, image) in images.iter().enumerate() {
        let left = GAP + index * tile;
        picture.frame((left, GAP), image, cell, scale);
        picture.text((left, GAP + rows * cell + 6), &format!("{}", index + 1));
    }
    let scale_height = (rows * cell).max(SCALE_HEIGHT_MIN);
    picture.color_scale((GAP + images.len() * tile, GAP), scale_height, scale);
    write_png(&picture, out)
}

/// The picture as a PNG of palette colours.
pub(super) fn write_png(picture: &Picture, out: &mut dyn Write) -> Result<()> {
    let (width, height) = (
        u32::try_from(picture.width)?,
        u32::try_from(picture.height)?,
    );
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette());
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&picture.dots)?;
    writer.finish()?;
    Ok(())
}

const TILE_WIDTH: usize = 234;
const SCALE_HEIGHT_MIN: usize = 160;
