//! The SVG writer: elements one after the other, every value escaped.

use crate::text::escape;
use std::fmt::{Display, Write as _};

/// SVG as far as it is written.
#[derive(Debug, Clone, Default)]
pub struct Svg(String);

/// An element whose start tag is being written; it ends by [`end`](Self::end), [`text`](Self::text) or
/// [`open`](Self::open).
#[derive(Debug)]
#[must_use = "the element is not ended"]
pub struct Element<'a> {
    svg: &'a mut String,
    name: &'static str,
}

impl Svg {
    /// A document that needs no other file: a white page, text without serifs. `more` are attributes of all that is on it.
    #[must_use]
    pub fn page(width: f64, height: f64, more: &[(&str, &str)]) -> Self {
        let mut svg = Self::default();
        let mut head = svg
            .element("svg")
            .with("xmlns", "http://www.w3.org/2000/svg")
            .with("width", width)
            .with("height", height)
            .with("viewBox", format_args!("0 0 {width} {height}"))
            .with("font-family", "sans-serif");
        for (name, value) in more {
            head = head.with(name, value);
        }
        head.open();
        svg.line_end();
        let paper = svg.element("rect").with("width", width);
        paper.with("height", height).with("fill", "#ffffff").end();
        svg.line_end();
        svg
    }

    /// A picture within a page of HTML, whose styles it takes; `label` is its text for those who do not see it.
    #[must_use]
    pub fn inline(class: &str, (width, height): (impl Display, impl Display), label: &str) -> Self {
        let mut svg = Self::default();
        let head = svg.element("svg").with("class", class);
        head.with("viewBox", format_args!("0 0 {width} {height}"))
            .with("role", "img")
            .with("aria-label", label)
            .open();
        svg
    }

    /// Begins an element.
    pub fn element(&mut self, name: &'static str) -> Element<'_> {
        self.0.push('<');
        self.0.push_str(name);
        Element {
            svg: &mut self.0,
            name,
        }
    }

    /// A path whose look the page's styles tell by its class.
    pub fn mark(&mut self, class: &str, d: impl Display) {
        self.element("path").with("class", class).with("d", d).end();
    }

    /// Ends an element that was left open.
    pub fn close(&mut self, name: &str) {
        // Writing into a string does not fail.
        let _ = write!(self.0, "</{name}>");
    }

    /// Begins the next line, so that people and version control can read it.
    pub fn line_end(&mut self) {
        self.0.push('\n');
    }

    /// A remark for who reads the source.
    pub fn remark(&mut self, text: impl Display) {
        let text = escape(&text.to_string()).replace("--", "- -");
        let _ = write!(self.0, "<!-- {text} -->");
    }

    /// The text as far as it was written.
    #[must_use]
    pub fn finish(self) -> String {
        self.0
    }
}

impl Element<'_> {
    /// An attribute.
    pub fn with(self, name: &str, value: impl Display) -> Self {
        let value = safe(&value.to_string());
        let _ = write!(self.svg, " {name}=\"{value}\"");
        self
    }

    /// A length, to so many decimals.
    pub fn at(self, name: &str, length: f64, decimals: usize) -> Self {
        self.with(name, format_args!("{length:.decimals$}"))
    }

    /// The place of its corner or base line, to the tenth.
    pub fn xy(self, (x, y): (f64, f64)) -> Self {
        self.at("x", x, 1).at("y", y, 1)
    }

    /// A white border, so that text can be read on anything.
    pub fn halo(self) -> Self {
        self.with("stroke", "#ffffff")
            .with("stroke-width", 3)
            .with("stroke-linejoin", "round")
            .with("paint-order", "stroke")
    }

    /// Ends the element: nothing is in it.
    pub fn end(self) {
        self.svg.push_str("/>");
    }

    /// Ends the element with this text in it.
    pub fn text(self, text: impl Display) {
        let text = safe(&text.to_string());
        let _ = write!(self.svg, ">{text}</{}>", self.name);
    }

    /// Leaves it open: what is written next is in it, until [`Svg::close`].
    pub fn open(self) {
        self.svg.push('>');
    }
}

/// The `d` of a path from point to point, to so many decimals.
#[must_use]
pub fn path(
    points: impl IntoIterator<Item = (f64, f64)>,
    decimals: usize,
    is_closed: bool,
) -> String {
    let mut path = String::new();
    let mut letter = 'M';
    for (x, y) in points {
        let _ = write!(path, "{letter}{x:.decimals$} {y:.decimals$}");
        letter = 'L';
    }
    if is_closed {
        path.push('Z');
    }
    path
}

/// Text that cannot be read as markup; what XML cannot hold at all becomes a space.
fn safe(text: &str) -> String {
    let can_hold =
        |character: char| !character.is_control() && !matches!(character, '\u{fffe}' | '\u{ffff}');
    let held = text.chars().map(|character| match can_hold(character) {
        true => character,
        false => ' ',
    });
    // Values stand in double quotes: an apostrophe may stay.
    escape(&held.collect::<String>()).replace("&#39;", "'")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_xml_cannot_hold_becomes_a_space() {
        assert_eq!(safe("a&b<c>d\"e'"), "a&amp;b&lt;c&gt;d&quot;e'");
        assert_eq!(
            safe("a\u{0}b\nc\u{fffe}d\u{ffff}e\u{fffd}"),
            "a b c d e\u{fffd}"
        );
    }

    #[test]
    fn elements_stand_in_one_another() {
        let mut svg = Svg::inline("map", (3.0, 2.5), "a \"map\"");
        svg.element("g").with("class", "dots").open();
        svg.element("circle").at("r", 2.0, 1).end();
        svg.close("g");
        svg.mark("grid", "M0 0H3");
        svg.element("text").xy((1.0, 0.25)).text("a < b");
        svg.remark("no --> end");
        svg.close("svg");
        assert_eq!(
            svg.finish(),
            "<svg class=\"map\" viewBox=\"0 0 3 2.5\" role=\"img\" aria-label=\"a &quot;map&quot;\">\
             <g class=\"dots\"><circle r=\"2.0\"/></g><path class=\"grid\" d=\"M0 0H3\"/><text x=\"1.0\" y=\"0.2\">a &lt; b</text>\
             <!-- no - -&gt; end --></svg>"
        );
    }

    #[test]
    fn a_path_is_closed_where_it_is_to_be() {
        let points = [(0.0, 1.0), (2.25, 3.0)];
        assert_eq!(path(points, 1, true), "M0.0 1.0L2.2 3.0Z");
        assert_eq!(path(points, 2, false), "M0.00 1.00L2.25 3.00");
    }
}
