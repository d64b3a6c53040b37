//! Images, and films of them: what is done to every pixel.

use crate::align::Orientation;
use crate::numbers::single;
use grideye_frame::PIXELS;
use std::time::Duration;

/// One image, row by row, °C.
pub(crate) type Image = [f32; PIXELS];
/// Pixels of an image.
pub(crate) const PIXEL_COUNT: f32 = 64.0;

pub(crate) fn moment(time_s: f64) -> Duration {
    Duration::try_from_secs_f64(time_s.max(0.0)).unwrap_or_default()
}

pub(crate) fn image(celsius: &[f64]) -> Image {
    std::array::from_fn(|pixel| single(celsius.get(pixel).copied().unwrap_or_default()))
}

#[inline]
pub(crate) fn add(image: &mut Image, other: &Image, share: f32) {
    for pixel in 0..PIXELS {
        image[pixel] += share * other[pixel];
    }
}

pub(crate) fn add_all(film: &mut [Image], other: &[Image], share: f32) {
    for (image, other) in film.iter_mut().zip(other) {
        add(image, other, share);
    }
}

pub(crate) fn less(with: &Image, without: &Image) -> Image {
    let mut less = *with;
    add(&mut less, without, -1.0);
    less
}

pub(crate) fn all_less(with: &[Image], without: &[Image]) -> Vec<Image> {
    let pairs = with.iter().zip(without);
    pairs.map(|(with, without)| less(with, without)).collect()
}

pub(crate) fn turned(images: &[Image], orientation: Orientation) -> Vec<Image> {
    let images = images.iter();
    images.map(|image| orientation.apply(image)).collect()
}

/// Pictures shown later.
pub(crate) fn later(pictures: Vec<Image>, times_s: &[f64], lag_s: f64) -> Vec<Image> {
    if lag_s == 0.0 {
        return pictures;
    }
    let last = pictures.len().saturating_sub(1);
    let at = |time_s: &f64| {
        let time_s = time_s - lag_s;
        let after = times_s.partition_point(|other| *other < time_s).min(last);
        let before = after.saturating_sub(1);
        let (low, high) = (times_s[before], times_s[after]);
        let share = match high > low {
            true => single(((time_s - low) / (high - low)).clamp(0.0, 1.0)),
            false => 1.0,
        };
        let mut image = pictures[before];
        let after = &pictures[after];
        for pixel in 0..PIXELS {
            image[pixel] += share * (after[pixel] - image[pixel]);
        }
        image
    };
    times_s.iter().map(at).collect()
}
