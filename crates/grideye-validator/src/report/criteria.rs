//! The criteria with a chart for each score, and the thresholds with their sources.

use crate::compare::Comparison;
use crate::expected::{DRAWS, ScoreDistribution};
use crate::report::text::Context;
use crate::verdict::{Asked, Criterion, State};
use grideye_draw::plot::Axis;
use grideye_draw::svg::Svg;
use grideye_draw::text::{escape, fixed};

pub(crate) fn section(comparison: &Comparison) -> String {
    let criteria = || comparison.judgment.criteria.iter();
    let is_shown = |criterion: &&Criterion| {
        criterion.asked.is_some() || matches!(criterion.state, State::Failed | State::Open)
    };
    let rows = |rows: String| {
        format!("<table class=\"list criteria\">\n<tbody>\n{rows}</tbody>\n</table>\n")
    };
    let shown = rows(criteria().filter(is_shown).map(row).collect());
    let others = criteria().filter(|criterion| !is_shown(criterion));
    let (count, others) = (others.clone().count(), others.map(row).collect());
    format!(
        "<h2>Criteria</h2>\n<p>Every criterion that was asked must be met. In the charts, the diamond is the score, the \
         stroke the requirement, the bar the range of {DRAWS} simulated sensors that see the scene, and the dashed outline of \
         those that see the room without its people, or an empty room.</p>\n{shown}\
         <details><summary>{count} more, met or not asked</summary>\n{}</details>\n",
        rows(others)
    )
}

fn row(criterion: &Criterion) -> String {
    let (mark, word) = match criterion.state {
        State::Met => ("✓", "met"),
        State::Failed => ("✗", "failed"),
        State::Open => ("?", "cannot tell"),
        State::NotAsked => ("–", "not asked"),
    };
    let text = format!("{} {}", criterion.sentence, criterion.next_step);
    format!(
        "<tr class=\"{}\"><th scope=\"row\">{}</th><td class=\"state\"><span aria-hidden=\"true\">{mark}</span> {word}</td><td>{}{}</td></tr>\n",
        criterion.state.name(),
        escape(criterion.title),
        escape(text.trim_end()),
        criterion.asked.as_ref().map_or_else(String::new, ruler)
    )
}

/// Each threshold with its number and source; empty without thresholds.
pub(crate) fn thresholds(context: &Context) -> String {
    if context.thresholds.is_empty() {
        return String::new();
    }
    let rows: String = context
        .thresholds
        .iter()
        .map(|line| {
            format!(
                "<tr><th scope=\"row\"><code>{}</code></th><td>{}</td><td>{}<br><span class=\"soft\">{}</span></td></tr>\n",
                line.key,
                line.value,
                escape(&line.source),
                escape(&line.file)
            )
        })
        .collect();
    format!(
        "<h2>Thresholds</h2>\n<details><summary>Values and sources</summary>\n<p>A skill is a share of the way from chance to \
         the lowest score of a right scene; keys ending in <code>_c</code> are in °C. Change them with \
         <code>--thresholds FILE</code>.</p>\n\
         <table class=\"list thresholds\">\n<tbody>\n{rows}</tbody>\n</table></details>\n"
    )
}

const WIDTH: f64 = 440.0;
const HEIGHT: f64 = 46.0;
const EDGE: f64 = 26.0;
const MIDDLE: f64 = 15.0;
/// The share of units beyond either end of a bar.
const BEYOND: f64 = 0.001;

/// Bar: right scenes; dashed outline: rooms without people, or empty; stroke: required; diamond: found.
pub(crate) fn ruler(asked: &Asked) -> String {
    let axis = axis(asked);
    let label = format!(
        "{} found, {} required",
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
    let (least, value) = (axis.place(asked.least), axis.place(asked.value));
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

fn axis(asked: &Asked) -> Axis {
    let laws = [Some(asked.right), asked.without].into_iter().flatten();
    let ends = laws.flat_map(|law| [law.low(BEYOND), law.high(BEYOND)]);
    let (from, to) = ends
        .chain([asked.value, asked.least])
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), end| {
            (from.min(end), to.max(end))
        });
    Axis::linear((from, to.max(from + 1e-6)), (EDGE, WIDTH - EDGE))
}

fn bar(svg: &mut Svg, axis: &Axis, class: &str, law: &ScoreDistribution) {
    let (from, to) = (axis.place(law.low(BEYOND)), axis.place(law.high(BEYOND)));
    let bar = svg.element("rect").with("class", class);
    bar.xy((from, MIDDLE - 6.0))
        .at("width", (to - from).max(2.0), 1)
        .with("height", 12)
        .with("rx", 3)
        .end();
}

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
    use crate::expected::units::Scale;

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
        let axis = axis(&asked(0.6));
        let places = [-0.309, 0.0, 0.3, 0.6, 0.85].map(|value| axis.place(value));
        assert!(places.is_sorted() && places[0] >= EDGE && places[4] <= WIDTH - EDGE);
        // 3.09 standard deviations of 0.1 below 0, and of 0.05 above 0.7.
        assert!((axis.place(-0.309_02) - EDGE).abs() < 0.01);
        assert!((axis.place(0.854_51) - (WIDTH - EDGE)).abs() < 0.01);
    }

    #[test]
    fn numbers_do_not_lie_on_each_other() {
        let svg = ruler(&asked(0.31));
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
        assert!(!ruler(&same).contains("NaN"));
    }
}
