//! Assumptions and definitions behind the scores, in sentences.

use crate::compare::Comparison;
use crate::frames::Protocol;
use crate::metrics::foreground::RoomSource;
use crate::metrics::score::Measure;
use crate::report::paper;
use crate::report::text::{Context, list};
use grideye_draw::text::{fixed, signed};

pub(crate) fn section(comparison: &Comparison, context: &Context) -> String {
    let settings = &comparison.settings;
    let own = [
        background(comparison),
        units(comparison),
        format!(
            "A pixel is warm if it is more than {} °C above the background ({} σ of the sensor's noise, at least two steps).",
            fixed(comparison.warm_above_c, 2),
            fixed(settings.thresholds.warm_sigma, 0)
        ),
        union_sentence(comparison),
        "C ignores a common offset; RMSE, MAE, bias and IS do not. RMSE and MAE also count the simulation's noise, which a \
         blank frame lacks."
            .to_owned(),
        format!(
            "Entropies use 256 gray levels over each frame's own range (the paper names no binning; this fits its figures) \
             and {} (the chosen bins). Corrected values subtract the first-order bias (Miller and Madow).",
            settings.binning.in_words()
        ),
        information(comparison),
        noise_fit(comparison),
        format!(
            "Shuffled scores use {} random pixel orders, seed {}.",
            settings.shuffles, settings.seed
        ),
    ];
    let papers_room = context.experiment.and_then(paper::experiment).map(|experiment| {
        format!(
            "The paper's figures are from its own experiment {}. Values that the scene file marks as assumed are ours: the \
             copies available to us lack the room, the sensor's position and the sizes of the furniture.",
            experiment.number
        )
    });
    let sentences: Vec<&String> = context
        .assumptions
        .iter()
        .chain(&papers_room)
        .chain(&comparison.notes)
        .chain(&own)
        .collect();
    format!(
        "<h2>Assumptions</h2>\n<details><summary>{} assumptions and definitions</summary>\n{}</details>\n",
        sentences.len(),
        list(sentences.into_iter())
    )
}

fn units(comparison: &Comparison) -> String {
    let pattern = fixed(comparison.pattern_c, 2);
    let known = match comparison.pattern_from {
        RoomSource::Profile => "what the profile leaves unknown",
        RoomSource::Recording => "what the empty stretches of the recording leave unknown",
        RoomSource::Scene => "as measured in other rooms",
    };
    format!(
        "Recordings that could be have the recording's noise, and of unit and room a fixed pattern of σ {pattern} °C ({known})."
    )
}

fn background(comparison: &Comparison) -> String {
    let ambient = fixed(comparison.settings.ambient_c, 2);
    let known = match comparison.pattern_from {
        RoomSource::Profile => {
            "the profile's pattern, and its background if it has one, were added to the scene"
        }
        RoomSource::Recording => {
            "the empty room from the recording was added to the scene where nothing warm is"
        }
        RoomSource::Scene => "no map of the empty room was used",
    };
    format!(
        "The blank frame has the scene's ambient temperature of {ambient} °C everywhere; {known}."
    )
}

fn information(comparison: &Comparison) -> String {
    let p = |measure| {
        let shuffled = comparison.score(measure).shuffled;
        let p = shuffled.and_then(|shuffled| shuffled.p);
        p.map_or_else(|| "undefined".to_owned(), |p| fixed(p, 3))
    };
    format!(
        "MI has a permutation p-value of {} in 256 levels and {} in the chosen bins: the share of pixel orders, the true one \
         included, that score at least as well.",
        p(Measure::MutualInformationGrey),
        p(Measure::MutualInformationBinned)
    )
}

fn noise_fit(comparison: &Comparison) -> String {
    let fit = &comparison.noise_fit;
    let p = fit
        .p_value()
        .map_or_else(|| "undefined".to_owned(), |p| fixed(p, 3));
    let drift = comparison
        .drift_c_per_min
        .map_or_else(String::new, |slope| {
            format!(
                " The common offset drifts by {} °C per minute.",
                signed(slope, 2)
            )
        });
    format!(
        "Recording minus noise-free scene has χ² = {} at {} degrees of freedom (p = {p}). The sensor's fixed pattern is in it, so \
         even a right scene can exceed 1 per degree.{drift}",
        fixed(fit.value, 0),
        fit.degrees_of_freedom
    )
}

fn union_sentence(comparison: &Comparison) -> String {
    let frame = match comparison.settings.protocol {
        Protocol::Static => "the mean of the real frames",
        Protocol::Dynamic => "the real frame",
    };
    let overlap = comparison.warm.overlap.map_or_else(String::new, |share| {
        format!(
            " {} % of these pixels are warm on both sides.",
            fixed(100.0 * share, 0)
        )
    });
    format!(
        "The gain over the blank frame is 1 minus the simulation's RMSE divided by the blank frame's, over the pixels that are more \
         than {} °C above ambient in {frame} or more than {} °C in the noise-free simulated one, with each pair's common offset \
         removed.{overlap}",
        fixed(comparison.union_above_c, 2),
        fixed(comparison.union_above_c / 2.0, 2)
    )
}
