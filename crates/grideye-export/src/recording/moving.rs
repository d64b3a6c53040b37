//! An animated GIF: the frames at their original speed, on one color scale.

use super::frames::Frames;
use super::rows::{Out, Rows};
use crate::error::ExportError;
use gif::{Encoder, Frame, Repeat};
use grideye_draw::number::{float, whole};
use grideye_draw::thermogram::{GAP, SCALE_WITH_NUMBERS, Scale, TEXT_HEIGHT, Thermogram, palette};
use std::borrow::Cow;

/// Maximum frames of one GIF; of more, every second, third … is shown, for that much longer.
const FRAMES_MAX: usize = 3_000;

/// Writes up to 3,000 frames as a GIF.
pub(super) fn write(rows: Rows<'_>, out: &mut dyn Out) -> Result<String, ExportError> {
    let frames = Frames::of(rows)?;
    let sampling_hz = frames.sampling_hz();
    // Browsers slow down animations faster than 50 frames per second.
    let fastest = whole((sampling_hz / FASTEST_HZ).ceil());
    let step = frames.count().div_ceil(FRAMES_MAX).max(fastest).max(1);
    let (blank, cell) = stage(frames.size, frames.scale()?);
    let canvas = blank.canvas();
    let (width, height) = (
        u16::try_from(canvas.width())?,
        u16::try_from(canvas.height())?,
    );
    let mut encoder = Encoder::new(out, width, height, &palette())?;
    encoder.set_repeat(Repeat::Infinite)?;
    let shown = frames.every(step);
    let (columns, rows) = frames.size;
    for (index, (celsius, time)) in (0..).zip(&shown) {
        let mut picture = blank.clone();
        picture.frame((GAP, GAP), celsius, columns, cell);
        picture.text((GAP, GAP + rows * cell + 8), time);
        encoder.write_frame(&Frame {
            width,
            height,
            delay: hundredths(index, sampling_hz / float(step)),
            buffer: Cow::Owned(picture.into_canvas().into_dots()),
            ..Frame::default()
        })?;
    }
    let left_out = frames.left_out(step);
    Ok(format!("a film of {} frames{left_out}", shown.len()))
}

/// The constant parts of every image, and the side of its pixels.
fn stage((columns, rows): (usize, usize), scale: Scale) -> (Thermogram, usize) {
    let cell = (FRAME_WIDTH / columns.max(rows)).clamp(1, 40);
    let frame_width = (columns * cell).max(TIME_WIDTH);
    let scale_height = (rows * cell).max(SCALE_HEIGHT_MIN);
    let width = GAP + frame_width + GAP + SCALE_WITH_NUMBERS + GAP;
    let mut blank = Thermogram::new(width, GAP + scale_height + TEXT_HEIGHT + 2 * GAP, scale);
    blank.color_scale((GAP + frame_width + GAP, GAP), scale_height);
    (blank, cell)
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
