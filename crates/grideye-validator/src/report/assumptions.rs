//! Assumptions and definitions behind the scores, in sentences.

use crate::compare::Comparison;
use crate::frames::RoomSource;
use crate::report::paper;
use crate::report::text::{Context, list};
use grideye_draw::text::fixed;

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
        "C ignores a common offset; RMSE, bias and IS do not. RMSE also counts the simulation's noise, which a blank frame lacks."
            .to_owned(),
        "Entropies use 256 gray levels over each frame's own range: the paper names no binning, this fits its figures.".to_owned(),
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
    list(sentences.into_iter())
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
