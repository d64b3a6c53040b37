//! Finds people below a Grid-EYE: pixels much warmer than the room.

use embedded_hal::i2c::I2c;
use grideye::GridEye;

/// The minimum contrast between a person and the room, in °C.
const CONTRAST_C: f32 = 5.0;

/// Eight rows of eight pixels in °C, pixels 1 to 8 first.
pub type Picture = [[f32; 8]; 8];

/// Reads the sensor's image pixel by pixel.
///
/// # Errors
/// The bus error.
pub fn picture<B: I2c>(sensor: &mut GridEye<B>) -> Result<Picture, B::Error> {
    let mut picture = Picture::default();
    for (pixel, celsius) in (0..).zip(picture.as_flattened_mut()) {
        *celsius = sensor.get_pixel_temperature_celsius(pixel)?;
    }
    Ok(picture)
}

/// The room's temperature in °C: the median pixel.
pub fn room_c(picture: &Picture) -> f32 {
    let mut pixels: Vec<f32> = picture.as_flattened().to_vec();
    pixels.sort_by(f32::total_cmp);
    pixels[pixels.len() / 2]
}

/// Row and column, from 0, of each pixel that shows a person; empty if nobody is there.
pub fn somebody(picture: &Picture) -> Vec<(usize, usize)> {
    let threshold_c = room_c(picture) + CONTRAST_C;
    let places = (0..8).flat_map(|row| (0..8).map(move |column| (row, column)));
    places
        .filter(|(row, column)| picture[*row][*column] > threshold_c)
        .collect()
}
