//! The evaluation graph, and scores over time, as SVG.

use crate::compare::{Comparison, EvaluationGraph, FrameScores};
use crate::metrics::IS_THRESHOLD;
use crate::metrics::score::Measure;
use crate::numbers::count;
use grideye_draw::plot::{Axis, Plot};
use grideye_draw::svg::Svg;
use grideye_draw::text::{fixed, signed};

const WIDTH: f64 = 720.0;
const ACROSS: (f64, f64) = (80.0, WIDTH - 16.0);
const DOWN: (f64, f64) = (16.0, 288.0);

/// Share of pixels below each threshold: simulated, blank frame and ceiling, in different strokes.
pub(crate) fn evaluation_graph(graph: &EvaluationGraph) -> String {
    let label = "Evaluation graph: share of pixels whose difference is below a threshold";
    let mut svg = Svg::inline("graph", (WIDTH, DOWN.1 + 52.0), label);
    let largest_c = largest_c(graph);
    let mut plot = Plot {
        svg: &mut svg,
        x: Axis::linear((0.0, largest_c), ACROSS),
        y: Axis::linear((1.0, 0.0), DOWN),
    };
    plot.rows((0..=4_u32).map(|quarter| (f64::from(quarter) / 4.0, format!("{} %", 25 * quarter))));
    let ticks = (0..=10_u32).map(|half| f64::from(half) / 2.0);
    plot.columns(
        ticks
            .take_while(|&tick| tick <= largest_c)
            .map(|tick| (tick, tick)),
    );
    plot.names("threshold in °C", "share of pixels");
    plot.upright("mark", IS_THRESHOLD);
    let at = (plot.x.place(IS_THRESHOLD) + 6.0, DOWN.1 - 12.0);
    let read = format!("IS is read here: 2σ = {IS_THRESHOLD:.2} °C");
    plot.word("name", at, read);
    let pair = ("pair", "simulated", &graph.simulated);
    let blank = ("blank", "blank frame (floor)", &graph.blank);
    let repeat = graph
        .repeat
        .as_ref()
        .map(|repeat| ("repeat", "own repeat (ceiling)", repeat));
    let x = ACROSS.1 - 270.0;
    let curves: Vec<_> = [pair, blank].into_iter().chain(repeat).collect();
    // The most important curve is drawn last.
    for (index, (class, label, shares)) in curves.into_iter().enumerate().rev() {
        let class = format!("curve {class}");
        let points = graph.thresholds_c.iter().zip(shares.iter());
        let shown = points.take_while(|(threshold_c, _)| **threshold_c <= largest_c);
        plot.curve(&class, shown.map(|(x, y)| (*x, Some(*y))));
        let y = DOWN.1 - 104.0 + 24.0 * count(index);
        plot.svg.mark(&class, format_args!("M{x:.0} {y:.0}h36"));
        plot.word("name", (x + 46.0, y), label);
    }
    svg.close("svg");
    svg.finish()
}

/// The axis ends where every curve has reached the top, at 3 °C or later.
fn largest_c(graph: &EvaluationGraph) -> f64 {
    let curves = [&graph.simulated, &graph.blank].into_iter();
    let full = curves
        .chain(&graph.repeat)
        .map(|curve| curve.partition_point(|&share| share < 1.0))
        .max()
        .unwrap_or(0);
    let last = graph.thresholds_c.last().copied().unwrap_or(1.0);
    let full_c = graph.thresholds_c.get(full).copied().unwrap_or(last);
    full_c.ceil().clamp(last.min(3.0), last)
}

const PANEL: f64 = 116.0;
const GAP: f64 = 56.0;
const TOP: f64 = 30.0;
const DOTS_MAX: usize = 60;

struct Panel {
    title: &'static str,
    points: Vec<(f64, Option<f64>)>,
    /// Dashed: the blank frame, or the allowed range.
    floors: Vec<f64>,
    ceiling: Option<f64>,
    holds: (f64, f64),
    number: fn(f64, usize) -> String,
}

/// Correlation, RMSE and common offset of each pair over time; empty for a single frame.
pub(crate) fn section(comparison: &Comparison) -> String {
    if comparison.timeline.len() < 2 {
        return String::new();
    }
    format!(
        "<h3>Scores over time</h3>\n<p>Each real frame with its simulated one. Dashed: the blank frame's mean, or the allowed offset. \
         Dotted: the ceiling.</p>\n<figure>{}</figure>\n",
        over_time(&panels(comparison))
    )
}

fn panels(comparison: &Comparison) -> [Panel; 3] {
    let over_time = |value: &dyn Fn(&FrameScores) -> Option<f64>| {
        let frames = comparison.timeline.iter();
        frames
            .map(|frame| (frame.time.as_secs_f64(), value(frame)))
            .collect()
    };
    let measure = |measure: Measure, title, holds| {
        let score = comparison.score(measure);
        Panel {
            title,
            points: over_time(&|frame| frame.get(measure)),
            floors: score.blank.into_iter().collect(),
            ceiling: score.ceiling,
            holds,
            number: fixed,
        }
    };
    let most_c = comparison.level_max_c;
    [
        measure(Measure::Correlation, "C, correlation", (0.0, 1.0)),
        measure(Measure::Rmse, "RMSE in °C", (0.0, 0.5)),
        Panel {
            title: "Recording minus scene, °C",
            points: over_time(&|frame| Some(frame.offset_c)),
            floors: vec![-most_c, most_c],
            ceiling: None,
            holds: (-most_c, most_c),
            number: signed,
        },
    ]
}

fn over_time(panels: &[Panel]) -> String {
    let height = TOP + count(panels.len()) * (PANEL + GAP) + 8.0;
    let mut svg = Svg::inline("graph time", (WIDTH, height), "Scores over time");
    for (index, panel) in panels.iter().enumerate() {
        let top = TOP + count(index) * (PANEL + GAP);
        panel.draw(&mut svg, top, index + 1 == panels.len());
    }
    svg.close("svg");
    svg.finish()
}

impl Panel {
    fn draw(&self, svg: &mut Svg, top: f64, is_last: bool) {
        let values = self.points.iter().filter_map(|point| point.1);
        let values = values
            .chain(self.floors.iter().copied())
            .chain(self.ceiling);
        let (low, high) = values.fold(self.holds, |(low, high), value| {
            (low.min(value), high.max(value))
        });
        let first = self.points.first().map_or(0.0, |point| point.0);
        let last = self.points.last().map_or(1.0, |point| point.0);
        let last = last.max(first + 1e-3);
        let mut plot = Plot {
            svg,
            x: Axis::linear((first, last), ACROSS),
            y: Axis::linear((high, low), (top, top + PANEL)),
        };
        plot.word("name", (ACROSS.0, top - 14.0), self.title);
        let levels = [low, f64::midpoint(low, high), high];
        plot.rows(levels.map(|level| (level, (self.number)(level, 2))));
        for floor in &self.floors {
            plot.level("curve blank", *floor);
        }
        if let Some(ceiling) = self.ceiling {
            plot.level("curve repeat", ceiling);
        }
        plot.curve("curve pair", self.points.iter().copied());
        if self.points.len() <= DOTS_MAX {
            plot.svg.element("g").with("class", "dots").open();
            for (time_s, value) in &self.points {
                if let Some(value) = value {
                    let (x, y) = (plot.x.place(*time_s), plot.y.place(*value));
                    let dot = plot.svg.element("circle").at("cx", x, 1).at("cy", y, 1);
                    dot.with("r", 2.6).end();
                }
            }
            plot.svg.close("g");
        }
        let unit = if is_last { " s" } else { "" };
        for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let time_s = first + share * (last - first);
            plot.below(time_s, 14.0, format_args!("{}{unit}", fixed(time_s, 1)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn holds(svg: &str, pieces: &[&str]) {
        for piece in pieces {
            assert!(svg.contains(piece), "{piece} is not in {svg}");
        }
    }

    /// 0 to 4 degrees over 80 to 704, 0 to 100 % over 288 to 16.
    #[test]
    fn curves_start_and_end_where_their_shares_are() {
        let graph = EvaluationGraph {
            thresholds_c: vec![0.0, 1.0, 2.0, 4.0],
            simulated: vec![0.0, 0.5, 1.0, 1.0],
            blank: vec![0.0, 0.25, 0.5, 1.0],
            repeat: None,
        };
        let svg = evaluation_graph(&graph);
        holds(
            &svg,
            &[
                "class=\"curve pair\" d=\"M80.0 288.0L236.0 152.0L392.0 16.0L704.0 16.0\"",
                "class=\"curve blank\" d=\"M80.0 288.0L236.0 220.0L392.0 152.0L704.0 16.0\"",
                "threshold in °C",
                "2σ = 1.67 °C",
            ],
        );
        assert!(!svg.contains("ceiling"));
    }

    /// Values 0 to 1 over 30 to 146, times 2 to 6 s over 80 to 704; the second value is missing.
    #[test]
    fn points_stand_where_they_are_and_gaps_stay_open() {
        let points = [(2.0, Some(0.0)), (3.0, None), (4.0, Some(0.5))];
        let panel = Panel {
            title: "C",
            points: points.into_iter().chain([(6.0, Some(1.0))]).collect(),
            floors: vec![0.25],
            ceiling: Some(0.75),
            holds: (0.0, 1.0),
            number: fixed,
        };
        holds(
            &over_time(&[panel]),
            &[
                "class=\"curve pair\" d=\"M80.0 146.0M392.0 88.0L704.0 30.0\"",
                "class=\"curve blank\" d=\"M80 117.0H704\"",
                "class=\"curve repeat\" d=\"M80 59.0H704\"",
                ">6.0 s<",
            ],
        );
    }
}
