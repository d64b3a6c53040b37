//! Every score with its floors and ceiling, as a table for the page and the terminal; and the paper's three in one line.

use crate::compare::Comparison;
use crate::metrics::score::{Better, Measure, Score};
use crate::report::paper;
use crate::report::text::{Context, UNDEFINED, value};
use grideye_draw::text::{fixed, frames as frames_in_words};

pub(crate) fn section(comparison: &Comparison, context: &Context) -> String {
    let experiment = context.experiment.and_then(paper::experiment);
    let papers = experiment.map_or_else(String::new, |experiment| {
        let number = experiment.number;
        format!("<th scope=\"col\">The paper's,<br>exp. {number}</th>")
    });
    let row = |score: &Score| {
        let figure = experiment.map(|one| one.figure(score.measure));
        row(score, figure)
    };
    let rows: String = comparison.scores.iter().map(row).collect();
    format!(
        "<h2>Scores</h2>\n\
         <p>Read a score between its floors (a blank frame at {} °C, the simulation's pixels shuffled) and \
         its ceiling (the recording against itself {} later). Skill is the position between them, 0 to 1.</p>\n\
         <div class=\"wide\"><table>\n<thead><tr><th scope=\"col\">Measure</th><th scope=\"col\">Value</th>\
         <th scope=\"col\">Skill</th><th scope=\"col\">Floor:<br>blank frame</th>\
         <th scope=\"col\">Floor: shuffled,<br>mean (best 5 %)</th>\
         <th scope=\"col\">Ceiling:<br>own repeat</th>\
         {papers}</tr></thead>\n<tbody>\n{rows}</tbody></table></div>\n\
         <details><summary>How to read the table</summary><p>H of the simulation is higher, as its values have no steps. The ceiling counts the sensor's noise once in C, RMSE and \
         centroid, twice elsewhere. A value can exceed it, for example if something moved before the repeat; its \
         skill is then 1. A skill of “{UNDEFINED}” means that the ceiling is no better than chance: here this measure tells \
         nothing.</p></details>\n",
        fixed(comparison.settings.ambient_c, 2),
        frames_in_words(comparison.settings.lag_frames),
    )
}

/// `papers`: the paper's figure, if there is a column of them.
fn row(score: &Score, papers: Option<Option<f64>>) -> String {
    let measure = score.measure;
    let unit = match measure.unit() {
        "" | "%" => String::new(),
        unit => format!(" <span class=\"unit\">{unit}</span>"),
    };
    let [_, value, _, blank, mean, best, ceiling, _] = cells(score, None);
    let shuffled = match best.as_str() {
        // Without a better direction, no pixel order is the best.
        UNDEFINED => mean,
        best => format!("{mean} ({best})"),
    };
    let papers = papers.map_or_else(String::new, |figure| {
        let figure = figure.map(|figure| rounded(measure, figure));
        format!("<td class=\"paper\">{}</td>", figure.unwrap_or_default())
    });
    format!(
        "<tr><th scope=\"row\">{measure}{unit}</th><td class=\"value\">{value}</td><td>{}</td><td>{blank}</td><td>{shuffled}</td><td>{ceiling}</td>{papers}</tr>\n",
        skill(score),
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

/// As many digits as the paper prints.
fn rounded(measure: Measure, figure: f64) -> String {
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
    let title = experiment.map_or_else(String::new, |experiment| {
        format!("the paper's, table {}", experiment.number)
    });
    let names = [
        "score", "value", "skill", "blank", "shuffled", "best 5 %", "repeat", &title,
    ];
    let mut lines = vec![names.map(str::to_owned)];
    lines.extend(
        comparison
            .scores
            .iter()
            .map(|score| cells(score, experiment.and_then(|one| one.figure(score.measure)))),
    );
    let widths: Vec<usize> = (0..names.len())
        .map(|column| lines.iter().map(|line| line[column].chars().count()).max())
        .map(Option::unwrap_or_default)
        .collect();
    let mut text: String = lines.iter().map(|line| joined(line, &widths)).collect();
    text.push_str(&format!(
        "entropies in 256 gray levels; {} shuffled orders; offset {} °C\n",
        comparison.settings.shuffles,
        fixed(comparison.offset_c, 2),
    ));
    text
}

const COLUMNS: usize = 8;

fn cells(score: &Score, figure: Option<f64>) -> [String; COLUMNS] {
    let (measure, shuffled) = (score.measure, score.shuffled);
    let best = shuffled.filter(|_| measure.better() != Better::Neither);
    let skill = score.skill().map(|skill| fixed(skill, 2));
    [
        match measure.unit() {
            "" | "%" => measure.to_string(),
            unit => format!("{measure} [{unit}]"),
        },
        value(measure, score.value),
        skill.unwrap_or_else(|| UNDEFINED.to_owned()),
        value(measure, score.blank),
        value(measure, shuffled.map(|shuffled| shuffled.mean)),
        value(measure, best.map(|shuffled| shuffled.p95)),
        value(measure, score.ceiling),
        figure.map_or_else(String::new, |figure| value(measure, Some(figure))),
    ]
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

/// The paper's three scores in one line, each with its floors, its ceiling and the paper's figure.
#[must_use]
pub fn scores_line(comparison: &Comparison, experiment: Option<u8>) -> String {
    let published = experiment.and_then(paper::experiment);
    [
        (Measure::Correlation, "correlation", ""),
        (Measure::MutualInformation, "mutual information", " bit"),
        (Measure::ImageSimilarity, "image similarity", ""),
    ]
    .map(|(measure, title, unit)| {
        let number = |value: f64| rounded(measure, value) + unit;
        let score = comparison.score(measure);
        let beside = [
            ("blank frame", score.blank),
            ("shuffled", score.shuffled.map(|shuffled| shuffled.mean)),
            ("repeat", score.ceiling),
            ("the paper's", published.and_then(|one| one.figure(measure))),
        ];
        let beside = beside.into_iter();
        let beside = beside.filter_map(|(name, value)| Some(format!("{name} {}", number(value?))));
        let value = score.value.map_or_else(|| "none".to_owned(), number);
        format!(
            "{title} {value} ({})",
            beside.collect::<Vec<_>>().join(", ")
        )
    })
    .join("; ")
}
