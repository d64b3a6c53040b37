//! From the evidence to the verdict, its headline and its reasons.

use crate::align::Orientation;
use crate::frames::fitted::FittedShare;
use crate::thresholds::{Thresholds, too_few};
use crate::verdict::scene_criteria::{drift, level, scene};
use crate::verdict::types::{
    Criterion, Evidence, Judgment, Next, Question, State, Verdict, WHOLE, Weighed, joined, lower,
};
use grideye_draw::text::frames;

pub(crate) fn judge(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Judgment {
    let open = insufficiency(evidence, thresholds);
    let weighed = weighed(evidence, thresholds, open);
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
    // What is wrong most comes before what shows it.
    let remedy = evidence.prior.remedy.as_ref();
    let remedy = remedy.filter(|_| verdict == Verdict::Disagrees);
    let remedy = remedy.map(|remedy| (remedy.found.as_str(), remedy.step.as_str()));
    let decisive = reasons(verdict, &weighed).into_iter().map(|one| {
        let Criterion {
            sentence,
            next_step,
            ..
        } = &one.criterion;
        (sentence.as_str(), next_step.as_str())
    });
    let reasons: Vec<(&str, &str)> = remedy.into_iter().chain(decisive).collect();
    let (found, next_step) = reasons.first().copied().unwrap_or_default();
    let in_words = |(found, step): &(&str, &str)| format!("{found} {step}").trim_end().to_owned();
    Judgment {
        verdict,
        headline: headline(verdict, found, evidence),
        next_step: next_step.to_owned(),
        reasons: reasons.iter().map(in_words).collect(),
        would_change: would_change(verdict, &weighed),
        criteria: weighed
            .into_iter()
            .map(|weighed| weighed.criterion)
            .collect(),
    }
}

fn headline(verdict: Verdict, found: &str, evidence: &Evidence<'_>) -> String {
    let mut letters = verdict.to_string();
    letters[..1].make_ascii_uppercase();
    let found = lower(found) + " ";
    let found = found.trim_start();
    let decision = evidence.prior.decision.as_ref();
    let compared = decision.map_or(evidence.real_frames, |decision| decision.frames);
    let apart = evidence.prior.fitted.filter(|share| share.is_apart());
    let all = match apart {
        None => frames(evidence.prior.recorded_frames.max(compared)),
        Some(share) => format!("{} that the scene was not fitted to", frames(share.rest())),
    };
    let turned = match evidence.prior.turned {
        Orientation::Upright => String::new(),
        turned => format!(" The image, which is {turned}, was turned back, as requested."),
    };
    format!("{letters}: {found}Judged by {compared} of {all}.{turned}")
}

/// The criteria that decided the verdict. A sound sensor is no reason to believe a scene, so its checks are none.
fn reasons(verdict: Verdict, weighed: &[Weighed]) -> Vec<&Weighed> {
    let decides = |one: &&Weighed| !one.turn.is_empty() || one.criterion.name == "told_apart";
    let of = |state: State| {
        let all = weighed.iter().filter(decides);
        all.filter(move |weighed| weighed.criterion.state == state)
    };
    match verdict {
        Verdict::CannotTell => of(State::Open).collect(),
        Verdict::Agrees => of(State::Met).collect(),
        Verdict::Disagrees => of(State::Failed).collect(),
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
            "It would not agree with {}.",
            joined(&turns(State::Met), "or")
        ),
        Verdict::Disagrees => format!(
            "To agree, it takes {}.",
            joined(&turns(State::Failed), "and")
        ),
        Verdict::CannotTell => format!("To tell, it takes {}.", joined(&turns(State::Open), "and")),
    }
}

fn weighed(
    evidence: &Evidence<'_>,
    thresholds: &Thresholds,
    open: Option<Insufficiency>,
) -> Vec<Weighed> {
    let is_enough = open.is_none();
    let mut all = vec![sufficiency(open)];
    all.extend(evidence.prior.fitted.map(judged_apart));
    if let (true, Some(decision)) = (is_enough, &evidence.prior.decision) {
        all.extend(scene(decision, evidence, thresholds));
    }
    all.push(level(evidence, thresholds));
    all.push(drift(evidence));
    all.extend(evidence.prior.sensor.iter().map(|criterion| Weighed {
        turn: match criterion.state {
            State::Failed => format!("“{}” to be met", criterion.title),
            _ => String::new(),
        },
        criterion: criterion.clone(),
    }));
    all
}

fn judged_apart(share: FittedShare) -> Weighed {
    let asked = Question {
        name: "judged_apart",
        title: "Judged by other frames than it was fitted to",
        keys: &[],
    };
    let FittedShare { fitted, of } = share;
    if fitted == 0 {
        let found = "The scene was calibrated on another recording.";
        return asked.weighed(State::Met, found, Next::default());
    }
    let all = frames(of);
    if share.is_apart() {
        let rest = share.rest();
        let found =
            format!("The scene was fitted to {fitted} of {all} and judged by the other {rest}.");
        return asked.weighed(State::Met, found, Next::default());
    }
    let found =
        format!("The scene was fitted to {fitted} of these {all}, so they cannot confirm it.");
    let remedy = (
        "Compare with another recording of the scene, or fit to one half of this one (`grideye calibrate --half first`) and compare again: the other half is then judged.",
        "frames that the scene was not fitted to (another recording, or `grideye calibrate --half first`)",
    );
    asked.weighed(State::Open, found, remedy)
}

const LONGER: (&str, &str) = (
    "Record the same scene for longer.",
    "a longer recording of the same scene",
);
const WARMER: (&str, &str) = (
    "Record again with a person, or another warm object of the scene, in view. Where it shows little, measure the empty room (`grideye characterize`, then `--profile`).",
    "a recording with a person, or another warm object of the scene, in view",
);
/// Why the recording cannot tell, what to do, and what it takes.
type Insufficiency = (String, (&'static str, &'static str));

fn sufficiency(open: Option<Insufficiency>) -> Weighed {
    let asked = Question {
        name: "enough_to_tell",
        title: "The recording shows enough to tell",
        keys: &["frames_min"],
    };
    let found = "The recording shows more than noise.";
    match open {
        Some((reason, remedy)) => asked.weighed(State::Open, reason, remedy),
        None => asked.weighed(State::Met, found, Next::default()),
    }
}

fn insufficiency(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Option<Insufficiency> {
    let prior = &evidence.prior;
    let few = match too_few(evidence.real_frames, thresholds) {
        true => Some(format!(
            "The recording holds {} to compare; measuring the sensor's noise takes at least {}.",
            frames(evidence.real_frames),
            thresholds.frames_min
        )),
        false if !evidence.has_repeat => Some(
            "The recording has no two frames in a row, so the sensor's noise is unknown."
                .to_owned(),
        ),
        false if prior.decision.is_none() => {
            Some("Frames without a scene decide nothing.".to_owned())
        }
        false => None,
    };
    if let Some(reason) = few {
        let torn = prior.torn().map(|torn| (format!("{reason} {torn}"), WHOLE));
        return Some(torn.unwrap_or((reason, LONGER)));
    }
    // Where right recordings hardly ever look empty, nobody is there.
    let decision = prior.decision.as_ref()?;
    let is_empty = decision.is_empty && !decision.is_refused(thresholds.right_min);
    let reason = "The recording shows nothing but the room and noise, which neither confirms nor refutes a scene.";
    is_empty.then(|| (reason.to_owned(), WARMER))
}
