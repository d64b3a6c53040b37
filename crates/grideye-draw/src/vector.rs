//! Writes shapes as SVG.

use crate::palette::hex;
use crate::shape::{Anchor, Shape};
use crate::svg::{Svg, path};
use glam::DVec2;

/// The shapes on a white page, as a self-contained SVG.
pub(crate) fn svg((width, height): (f64, f64), shapes: &[Shape]) -> String {
    let mut svg = Svg::page(width, height, &[]);
    for shape in shapes {
        element(&mut svg, shape);
        svg.line_end();
    }
    svg.close("svg");
    svg.line_end();
    svg.finish()
}

fn element(svg: &mut Svg, shape: &Shape) {
    match shape {
        Shape::Polygon { points, fill } => {
            let fill = hex(*fill);
            // A hairline in the fill color closes the seams between cells.
            svg.element("path")
                .with("d", way(points, true))
                .with("fill", &fill)
                .with("stroke", &fill)
                .with("stroke-width", 0.3)
                .end();
        }
        Shape::Line {
            points,
            width,
            color,
        } => svg
            .element("path")
            .with("d", way(points, false))
            .with("fill", "none")
            .with("stroke", hex(*color))
            .with("stroke-width", width)
            .end(),
        Shape::Text {
            at,
            anchor,
            size,
            text,
            color,
            halo,
        } => {
            let element = svg
                .element("text")
                .xy((at.x, at.y))
                .with("text-anchor", name(*anchor))
                .with("font-size", size)
                .with("fill", hex(*color));
            let element = if *halo { element.halo() } else { element };
            element.text(text);
        }
    }
}

fn way(points: &[DVec2], is_closed: bool) -> String {
    path(points.iter().map(|at| (at.x, at.y)), 2, is_closed)
}

const fn name(anchor: Anchor) -> &'static str {
    match anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    }
}
