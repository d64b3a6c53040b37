//! Every score beside its floors and its ceiling, as a table of the page.

use crate::compare::Comparison;
use crate::metrics::score::{Better, Measure, Score};
use crate::report::context::Context;
use crate::report::paper;
use crate::report::paper::EXPERIMENTS;
use crate::report::text::{UNDEFINED, value};
use grideye_draw::text::{fixed, frames as frames_in_words};

/// What the verdict rests on, then the paper's own and plain distances, then what counts bins.
pub(crate) const GROUPS: [(&str, &str, &[Measure]); 4] = [
    (
        "The verdict rests on",
        "rests",
        &[Measure::Correlation, Measure::Gain],
    ),
    (
        "Distances, reported",
        "reported",
        &[
            Measure::ImageSimilarity,
            Measure::Rmse,
            Measure::Mae,
            Measure::Bias,
            Measure::GainWithOffset,
        ],
    ),
    (
        "Places, structure and the sensor's noise, reported",
        "reported",
        &[
            Measure::ForegroundRmse,
            Measure::ContrastSlope,
            Measure::CentroidErrorPixels,
            Measure::CentroidErrorDegrees,
            Measure::WarmOverlap,
            Measure::StructuralSimilarity,
            Measure::ChiSquaredPerDegree,
        ],
    ),
    (
        "Entropy and mutual information, reported, not believed",
        "reported",
        &[
            Measure::EntropyRealGrey,
            Measure::EntropySimulatedGrey,
            Measure::JointEntropyGrey,
            Measure::MutualInformationGrey,
            Measure::MutualInformationGreyCorrected,
            Measure::EntropyRealBinned,
            Measure::EntropySimulatedBinned,
            Measure::JointEntropyBinned,
            Measure::MutualInformationBinned,
            Measure::MutualInformationBinnedCorrected,
        ],
    ),
];

pub(crate) fn section(comparison: &Comparison, context: &Context) -> String {
    let papers = context
        .experiment
        .filter(|&number| paper::experiment(number).is_some());
    let papers = papers.map_or_else(|| "exp. 1–4".to_owned(), |number| format!("exp. {number}"));
    let rows: String = GROUPS
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
        "<h2>Scores, and what they are worth</h2>\n\
         <p>A score means something only between its floor (what a blank frame at {} °C, the simulation's own pixels in \
         random order, or an image of nothing but the sensor's noise would have scored) and its ceiling (the recording \
         against itself {} later; in C, gain, RMSE, MAE, contrast, centroid and χ² the sensor's noise counted once, \
         elsewhere as it comes). Skill is the place between the two, 0 to 1. A value \
         can pass its ceiling, for example where something has moved on before the repeat; its skill is 1 then.</p>\n\
         <div class=\"wide\"><table>\n<thead><tr><th scope=\"col\">Measure</th><th scope=\"col\">Value</th>\
         <th scope=\"col\">Skill</th><th scope=\"col\">Floor:<br>blank frame</th>\
         <th scope=\"col\">Floor: shuffled,<br>mean (best 5 %)</th><th scope=\"col\">Floor:<br>noise only</th>\
         <th scope=\"col\">Ceiling:<br>own repeat</th>\
         <th scope=\"col\">The paper's,<br>{papers}</th></tr></thead>\n{rows}</table></div>\n\
         <p class=\"small soft\">The paper's figures come from its own room and recordings: they are there to compare the order \
         of magnitude, not to be reached. A skill of “{UNDEFINED}” says that the ceiling does not rise above chance: on this \
         recording that measure cannot tell a right scene from a wrong one.</p>\n",
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
    let shuffled = score.shuffled.map_or_else(
        || UNDEFINED.to_owned(),
        |shuffled| {
            let mean = value(measure, Some(shuffled.mean));
            match measure.better() {
                // Where neither more nor less is better, no order of the pixels is the best.
                Better::Neither => mean,
                _ => format!("{mean} ({})", value(measure, Some(shuffled.p95))),
            }
        },
    );
    format!(
        "<tr><th scope=\"row\">{measure}{unit}</th><td class=\"value\">{}</td><td>{}</td><td>{}</td><td>{shuffled}</td><td>{}</td><td>{}</td><td class=\"paper\">{}</td></tr>\n",
        value(measure, score.value),
        skill(score),
        value(measure, score.blank),
        value(measure, score.noise),
        value(measure, score.ceiling),
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

/// As many digits as the paper prints, no more.
fn papers_digits(measure: Measure, figure: f64) -> String {
    match measure {
        Measure::ImageSimilarity => format!("{} %", fixed(100.0 * figure, 0)),
        Measure::Correlation => fixed(figure, 2),
        _ => fixed(figure, 1),
    }
}
