//! Draws shapes as dots.

use crate::canvas::{At, CHARACTER, Canvas};
use crate::number::{float, whole};
use crate::palette::Rgb;
use crate::shape::{Anchor, Shape};
use glam::DVec2;

/// Dots per unit of the drawing, enough to keep its text readable.
const DOTS: f64 = 2.0;
/// The text height at which a font dot is two dots.
const SIZE_OF_TWO: f64 = 12.0;
const WHITE: Rgb = [255; 3];

/// The shapes on a white page.
pub(crate) fn canvas((width, height): (f64, f64), shapes: &[Shape]) -> Canvas<Rgb> {
    let mut canvas = Canvas::new(whole(DOTS * width), whole(DOTS * height), WHITE);
    for shape in shapes {
        draw(&mut canvas, shape);
    }
    canvas
}

fn draw(canvas: &mut Canvas<Rgb>, shape: &Shape) {
    match shape {
        Shape::Polygon { points, fill } => canvas.polygon(&in_dots(points), *fill),
        Shape::Line {
            points,
            width,
            color,
        } => {
            for pair in in_dots(points).windows(2) {
                canvas.line((pair[0], pair[1]), (DOTS * width).max(1.0), *color);
            }
        }
        Shape::Text {
            at,
            anchor,
            size,
            text,
            color,
            halo,
        } => {
            let dot = if *size > 1.3 * SIZE_OF_TWO { 3 } else { 2 };
            let wide = float(dot * CHARACTER.0 * text.chars().count());
            let left = match anchor {
                Anchor::Start => DOTS * at.x,
                Anchor::Middle => DOTS * at.x - 0.5 * wide,
                Anchor::End => DOTS * at.x - wide,
            };
            let top = DOTS * at.y - float(CHARACTER.1 * dot);
            let mut write = |x: f64, y: f64, color| {
                canvas.text((whole(left + x), whole(top + y)), text, dot, color);
            };
            if *halo {
                for (x, y) in [(-2.0, 0.0), (2.0, 0.0), (0.0, -2.0), (0.0, 2.0)] {
                    write(x, y, WHITE);
                }
            }
            write(0.0, 0.0, *color);
        }
    }
}

fn in_dots(points: &[DVec2]) -> Vec<At> {
    points.iter().map(|at| (DOTS * at.x, DOTS * at.y)).collect()
}
