//! What simple drawings are made of: polygons, lines and text.

use crate::palette::Rgb;
use glam::DVec2;

/// One thing on the page.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A filled polygon.
    Polygon {
        /// Its corners.
        points: Vec<DVec2>,
        /// Its color.
        fill: Rgb,
    },
    /// Straight lines from point to point.
    Line {
        /// The points.
        points: Vec<DVec2>,
        /// How thick.
        width: f64,
        /// Its color.
        color: Rgb,
    },
    /// A line of text.
    Text {
        /// Where its base line begins, has its middle, or ends.
        at: DVec2,
        /// Which of them.
        anchor: Anchor,
        /// Its height.
        size: f64,
        /// The text.
        text: String,
        /// Its color.
        color: Rgb,
        /// Whether it has a white border, so that it can be read on anything.
        halo: bool,
    },
}

/// What of a text is at its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// Its beginning.
    Start,
    /// Its middle.
    Middle,
    /// Its end.
    End,
}
