//! A plot in an HTML page: axes, lines, curves and labels. The page's CSS styles them by class.

use crate::svg::Svg;
use std::fmt::{Display, Write as _};

/// Maps values to places along one side of a plot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// The values at the start and the end.
    values: (f64, f64),
    /// The places of these values on the page.
    places: (f64, f64),
}

impl Axis {
    /// A linear axis from one value to another, between two places.
    #[must_use]
    pub const fn linear(values: (f64, f64), places: (f64, f64)) -> Self {
        Self { values, places }
    }

    /// The place of a value.
    #[must_use]
    pub fn place(&self, value: f64) -> f64 {
        let ((from, to), (begin, end)) = (self.values, self.places);
        begin + (end - begin) * (value - from) / (to - from)
    }
}

/// A plot on an SVG that may hold several.
#[derive(Debug)]
pub struct Plot<'a> {
    /// The SVG to draw on.
    pub svg: &'a mut Svg,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis; its places may run in either direction.
    pub y: Axis,
}

impl Plot<'_> {
    fn bottom(&self) -> f64 {
        self.y.places.0.max(self.y.places.1)
    }

    /// A horizontal grid line for each value, with its text at the left.
    pub fn rows<T: Display>(&mut self, ticks: impl IntoIterator<Item = (f64, T)>) {
        for (value, text) in ticks {
            self.level("grid", value);
            let at = (self.x.places.0 - 8.0, self.y.place(value));
            self.word("end", at, text);
        }
    }

    /// A vertical grid line for each value, with its text below.
    pub fn columns<T: Display>(&mut self, ticks: impl IntoIterator<Item = (f64, T)>) {
        for (value, text) in ticks {
            self.upright("grid", value);
            self.below(value, 16.0, text);
        }
    }

    /// Text at a value, `down` below the plot.
    pub fn below(&mut self, value: f64, down: f64, text: impl Display) {
        let at = (self.x.place(value), self.bottom() + down);
        self.word("middle", at, text);
    }

    /// Labels of both axes.
    pub fn names(&mut self, x: &str, y: &str) {
        let middle = |places: (f64, f64)| f64::midpoint(places.0, places.1);
        let at = (middle(self.x.places), self.bottom() + 42.0);
        self.word("middle name", at, x);
        let (left, middle) = (self.x.places.0 - 66.0, middle(self.y.places));
        let turned = format!("translate({left} {middle:.1}) rotate(-90)");
        let name = self.svg.element("text").with("class", "middle name");
        name.with("transform", turned).text(y);
    }

    /// A horizontal line across the plot.
    pub fn level(&mut self, class: &str, value: f64) {
        let ((left, right), y) = (self.x.places, self.y.place(value));
        self.svg.mark(class, format_args!("M{left} {y:.1}H{right}"));
    }

    /// A vertical line across the plot.
    pub fn upright(&mut self, class: &str, value: f64) {
        let (x, (one, other)) = (self.x.place(value), self.y.places);
        let (top, bottom) = (one.min(other), one.max(other));
        self.svg.mark(class, format_args!("M{x:.1} {top}V{bottom}"));
    }

    /// A curve from point to point, with a gap at each missing value.
    pub fn curve(&mut self, class: &str, points: impl IntoIterator<Item = (f64, Option<f64>)>) {
        let (mut path, mut letter) = (String::new(), 'M');
        for (x, value) in points {
            let Some(value) = value else {
                letter = 'M';
                continue;
            };
            let (x, y) = (self.x.place(x), self.y.place(value));
            // Writing to a string cannot fail.
            let _ = write!(path, "{letter}{x:.1} {y:.1}");
            letter = 'L';
        }
        self.svg.mark(class, path);
    }

    /// Text at a place on the page.
    pub fn word(&mut self, class: &str, at: (f64, f64), text: impl Display) {
        let word = self.svg.element("text").with("class", class);
        word.xy(at).text(text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x maps 0 to 10 to places 50 to 150, y maps 0 to 1 to places 100 to 0; the second value is missing.
    #[test]
    fn points_are_placed_by_both_axes_and_gaps_stay_open() {
        let mut svg = Svg::default();
        let mut plot = Plot {
            svg: &mut svg,
            x: Axis::linear((0.0, 10.0), (50.0, 150.0)),
            y: Axis::linear((1.0, 0.0), (0.0, 100.0)),
        };
        let points = [(0.0, Some(0.0)), (2.0, None), (5.0, Some(0.5))];
        plot.curve("pair", points.into_iter().chain([(10.0, Some(1.0))]));
        plot.rows([(0.25, "low")]);
        plot.columns([(5.0, 5)]);
        plot.names("x", "y");
        assert_eq!(
            svg.finish(),
            "<path class=\"pair\" d=\"M50.0 100.0M100.0 50.0L150.0 0.0\"/>\
             <path class=\"grid\" d=\"M50 75.0H150\"/><text class=\"end\" x=\"42.0\" y=\"75.0\">low</text>\
             <path class=\"grid\" d=\"M100.0 0V100\"/><text class=\"middle\" x=\"100.0\" y=\"116.0\">5</text>\
             <text class=\"middle name\" x=\"100.0\" y=\"142.0\">x</text>\
             <text class=\"middle name\" transform=\"translate(-16 50.0) rotate(-90)\">y</text>"
        );
    }
}
