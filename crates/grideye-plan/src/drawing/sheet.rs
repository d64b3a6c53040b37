//! The page: SVG without styles, fonts or pictures of other files.

use super::camera::{Camera, Panel};
use super::labels::{Labels, width};
use super::painter::{Paint, Piece};
use super::pieces::{AGENT, OBJECT, SEEN, SEEN_EDGE};
use super::plane::Plane;
use glam::{DVec2, DVec3};
use grideye_draw::number::round_step;
use grideye_scene::Sensor;
use grideye_scene::count;

#[derive(Debug)]
pub(super) struct Sheet {
    svg: String,
}

impl Sheet {
    pub(super) fn new(width: f64, height: f64) -> Self {
        Self {
            svg: format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
                 font-family=\"sans-serif\" font-size=\"12\" fill=\"#222222\">\n\
                 <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n"
            ),
        }
    }

    pub(super) fn finish(mut self) -> String {
        self.svg.push_str("</svg>\n");
        self.svg
    }

    pub(super) fn head(&mut self, title: &str, summary: &str) {
        let (title, summary) = (escaped(title), escaped(summary));
        self.add(&format!("<title>{title}</title>"));
        self.add(&format!(
            "<text x=\"24\" y=\"34\" font-size=\"19\" font-weight=\"bold\">{title}</text>"
        ));
        self.add(&format!(
            "<text x=\"24\" y=\"56\" fill=\"#555555\">{summary}</text>"
        ));
    }

    pub(super) fn panel(&mut self, title: &str, panel: &Panel) {
        let Panel {
            left,
            top,
            width,
            height,
        } = *panel;
        self.add(&format!(
            "<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" rx=\"6\" fill=\"#fafafa\" stroke=\"#dddddd\"/>"
        ));
        self.add(&format!(
            "<text x=\"{}\" y=\"{}\" fill=\"#777777\">{title}</text>",
            left + 12.0,
            top + 20.0
        ));
    }

    /// Floor and walls that are seen from within.
    pub(super) fn walls_behind(&mut self, camera: &Camera, walls: &[Vec<DVec3>]) {
        for wall in walls.iter().filter(|wall| is_seen(camera, wall)) {
            let outline = path(camera, wall, true);
            self.add(&format!("<path class=\"wall\" d=\"{outline}\" fill=\"#f1f1f1\" stroke=\"#999999\" stroke-width=\"1\"/>"));
        }
    }

    /// The edges of the walls between the eye and the room.
    pub(super) fn walls_before(&mut self, camera: &Camera, walls: &[Vec<DVec3>]) {
        for wall in walls.iter().filter(|wall| !is_seen(camera, wall)) {
            let outline = path(camera, wall, true);
            self.add(&format!(
                "<path class=\"wire\" d=\"{outline}\" fill=\"none\" stroke=\"#999999\" stroke-width=\"0.8\" stroke-dasharray=\"6 4\"/>"
            ));
        }
    }

    pub(super) fn piece(&mut self, camera: &Camera, piece: &Piece) {
        match piece.paint {
            Paint::Face {
                fill,
                opacity,
                edge,
            } => self.face(camera, piece, (fill, opacity, edge)),
            Paint::Line { color } => {
                let line = path(camera, &piece.points_m, false);
                let color = hex(color);
                self.add(&format!(
                    "<path class=\"way\" d=\"{line}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.6\" stroke-dasharray=\"0.1 4\" stroke-linecap=\"round\"/>"
                ));
            }
            Paint::Circle { color, radius } => {
                for point in &piece.points_m {
                    let at = camera.project(*point);
                    self.add(&format!(
                        "<circle class=\"captured\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\" fill=\"#ffffff\" stroke=\"{}\" stroke-width=\"1.1\"/>",
                        at.x,
                        at.y,
                        hex(color)
                    ));
                }
            }
        }
    }

    /// The sensor itself, and the edges of its pyramid from above, which cross in its place.
    pub(super) fn sensors(&mut self, camera: &Camera, sensors: &[Sensor]) {
        for sensor in sensors {
            let at = camera.project(sensor.pose.position_m);
            let ahead = sensor.pose.position_m + 0.25 * sensor.pose.world_from_sensor().x_axis;
            let ahead = camera.project(ahead);
            self.add(&format!(
                "<g class=\"sensor\" stroke=\"{}\"><line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke-width=\"1.5\"/>\
                 <rect x=\"{:.1}\" y=\"{:.1}\" width=\"9\" height=\"9\" fill=\"{}\" stroke-width=\"1.2\"/></g>",
                hex(SEEN_EDGE),
                at.x,
                at.y,
                ahead.x,
                ahead.y,
                at.x - 4.5,
                at.y - 4.5,
                hex(SEEN)
            ));
        }
    }

    /// The directions of the room's axes, in its corner.
    pub(super) fn axes(&mut self, camera: &Camera, (low, high): (DVec3, DVec3)) {
        let corner = camera.project(low);
        for (name, end) in [
            ("x", low.with_x(high.x)),
            ("y", low.with_y(high.y)),
            ("z", low.with_z(high.z)),
        ] {
            let towards = (camera.project(end) - corner).normalize_or_zero();
            let tip = corner + 34.0 * towards;
            let text = corner + 46.0 * towards;
            self.add(&format!(
                "<line class=\"axis\" x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"#444444\" stroke-width=\"1.6\"/>",
                corner.x, corner.y, tip.x, tip.y
            ));
            self.text(text + DVec2::new(0.0, 4.0), name, "#444444");
        }
    }

    /// Lengths in metres along the front and the left of the map.
    pub(super) fn ruler(&mut self, camera: &Camera, (low, high): (DVec3, DVec3)) {
        let step = round_step((high - low).max_element() / 7.0);
        for (axis, span) in [(DVec3::X, high.x - low.x), (DVec3::Y, high.y - low.y)] {
            let outwards = if axis.x > 0.0 { DVec2::Y } else { -DVec2::X };
            for tick in 0..=count::floor(span / step + 1e-9) {
                let length = step * count::float(tick);
                let from = camera.project(low + length * axis);
                let to = from + 5.0 * outwards;
                self.add(&format!(
                    "<line class=\"tick\" x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"#777777\"/>",
                    from.x, from.y, to.x, to.y
                ));
                let unit = if tick == 0 { " m" } else { "" };
                let text = format!("{}{unit}", (length * 1000.0).round() / 1000.0);
                self.text(
                    from + 16.0 * outwards + DVec2::new(0.0, 4.0),
                    &text,
                    "#777777",
                );
            }
        }
    }

    pub(super) fn labels(&mut self, labels: &Labels) {
        for label in &labels.placed {
            self.text(label.at, &label.text, "#222222");
        }
        if labels.left_out > 0 {
            self.add(&format!("<!-- {} names have no room -->", labels.left_out));
        }
    }

    /// What the colours stand for.
    pub(super) fn legend(&mut self, y: f64, somebody_walks: bool) {
        let mut x = 24.0;
        for (color, text) in [
            (OBJECT, "object"),
            (AGENT, "agent"),
            (SEEN, "sensor and what it has in view"),
        ] {
            self.add(&format!(
                "<rect x=\"{x}\" y=\"{}\" width=\"14\" height=\"14\" fill=\"{}\" stroke=\"#888888\" stroke-width=\"0.5\"/>",
                y - 11.0,
                hex(color)
            ));
            self.add(&format!("<text x=\"{}\" y=\"{y}\">{text}</text>", x + 20.0));
            x += 44.0 + width(text);
        }
        if somebody_walks {
            let color = hex(AGENT);
            self.add(&format!(
                "<path d=\"M{x} {0}h34\" stroke=\"{color}\" stroke-width=\"1.6\" stroke-dasharray=\"0.1 4\" stroke-linecap=\"round\"/>\
                 <circle cx=\"{1}\" cy=\"{0}\" r=\"3\" fill=\"#ffffff\" stroke=\"{color}\"/>",
                y - 4.0,
                x + 17.0
            ));
            self.add(&format!(
                "<text x=\"{}\" y=\"{y}\">way, and where a frame is taken</text>",
                x + 42.0
            ));
        }
    }

    fn face(
        &mut self,
        camera: &Camera,
        piece: &Piece,
        (fill, opacity, edge): ([u8; 3], f64, [u8; 3]),
    ) {
        let outline = path(camera, &piece.points_m, true);
        let (fill, edge) = (hex(fill), hex(edge));
        if opacity <= 0.0 {
            // Only its edges.
        } else if opacity < 1.0 {
            self.add(&format!("<path class=\"view\" d=\"{outline}\" fill=\"{fill}\" fill-opacity=\"{opacity:.3}\"/>"));
        } else {
            // The hair line in its own colour closes the seams between faces that were cut.
            self.add(&format!(
                "<path d=\"{outline}\" fill=\"{fill}\" stroke=\"{fill}\" stroke-width=\"0.4\"/>"
            ));
        }
        if is_tiny(camera, &piece.points_m) {
            // Edges would be all that is seen of it.
            return;
        }
        let corners = piece.points_m.len();
        let lines: String = (0..corners)
            .filter(|index| piece.edges.get(*index) == Some(&true))
            .map(|index| {
                let ends = [piece.points_m[index], piece.points_m[(index + 1) % corners]];
                path(camera, &ends, false)
            })
            .collect();
        if !lines.is_empty() {
            self.add(&format!("<path d=\"{lines}\" fill=\"none\" stroke=\"{edge}\" stroke-width=\"0.8\" stroke-linecap=\"round\"/>"));
        }
    }

    fn text(&mut self, at: DVec2, text: &str, color: &str) {
        self.add(&format!(
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"{color}\" stroke=\"#ffffff\" stroke-width=\"3\" stroke-linejoin=\"round\" paint-order=\"stroke\">{}</text>",
            at.x,
            at.y,
            escaped(text)
        ));
    }

    fn add(&mut self, element: &str) {
        self.svg.push_str(element);
        self.svg.push('\n');
    }
}

fn is_seen(camera: &Camera, wall: &[DVec3]) -> bool {
    Plane::of_face(wall).is_some_and(|plane| camera.side_of(&plane) > 1e-9)
}

fn is_tiny(camera: &Camera, points_m: &[DVec3]) -> bool {
    let places = points_m.iter().map(|point| camera.project(*point));
    let (low, high) = places.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), at| {
        (low.min(at), high.max(at))
    });
    (high - low).max_element() < TINY
}

fn path(camera: &Camera, points_m: &[DVec3], closed: bool) -> String {
    let mut path = String::new();
    for (index, point) in points_m.iter().enumerate() {
        let at = camera.project(*point);
        let letter = if index == 0 { 'M' } else { 'L' };
        path.push_str(&format!("{letter}{:.1} {:.1}", at.x, at.y));
    }
    if closed {
        path.push('Z');
    }
    path
}

fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Text that cannot be read as markup; what XML cannot hold at all becomes a space.
pub(crate) fn escaped(text: &str) -> String {
    let mut safe = String::new();
    for character in text.chars() {
        match character {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            other if other.is_control() || matches!(other, '\u{fffe}' | '\u{ffff}') => {
                safe.push(' ');
            }
            other => safe.push(other),
        }
    }
    safe
}

/// Faces smaller than this on the page have no edges.
const TINY: f64 = 5.0;

#[cfg(test)]
mod tests;
