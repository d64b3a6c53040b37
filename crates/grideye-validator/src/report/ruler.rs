//! A score on a line, between what right scenes have and what chance has, as SVG.

use crate::expected::ScoreDistribution;
use crate::verdict::Asked;
use grideye_draw::svg::Svg;
use grideye_draw::text::fixed;

const WIDTH: f64 = 440.0;
const HEIGHT: f64 = 46.0;
/// Room for half a number at either end.
const EDGE: f64 = 26.0;
/// The line that scores lie on.
const MIDDLE: f64 = 15.0;
/// Of the units, this share lies beyond either end of a bar.
const BEYOND: f64 = 0.001;

/// Told apart by form: a full bar is right scenes, a bar with a broken outline what has to be told from them, the
/// upright stroke what is asked, the diamond what was found.
pub(crate) fn svg(asked: &Asked) -> String {
    let axis = Axis::new(asked);
    let label = format!(
        "{} found, {} asked for",
        fixed(asked.value, 2),
        fixed(asked.least, 2)
    );
    let mut svg = Svg::inline("ruler", (WIDTH, HEIGHT), &label);
    let line = svg.element("line").with("class", "axis");
    let line = line.with("x1", 0).with("x2", WIDTH);
    line.with("y1", MIDDLE).with("y2", MIDDLE).end();
    bar(&mut svg, &axis, "right", &asked.right);
    if let Some(without) = &asked.without {
        bar(&mut svg, &axis, "without", without);
    }
    let (least, value) = (axis.x(asked.least), axis.x(asked.value));
    let line = svg.element("line").with("class", "least");
    let line = line.at("x1", least, 1).at("x2", least, 1);
    line.with("y1", 1).with("y2", 29).end();
    let top = MIDDLE - 7.0;
    svg.mark(
        "found",
        format_args!("M{value:.1} {top:.1}l7 7l-7 7l-7 -7z"),
    );
    labels(
        &mut svg,
        [(least, asked.least, "soft"), (value, asked.value, "name")],
    );
    svg.close("svg");
    svg.finish()
}

struct Axis {
    from: f64,
    to: f64,
}

impl Axis {
    fn new(asked: &Asked) -> Self {
        let laws = [Some(asked.right), asked.without];
        let ends = laws
            .iter()
            .flatten()
            .flat_map(|law| [law.low(BEYOND), law.high(BEYOND)])
            .chain([asked.value, asked.least]);
        let (from, to) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), end| {
            (from.min(end), to.max(end))
        });
        Self {
            from,
            to: to.max(from + 1e-6),
        }
    }

    fn x(&self, value: f64) -> f64 {
        EDGE + (WIDTH - 2.0 * EDGE) * (value - self.from) / (self.to - self.from)
    }
}

fn bar(svg: &mut Svg, axis: &Axis, class: &str, law: &ScoreDistribution) {
    let (from, to) = (axis.x(law.low(BEYOND)), axis.x(law.high(BEYOND)));
    let bar = svg.element("rect").with("class", class);
    bar.xy((from, MIDDLE - 6.0))
        .at("width", (to - from).max(2.0), 1)
        .with("height", 12)
        .with("rx", 3)
        .end();
}

/// Two numbers below the line, moved apart where they would touch.
fn labels(svg: &mut Svg, [mut least, mut value]: [(f64, f64, &str); 2]) {
    const APART: f64 = 36.0;
    let gap = value.0 - least.0;
    if gap.abs() < APART {
        let push = (APART - gap.abs()) / 2.0;
        let sign = if gap < 0.0 { -1.0 } else { 1.0 };
        least.0 -= sign * push;
        value.0 += sign * push;
    }
    for (x, number, class) in [least, value] {
        let x = x.clamp(EDGE / 2.0, WIDTH - EDGE / 2.0);
        svg.element("text")
            .with("class", format_args!("middle {class}"))
            .at("x", x, 1)
            .with("y", 39)
            .text(fixed(number, 2));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expected::distribution::Scale;

    fn law(values: &[f64]) -> ScoreDistribution {
        ScoreDistribution::of(Scale::Plain, values.iter().map(|&value| Some(value))).unwrap()
    }

    fn asked(value: f64) -> Asked {
        Asked {
            value,
            least: 0.3,
            right: law(&[0.65, 0.75]),
            without: Some(law(&[-0.1, 0.1])),
        }
    }

    #[test]
    fn what_is_more_lies_further_right_and_all_lies_on_the_paper() {
        let axis = Axis::new(&asked(0.6));
        let places = [-0.309, 0.0, 0.3, 0.6, 0.85].map(|value| axis.x(value));
        assert!(places.is_sorted() && places[0] >= EDGE && places[4] <= WIDTH - EDGE);
        // 3.09 standard deviations of 0.1 below 0, and of 0.05 above 0.7.
        assert!((axis.x(-0.309_02) - EDGE).abs() < 0.01);
        assert!((axis.x(0.854_51) - (WIDTH - EDGE)).abs() < 0.01);
    }

    #[test]
    fn numbers_do_not_lie_on_each_other() {
        let svg = svg(&asked(0.31));
        let places: Vec<f64> = svg
            .split("<text ")
            .skip(1)
            .map(|text| {
                text.split("x=\"")
                    .nth(1)
                    .unwrap()
                    .split('"')
                    .next()
                    .unwrap()
            })
            .map(|x| x.parse().unwrap())
            .collect();
        assert!((places[1] - places[0] - 36.0).abs() < 0.2, "{places:?}");
    }

    #[test]
    fn a_law_of_one_value_has_a_place_too() {
        let law = law(&[0.5, 0.5]);
        let same = Asked {
            value: 0.5,
            least: 0.5,
            right: law,
            without: None,
        };
        assert!(!svg(&same).contains("NaN"));
    }
}
