//! The evaluation graph as SVG.

use crate::compare::EvaluationGraph;
use crate::metrics::IS_THRESHOLD;
use crate::numbers::count;
use std::fmt::Write;

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 340.0;
const LEFT: f64 = 80.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 16.0;
const BOTTOM: f64 = 52.0;

/// Share of pixels over the threshold: the pair, the blank frame and the ceiling, told apart by their strokes.
pub(crate) fn svg(graph: &EvaluationGraph) -> String {
    let plot = Plot::new(graph);
    let mut svg = format!(
        "<svg class=\"graph\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" \
         aria-label=\"Evaluation graph: share of pixels whose difference is below a threshold\">"
    );
    plot.axes(&mut svg);
    plot.threshold(&mut svg);
    if let Some(repeat) = &graph.repeat {
        plot.curve(&mut svg, "repeat", repeat);
    }
    plot.curve(&mut svg, "blank", &graph.blank);
    plot.curve(&mut svg, "pair", &graph.simulated);
    legend(&mut svg, graph.repeat.is_some());
    svg.push_str("</svg>");
    svg
}

struct Plot<'a> {
    thresholds_c: &'a [f64],
    largest_c: f64,
}

impl<'a> Plot<'a> {
    /// The axis ends where every curve has reached the top, but not before 3 degrees.
    fn new(graph: &'a EvaluationGraph) -> Self {
        let thresholds_c = &graph.thresholds_c;
        let curves = [
            Some(&graph.simulated),
            Some(&graph.blank),
            graph.repeat.as_ref(),
        ];
        let full = curves
            .into_iter()
            .flatten()
            .map(|curve| curve.partition_point(|&share| share < 1.0))
            .max()
            .unwrap_or(0);
        let last = thresholds_c.last().copied().unwrap_or(1.0);
        let largest_c = thresholds_c
            .get(full)
            .copied()
            .unwrap_or(last)
            .ceil()
            .clamp(last.min(3.0), last);
        Self {
            thresholds_c,
            largest_c,
        }
    }

    fn x(&self, threshold_c: f64) -> f64 {
        LEFT + (WIDTH - LEFT - RIGHT) * threshold_c / self.largest_c
    }

    fn y(share: f64) -> f64 {
        TOP + (HEIGHT - TOP - BOTTOM) * (1.0 - share)
    }

    fn axes(&self, svg: &mut String) {
        let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
        for quarter in 0..=4_u32 {
            let y = Self::y(f64::from(quarter) / 4.0);
            let _ = write!(
                svg,
                "<path class=\"grid\" d=\"M{LEFT} {y:.1}H{right}\"/><text class=\"end\" x=\"{:.0}\" y=\"{y:.1}\">{} %</text>",
                LEFT - 8.0,
                25 * quarter
            );
        }
        for tick in self.ticks() {
            let x = self.x(tick);
            let _ = write!(
                svg,
                "<path class=\"grid\" d=\"M{x:.1} {TOP}V{bottom}\"/><text class=\"middle\" x=\"{x:.1}\" y=\"{:.0}\">{tick}</text>",
                bottom + 16.0
            );
        }
        let _ = write!(
            svg,
            "<text class=\"middle name\" x=\"{:.0}\" y=\"{:.0}\">threshold in °C</text>\
             <text class=\"middle name\" transform=\"translate(14 {:.0}) rotate(-90)\">pixels that differ by less</text>",
            f64::midpoint(LEFT, right),
            HEIGHT - 10.0,
            f64::midpoint(TOP, bottom)
        );
    }

    fn ticks(&self) -> Vec<f64> {
        (0..=10_u32)
            .map(|half| f64::from(half) / 2.0)
            .filter(|&tick| tick <= self.largest_c)
            .collect()
    }

    fn threshold(&self, svg: &mut String) {
        let (x, bottom) = (self.x(IS_THRESHOLD), HEIGHT - BOTTOM);
        let _ = write!(
            svg,
            "<path class=\"mark\" d=\"M{x:.1} {TOP}V{bottom}\"/>\
             <text class=\"name\" x=\"{:.1}\" y=\"{:.0}\">IS is read here: 2σ = {IS_THRESHOLD:.2} °C</text>",
            x + 6.0,
            bottom - 12.0
        );
    }

    fn curve(&self, svg: &mut String, class: &str, shares: &[f64]) {
        let _ = write!(svg, "<path class=\"curve {class}\" d=\"");
        let points = self
            .thresholds_c
            .iter()
            .zip(shares)
            .filter(|&(&threshold, _)| threshold <= self.largest_c);
        for (index, (&threshold, &share)) in points.enumerate() {
            let command = if index == 0 { 'M' } else { 'L' };
            let _ = write!(
                svg,
                "{command}{:.1} {:.1}",
                self.x(threshold),
                Self::y(share)
            );
        }
        svg.push_str("\"/>");
    }
}

fn legend(svg: &mut String, has_repeat: bool) {
    let mut entries = vec![("pair", "simulated"), ("blank", "blank frame (floor)")];
    if has_repeat {
        entries.push(("repeat", "the sensor's own repeat (ceiling)"));
    }
    let x = WIDTH - RIGHT - 270.0;
    for (index, (class, label)) in entries.iter().enumerate() {
        let y = HEIGHT - BOTTOM - 104.0 + 24.0 * count(index);
        let _ = write!(
            svg,
            "<path class=\"curve {class}\" d=\"M{x:.0} {y:.0}h36\"/><text class=\"name\" x=\"{:.0}\" y=\"{y:.0}\">{label}</text>",
            x + 46.0
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_start_and_end_where_their_shares_are() {
        let graph = EvaluationGraph {
            thresholds_c: vec![0.0, 1.0, 2.0, 4.0],
            simulated: vec![0.0, 0.5, 1.0, 1.0],
            blank: vec![0.0, 0.25, 0.5, 1.0],
            repeat: None,
        };
        let svg = svg(&graph);
        // 0 to 4 degrees over 80 to 704, 0 to 100 % over 288 to 16.
        assert!(
            svg.contains(
                "class=\"curve pair\" d=\"M80.0 288.0L236.0 152.0L392.0 16.0L704.0 16.0\""
            ),
            "{svg}"
        );
        assert!(svg.contains(
            "class=\"curve blank\" d=\"M80.0 288.0L236.0 220.0L392.0 152.0L704.0 16.0\""
        ));
        assert!(!svg.contains("ceiling"));
        assert!(svg.contains("threshold in °C") && svg.contains("2σ = 1.67 °C"));
    }
}
