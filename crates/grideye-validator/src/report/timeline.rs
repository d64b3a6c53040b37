//! Scores over time as SVG: one panel a measure, under one axis of time.

use crate::compare::{Comparison, FrameScores};
use crate::metrics::score::Measure;
use crate::numbers::count;
use grideye_draw::svg::Svg;
use grideye_draw::text::{fixed, signed};
use std::fmt::Write;

const WIDTH: f64 = 720.0;
const LEFT: f64 = 80.0;
const RIGHT: f64 = 16.0;
const PANEL: f64 = 116.0;
const GAP: f64 = 56.0;
const TOP: f64 = 30.0;
/// More points than this are drawn as a line alone.
const DOTS_MAX: usize = 60;

/// One measure over time, with its floor and its ceiling.
struct Panel {
    title: String,
    points: Vec<(f64, Option<f64>)>,
    /// Dashed: the blank frame, or what is allowed.
    floors: Vec<f64>,
    /// Dotted.
    ceiling: Option<f64>,
    /// What the axis shows at least.
    holds: (f64, f64),
    signed: bool,
}

/// C, RMSE and the common offset of each real frame and the simulated one beside it; empty where there is one frame.
pub(crate) fn section(comparison: &Comparison) -> String {
    if comparison.timeline.len() < 2 {
        return String::new();
    }
    format!(
        "<h2>Scores over time</h2>\n<p>Each real frame and the simulated one beside it. Dashed: what a blank frame scores \
         on average, and for the offset what is allowed; dotted: the ceiling.</p>\n<figure>{}</figure>\n",
        svg(&panels(comparison))
    )
}

fn panels(comparison: &Comparison) -> [Panel; 3] {
    let over_time = |value: &dyn Fn(&FrameScores) -> Option<f64>| {
        comparison
            .timeline
            .iter()
            .map(|frame| (frame.time.as_secs_f64(), value(frame)))
            .collect()
    };
    let measure = |measure: Measure, title: &str, holds| {
        let score = comparison.score(measure);
        Panel {
            title: title.to_owned(),
            points: over_time(&|frame| frame.get(measure)),
            floors: score.blank.into_iter().collect(),
            ceiling: score.ceiling,
            holds,
            signed: false,
        }
    };
    let most_c = comparison.level_max_c;
    [
        measure(Measure::Correlation, "C, correlation", (0.0, 1.0)),
        measure(Measure::Rmse, "RMSE in °C", (0.0, 0.5)),
        Panel {
            title: "Recording less scene all over, °C".to_owned(),
            points: over_time(&|frame| Some(frame.offset_c)),
            floors: vec![-most_c, most_c],
            ceiling: None,
            holds: (-most_c, most_c),
            signed: true,
        },
    ]
}

fn svg(panels: &[Panel]) -> String {
    let height = TOP + count(panels.len()) * (PANEL + GAP) + 8.0;
    let mut svg = Svg::inline("graph time", (WIDTH, height), "Scores over time");
    for (index, panel) in panels.iter().enumerate() {
        let top = TOP + count(index) * (PANEL + GAP);
        Plot::new(panel, top).draw(&mut svg, index + 1 == panels.len());
    }
    svg.close("svg");
    svg.finish()
}

struct Plot<'a> {
    panel: &'a Panel,
    top: f64,
    times_s: (f64, f64),
    values: (f64, f64),
}

impl<'a> Plot<'a> {
    fn new(panel: &'a Panel, top: f64) -> Self {
        let values = panel
            .points
            .iter()
            .filter_map(|point| point.1)
            .chain(panel.floors.iter().copied())
            .chain(panel.ceiling);
        let (low, high) = values.fold(panel.holds, |(low, high), value| {
            (low.min(value), high.max(value))
        });
        let first = panel.points.first().map_or(0.0, |point| point.0);
        let last = panel.points.last().map_or(1.0, |point| point.0);
        Self {
            panel,
            top,
            times_s: (first, last.max(first + 1e-3)),
            values: (low, high),
        }
    }

    fn x(&self, time_s: f64) -> f64 {
        let (first, last) = self.times_s;
        LEFT + (WIDTH - LEFT - RIGHT) * (time_s - first) / (last - first)
    }

    fn y(&self, value: f64) -> f64 {
        let (low, high) = self.values;
        self.top + PANEL * (high - value) / (high - low)
    }

    fn draw(&self, svg: &mut Svg, is_last: bool) {
        let right = WIDTH - RIGHT;
        let title = svg.element("text").with("class", "name");
        title
            .with("x", LEFT)
            .at("y", self.top - 14.0, 1)
            .text(&self.panel.title);
        let (low, high) = self.values;
        for value in [low, f64::midpoint(low, high), high] {
            let y = self.y(value);
            let label = if self.panel.signed {
                signed(value, 2)
            } else {
                fixed(value, 2)
            };
            svg.mark("grid", format_args!("M{LEFT} {y:.1}H{right}"));
            let number = svg.element("text").with("class", "end");
            number.at("x", LEFT - 8.0, 0).at("y", y, 1).text(label);
        }
        let floors = self.panel.floors.iter().map(|floor| ("blank", *floor));
        let ceiling = self.panel.ceiling.map(|ceiling| ("repeat", ceiling));
        for (class, value) in floors.chain(ceiling) {
            let y = self.y(value);
            svg.mark(
                &format!("curve {class}"),
                format_args!("M{LEFT} {y:.1}H{right}"),
            );
        }
        self.line(svg);
        self.times(svg, is_last);
    }

    /// A gap where the measure is not defined.
    fn line(&self, svg: &mut Svg) {
        let mut path = String::new();
        let mut dots = Vec::new();
        let mut is_begun = false;
        for &(time_s, value) in &self.panel.points {
            let Some(value) = value else {
                is_begun = false;
                continue;
            };
            let (x, y) = (self.x(time_s), self.y(value));
            let command = if is_begun { 'L' } else { 'M' };
            is_begun = true;
            let _ = write!(path, "{command}{x:.1} {y:.1}");
            dots.push((x, y));
        }
        svg.mark("curve pair", path);
        if self.panel.points.len() <= DOTS_MAX {
            svg.element("g").with("class", "dots").open();
            for (x, y) in dots {
                let dot = svg.element("circle").at("cx", x, 1).at("cy", y, 1);
                dot.with("r", 2.6).end();
            }
            svg.close("g");
        }
    }

    fn times(&self, svg: &mut Svg, is_last: bool) {
        let bottom = self.top + PANEL + 14.0;
        let (first, last) = self.times_s;
        for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let time_s = first + share * (last - first);
            let unit = if is_last { " s" } else { "" };
            let time = svg.element("text").with("class", "middle");
            time.xy((self.x(time_s), bottom))
                .text(format_args!("{}{unit}", fixed(time_s, 1)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values 0 to 1 over 30 to 146, times 2 to 6 s over 80 to 704; the second value is missing.
    #[test]
    fn points_stand_where_they_are_and_gaps_stay_open() {
        let panel = Panel {
            title: "C".to_owned(),
            points: vec![
                (2.0, Some(0.0)),
                (3.0, None),
                (4.0, Some(0.5)),
                (6.0, Some(1.0)),
            ],
            floors: vec![0.25],
            ceiling: Some(0.75),
            holds: (0.0, 1.0),
            signed: false,
        };
        let svg = svg(&[panel]);
        let pieces = [
            "class=\"curve pair\" d=\"M80.0 146.0M392.0 88.0L704.0 30.0\"",
            "class=\"curve blank\" d=\"M80 117.0H704\"",
            "class=\"curve repeat\" d=\"M80 59.0H704\"",
            ">6.0 s<",
        ];
        for piece in pieces {
            assert!(svg.contains(piece), "{piece} is not in {svg}");
        }
    }
}
