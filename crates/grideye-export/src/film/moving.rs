//! An animated GIF: the frames at their original speed, on one color scale.

use super::source::{Film, left_out};
use crate::error::ExportError;
use gif::{Encoder, Frame, Repeat};
use grideye_draw::number::whole;
use grideye_draw::thermogram::{GAP, SCALE_WITH_NUMBERS, Scale, TEXT_HEIGHT, Thermogram, palette};
use std::borrow::Cow;
use std::io::Write;

/// Maximum frames of one GIF; a longer film shows every second, third … frame, for that much longer.
const FRAMES_MAX: u32 = 3_000;

/// Writes up to 3,000 frames as a GIF, calls back after each, and returns a description of the result.
///
/// # Errors
/// If writing fails, or a temperature is not a number.
pub fn write(film: &Film<'_>, out: &mut dyn Write, tick: &dyn Fn()) -> Result<String, ExportError> {
    let scale = Scale::of(film.celsius()).ok_or(ExportError::NotANumber)?;
    // Browsers slow down animations faster than 50 frames per second.
    let fastest = whole((film.sampling_hz / FASTEST_HZ).ceil());
    let fastest = u32::try_from(fastest).unwrap_or(u32::MAX);
    let step = film.frames.div_ceil(FRAMES_MAX).max(fastest).max(1);
    let (blank, top_left, cell) = stage(film, scale);
    let canvas = blank.canvas();
    let (width, height) = (
        u16::try_from(canvas.width())?,
        u16::try_from(canvas.height())?,
    );
    let mut encoder = Encoder::new(out, width, height, &palette())?;
    encoder.set_repeat(Repeat::Infinite)?;
    let mut shown = 0;
    for index in (0..film.frames).step_by(usize::try_from(step)?) {
        let (time, frame) = (film.frame)(index);
        let mut picture = blank.clone();
        picture.frame(top_left, &frame, film.columns, cell);
        let below = (top_left.0, top_left.1 + film.rows * cell + 8);
        picture.text(below, &format!("{:.2} s", time.as_secs_f64()));
        encoder.write_frame(&Frame {
            width,
            height,
            delay: hundredths(shown, film.sampling_hz / f64::from(step)),
            buffer: Cow::Owned(picture.into_canvas().into_dots()),
            ..Frame::default()
        })?;
        shown += 1;
        tick();
    }
    let left_out = left_out(step, film.frames);
    Ok(format!("a film of {shown} frames{left_out}"))
}

/// The constant parts of every image, where the frame goes, and the side of its pixels.
fn stage(film: &Film<'_>, scale: Scale) -> (Thermogram, (usize, usize), usize) {
    let cell = (FRAME_WIDTH / film.columns.max(film.rows)).clamp(1, 40);
    let (frame_width, frame_height) = (film.columns * cell, film.rows * cell);
    let scale_height = frame_height.max(SCALE_HEIGHT_MIN);
    let width = GAP + frame_width.max(TIME_WIDTH) + GAP + SCALE_WITH_NUMBERS + GAP;
    let mut blank = Thermogram::new(width, GAP + scale_height + TEXT_HEIGHT + 2 * GAP, scale);
    blank.color_scale((GAP + frame_width.max(TIME_WIDTH) + GAP, GAP), scale_height);
    (blank, (GAP, GAP), cell)
}

/// How long image `index` is shown, in hundredths of a second; rounding errors do not add up.
fn hundredths(index: u32, pictures_per_s: f64) -> u16 {
    let end = |index: u32| (f64::from(index) * 100.0 / pictures_per_s).round();
    let length = whole(end(index + 1) - end(index));
    u16::try_from(length).unwrap_or(u16::MAX)
}

const FASTEST_HZ: f64 = 50.0;
const FRAME_WIDTH: usize = 320;
const TIME_WIDTH: usize = 84;
const SCALE_HEIGHT_MIN: usize = 160;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_film_is_as_long_as_the_walk() {
        // The Lepton's 8.7 frames per second take 11 or 12 hundredths each, and 87 of them ten seconds.
        let delays: Vec<u16> = (0..87).map(|index| hundredths(index, 8.7)).collect();
        assert!(delays.iter().all(|delay| (11..=12).contains(delay)));
        assert_eq!(
            delays.iter().map(|delay| u32::from(*delay)).sum::<u32>(),
            1000
        );
        assert_eq!(hundredths(5, 10.0), 10);
        assert_eq!(hundredths(0, 0.001), u16::MAX);
    }
}
