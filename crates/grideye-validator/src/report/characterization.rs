//! The characterization as an HTML page: table, maps, Allan deviations.

use crate::characterize::{AllanPoint, Characterization};
use crate::numbers::extremes;
use grideye_draw::palette::{DIFFERENCE, INFERNO, Rgb, color, ink};
use grideye_draw::plot::{Axis, Plot};
use grideye_draw::svg::Svg;
use grideye_draw::text::{escape, fixed, signed};
use grideye_frame::{COLUMNS, PIXELS};

const STYLE: &str = include_str!("characterization.css");

impl Characterization {
    /// One HTML file without scripts or network, readable in gray and in print; equal input gives equal bytes.
    #[must_use]
    pub fn to_html(&self, recording: &str, command: &str) -> String {
        let (recording, command) = (escape(recording), escape(command));
        format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
             <title>The sensor of {recording}</title><style>{STYLE}</style></head><body><main>\n\
             <h1>The sensor of {recording}</h1>\n<p class=\"lead\">{}</p>\n{}{}{}\
             <h2>Reproduce</h2>\n<pre>{command}</pre>\n</main></body></html>\n",
            self.lead(),
            self.table(),
            self.maps(),
            self.allan_section(),
        )
    }

    fn lead(&self) -> String {
        let (least, most) = self.noise.range_c();
        let rate = self.sensor_hz().map_or_else(
            || format!("{} frames per second", fixed(self.timing.rate_hz, 2)),
            |rate| format!("{} frames per second by the sensor's clock", fixed(rate, 2)),
        );
        format!(
            "{} frames; {rate}; noise {} °C in the median pixel, {} to {} over all pixels. {} % of the frames are partly repeated (torn), {} % wholly.",
            self.frames,
            fixed(self.noise.median_c(), 2),
            fixed(least, 2),
            fixed(most, 2),
            fixed(100.0 * self.faults.torn_share(), 1),
            fixed(100.0 * self.faults.duplicate_share(), 1),
        )
    }

    fn table(&self) -> String {
        let mut html = "<h2>Findings</h2>\n<div class=\"wide\"><table>\n".to_owned();
        for line in self.lines() {
            html.push_str(&format!(
                "<tr><th>{}</th><td class=\"value\">{}</td><td>{}</td></tr>\n",
                escape(line.label),
                escape(&line.value),
                escape(&line.note)
            ));
        }
        html.push_str("</table></div>\n");
        html
    }

    fn maps(&self) -> String {
        let (least, most) = self.noise.range_c();
        let noise = map(
            &self.noise.sigma_c,
            "Noise of each pixel, °C",
            "From frame to frame, as read. Pixel 1 is at the upper left.",
            &|sigma| color(&INFERNO, (sigma - least) / (most - least).max(1e-9)),
            &|sigma| fixed(sigma, 2),
        );
        let pattern = self.pattern.map_or_else(String::new, |pattern| {
            let largest = pattern
                .offset_c
                .iter()
                .fold(1e-9, |largest, offset| f64::max(largest, offset.abs()));
            map(
                &pattern.offset_c,
                "Fixed pattern, °C",
                "Each pixel's constant difference from a smooth surface.",
                &|offset| color(&DIFFERENCE, 0.5 + offset / largest / 2.0),
                &|offset| signed(offset, 2),
            )
        });
        let surface = self.pattern.map_or_else(String::new, |pattern| {
            let (low, high) = extremes(&pattern.surface_c);
            map(
                &pattern.surface_c,
                "Smooth surface, °C",
                "Relative to the median pixel. Attributed to the scene; in the profile only if the room is empty.",
                &|level| color(&INFERNO, (level - low) / (high - low).max(1e-9)),
                &|level| signed(level, 2),
            )
        });
        format!("<h2>Maps</h2>\n<div class=\"maps\">{noise}{pattern}{surface}</div>\n")
    }

    fn allan_section(&self) -> String {
        if self.allan.is_empty() {
            return "<h2>Allan deviation</h2>\n<p>The recording has no 100 frames in a row.</p>\n"
                .to_owned();
        }
        let rows: String = self
            .allan
            .iter()
            .map(|point| {
                format!(
                    "<tr><td>{}</td><td>{}</td><td>{}</td></tr>",
                    fixed(point.tau_s, 2),
                    fixed(point.pixel_c, 4),
                    fixed(point.common_c, 4)
                )
            })
            .collect();
        format!(
            "<h2>Allan deviation</h2>\n<p>The difference between the means of two successive stretches of time. White noise follows the thin line. \
             Where a curve is flatter, longer averages help less; where it rises, they harm.</p>\n\
             {}\n<div class=\"wide\"><table class=\"small\"><thead><tr><th>averaged over, s</th><th>one pixel, °C</th><th>common mode, °C</th></tr></thead>\
             <tbody>{rows}</tbody></table></div>\n",
            self.allan_plot()
        )
    }

    fn allan_plot(&self) -> String {
        let taus: Vec<f64> = self.allan.iter().map(|point| point.tau_s).collect();
        let of =
            |value: fn(&AllanPoint) -> f64| -> Vec<f64> { self.allan.iter().map(value).collect() };
        let (pixel, common) = (of(|point| point.pixel_c), of(|point| point.common_c));
        let all = pixel
            .iter()
            .chain(&common)
            .copied()
            .filter(|value| *value > 0.0);
        let lowest = all.clone().fold(f64::INFINITY, f64::min);
        let white: Vec<f64> = taus
            .iter()
            .map(|tau| pixel[0] * (taus[0] / tau).sqrt())
            .collect();
        let label = "Allan deviation over averaging time, both logarithmic";
        let mut svg = Svg::inline("plot", (ACROSS.1 + 130.0, DOWN.1 + 56.0), label);
        let mut plot = Plot {
            svg: &mut svg,
            x: Axis::decades(taus[0], taus[taus.len() - 1], ACROSS),
            y: Axis::decades(lowest, all.fold(0.0, f64::max), (DOWN.1, DOWN.0)),
        };
        plot.columns(plot.x.decade_ticks().into_iter().map(|tick| (tick, tick)));
        plot.rows(plot.y.decade_ticks().into_iter().map(|tick| (tick, tick)));
        plot.names("averaged over, s", "Allan deviation, °C");
        curve(&mut plot, "white", (&taus, &white), "white noise");
        curve(&mut plot, "pixel", (&taus, &pixel), "one pixel");
        curve(&mut plot, "common", (&taus, &common), "common mode");
        svg.close("svg");
        svg.finish()
    }
}

const ACROSS: (f64, f64) = (80.0, 590.0);
const DOWN: (f64, f64) = (16.0, 324.0);

/// A curve with its name at its end, without values of zero or below.
fn curve(plot: &mut Plot<'_>, class: &str, (x, y): (&[f64], &[f64]), name: &str) {
    let points = x.iter().zip(y).filter(|(_, y)| **y > 0.0);
    let points: Vec<(f64, f64)> = points
        .map(|(x, y)| (plot.x.place(*x), plot.y.place(*y).min(DOWN.1)))
        .collect();
    let Some((end_x, end_y)) = points.last() else {
        return;
    };
    let way: Vec<String> = points
        .iter()
        .map(|(x, y)| format!("{x:.1},{y:.1}"))
        .collect();
    let line = plot.svg.element("polyline").with("class", class);
    line.with("points", way.join(" ")).end();
    plot.word("name", (end_x + 8.0, *end_y), name);
}

fn map(
    values: &[f64; PIXELS],
    title: &str,
    note: &str,
    shade: &dyn Fn(f64) -> Rgb,
    text: &dyn Fn(f64) -> String,
) -> String {
    let mut svg = Svg::default();
    let head = svg.element("svg").with("viewBox", "0 0 320 320");
    head.with("role", "img").with("aria-label", title).open();
    for (pixel, value) in values.iter().enumerate() {
        let shade = shade(*value);
        let [red, green, blue] = shade;
        let (x, y) = (40 * (pixel % COLUMNS), 40 * (pixel / COLUMNS));
        let cell = svg.element("rect").with("x", x).with("y", y);
        cell.with("width", 40)
            .with("height", 40)
            .with("fill", format_args!("rgb({red},{green},{blue})"))
            .end();
        let number = svg.element("text").with("x", x + 20).with("y", y + 20);
        number.with("fill", ink(shade)).text(text(*value));
    }
    svg.close("svg");
    let svg = svg.finish();
    format!("<figure>{svg}<figcaption><b>{title}</b><br>{note}</figcaption></figure>")
}
