//! What was assumed on the way to the scores, in sentences.

use crate::compare::Comparison;
use crate::expected::DRAWS;
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
            "A pixel of one frame is warm when it lies more than {} °C above the background ({} σ of the sensor's noise, at least two steps of the sensor).",
            fixed(comparison.warm_above_c, 2),
            fixed(settings.thresholds.warm_sigma, 0)
        ),
        union_sentence(comparison),
        "C does not see a common offset; RMSE, MAE, bias and IS do. RMSE and MAE also charge the simulation for noise of its \
         own, which a blank frame has not."
            .to_owned(),
        format!(
            "Entropies are counted in 256 grey levels over each frame's own range, as an 8-bit picture has them, and in {} (the chosen bins). \
             The paper does not name its binning; 256 levels fit its figures. Where the bias is taken out, it is that of the first order, after Miller and Madow.",
            settings.binning.in_words()
        ),
        information(comparison),
        noise_fit(comparison),
        format!("Shuffled scores are those of {} random orders of the pixels, seed {}.", settings.shuffles, settings.seed),
    ];
    let papers_room = context.experiment.and_then(paper::experiment).map(|experiment| {
        format!(
            "The paper's figures belong to its own experiment {}. What the scene file marks as assumed is not the paper's: room, \
             sensor position and furniture sizes are lost in the copies that were to hand.",
            experiment.number
        )
    });
    let sentences = context
        .assumptions
        .iter()
        .chain(&papers_room)
        .chain(&comparison.notes)
        .chain(&own);
    format!("<h2>What was assumed</h2>\n{}", list(sentences))
}

fn units(comparison: &Comparison) -> String {
    let pattern = comparison.pattern_c;
    let known = match comparison.pattern_from {
        RoomSource::Profile => "the unit's profile leaves unknown of its pattern",
        RoomSource::Recording => {
            "the empty stretches of the recording leave unknown of its pattern"
        }
        RoomSource::Scene => "units are known to differ by from pixel to pixel",
    };
    format!(
        "What a right scene scores, and a room without people or without anything, is what {DRAWS} units drawn with seed {} would have recorded of it: \
         with a pattern of σ {} °C, which is what {known}, and the recording's own noise. A score is asked to come the stated share of the way from its floor to what all but {} of right scenes reach.",
        comparison.settings.seed,
        fixed(pattern, 2),
        comparison.settings.thresholds.false_alarm_max
    )
}

fn background(comparison: &Comparison) -> String {
    let ambient = fixed(comparison.settings.ambient_c, 2);
    match comparison.pattern_from {
        RoomSource::Profile => format!(
            "The blank frame is uniform at the scene's ambient temperature of {ambient} °C; the pattern of the profile is added to the scene."
        ),
        RoomSource::Recording => format!(
            "The blank frame is uniform at the scene's ambient temperature of {ambient} °C; what the recording shows of the empty room, where the scene has nothing warm, was added to the scene."
        ),
        RoomSource::Scene => format!(
            "The background is uniform at the scene's ambient temperature of {ambient} °C; no background map of the empty room was used."
        ),
    }
}

fn information(comparison: &Comparison) -> String {
    let p = |measure| {
        let shuffled = comparison.score(measure).shuffled;
        let p = shuffled.and_then(|shuffled| shuffled.p);
        p.map_or_else(|| "not defined".to_owned(), |p| fixed(p, 3))
    };
    format!(
        "Of orders of the pixels as good as the true one or better, the true one counted among them, the share is {} for MI in 256 levels and {} in the chosen bins (permutation p-value).",
        p(Measure::MutualInformationGrey),
        p(Measure::MutualInformationBinned)
    )
}

fn noise_fit(comparison: &Comparison) -> String {
    let fit = &comparison.noise_fit;
    let p = fit
        .p_value()
        .map_or_else(|| "not defined".to_owned(), |p| fixed(p, 3));
    let drift = comparison
        .drift_c_per_min
        .map_or_else(String::new, |slope| {
            format!(
                " The common offset drifts by {} °C a minute.",
                signed(slope, 2)
            )
        });
    format!(
        "What is left between the recording and the noise-free claim is χ² = {} at {} degrees of freedom (p = {p}); the sensor's fixed pattern is in it, so that even a right scene need not reach 1 a degree.{drift}",
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
            " Of these pixels {} % are warm on both sides.",
            fixed(100.0 * share, 0)
        )
    });
    format!(
        "The gain over the blank frame is 1 less the ratio of the simulation's RMSE to the blank frame's, \
         taken over the pixels that lie more than {} °C above ambient in {frame} or more than {} °C in the \
         noise-free simulated one, after the common offset of each pair was taken out.{overlap}",
        fixed(comparison.union_above_c, 2),
        fixed(comparison.union_above_c / 2.0, 2)
    )
}
