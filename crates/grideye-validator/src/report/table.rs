//! The scores as plain text, for a terminal or a log.

use crate::compare::Comparison;
use crate::metrics::score::{Better, Measure, Score};
use crate::report::paper;
use crate::report::scores::GROUPS;
use crate::report::text::{UNDEFINED, value};
use grideye_draw::text::fixed;

/// Every score in a line with its floors, its ceiling, its skill and, marked as the paper's, the figure that the paper
/// published for `experiment`. The bins that entropies were counted in stand below.
#[must_use]
pub fn table(comparison: &Comparison, experiment: Option<u8>) -> String {
    let experiment = experiment.and_then(paper::experiment);
    let measures = GROUPS.iter().flat_map(|(_, _, measures)| measures.iter());
    let mut lines = vec![header(experiment)];
    lines.extend(measures.map(|&measure| {
        let figure = experiment.and_then(|experiment| experiment.figure(measure));
        cells(&comparison.score(measure), figure)
    }));
    let widths: Vec<usize> = (0..lines[0].len())
        .map(|column| lines.iter().map(|line| line[column].chars().count()).max())
        .map(Option::unwrap_or_default)
        .collect();
    let mut text: String = lines.iter().map(|line| joined(line, &widths)).collect();
    text.push_str(&below(comparison));
    text
}

const COLUMNS: usize = 9;

fn header(experiment: Option<&paper::Experiment>) -> [String; COLUMNS] {
    let papers = experiment.map_or_else(String::new, |experiment| {
        format!("the paper's, table {}", experiment.number)
    });
    [
        "score",
        "value",
        "skill",
        "blank",
        "shuffled",
        "best 5 %",
        "noise only",
        "repeat",
        &papers,
    ]
    .map(str::to_owned)
}

fn cells(score: &Score, figure: Option<f64>) -> [String; COLUMNS] {
    let measure = score.measure;
    let shuffled = score.shuffled;
    let best = shuffled
        .filter(|_| measure.better() != Better::Neither)
        .map(|shuffled| shuffled.p95);
    [
        title(measure),
        value(measure, score.value),
        score
            .skill()
            .map_or_else(|| UNDEFINED.to_owned(), |skill| fixed(skill, 2)),
        value(measure, score.blank),
        value(measure, shuffled.map(|shuffled| shuffled.mean)),
        value(measure, best),
        value(measure, score.noise),
        value(measure, score.ceiling),
        figure.map_or_else(String::new, |figure| value(measure, Some(figure))),
    ]
}

fn title(measure: Measure) -> String {
    match measure.unit() {
        "" | "%" => measure.title().to_owned(),
        unit => format!("{} [{unit}]", measure.title()),
    }
}

fn joined(line: &[String; COLUMNS], widths: &[usize]) -> String {
    let cells: Vec<String> = line
        .iter()
        .zip(widths)
        .enumerate()
        .map(|(column, (cell, &width))| match column {
            0 => format!("{cell:width$}"),
            _ => format!("{cell:>width$}"),
        })
        .collect();
    format!("{}\n", cells.join("  ").trim_end())
}

fn below(comparison: &Comparison) -> String {
    let fit = &comparison.noise_fit;
    let p = |measure| {
        let shuffled = comparison.score(measure).shuffled;
        shuffled.and_then(|shuffled| shuffled.p).unwrap_or(1.0)
    };
    let drift = comparison
        .drift_c_per_min
        .map_or_else(|| UNDEFINED.to_owned(), |slope| fixed(slope, 2));
    format!(
        "chosen bins: {} ({}); 256 levels: the paper's\n\
         MI against {} shuffled orders: p {} (256 levels), {} (chosen bins); bias taken out after Miller and Madow\n\
         chi squared {} at {} degrees of freedom, p {}; offset {} °C, drift {drift} °C a minute\n",
        comparison.settings.binning,
        comparison.settings.binning.in_words(),
        comparison.settings.shuffles,
        fixed(p(Measure::MutualInformationGrey), 3),
        fixed(p(Measure::MutualInformationBinned), 3),
        fixed(fit.value, 0),
        fit.degrees_of_freedom,
        fit.p_value()
            .map_or_else(|| UNDEFINED.to_owned(), |p| fixed(p, 3)),
        fixed(comparison.offset_c, 2),
    )
}
