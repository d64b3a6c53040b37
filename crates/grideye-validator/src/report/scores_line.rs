//! The paper's three scores in one line.

use super::paper;
use crate::compare::Comparison;
use crate::metrics::score::Measure;

/// The paper's three scores in one line, each with its blank frame, shuffled pixels and repeat, and the paper's own.
#[must_use]
pub fn scores_line(comparison: &Comparison, experiment: Option<u8>) -> String {
    let mut published = paper::EXPERIMENTS.iter();
    let published = published.find(|published| Some(published.number) == experiment);
    let lines = [
        (Measure::Correlation, ("C", 2, 1.0, "")),
        (Measure::MutualInformationGrey, ("MI", 1, 1.0, " bit")),
        (Measure::ImageSimilarity, ("IS", 0, 100.0, " %")),
    ];
    lines
        .map(|(measure, style)| {
            let figure = published.and_then(|published| published.figure(measure));
            shown(comparison, measure, figure, style)
        })
        .join("; ")
}

/// `C 0.97 (shuffled 0.01, repeat 0.98; the paper's 0.79)`, by the name, digits, scale and unit.
fn shown(
    comparison: &Comparison,
    measure: Measure,
    published: Option<f64>,
    (title, digits, scale, unit): (&str, usize, f64, &str),
) -> String {
    let number = |value: f64| {
        let rounded = format!("{:.digits$}", value * scale);
        // Without the zero, a shuffled mean of -0.001 would read "-0.00".
        let is_zero = !rounded.contains(|digit| ('1'..='9').contains(&digit));
        let plain = rounded.trim_start_matches(|sign| is_zero && sign == '-');
        format!("{plain}{unit}")
    };
    let score = comparison.score(measure);
    let value = score.value.map_or_else(|| "none".to_owned(), number);
    let beside = [
        ("blank frame", score.blank),
        ("shuffled", score.shuffled.map(|shuffled| shuffled.mean)),
        ("repeat", score.ceiling),
        ("the paper's", published),
    ];
    let beside = beside
        .into_iter()
        .filter_map(|(name, value)| Some(format!("{name} {}", number(value?))));
    format!(
        "{title} {value} ({})",
        beside.collect::<Vec<_>>().join(", ")
    )
}
