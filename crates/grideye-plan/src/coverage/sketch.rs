//! Shapes of a map as SVG.

use glam::DVec2;

/// A drawing: shapes in the order in which they are painted, on a white page whose origin is at the top left.
#[derive(Debug, Clone, PartialEq)]
pub struct Sketch {
    /// Its width.
    pub width: f64,
    /// Its height.
    pub height: f64,
    /// What is on it.
    pub shapes: Vec<Shape>,
}

/// One thing on the page.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A filled polygon.
    Polygon {
        /// Its corners.
        points: Vec<DVec2>,
        /// Red, green, blue.
        fill: [u8; 3],
    },
    /// Straight lines from point to point.
    Line {
        /// The points.
        points: Vec<DVec2>,
        /// How thick.
        width: f64,
        /// Red, green, blue.
        color: [u8; 3],
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
        /// Red, green, blue.
        color: [u8; 3],
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

pub(super) const DARK: [u8; 3] = [34, 34, 34];
pub(super) const GREY: [u8; 3] = [110, 110, 110];
pub(super) const WHITE: [u8; 3] = [255, 255, 255];

/// Corners of a disc.
const DISC_CORNERS: u8 = 20;
/// Lengths of a dash and of what is between two.
const DASH: f64 = 7.0;
const BETWEEN: f64 = 5.0;
/// Dashes of one line at most.
const DASHES_MAX: usize = 500;

impl Sketch {
    pub(super) const fn new(width: f64, height: f64) -> Self {
        Self {
            width,
            height,
            shapes: Vec::new(),
        }
    }

    /// The drawing as a self-contained SVG.
    #[must_use]
    pub fn svg(&self) -> String {
        let (width, height) = (self.width, self.height);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n"
        );
        for shape in &self.shapes {
            svg.push_str(&element(shape));
            svg.push('\n');
        }
        svg.push_str("</svg>\n");
        svg
    }

    pub(super) fn text(&mut self, at: DVec2, anchor: Anchor, size: f64, text: &str) {
        self.write((at, anchor, size), text, false);
    }

    pub(super) fn halo(&mut self, at: DVec2, anchor: Anchor, size: f64, text: &str) {
        self.write((at, anchor, size), text, true);
    }

    fn write(&mut self, (at, anchor, size): (DVec2, Anchor, f64), text: &str, halo: bool) {
        self.shapes.push(Shape::Text {
            at,
            anchor,
            size,
            text: text.to_owned(),
            color: DARK,
            halo,
        });
    }

    pub(super) fn rectangle(&mut self, (low, high): (DVec2, DVec2), fill: [u8; 3]) {
        let points = vec![
            low,
            DVec2::new(high.x, low.y),
            high,
            DVec2::new(low.x, high.y),
        ];
        self.shapes.push(Shape::Polygon { points, fill });
    }

    pub(super) fn disc(&mut self, middle: DVec2, radius: f64, fill: [u8; 3]) {
        let turn = std::f64::consts::TAU / f64::from(DISC_CORNERS);
        let corner = |index: u8| {
            let (sin, cos) = libm::sincos(turn * f64::from(index));
            middle + radius * DVec2::new(cos, sin)
        };
        let points = (0..DISC_CORNERS).map(corner).collect();
        self.shapes.push(Shape::Polygon { points, fill });
    }

    pub(super) fn line(&mut self, points: Vec<DVec2>, width: f64, color: [u8; 3]) {
        self.shapes.push(Shape::Line {
            points,
            width,
            color,
        });
    }

    pub(super) fn closed(&mut self, mut points: Vec<DVec2>, width: f64, color: [u8; 3]) {
        points.extend(points.first().copied());
        self.line(points, width, color);
    }

    /// A closed line of dashes, white below dark, so that it is seen on anything.
    pub(super) fn dashed(&mut self, corners: &[DVec2]) {
        let next = corners.iter().cycle().skip(1);
        for (from, to) in corners.iter().zip(next) {
            let length = from.distance(*to);
            let along = (*to - *from).normalize_or_zero();
            let mut way = 0.0;
            for _ in 0..DASHES_MAX {
                if way >= length {
                    break;
                }
                let end = (way + DASH).min(length);
                let dash = vec![*from + way * along, *from + end * along];
                self.line(dash.clone(), 3.2, WHITE);
                self.line(dash, 1.4, DARK);
                way += DASH + BETWEEN;
            }
        }
    }
}

fn element(shape: &Shape) -> String {
    match shape {
        Shape::Polygon { points, fill } => {
            let fill = hex(*fill);
            // The hair line in its own colour closes the seams between cells.
            format!(
                "<path d=\"{}Z\" fill=\"{fill}\" stroke=\"{fill}\" stroke-width=\"0.3\"/>",
                path(points)
            )
        }
        Shape::Line {
            points,
            width,
            color,
        } => format!(
            "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\"/>",
            path(points),
            hex(*color)
        ),
        Shape::Text {
            at,
            anchor,
            size,
            text,
            color,
            halo,
        } => {
            let anchor = match anchor {
                Anchor::Start => "start",
                Anchor::Middle => "middle",
                Anchor::End => "end",
            };
            let halo = if *halo {
                " stroke=\"#ffffff\" stroke-width=\"3\" stroke-linejoin=\"round\" paint-order=\"stroke\""
            } else {
                ""
            };
            format!(
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\" font-size=\"{size}\" fill=\"{}\"{halo}>{}</text>",
                at.x,
                at.y,
                hex(*color),
                crate::drawing::escaped(text)
            )
        }
    }
}

fn path(points: &[DVec2]) -> String {
    let mut path = String::new();
    for (index, at) in points.iter().enumerate() {
        let letter = if index == 0 { 'M' } else { 'L' };
        path.push_str(&format!("{letter}{:.2} {:.2}", at.x, at.y));
    }
    path
}

fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}
