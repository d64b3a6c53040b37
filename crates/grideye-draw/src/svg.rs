//! Writes SVG one element at a time, escaping every value.

use crate::text::escape;
use std::fmt::{Display, Write as _};

/// An SVG being written.
#[derive(Debug, Clone, Default)]
pub struct Svg(String);

/// An element with its start tag still open; finish it with [`end`](Self::end), [`text`](Self::text) or
/// [`open`](Self::open).
#[derive(Debug)]
#[must_use = "the element is not ended"]
pub struct Element<'a> {
    svg: &'a mut String,
    name: &'static str,
}

impl Svg {
    /// A self-contained document: a white page, sans-serif text. `more` are attributes of the root element.
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

    /// An image within an HTML page, styled by that page; `label` is its text for screen readers.
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

    /// A path, styled by its class.
    pub fn mark(&mut self, class: &str, d: impl Display) {
        self.element("path").with("class", class).with("d", d).end();
    }

    /// Closes an element left open.
    pub fn close(&mut self, name: &str) {
        // Writing to a string cannot fail.
        let _ = write!(self.0, "</{name}>");
    }

    /// Begins a new line, for people and version control.
    pub fn line_end(&mut self) {
        self.0.push('\n');
    }

    /// A comment in the source.
    pub fn remark(&mut self, text: impl Display) {
        let text = escape(&text.to_string()).replace("--", "- -");
        let _ = write!(self.0, "<!-- {text} -->");
    }

    /// The SVG written so far.
    #[must_use]
    pub fn finish(self) -> String {
        self.0
    }
}

impl Element<'_> {
    /// Adds an attribute.
    pub fn with(self, name: &str, value: impl Display) -> Self {
        let value = safe(&value.to_string());
        let _ = write!(self.svg, " {name}=\"{value}\"");
        self
    }

    /// Adds a length with this many decimals.
    pub fn at(self, name: &str, length: f64, decimals: usize) -> Self {
        self.with(name, format_args!("{length:.decimals$}"))
    }

    /// Adds the corner or baseline position, with one decimal.
    pub fn xy(self, (x, y): (f64, f64)) -> Self {
        self.at("x", x, 1).at("y", y, 1)
    }

    /// Ends the element, leaving it empty.
    pub fn end(self) {
        self.svg.push_str("/>");
    }

    /// Ends the element with this text in it.
    pub fn text(self, text: impl Display) {
        let text = safe(&text.to_string());
        let _ = write!(self.svg, ">{text}</{}>", self.name);
    }

    /// Leaves the element open: everything up to [`Svg::close`] goes inside.
    pub fn open(self) {
        self.svg.push('>');
    }
}

/// The `d` attribute of a path from point to point, with this many decimals.
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

/// Escapes markup, and replaces characters that XML cannot represent with spaces.
fn safe(text: &str) -> String {
    let can_hold =
        |character: char| !character.is_control() && !matches!(character, '\u{fffe}' | '\u{ffff}');
    let held = text.chars().map(|character| match can_hold(character) {
        true => character,
        false => ' ',
    });
    // Attribute values are in double quotes, so apostrophes may stay.
    escape(&held.collect::<String>()).replace("&#39;", "'")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_outside_xml_become_spaces() {
        assert_eq!(safe("a&b<c>d\"e'"), "a&amp;b&lt;c&gt;d&quot;e'");
        assert_eq!(
            safe("a\u{0}b\nc\u{fffe}d\u{ffff}e\u{fffd}"),
            "a b c d e\u{fffd}"
        );
    }

    #[test]
    fn elements_nest() {
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
    fn paths_close_on_request() {
        let points = [(0.0, 1.0), (2.25, 3.0)];
        assert_eq!(path(points, 1, true), "M0.0 1.0L2.2 3.0Z");
        assert_eq!(path(points, 2, false), "M0.00 1.00L2.25 3.00");
    }
}
