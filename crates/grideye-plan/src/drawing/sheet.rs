//! A page with drawings of a room: SVG that needs no other file.

use super::bodies::{Bodies, Kind};
use super::camera::{Camera, Panel};
use super::labels::{Labels, width};
use super::tree::{Drawn, Face, Footprint, Round};
use crate::ground::View;
use crate::plane::Plane;
use glam::{DVec2, DVec3};
use grideye_draw::Rgb;
use grideye_draw::number::round_step;
use grideye_draw::palette::{
    FAINT, FLOOR, INK, JUTTING_WALL, PANEL, PAPER, VIEW, VIEW_EDGE, WALL, hex,
};
use grideye_draw::svg::{self, Svg};
use grideye_scene::{Sensor, count, polygon::bounds};
use std::f64::consts::TAU;

#[derive(Debug)]
pub(crate) struct Sheet {
    pub(crate) svg: Svg,
}

/// What each class looks like; bodies have their own colors.
fn style() -> String {
    let [ink, faint, paper] = [INK, FAINT, PAPER].map(hex);
    let [panel, floor, wall, jutting] = [PANEL, FLOOR, WALL, JUTTING_WALL].map(hex);
    let [view, edge] = [VIEW, VIEW_EDGE].map(hex);
    format!(
        "text{{fill:{ink}}}.title{{font-size:19px;font-weight:bold}}.label,.tick-label{{text-anchor:middle;stroke:{paper};\
         stroke-width:3;stroke-linejoin:round;paint-order:stroke}}.tick-label,.faint{{fill:{faint}}}\
         path,circle,rect{{stroke-width:.8}}.panel{{fill:{panel};stroke:#dddddd}}.seam{{stroke-width:.4}}.wall{{fill:{floor};stroke:{wall}}}\
         .wire{{fill:none;stroke:{wall};stroke-dasharray:6 4}}.jutting{{fill:{jutting};fill-opacity:.6;stroke:{wall}}}\
         .view{{fill:{view};stroke:{edge}}}.ray,.ahead{{fill:none;stroke:{edge}}}.ahead{{stroke-width:1.5}}\
         .sensor{{fill:{view};stroke:{edge};stroke-width:1.2}}.way{{fill:none;stroke-width:1.6;stroke-dasharray:.1 4;\
         stroke-linecap:round}}.captured{{fill:{paper};stroke-width:1.1}}.axis,.tick{{fill:none;stroke:{faint}}}\
         .axis{{stroke-width:1.6}}.key{{stroke:{faint};stroke-width:.5}}"
    )
}

impl Sheet {
    /// A page without words; `more` is its style besides that of rooms.
    pub(crate) fn bare((width, height): (f64, f64), more: &str) -> Self {
        let mut svg = Svg::page(width, height, &[("font-size", "12")]);
        svg.element("style").text(style() + more);
        svg.line_end();
        Self { svg }
    }

    /// A page with its title and a line below.
    pub(crate) fn new(size: (f64, f64), title: &str, summary: &str, more: &str) -> Self {
        let mut sheet = Self::bare(size, more);
        sheet.svg.element("title").text(title);
        sheet.text("title", DVec2::new(24.0, 34.0), title);
        sheet.text("faint", DVec2::new(24.0, 56.0), summary);
        sheet
    }

    pub(crate) fn finish(mut self) -> String {
        self.svg.close("svg");
        self.svg.line_end();
        self.svg.finish()
    }

    pub(crate) fn panel(&mut self, title: &str, panel: &Panel) {
        self.rectangle("panel", (panel.corner, panel.corner + panel.size));
        self.text("faint", panel.corner + DVec2::new(12.0, 20.0), title);
    }

    /// Walls seen from within are filled, the others dashed.
    pub(super) fn walls(&mut self, camera: &Camera, class: &str, walls: &[Vec<DVec3>]) {
        for wall in walls
            .iter()
            .filter(|wall| camera.sees(wall) == (class == "wall"))
        {
            self.mark(class, &path(camera, wall, true));
        }
    }

    /// What a sensor has in view; on walls that are not seen from within, only its outline.
    pub(super) fn view(&mut self, camera: &Camera, view: &View, opacity: f64) {
        for face in &view.faces_m {
            let opacity = if camera.sees(face) { opacity } else { 0.0 };
            let element = self.svg.element("path").with("class", "view");
            let element = element.with("d", path(camera, face, true));
            element.at("fill-opacity", opacity, 3).end();
            self.svg.line_end();
        }
    }

    pub(super) fn bodies(&mut self, camera: &Camera, bodies: &Bodies, colors: &[Rgb]) {
        let depth_m = |at_m: DVec3| camera.depth_m(at_m);
        let side_of = |plane: &Plane| camera.side_of(plane);
        for drawn in bodies
            .tree
            .far_to_near(bodies.rounds.iter(), side_of, depth_m)
        {
            match drawn {
                Drawn::Face(face) => {
                    self.face(camera, bodies, face);
                    self.footprints(camera, &face.footprints, colors);
                }
                Drawn::Round(round) => {
                    self.round(camera, bodies, round);
                    self.footprints(camera, &round.footprints, colors);
                }
            }
        }
    }

    /// Each pixel's footprint that is seen from within the room, in its color.
    pub(super) fn footprints(&mut self, camera: &Camera, footprints: &[Footprint], colors: &[Rgb]) {
        for Footprint {
            pixel, corners_m, ..
        } in footprints
        {
            let Some(color) = colors.get(*pixel).filter(|_| camera.sees(corners_m)) else {
                continue;
            };
            let element = self.svg.element("path").with("class", "footprint");
            let element = element.with("d", path(camera, corners_m, true));
            let element = element.with("fill", hex(*color));
            element.with("fill-opacity", ".85").end();
            self.svg.line_end();
        }
    }

    fn round(&mut self, camera: &Camera, bodies: &Bodies, round: &Round) {
        let towards_eye = camera.towards_eye_from(round.center_m);
        // The points of a unit sphere that become the rim are at right angles to this.
        let pole = (round.axes_m.inverse() * towards_eye).normalize_or_zero();
        let (one, other) = pole.any_orthonormal_pair();
        let rim = (0..RIM).map(|side| {
            let (sin, cos) = libm::sincos(TAU * count::float(side) / count::float(RIM));
            round.center_m + round.axes_m * (cos * one + sin * other)
        });
        let rim: Vec<DVec3> = rim.collect();
        let color = bodies.shapes[round.shape].color;
        let fill = shaded(color, towards_eye);
        self.opaque(&path(camera, &rim, true), fill, edge_of(color));
    }

    fn face(&mut self, camera: &Camera, bodies: &Bodies, face: &Face) {
        let shape = &bodies.shapes[face.shape];
        let Some(plane) = Plane::of_face(&face.corners_m) else {
            return;
        };
        let side = camera.side_of(&plane);
        if shape.is_closed && side <= 1e-9 {
            return;
        }
        let d = path(camera, &face.corners_m, true);
        if shape.kind == Kind::Wall {
            self.mark("jutting", &d);
            return;
        }
        let fill = shaded(shape.color, plane.normal * side.signum());
        // The edges of a tiny face would cover it.
        let has_edges = !is_tiny(camera, &face.corners_m);
        if has_edges && !face.edges.contains(&false) {
            self.opaque(&d, fill, edge_of(shape.color));
            return;
        }
        // A hairline in the fill color closes the seams between cut faces.
        self.opaque(&d, fill, fill);
        let next = face.corners_m.iter().cycle().skip(1);
        let sides = face.corners_m.iter().zip(next).zip(&face.edges);
        let drawn = sides.filter(|(_, is_drawn)| has_edges && **is_drawn);
        let lines: String = drawn
            .map(|((from, to), _)| path(camera, &[*from, *to], false))
            .collect();
        if !lines.is_empty() {
            let element = self
                .svg
                .element("path")
                .with("d", lines)
                .with("fill", "none");
            element.with("stroke", hex(edge_of(shape.color))).end();
            self.svg.line_end();
        }
    }

    fn opaque(&mut self, d: &str, fill: Rgb, edge: Rgb) {
        let element = self
            .svg
            .element("path")
            .with("d", d)
            .with("fill", hex(fill));
        let element = element.with("stroke", hex(edge));
        match fill == edge {
            true => element.with("class", "seam").end(),
            false => element.end(),
        }
        self.svg.line_end();
    }

    /// A path in its color, and a circle at each frame.
    pub(super) fn way(&mut self, camera: &Camera, way_m: &[DVec3], frames_m: &[DVec3], color: Rgb) {
        let element = self.svg.element("path").with("class", "way");
        let element = element.with("d", path(camera, way_m, false));
        element.with("stroke", hex(color)).end();
        self.svg.line_end();
        let radius = if frames_m.len() > CROWDED { 1.8 } else { 3.0 };
        for frame_m in frames_m {
            let at = camera.project(*frame_m);
            let element = self.svg.element("circle").with("class", "captured");
            let element = element
                .at("cx", at.x, 1)
                .at("cy", at.y, 1)
                .with("r", radius);
            element.with("stroke", hex(color)).end();
            self.svg.line_end();
        }
    }

    /// A square, its direction, and lines to the corners of what it has in view.
    pub(crate) fn sensor(&mut self, camera: &Camera, sensor: &Sensor, corners_m: &[DVec3]) {
        let at_m = sensor.pose.position_m;
        let rays = corners_m
            .iter()
            .map(|corner_m| path(camera, &[at_m, *corner_m], false));
        self.mark("ray", &rays.collect::<String>());
        let ahead_m = at_m + 0.25 * sensor.pose.world_from_sensor().x_axis;
        self.mark("ahead", &path(camera, &[at_m, ahead_m], false));
        let at = camera.project(at_m);
        self.rectangle("sensor", (at - 4.5, at + 4.5));
    }

    pub(super) fn axes(&mut self, camera: &Camera, (low, high): (DVec3, DVec3)) {
        let corner = camera.project(low);
        let ends = [
            ("x", low.with_x(high.x)),
            ("y", low.with_y(high.y)),
            ("z", low.with_z(high.z)),
        ];
        for (name, end) in ends {
            let towards = (camera.project(end) - corner).normalize_or_zero();
            self.stroke("axis", [corner, corner + 34.0 * towards]);
            self.text(
                "tick-label",
                corner + 46.0 * towards + DVec2::new(0.0, 4.0),
                name,
            );
        }
    }

    pub(crate) fn ruler(&mut self, camera: &Camera, (low, high): (DVec3, DVec3)) {
        let step = round_step((high - low).max_element() / 7.0);
        for (axis, span) in [(DVec3::X, high.x - low.x), (DVec3::Y, high.y - low.y)] {
            let outwards = if axis.x > 0.0 { DVec2::Y } else { -DVec2::X };
            for tick in 0..=count::floor(span / step + 1e-9) {
                let length = step * count::float(tick);
                let from = camera.project(low + length * axis);
                self.stroke("tick", [from, from + 5.0 * outwards]);
                let unit = if tick == 0 { " m" } else { "" };
                let text = format!("{}{unit}", (length * 1000.0).round() / 1000.0);
                self.text(
                    "tick-label",
                    from + 16.0 * outwards + DVec2::new(0.0, 4.0),
                    &text,
                );
            }
        }
    }

    pub(crate) fn labels(&mut self, labels: &Labels) {
        for label in &labels.placed {
            self.text("label", label.at, &label.text);
        }
        if labels.left_out > 0 {
            let omitted = format!("no room for {} names", labels.left_out);
            self.svg.remark(omitted);
            self.svg.line_end();
        }
    }

    /// A box in its color and what it means; returns the place of the next one.
    pub(crate) fn key(&mut self, at: DVec2, fill: &str, text: &str) -> DVec2 {
        let corner = at - DVec2::new(0.0, 11.0);
        let element = self
            .svg
            .element("rect")
            .with("class", "key")
            .xy(corner.into());
        element
            .with("width", 14)
            .with("height", 14)
            .with("fill", fill)
            .end();
        self.text("", at + DVec2::new(20.0, 0.0), text);
        at + DVec2::new(44.0 + width(text), 0.0)
    }

    pub(crate) fn rectangle(&mut self, class: &str, (low, high): (DVec2, DVec2)) {
        let (element, size) = (self.svg.element("rect").with("class", class), high - low);
        let element = element.xy(low.into()).at("width", size.x, 1);
        element.at("height", size.y, 1).end();
        self.svg.line_end();
    }

    fn stroke(&mut self, class: &str, ends: [DVec2; 2]) {
        self.mark(class, &svg::path(ends.map(|at| (at.x, at.y)), 1, false));
    }

    pub(crate) fn mark(&mut self, class: &str, d: &str) {
        self.svg.mark(class, d);
        self.svg.line_end();
    }

    pub(crate) fn text(&mut self, class: &str, at: DVec2, text: &str) {
        let element = self.svg.element("text").with("class", class);
        element.xy(at.into()).text(text);
        self.svg.line_end();
    }
}

fn edge_of(color: Rgb) -> Rgb {
    color.map(|part| part / 2)
}

fn shaded(color: Rgb, normal: DVec3) -> Rgb {
    let light = DVec3::new(-0.37, -0.56, 0.74);
    let brightness = 0.72 + 0.28 * normal.dot(light).max(0.0);
    color.map(|part| {
        let lit = count::floor((f64::from(part) * brightness).round());
        u8::try_from(lit).unwrap_or(u8::MAX)
    })
}

fn is_tiny(camera: &Camera, points_m: &[DVec3]) -> bool {
    let places = points_m.iter().map(|point| camera.project(*point));
    let (low, high) = bounds(places);
    (high - low).max_element() < TINY
}

pub(crate) fn path(camera: &Camera, points_m: &[DVec3], closed: bool) -> String {
    let places = points_m.iter().map(|point| camera.project(*point));
    svg::path(places.map(|at| (at.x, at.y)), 1, closed)
}

const TINY: f64 = 5.0;
/// Corners of an ellipsoid's outline.
const RIM: usize = 16;
const CROWDED: usize = 60;

#[cfg(test)]
mod tests;
