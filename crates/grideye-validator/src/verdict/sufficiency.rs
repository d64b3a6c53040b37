//! Whether a recording holds enough to tell anything from.

use crate::metrics::score::Measure;
use crate::thresholds::{Thresholds, too_few};
use crate::verdict::criterion::{Criterion, State};
use crate::verdict::types::Evidence;
use crate::verdict::weighed::Weighed;
use grideye_draw::text::{fixed, frames};

/// Why the recording cannot tell.
pub(crate) struct Insufficiency {
    reason: String,
    remedy: &'static str,
}

pub(crate) fn sufficiency(evidence: &Evidence<'_>, open: Option<&Insufficiency>) -> Weighed {
    let (state, sentence) = open.map_or_else(
        || {
            let text = format!(
                "{} and {} warm pixels in each are enough to tell.",
                frames(evidence.real_frames),
                fixed(evidence.warm.real, 1)
            );
            (State::Met, text)
        },
        |open| (State::Open, open.reason.clone()),
    );
    Weighed {
        criterion: Criterion {
            name: "enough_to_tell",
            title: "The recording holds enough to tell",
            state,
            sentence,
            keys: &[
                "frames_min",
                "warm_pixels_min",
                "warm_sigma",
                "headroom_min",
            ],
            asked: None,
        },
        margin: None,
        turn: open.map_or_else(String::new, |open| open.remedy.to_owned()),
    }
}

pub(crate) fn insufficiency(
    evidence: &Evidence<'_>,
    thresholds: &Thresholds,
) -> Option<Insufficiency> {
    if too_few(evidence.real_frames, thresholds) {
        return Some(Insufficiency {
            reason: format!(
                "The recording holds {} to compare; at least {} are needed to know what the sensor's noise is worth.",
                frames(evidence.real_frames),
                thresholds.frames_min
            ),
            remedy: "a longer recording of the same scene",
        });
    }
    if evidence.warm.real < thresholds.warm_pixels_min {
        return Some(Insufficiency {
            reason: nothing_warm(evidence),
            remedy: "a recording with a person, or another warm thing of the scene, in view",
        });
    }
    [Measure::Correlation, Measure::Gain]
        .into_iter()
        .find_map(|measure| no_headroom(evidence, measure, thresholds.headroom_min))
}

fn nothing_warm(evidence: &Evidence<'_>) -> String {
    let claim = if evidence.warm.claimed > 0.0 {
        format!(
            "the scene claims {:.1} such pixels a frame, which an empty recording neither proves nor refutes",
            evidence.warm.claimed
        )
    } else {
        "the scene claims none either, and any two empty rooms look alike".to_owned()
    };
    format!(
        "The recording shows nothing warm: {:.2} pixels a frame lie more than {:.2} °C above the background; {claim}.",
        evidence.warm.real, evidence.warm_above_c
    )
}

fn no_headroom(evidence: &Evidence<'_>, measure: Measure, least: f64) -> Option<Insufficiency> {
    let score = evidence.scores.get(measure);
    let remedy =
        "a recording of at least a second at 10 Hz without gaps, with more contrast or less noise";
    let Some(ceiling) = score.ceiling else {
        let reason = format!(
            "The recording has no frame {} after another to measure its own repeat with, so {measure} has no ceiling.",
            frames(evidence.lag_frames)
        );
        return Some(Insufficiency { reason, remedy });
    };
    let chance = score.chance()?;
    // Written so that a value that is not a number falls on the side of "cannot tell".
    let rises = ceiling - chance >= least;
    (!rises).then(|| Insufficiency {
        reason: format!(
            "The recording does not even resemble itself {} later: {measure} reaches {} where chance reaches {}.",
            frames(evidence.lag_frames), fixed(ceiling, 2), fixed(chance, 2)
        ),
        remedy,
    })
}
