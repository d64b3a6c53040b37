//! The shapes of simple drawings: polygons, lines and text.

use crate::palette::Rgb;
use glam::DVec2;

/// A shape on the page.
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
        /// Line width.
        width: f64,
        /// Its color.
        color: Rgb,
    },
    /// A line of text.
    Text {
        /// Where `anchor` lies on the baseline.
        at: DVec2,
        /// Which part of the text lies at `at`.
        anchor: Anchor,
        /// Font size.
        size: f64,
        /// The text.
        text: String,
        /// Its color.
        color: Rgb,
        /// Whether a white border keeps it readable on any background.
        halo: bool,
    },
}

/// The part of a text that lies at its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// Its start.
    Start,
    /// Its middle.
    Middle,
    /// Its end.
    End,
}
