//! From the numbers to the verdict, if a recording holds enough to tell anything from.

use crate::metrics::score::Measure;
use crate::thresholds::{Thresholds, too_few};
use crate::verdict::image_criteria::{level, orientation, unclaimed};
use crate::verdict::score_criteria::scores;
use crate::verdict::types::{Evidence, Judgment, Question, State, Verdict, Weighed};
use grideye_draw::text::{fixed, frames};

pub(crate) fn judge(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Judgment {
    let open = insufficiency(evidence, thresholds);
    let weighed = weighed(evidence, thresholds, open.as_ref());
    let has_state = |state: State| {
        weighed
            .iter()
            .any(|weighed| weighed.criterion.state == state)
    };
    let verdict = if has_state(State::Failed) && !too_few(evidence.real_frames, thresholds) {
        Verdict::Disagrees
    } else if has_state(State::Open) {
        Verdict::CannotTell
    } else {
        Verdict::Agrees
    };
    Judgment {
        verdict,
        headline: headline(verdict).to_owned(),
        reasons: reasons(verdict, &weighed),
        would_change: would_change(verdict, &weighed),
        criteria: weighed
            .into_iter()
            .map(|weighed| weighed.criterion)
            .collect(),
    }
}

const fn headline(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Agrees => "The simulated scene agrees with the recording.",
        Verdict::Disagrees => "The simulated scene disagrees with the recording.",
        Verdict::CannotTell => "This recording cannot tell whether the simulated scene is right.",
    }
}

/// What failed comes first: it is what the reader has to act on. A verdict that cannot be given has what is missing.
fn reasons(verdict: Verdict, weighed: &[Weighed]) -> Vec<String> {
    let of = |state: State| {
        weighed
            .iter()
            .filter(move |weighed| weighed.criterion.state == state)
    };
    let sentence = |weighed: &Weighed| weighed.criterion.sentence.clone();
    // That a sensor has no fault is no reason to believe in a scene.
    let is_reason = |weighed: &&Weighed| !weighed.turn.is_empty();
    match verdict {
        Verdict::CannotTell => of(State::Open).map(sentence).collect(),
        Verdict::Agrees | Verdict::Disagrees => of(State::Failed)
            .chain(of(State::Open))
            .chain(of(State::Met).filter(is_reason))
            .map(sentence)
            .collect(),
    }
}

fn would_change(verdict: Verdict, weighed: &[Weighed]) -> String {
    let turns = |sought: State| {
        let mut turns: Vec<&str> = Vec::new();
        for weighed in weighed
            .iter()
            .filter(|weighed| weighed.criterion.state == sought)
        {
            if !weighed.turn.is_empty() && !turns.contains(&weighed.turn.as_str()) {
                turns.push(&weighed.turn);
            }
        }
        turns
    };
    match verdict {
        Verdict::Agrees => format!(
            "Any of: {}.{}",
            joined(&turns(State::Met), "or"),
            nearest(weighed)
        ),
        Verdict::Disagrees => format!(
            "To agree, it takes {}.",
            joined(&turns(State::Failed), "and")
        ),
        Verdict::CannotTell => format!("To tell, it takes {}.", joined(&turns(State::Open), "and")),
    }
}

fn nearest(weighed: &[Weighed]) -> String {
    weighed
        .iter()
        .filter_map(|weighed| Some((weighed.margin?, weighed.criterion.title)))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or_else(String::new, |(margin, title)| {
            format!(
                " Nearest to its threshold is “{title}”, by {} of skill.",
                fixed(margin, 2)
            )
        })
}

fn joined(pieces: &[&str], word: &str) -> String {
    match pieces {
        [] => "nothing that was asked".to_owned(),
        [one] => (*one).to_owned(),
        [others @ .., last] => format!("{}, {word} {last}", others.join(", ")),
    }
}

fn weighed(
    evidence: &Evidence<'_>,
    thresholds: &Thresholds,
    open: Option<&Insufficiency>,
) -> Vec<Weighed> {
    let mut all = vec![sufficiency(evidence, open)];
    if open.is_none() {
        all.extend(scores(evidence, thresholds));
    }
    all.push(unclaimed(evidence, thresholds));
    all.push(level(evidence, thresholds));
    if open.is_none() {
        all.push(orientation(evidence, thresholds));
    }
    all.extend(evidence.prior.sensor.iter().map(|criterion| Weighed {
        turn: match criterion.state {
            State::Failed => format!("“{}” to hold", criterion.title),
            _ => String::new(),
        },
        criterion: criterion.clone(),
        margin: None,
    }));
    all
}

struct Insufficiency {
    reason: String,
    remedy: &'static str,
}

fn sufficiency(evidence: &Evidence<'_>, open: Option<&Insufficiency>) -> Weighed {
    let asked = Question {
        name: "enough_to_tell",
        title: "The recording holds enough to tell",
        keys: &[
            "frames_min",
            "warm_pixels_min",
            "warm_sigma",
            "headroom_min",
        ],
    };
    if let Some(Insufficiency { reason, remedy }) = open {
        return asked.weighed(State::Open, reason, *remedy);
    }
    let (frames, warm) = (frames(evidence.real_frames), fixed(evidence.warm.real, 1));
    let enough = format!("{frames} and {warm} warm pixels in each are enough to tell.");
    asked.weighed(State::Met, enough, "")
}

fn insufficiency(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Option<Insufficiency> {
    if too_few(evidence.real_frames, thresholds) {
        let (found, least) = (frames(evidence.real_frames), thresholds.frames_min);
        return Some(Insufficiency {
            reason: format!(
                "The recording holds {found} to compare; at least {least} are needed to know what the sensor's noise is worth."
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
