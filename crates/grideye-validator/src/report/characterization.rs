//! The characterisation as one page that needs nothing else: table, maps, Allan deviations.

use crate::characterize::{AllanPoint, Characterization};
use crate::numbers::extremes;
use grideye_draw::palette::{DIFFERENCE, INFERNO, Rgb, color, ink};
use grideye_draw::svg::Svg;
use grideye_draw::text::{escape, fixed, signed};
use grideye_frame::{COLUMNS, PIXELS};

const STYLE: &str = include_str!("characterization.css");

impl Characterization {
    /// The whole as one HTML page without scripts, fonts or pictures from elsewhere. Maps carry their numbers, curves are
    /// told apart by their strokes: neither colour vision nor a screen is needed. `recording` names the recording,
    /// `command` made the page; the same input gives the same bytes.
    #[must_use]
    pub fn to_html(&self, recording: &str, command: &str) -> String {
        let (recording, command) = (escape(recording), escape(command));
        format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
             <title>The sensor of {recording}</title><style>{STYLE}</style></head><body><main>\n\
             <h1>The sensor of {recording}</h1>\n<p class=\"lead\">{}</p>\n{}{}{}\
             <h2>How to make this page again</h2>\n<pre>{command}</pre>\n</main></body></html>\n",
            self.lead(),
            self.table(),
            self.maps(),
            self.allan_section(),
        )
    }

    /// The sensor in a sentence or two.
    fn lead(&self) -> String {
        let (least, most) = self.noise.range_c();
        let rate = self.sensor_hz().map_or_else(
            || format!("{} frames a second", fixed(self.timing.rate_hz, 2)),
            |rate| format!("{} frames a second by its own clock", fixed(rate, 2)),
        );
        format!(
            "{} frames; {rate}; noise {} °C in the middle pixel, {} to {} over all. {} % of the frames are partly repeated, {} % wholly.",
            self.frames,
            fixed(self.noise.median_c(), 2),
            fixed(least, 2),
            fixed(most, 2),
            fixed(100.0 * self.faults.torn_share(), 1),
            fixed(100.0 * self.faults.duplicate_share(), 1),
        )
    }

    fn table(&self) -> String {
        let mut html = "<h2>What was found</h2>\n<div class=\"wide\"><table>\n".to_owned();
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
            "From frame to frame, as read; pixel 1 is at the top left.",
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
                "What each pixel keeps beyond a smooth surface; signs say which way.",
                &|offset| color(&DIFFERENCE, 0.5 + offset / largest / 2.0),
                &|offset| signed(offset, 2),
            )
        });
        let surface = self.pattern.map_or_else(String::new, |pattern| {
            let (low, high) = extremes(&pattern.surface_c);
            map(
                &pattern.surface_c,
                "Smooth surface, °C",
                "Taken for the scene's, above the middle pixel; in the profile of an empty room alone.",
                &|level| color(&INFERNO, (level - low) / (high - low).max(1e-9)),
                &|level| signed(level, 2),
            )
        });
        format!("<h2>Maps</h2>\n<div class=\"maps\">{noise}{pattern}{surface}</div>\n")
    }

    fn allan_section(&self) -> String {
        if self.allan.is_empty() {
            return "<h2>Allan deviation</h2>\n<p>The recording has no hundred frames in a row.</p>\n".to_owned();
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
            "<h2>Allan deviation</h2>\n<p>How far the mean over one stretch of time differs from that over the next. White noise \
             falls along the thin line; where a curve leaves it, longer averages gain less, and where it rises, they lose.</p>\n\
             {}\n<div class=\"wide\"><table class=\"small\"><thead><tr><th>over, s</th><th>one pixel, °C</th><th>common mode, °C</th></tr></thead>\
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
        let plot = Plot {
            x: decades(taus[0], taus[taus.len() - 1]),
            y: decades(lowest, all.fold(0.0, f64::max)),
        };
        let white: Vec<f64> = taus
            .iter()
            .map(|tau| pixel[0] * (taus[0] / tau).sqrt())
            .collect();
        let label = "Allan deviation over averaging time, both logarithmic";
        let mut svg = Svg::inline("plot", (WIDTH, HEIGHT), label);
        plot.axes(&mut svg);
        plot.curve(&mut svg, "white", (&taus, &white), "white noise");
        plot.curve(&mut svg, "pixel", (&taus, &pixel), "one pixel");
        plot.curve(&mut svg, "common", (&taus, &common), "common mode");
        svg.close("svg");
        svg.finish()
    }
}

/// Eight by eight cells, each with its number.
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

/// From below the least to above the greatest in whole and half decades, as logarithms.
fn decades(least: f64, greatest: f64) -> [f64; 2] {
    let [low, high] = [least.log10(), greatest.log10()];
    [
        (low * 2.0).floor() / 2.0,
        ((high * 2.0).ceil() / 2.0).max(low + 0.5),
    ]
}

/// Both axes are logarithmic.
struct Plot {
    x: [f64; 2],
    y: [f64; 2],
}

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 380.0;
const LEFT: f64 = 80.0;
const RIGHT: f64 = 130.0;
const TOP: f64 = 16.0;
const BOTTOM: f64 = 56.0;

impl Plot {
    fn at_x(&self, value: f64) -> f64 {
        LEFT + (WIDTH - LEFT - RIGHT) * (value.log10() - self.x[0]) / (self.x[1] - self.x[0])
    }

    fn at_y(&self, value: f64) -> f64 {
        TOP + (HEIGHT - TOP - BOTTOM) * (self.y[1] - value.log10()) / (self.y[1] - self.y[0])
    }

    fn axes(&self, svg: &mut Svg) {
        let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
        for value in ticks(self.x) {
            let x = self.at_x(value);
            svg.mark("grid", format_args!("M{x:.1} {TOP}V{bottom}"));
            let number = svg.element("text").with("class", "middle");
            number.xy((x, bottom + 16.0)).text(value);
        }
        for value in ticks(self.y) {
            let y = self.at_y(value);
            svg.mark("grid", format_args!("M{LEFT} {y:.1}H{right}"));
            let number = svg.element("text").with("class", "end");
            number.xy((LEFT - 8.0, y)).text(value);
        }
        let name = svg.element("text").with("class", "middle");
        name.xy(((LEFT + right) / 2.0, HEIGHT - 12.0))
            .text("averaged over, s");
        let middle = (TOP + bottom) / 2.0;
        let turned = format!("translate(18 {middle:.1}) rotate(-90)");
        let name = svg.element("text").with("class", "middle");
        name.with("transform", turned).text("Allan deviation, °C");
    }

    /// A curve with its name at its end; what is not above zero is left out.
    fn curve(&self, svg: &mut Svg, class: &str, (x, y): (&[f64], &[f64]), name: &str) {
        let points: Vec<(f64, f64)> = x
            .iter()
            .zip(y)
            .filter(|(_, y)| **y > 0.0)
            .map(|(x, y)| (self.at_x(*x), self.at_y(*y).min(HEIGHT - BOTTOM)))
            .collect();
        let Some((end_x, end_y)) = points.last() else {
            return;
        };
        let way: Vec<String> = points
            .iter()
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect();
        let line = svg.element("polyline").with("class", class);
        line.with("points", way.join(" ")).end();
        let text = svg.element("text").with("class", "name");
        text.xy((end_x + 8.0, *end_y)).text(name);
    }
}

/// 1, 2 and 5 of every decade inside.
fn ticks(range: [f64; 2]) -> Vec<f64> {
    let mut ticks = Vec::new();
    let mut decade = range[0].floor();
    while decade <= range[1] {
        for digit in [1.0, 2.0, 5.0] {
            let value: f64 = format!("{digit}e{decade}").parse().unwrap_or(1.0);
            let place = value.log10();
            if place >= range[0] - 1e-9 && place <= range[1] + 1e-9 {
                ticks.push(value);
            }
        }
        decade += 1.0;
    }
    ticks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers_inside_the_range() {
        assert_eq!(ticks([-1.0, 0.5]), [0.1, 0.2, 0.5, 1.0, 2.0]);
        // The next half decade above 30 ends at 31.6, that above 50 at 100.
        assert_eq!(
            ticks(decades(0.1, 30.0)),
            [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0]
        );
        assert_eq!(
            ticks(decades(0.1, 50.0)),
            [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]
        );
    }

    #[test]
    fn a_slope_of_a_half_falls_half_a_decade_in_one() {
        let plot = Plot {
            x: [-1.0, 2.0],
            y: [-2.0, 0.0],
        };
        let scale = (HEIGHT - TOP - BOTTOM) / 2.0;
        assert!((plot.at_y(0.1) - plot.at_y(1.0) - scale).abs() < 1e-9);
        assert!((plot.at_x(1.0) - plot.at_x(0.1) - (WIDTH - LEFT - RIGHT) / 3.0).abs() < 1e-9);
    }
}
