//! The evaluation graph as SVG.

use crate::compare::EvaluationGraph;
use crate::metrics::IS_THRESHOLD;
use crate::numbers::count;
use grideye_draw::svg::{Svg, path};

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 340.0;
const LEFT: f64 = 80.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 16.0;
const BOTTOM: f64 = 52.0;

/// Share of pixels over the threshold: the pair, the blank frame and the ceiling, told apart by their strokes.
pub(crate) fn svg(graph: &EvaluationGraph) -> String {
    let plot = Plot::new(graph);
    let mut svg = Svg::inline(
        "graph",
        (WIDTH, HEIGHT),
        "Evaluation graph: share of pixels whose difference is below a threshold",
    );
    plot.axes(&mut svg);
    plot.threshold(&mut svg);
    if let Some(repeat) = &graph.repeat {
        plot.curve(&mut svg, "repeat", repeat);
    }
    plot.curve(&mut svg, "blank", &graph.blank);
    plot.curve(&mut svg, "pair", &graph.simulated);
    legend(&mut svg, graph.repeat.is_some());
    svg.close("svg");
    svg.finish()
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

    fn axes(&self, svg: &mut Svg) {
        let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
        for quarter in 0..=4_u32 {
            let y = Self::y(f64::from(quarter) / 4.0);
            svg.mark("grid", format_args!("M{LEFT} {y:.1}H{right}"));
            let number = svg.element("text").with("class", "end");
            let number = number.at("x", LEFT - 8.0, 0).at("y", y, 1);
            number.text(format_args!("{} %", 25 * quarter));
        }
        for tick in self.ticks() {
            let x = self.x(tick);
            svg.mark("grid", format_args!("M{x:.1} {TOP}V{bottom}"));
            let number = svg.element("text").with("class", "middle");
            number.at("x", x, 1).at("y", bottom + 16.0, 0).text(tick);
        }
        let name = svg.element("text").with("class", "middle name");
        name.at("x", f64::midpoint(LEFT, right), 0)
            .at("y", HEIGHT - 10.0, 0)
            .text("threshold in °C");
        let middle = f64::midpoint(TOP, bottom);
        let name = svg.element("text").with("class", "middle name");
        name.with(
            "transform",
            format_args!("translate(14 {middle:.0}) rotate(-90)"),
        )
        .text("pixels that differ by less");
    }

    fn ticks(&self) -> Vec<f64> {
        (0..=10_u32)
            .map(|half| f64::from(half) / 2.0)
            .filter(|&tick| tick <= self.largest_c)
            .collect()
    }

    fn threshold(&self, svg: &mut Svg) {
        let (x, bottom) = (self.x(IS_THRESHOLD), HEIGHT - BOTTOM);
        svg.mark("mark", format_args!("M{x:.1} {TOP}V{bottom}"));
        let name = svg.element("text").with("class", "name");
        name.at("x", x + 6.0, 1)
            .at("y", bottom - 12.0, 0)
            .text(format_args!("IS is read here: 2σ = {IS_THRESHOLD:.2} °C"));
    }

    fn curve(&self, svg: &mut Svg, class: &str, shares: &[f64]) {
        let points = self
            .thresholds_c
            .iter()
            .zip(shares)
            .filter(|&(&threshold, _)| threshold <= self.largest_c)
            .map(|(&threshold, &share)| (self.x(threshold), Self::y(share)));
        svg.mark(&format!("curve {class}"), path(points, 1, false));
    }
}

fn legend(svg: &mut Svg, has_repeat: bool) {
    let mut entries = vec![("pair", "simulated"), ("blank", "blank frame (floor)")];
    if has_repeat {
        entries.push(("repeat", "the sensor's own repeat (ceiling)"));
    }
    let x = WIDTH - RIGHT - 270.0;
    for (index, (class, label)) in entries.iter().enumerate() {
        let y = HEIGHT - BOTTOM - 104.0 + 24.0 * count(index);
        svg.mark(&format!("curve {class}"), format_args!("M{x:.0} {y:.0}h36"));
        let name = svg.element("text").with("class", "name");
        name.at("x", x + 46.0, 0).at("y", y, 0).text(label);
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
