//! Every score with its floors and ceiling, as a table for the page and the terminal; and the paper's three in one line.

use crate::compare::Comparison;
use crate::metrics::score::{Better, Measure, Score};
use crate::report::paper::{self, EXPERIMENTS};
use crate::report::text::{Context, UNDEFINED, value};
use grideye_draw::text::{fixed, frames as frames_in_words};

pub(crate) fn section(comparison: &Comparison, context: &Context) -> String {
    let papers = context
        .experiment
        .filter(|&number| paper::experiment(number).is_some());
    let papers = papers.map_or_else(|| "exp. 1–4".to_owned(), |number| format!("exp. {number}"));
    let rows: String = Measure::GROUPS
        .iter()
        .map(|(title, class, measures)| {
            let rows: String = measures
                .iter()
                .map(|&measure| row(&comparison.score(measure), context.experiment))
                .collect();
            format!("<tbody class=\"{class}\">\n<tr class=\"group\"><th colspan=\"8\" scope=\"rowgroup\">{title}</th></tr>\n{rows}</tbody>\n")
        })
        .collect();
    format!(
        "<h2>Scores</h2>\n\
         <p>Read a score between its floors (a blank frame at {} °C, the simulation's pixels shuffled, noise alone) and \
         its ceiling (the recording against itself {} later). Skill is the position between them, 0 to 1.</p>\n\
         <div class=\"wide\"><table>\n<thead><tr><th scope=\"col\">Measure</th><th scope=\"col\">Value</th>\
         <th scope=\"col\">Skill</th><th scope=\"col\">Floor:<br>blank frame</th>\
         <th scope=\"col\">Floor: shuffled,<br>mean (best 5 %)</th><th scope=\"col\">Floor:<br>noise only</th>\
         <th scope=\"col\">Ceiling:<br>own repeat</th>\
         <th scope=\"col\">The paper's,<br>{papers}</th></tr></thead>\n{rows}</table></div>\n\
         <details><summary>How to read the table</summary><p>The ceiling counts the sensor's noise once in C, gain, RMSE, MAE, \
         contrast, centroid and χ², twice elsewhere. A value can exceed it, for example if something moved before the repeat; its \
         skill is then 1. A skill of “{UNDEFINED}” means that the ceiling is no better than chance: here this measure tells \
         nothing. The paper's figures are from its own room; compare only their order of magnitude.</p></details>\n",
        fixed(comparison.settings.ambient_c, 2),
        frames_in_words(comparison.settings.lag_frames),
    )
}

fn row(score: &Score, experiment: Option<u8>) -> String {
    let measure = score.measure;
    let unit = match measure.unit() {
        "" | "%" => String::new(),
        unit => format!(" <span class=\"unit\">{unit}</span>"),
    };
    let [_, value, _, blank, mean, best, noise, ceiling, _] = cells(score, None);
    let shuffled = match best.as_str() {
        // Without a better direction, no pixel order is the best.
        UNDEFINED => mean,
        best => format!("{mean} ({best})"),
    };
    format!(
        "<tr><th scope=\"row\">{measure}{unit}</th><td class=\"value\">{value}</td><td>{}</td><td>{blank}</td><td>{shuffled}</td><td>{noise}</td><td>{ceiling}</td><td class=\"paper\">{}</td></tr>\n",
        skill(score),
        papers_figure(measure, experiment)
    )
}

fn skill(score: &Score) -> String {
    score.skill().map_or_else(
        || UNDEFINED.to_owned(),
        |skill| {
            format!(
                "<span class=\"skill\"><span class=\"bar\" aria-hidden=\"true\"><i style=\"width:{:.0}%\"></i></span>{skill:.2}</span>",
                100.0 * skill
            )
        },
    )
}

fn papers_figure(measure: Measure, experiment: Option<u8>) -> String {
    if let Some(experiment) = experiment.and_then(paper::experiment) {
        return experiment
            .figure(measure)
            .map_or_else(String::new, |figure| papers_digits(measure, figure));
    }
    let figures: Vec<f64> = EXPERIMENTS
        .iter()
        .filter_map(|experiment| experiment.figure(measure))
        .collect();
    let lowest = figures.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = figures.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    match lowest.total_cmp(&highest) {
        _ if figures.is_empty() => String::new(),
        std::cmp::Ordering::Equal => papers_digits(measure, lowest),
        _ => format!(
            "{} – {}",
            papers_digits(measure, lowest),
            papers_digits(measure, highest)
        ),
    }
}

fn papers_digits(measure: Measure, figure: f64) -> String {
    match measure {
        Measure::ImageSimilarity => format!("{} %", fixed(100.0 * figure, 0)),
        Measure::Correlation => fixed(figure, 2),
        _ => fixed(figure, 1),
    }
}

/// One line for each score: value, skill, floors, ceiling, and the paper's figure for `experiment`.
#[must_use]
pub fn table(comparison: &Comparison, experiment: Option<u8>) -> String {
    let experiment = experiment.and_then(paper::experiment);
    let mut lines = vec![header(experiment)];
    lines.extend(Measure::ALL.iter().map(|&measure| {
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
         MI against {} shuffled orders: p {} (256 levels), {} (chosen bins); bias removed after Miller and Madow\n\
         chi squared {} at {} degrees of freedom, p {}; offset {} °C, drift {drift} °C per minute\n",
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

/// The paper's three scores in one line, each with its floors, its ceiling and the paper's figure.
#[must_use]
pub fn scores_line(comparison: &Comparison, experiment: Option<u8>) -> String {
    let published = experiment.and_then(paper::experiment);
    let lines = [
        (Measure::Correlation, ("correlation", 2, 1.0, "")),
        (
            Measure::MutualInformationGrey,
            ("mutual information", 1, 1.0, " bit"),
        ),
        (
            Measure::ImageSimilarity,
            ("image similarity", 0, 100.0, " %"),
        ),
    ];
    lines
        .map(|(measure, style)| {
            let figure = published.and_then(|published| published.figure(measure));
            shown(comparison, measure, figure, style)
        })
        .join("; ")
}

/// For example `correlation 0.97 (shuffled 0.01, repeat 0.98, the paper's 0.79)`.
fn shown(
    comparison: &Comparison,
    measure: Measure,
    published: Option<f64>,
    (title, digits, scale, unit): (&str, usize, f64, &str),
) -> String {
    let number = |value: f64| {
        let rounded = format!("{:.digits$}", value * scale);
        // Otherwise a shuffled mean of -0.001 would read "-0.00".
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
