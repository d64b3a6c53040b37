//! Encodes canvases as PNG.

use crate::canvas::Canvas;
use crate::palette::Rgb;
use png::{BitDepth, ColorType, Encoder};
use std::io::{self, Write};

/// Writes an RGB canvas.
///
/// # Errors
/// If writing fails or the canvas is too large for a PNG.
pub fn rgb(canvas: &Canvas<Rgb>, out: impl Write) -> io::Result<()> {
    let mut encoder = encoder(canvas, out)?;
    encoder.set_color(ColorType::Rgb);
    write(encoder, &canvas.dots().concat())
}

/// Writes a canvas of palette indices; `palette` lists red, green and blue of each color, and `about` becomes text
/// chunks.
///
/// # Errors
/// If writing fails or the canvas is too large for a PNG.
pub fn indexed(
    canvas: &Canvas<u8>,
    palette: Vec<u8>,
    about: &[(&str, String)],
    out: impl Write,
) -> io::Result<()> {
    let mut encoder = encoder(canvas, out)?;
    encoder.set_color(ColorType::Indexed);
    encoder.set_palette(palette);
    for (name, text) in about {
        encoder.add_text_chunk((*name).to_owned(), text.clone())?;
    }
    write(encoder, canvas.dots())
}

fn encoder<'a, C: Copy, W: Write>(canvas: &Canvas<C>, out: W) -> io::Result<Encoder<'a, W>> {
    let size = |dots: usize| u32::try_from(dots).map_err(io::Error::other);
    let mut encoder = Encoder::new(out, size(canvas.width())?, size(canvas.height())?);
    encoder.set_depth(BitDepth::Eight);
    Ok(encoder)
}

fn write(encoder: Encoder<'_, impl Write>, bytes: &[u8]) -> io::Result<()> {
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    Ok(writer.finish()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_png_holds_the_colors_it_was_given() {
        let mut canvas = Canvas::new(3, 2, [0; 3]);
        for number in 0..6_u8 {
            let at = (usize::from(number % 3), usize::from(number / 3));
            canvas.fill(at, (1, 1), [number, 10 * number, 255 - number]);
        }
        let mut bytes = Vec::new();
        rgb(&canvas, &mut bytes).unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(bytes))
            .read_info()
            .unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((frame.width, frame.height), (3, 2));
        assert_eq!(pixels, canvas.dots().concat());
    }
}
