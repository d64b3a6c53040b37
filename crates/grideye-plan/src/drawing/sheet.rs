//! The page: SVG without styles, fonts or external images.

use super::camera::{Camera, Panel, Plane};
use super::labels::{Labels, width};
use super::painter::{Paint, Piece};
use super::pieces::{AGENT, OBJECT, SEEN, SEEN_EDGE};
use glam::{DVec2, DVec3};
use grideye_draw::number::round_step;
use grideye_draw::palette::hex;
use grideye_draw::svg::{self, Element, Svg};
use grideye_scene::{Sensor, count, polygon::bounds};

#[derive(Debug)]
pub(super) struct Sheet {
    svg: Svg,
}

impl Sheet {
    pub(super) fn new(width: f64, height: f64) -> Self {
        Self {
            svg: Svg::page(width, height, &[("font-size", "12"), ("fill", "#222222")]),
        }
    }

    pub(super) fn finish(mut self) -> String {
        self.svg.close("svg");
        self.svg.line_end();
        self.svg.finish()
    }

    pub(super) fn head(&mut self, title: &str, summary: &str) {
        self.line("title", |element| {
            element.text(title);
        });
        self.line("text", |element| {
            let element = element.with("x", 24).with("y", 34);
            element
                .with("font-size", 19)
                .with("font-weight", "bold")
                .text(title);
        });
        self.line("text", |element| {
            let element = element.with("x", 24).with("y", 56);
            element.with("fill", "#555555").text(summary);
        });
    }

    pub(super) fn panel(&mut self, title: &str, panel: &Panel) {
        let (DVec2 { x: left, y: top }, size) = (panel.corner, panel.size);
        self.line("rect", |element| {
            let element = element.with("x", left).with("y", top);
            let element = element.with("width", size.x).with("height", size.y);
            let element = element.with("rx", 6).with("fill", "#fafafa");
            element.with("stroke", "#dddddd").end();
        });
        self.line("text", |element| {
            let element = element.with("x", left + 12.0).with("y", top + 20.0);
            element.with("fill", "#777777").text(title);
        });
    }

    pub(super) fn walls_behind(&mut self, camera: &Camera, walls: &[Vec<DVec3>]) {
        for wall in walls.iter().filter(|wall| is_seen(camera, wall)) {
            let outline = path(camera, wall, true);
            self.line("path", |element| {
                let element = element.with("class", "wall").with("d", outline);
                stroke(element.with("fill", "#f1f1f1"), "#999999", "1").end();
            });
        }
    }

    pub(super) fn walls_before(&mut self, camera: &Camera, walls: &[Vec<DVec3>]) {
        for wall in walls.iter().filter(|wall| !is_seen(camera, wall)) {
            let outline = path(camera, wall, true);
            self.line("path", |element| {
                let element = element.with("class", "wire").with("d", outline);
                let element = stroke(element.with("fill", "none"), "#999999", "0.8");
                element.with("stroke-dasharray", "6 4").end();
            });
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
                self.line("path", |element| {
                    let element = element.with("class", "way").with("d", line);
                    dotted(element.with("fill", "none"), &color);
                });
            }
            Paint::Circle { color, radius } => {
                for point in &piece.points_m {
                    let at = camera.project(*point);
                    self.line("circle", |element| {
                        let element = element.with("class", "captured");
                        let element = element.at("cx", at.x, 1).at("cy", at.y, 1);
                        let element = element.with("r", radius).with("fill", "#ffffff");
                        stroke(element, &hex(color), "1.1").end();
                    });
                }
            }
        }
    }

    /// The sensors; in the top view the edges of their pyramids cross there.
    pub(super) fn sensors(&mut self, camera: &Camera, sensors: &[Sensor]) {
        for sensor in sensors {
            let at = camera.project(sensor.pose.position_m);
            let ahead = sensor.pose.position_m + 0.25 * sensor.pose.world_from_sensor().x_axis;
            let ahead = camera.project(ahead);
            let group = self.svg.element("g").with("class", "sensor");
            group.with("stroke", hex(SEEN_EDGE)).open();
            let line = ends(self.svg.element("line"), at, ahead);
            line.with("stroke-width", 1.5).end();
            let place = self.svg.element("rect").xy((at.x - 4.5, at.y - 4.5));
            let place = place.with("width", 9).with("height", 9);
            place
                .with("fill", hex(SEEN))
                .with("stroke-width", 1.2)
                .end();
            self.svg.close("g");
            self.svg.line_end();
        }
    }

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
            self.line("line", |element| {
                let element = ends(element.with("class", "axis"), corner, tip);
                stroke(element, "#444444", "1.6").end();
            });
            self.text(text + DVec2::new(0.0, 4.0), name, "#444444");
        }
    }

    pub(super) fn ruler(&mut self, camera: &Camera, (low, high): (DVec3, DVec3)) {
        let step = round_step((high - low).max_element() / 7.0);
        for (axis, span) in [(DVec3::X, high.x - low.x), (DVec3::Y, high.y - low.y)] {
            let outwards = if axis.x > 0.0 { DVec2::Y } else { -DVec2::X };
            for tick in 0..=count::floor(span / step + 1e-9) {
                let length = step * count::float(tick);
                let from = camera.project(low + length * axis);
                let to = from + 5.0 * outwards;
                self.line("line", |element| {
                    let element = ends(element.with("class", "tick"), from, to);
                    element.with("stroke", "#777777").end();
                });
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
            self.svg
                .remark(format_args!("no room for {} names", labels.left_out));
            self.svg.line_end();
        }
    }

    pub(super) fn legend(&mut self, y: f64, somebody_walks: bool) {
        let mut x = 24.0;
        for (color, text) in [
            (OBJECT, "object"),
            (AGENT, "agent"),
            (SEEN, "sensor and its field of view"),
        ] {
            self.line("rect", |element| {
                let element = element.with("x", x).with("y", y - 11.0);
                let element = element.with("width", 14).with("height", 14);
                stroke(element.with("fill", hex(color)), "#888888", "0.5").end();
            });
            self.remark((x + 20.0, y), text);
            x += 44.0 + width(text);
        }
        if somebody_walks {
            let color = hex(AGENT);
            let middle = y - 4.0;
            let way = self.svg.element("path");
            dotted(way.with("d", format_args!("M{x} {middle}h34")), &color);
            self.line("circle", |element| {
                let element = element.with("cx", x + 17.0).with("cy", middle);
                let element = element.with("r", 3).with("fill", "#ffffff");
                element.with("stroke", &color).end();
            });
            self.remark((x + 42.0, y), "path, and where frames are taken");
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
            // Only its edges are drawn.
        } else if opacity < 1.0 {
            self.line("path", |element| {
                let element = element.with("class", "view").with("d", outline);
                let element = element.with("fill", &fill);
                element.at("fill-opacity", opacity, 3).end();
            });
        } else {
            // A hairline in the fill color closes the seams between cut faces.
            let is_whole = !is_tiny(camera, &piece.points_m) && !piece.edges.contains(&false);
            let (color, width) = match is_whole {
                true => (&edge, "0.8"),
                false => (&fill, "0.4"),
            };
            self.line("path", |element| {
                let element = element.with("d", outline).with("fill", &fill);
                stroke(element, color, width).end();
            });
            if is_whole {
                return;
            }
        }
        if is_tiny(camera, &piece.points_m) {
            // Edges would cover it completely.
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
            self.line("path", |element| {
                let element = element.with("d", lines).with("fill", "none");
                let element = stroke(element, &edge, "0.8");
                element.with("stroke-linecap", "round").end();
            });
        }
    }

    fn text(&mut self, at: DVec2, text: &str, color: &str) {
        self.line("text", |element| {
            let element = element.xy((at.x, at.y)).with("text-anchor", "middle");
            element.with("fill", color).halo().text(text);
        });
    }

    fn remark(&mut self, (x, y): (f64, f64), text: &str) {
        self.line("text", |element| {
            element.with("x", x).with("y", y).text(text);
        });
    }

    fn line(&mut self, name: &'static str, write: impl FnOnce(Element<'_>)) {
        write(self.svg.element(name));
        self.svg.line_end();
    }
}

fn stroke<'a>(element: Element<'a>, color: &str, width: &str) -> Element<'a> {
    element.with("stroke", color).with("stroke-width", width)
}

fn dotted(element: Element<'_>, color: &str) {
    let element = stroke(element, color, "1.6").with("stroke-dasharray", "0.1 4");
    element.with("stroke-linecap", "round").end();
}

fn ends<'a>(element: Element<'a>, from: DVec2, to: DVec2) -> Element<'a> {
    let element = element.at("x1", from.x, 1).at("y1", from.y, 1);
    element.at("x2", to.x, 1).at("y2", to.y, 1)
}

fn is_seen(camera: &Camera, wall: &[DVec3]) -> bool {
    Plane::of_face(wall).is_some_and(|plane| camera.side_of(&plane) > 1e-9)
}

fn is_tiny(camera: &Camera, points_m: &[DVec3]) -> bool {
    let places = points_m.iter().map(|point| camera.project(*point));
    let (low, high) = bounds(places);
    (high - low).max_element() < TINY
}

fn path(camera: &Camera, points_m: &[DVec3], closed: bool) -> String {
    let places = points_m.iter().map(|point| camera.project(*point));
    svg::path(places.map(|at| (at.x, at.y)), 1, closed)
}

const TINY: f64 = 5.0;

#[cfg(test)]
mod tests;
