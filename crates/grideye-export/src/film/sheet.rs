//! A contact sheet: frames side by side, each above its time, on one color scale.

use super::source::{Film, left_out};
use crate::error::ExportError;
use grideye_draw::number::{float, whole};
use grideye_draw::thermogram::{GAP, SCALE_WITH_NUMBERS, Scale, TEXT_HEIGHT, Thermogram};
use std::io::Write;

/// Maximum frames on one sheet; a longer film shows every second, third … frame.
const FRAMES_MAX: u32 = 120;

/// Writes up to 120 frames side by side as a PNG, calls back after each, and returns a description of the result.
///
/// # Errors
/// If writing fails, or a temperature is not a number.
pub fn write(film: &Film<'_>, out: &mut dyn Write, tick: &dyn Fn()) -> Result<String, ExportError> {
    let step = film.frames.div_ceil(FRAMES_MAX).max(1);
    let shown: Vec<u32> = (0..film.frames).step_by(usize::try_from(step)?).collect();
    let picture = sheet(film, &shown, tick)?;
    picture.png(&[], out)?;
    let left_out = left_out(step, film.frames);
    Ok(format!("a sheet of {} frames{left_out}", shown.len()))
}

fn sheet(film: &Film<'_>, shown: &[u32], tick: &dyn Fn()) -> Result<Thermogram, ExportError> {
    let scale = Scale::of(film.celsius()).ok_or(ExportError::NotANumber)?;
    let cell = cell(film);
    let (frame_width, frame_height) = (film.columns * cell, film.rows * cell);
    let tile = (
        frame_width.max(TIME_WIDTH) + GAP,
        frame_height + TEXT_HEIGHT + 6 + GAP,
    );
    let widest = (WIDTH_MAX / tile.0).max(1);
    let per_row = whole(
        (float(shown.len()) * float(tile.1) / float(tile.0))
            .sqrt()
            .ceil()
            * 1.25,
    )
    .clamp(1, widest)
    .min(shown.len().max(1));
    let tile_rows = shown.len().div_ceil(per_row);
    let height = (GAP + tile_rows * tile.1).max(SCALE_HEIGHT_MIN + TEXT_HEIGHT + 3 * GAP);
    let mut picture = Thermogram::new(
        GAP + per_row * tile.0 + SCALE_WITH_NUMBERS + GAP,
        height,
        scale,
    );
    for (place, index) in shown.iter().enumerate() {
        let (time, frame) = (film.frame)(*index);
        let (left, top) = (
            GAP + place % per_row * tile.0,
            GAP + place / per_row * tile.1,
        );
        picture.frame((left, top), &frame, film.columns, cell);
        picture.text(
            (left, top + frame_height + 6),
            &format!("{:.2} s", time.as_secs_f64()),
        );
        tick();
    }
    let scale_height = (height - TEXT_HEIGHT - 3 * GAP).min(SCALE_HEIGHT_MAX);
    picture.color_scale((GAP + per_row * tile.0, GAP), scale_height);
    Ok(picture)
}

/// The side of a sensor pixel in image pixels, so that a frame is easy to see.
fn cell(film: &Film<'_>) -> usize {
    (FRAME_WIDTH / film.columns.max(film.rows)).clamp(1, 20)
}

const FRAME_WIDTH: usize = 160;
const TIME_WIDTH: usize = 7 * 12;
const WIDTH_MAX: usize = 1_800;
const SCALE_HEIGHT_MIN: usize = 160;
const SCALE_HEIGHT_MAX: usize = 480;
