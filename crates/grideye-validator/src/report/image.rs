//! Frames and maps as images: a PNG with one dot per pixel, in an SVG that scales it and writes the values.

use crate::compare::{Comparison, FilmFrame};
use crate::metrics::IS_THRESHOLD;
use crate::numbers::{count, differences, extremes};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use grideye_draw::canvas::Canvas;
use grideye_draw::encode;
use grideye_draw::palette::{DIFFERENCE, INFERNO, Rgb, color, ink};
use grideye_draw::svg::Svg;
use grideye_draw::text::{fixed, signed};
use grideye_frame::{COLUMNS, ROWS};

#[derive(Clone, Copy)]
pub(crate) enum Shows {
    /// From the coldest to the warmest, °C.
    Temperatures((f64, f64)),
    /// Real minus simulated, on a scale from minus to plus this many degrees.
    Differences { limit_c: f64 },
}

const CELL: usize = 40;

/// The least that scales of temperatures and of differences show, as on the page: less would show noise as warmth.
const SPAN_MIN_C: f64 = 4.0;
const END_MIN_C: f64 = 2.0;

/// The common scale of all real and simulated frames, from whole degrees to whole degrees.
pub(crate) fn shared_range(comparison: &Comparison) -> (f64, f64) {
    let frames = comparison.film.iter();
    let values: Vec<f64> = frames
        .flat_map(|frame| frame.real.iter().chain(&frame.simulated))
        .copied()
        .collect();
    let (coldest_c, warmest_c) = extremes(&values);
    let low_c = coldest_c.floor();
    (low_c, warmest_c.ceil().max(low_c + SPAN_MIN_C))
}

/// The end of the scale of differences, in whole degrees.
pub(crate) fn difference_limit(comparison: &Comparison) -> f64 {
    let frames = comparison.film.iter();
    let all = frames.flat_map(|frame| differences(&frame.real, &frame.simulated));
    largest(all).ceil().max(END_MIN_C)
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most, value| f64::max(most, value.abs()))
}

/// Of a map's values, in half degrees.
fn limit(values: impl Iterator<Item = f64>) -> f64 {
    ((largest(values) * 2.0).ceil() / 2.0).max(0.5)
}

pub(crate) fn difference(real: &[f64], simulated: &[f64]) -> Vec<f64> {
    differences(simulated, real).collect()
}

/// An image, with the value in each cell if `numbered`; differences that do not count as similar are hatched.
pub(crate) fn svg(values: &[f64], shows: Shows, numbered: bool, title: &str) -> String {
    let (width, height) = (COLUMNS * CELL, ROWS * CELL);
    let colors: Vec<Rgb> = values.iter().map(|&value| shows.color(value)).collect();
    let mut svg = Svg::inline("frame", (width, height), title);
    svg.element("title").text(title);
    let image = svg.element("image").with("width", width);
    let image = image.with("height", height);
    image
        .with("preserveAspectRatio", "none")
        .with("href", png_uri(&colors))
        .end();
    for (index, (&value, &color)) in values.iter().zip(&colors).enumerate() {
        let (x, y) = (index % COLUMNS * CELL, index / COLUMNS * CELL);
        if shows.is_hatched(value) {
            svg.mark("hatch", hatch(x, y));
        }
        if numbered {
            let number = svg.element("text").with("x", x + CELL / 2);
            let number = number.with("y", y + CELL / 2);
            number.with("fill", ink(color)).text(shows.label(value));
        }
    }
    svg.close("svg");
    svg.finish()
}

/// The scale as a bar with its ends and middle, °C.
pub(crate) fn scale(shows: Shows) -> String {
    let (from, to, stops): (f64, f64, &[Rgb]) = match shows {
        Shows::Temperatures((low, high)) => (low, high, &INFERNO),
        Shows::Differences { limit_c } => (-limit_c, limit_c, &DIFFERENCE),
    };
    let stops = stops.iter();
    let steps = stops
        .map(|[r, g, b]| format!("rgb({r} {g} {b})"))
        .collect::<Vec<_>>()
        .join(",");
    let [low, middle, high] = [from, f64::midpoint(from, to), to].map(|value| shows.label(value));
    format!(
        "<div class=\"scale\"><div class=\"ramp\" style=\"background:linear-gradient(to right,{steps})\"></div>\
         <div class=\"ticks\"><span>{low} °C</span><span>{middle} °C</span><span>{high} °C</span></div></div>"
    )
}

impl Shows {
    pub(crate) fn color(self, value: f64) -> Rgb {
        match self {
            Self::Temperatures((low, high)) => {
                color(&INFERNO, (value - low) / (high - low).max(1e-9))
            }
            Self::Differences { limit_c } => {
                color(&DIFFERENCE, f64::midpoint(value / limit_c.max(1e-9), 1.0))
            }
        }
    }

    fn label(self, value: f64) -> String {
        match self {
            Self::Temperatures(_) => fixed(value, 2),
            Self::Differences { limit_c } if limit_c < 1.0 => signed(value, 2),
            Self::Differences { .. } => signed(value, 1),
        }
    }

    fn is_hatched(self, value: f64) -> bool {
        matches!(self, Self::Differences { .. }) && value.abs() >= IS_THRESHOLD
    }
}

fn hatch(x: usize, y: usize) -> String {
    let half = CELL / 2;
    format!(
        "M{x} {0}l{half} -{half}M{x} {1}l{CELL} -{CELL}M{2} {1}l{half} -{half}",
        y + half,
        y + CELL,
        x + half
    )
}

fn png_uri(colors: &[Rgb]) -> String {
    let mut bytes = Vec::new();
    let canvas = Canvas::of(COLUMNS, colors.to_vec());
    // Memory takes every byte.
    drop(encode::rgb(&canvas, &mut bytes));
    format!("data:image/png;base64,{}", STANDARD.encode(bytes))
}

/// The frame with the most contrast, shown large.
pub(crate) fn key_frame(comparison: &Comparison) -> Option<&FilmFrame> {
    let contrast = |frame: &&FilmFrame| {
        let mean = frame.simulated.iter().sum::<f64>() / count(frame.simulated.len());
        frame
            .simulated
            .iter()
            .map(|value| (value - mean).powi(2))
            .sum::<f64>()
    };
    let film = comparison.film.iter();
    film.max_by(|a, b| contrast(a).total_cmp(&contrast(b)))
}

pub(crate) fn maps_section(comparison: &Comparison) -> String {
    let maps = &comparison.maps;
    if maps.bias_c.is_empty() {
        return String::new();
    }
    let differences = Shows::Differences {
        limit_c: limit(maps.bias_c.iter().copied()),
    };
    let errors = Shows::Temperatures((0.0, limit(maps.rmse_c.iter().copied())));
    let figure = |values: &[f64], shows, name: &str, caption: &str| {
        let scale = scale(shows);
        let svg = svg(values, shows, true, name);
        format!("<figure>{svg}{scale}<figcaption><b>{name}</b> {caption}</figcaption></figure>\n")
    };
    format!(
        "<p>Each pixel over all frames. A single pixel that stands out has a fault or a fixed pattern; a patch is an \
         object that the scene lacks or has elsewhere.</p>\n<div class=\"frames\">\n{}{}</div>\n",
        figure(
            &maps.bias_c,
            differences,
            "Mean difference",
            "real minus simulated, °C"
        ),
        figure(&maps.rmse_c, errors, "Error", "root mean square, °C"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_from_the_threshold_on_are_hatched() {
        let shows = Shows::Differences { limit_c: 3.0 };
        let values = [0.0, 1.6, -1.7, 2.5, 0.0, 0.0, 0.0, 0.0];
        let svg = svg(&values, shows, true, "difference");
        assert_eq!(svg.matches("class=\"hatch\"").count(), 2);
        assert!(svg.contains(">+1.6<") && svg.contains(">\u{2212}1.7<") && svg.contains(">0.0<"));
        let plain = super::svg(&values, Shows::Temperatures((-3.0, 3.0)), false, "real");
        assert!(!plain.contains("hatch") && !plain.contains("<text"));
    }
}
