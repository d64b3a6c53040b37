//! From the evidence to the verdict, its headline and its reasons.

use crate::align::Orientation;
use crate::frames::fitted::FittedShare;
use crate::thresholds::{Thresholds, too_few};
use crate::verdict::scene_criteria::{drift, level, scene};
use crate::verdict::types::{Criterion, Evidence, Judgment, Question, State, Verdict, WHOLE};
use grideye_draw::text::{frames, lower, upper};

pub(crate) fn judge(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Judgment {
    let open = insufficiency(evidence, thresholds);
    let criteria = criteria(evidence, thresholds, open);
    let has_state = |state: State| criteria.iter().any(|one| one.state == state);
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
    let is_said = |one: &&Criterion| {
        // The contrast says more.
        let is_twice = criteria
            .iter()
            .any(|other| other.name == "contrast" && other.state == State::Failed);
        !(remedy.is_some() && one.name == "right" && is_twice)
    };
    let decisive = criteria.iter().filter(|one| decides(verdict, one));
    let decisive = decisive.filter(is_said);
    let decisive = decisive.map(|one| match (remedy, one.name) {
        // What a change mends is no second cause.
        (Some(_), "right" | "contrast") => {
            let found = format!("Without that change, {}", lower(&one.sentence));
            (found, "")
        }
        _ => (one.sentence.clone(), one.next_step.as_str()),
    });
    let remedy = remedy.map(|(found, step)| (found.to_owned(), step));
    let reasons: Vec<(String, &str)> = remedy.into_iter().chain(decisive).collect();
    let first = reasons.first();
    let (found, next_step) = first.map_or(("", ""), |(found, step)| (found.as_str(), *step));
    // The same step is said once.
    let in_words = |(index, (found, step)): (usize, &(String, &str))| {
        let is_new = reasons[..index].iter().all(|before| before.1 != *step);
        let step = if is_new { step } else { "" };
        format!("{found} {step}").trim_end().to_owned()
    };
    Judgment {
        verdict,
        headline: headline(verdict, found, evidence),
        next_step: next_step.to_owned(),
        reasons: reasons.iter().enumerate().map(in_words).collect(),
        criteria,
    }
}

fn headline(verdict: Verdict, found: &str, evidence: &Evidence<'_>) -> String {
    let title = upper(&verdict.to_string());
    let found = lower(found) + " ";
    let found = found.trim_start();
    let decision = evidence.prior.decision.as_ref();
    let compared = decision.map_or(evidence.real_frames, |decision| decision.frames);
    let apart = evidence.prior.fitted.filter(|share| share.is_apart());
    let all = match apart {
        None => frames(evidence.prior.recorded_frames.max(compared)),
        Some(share) => format!("{} that the scene was not fitted to", frames(share.rest())),
    };
    let left_out = evidence.prior.left_out.iter();
    let why = left_out.max_by_key(|one| one.rows);
    let why = why.filter(|one| 10 * one.rows >= evidence.prior.recorded_frames);
    let why = why.map(|one| format!(" {} were left out ({}).", one.rows, one.reason));
    let why = why.filter(|_| apart.is_none()).unwrap_or_default();
    let turned = match evidence.prior.turned {
        Orientation::Upright => String::new(),
        turned => format!(" The image, which is {turned}, was turned back, as requested."),
    };
    format!("{title}: {found}Based on {compared} of {all}.{why}{turned}")
}

/// What a scene that agrees has shown. That a sensor is sound is no reason to believe a scene.
const SHOWN: [&str; 4] = ["right", "contrast", "told_apart", "level"];

fn decides(verdict: Verdict, criterion: &Criterion) -> bool {
    match verdict {
        Verdict::CannotTell => criterion.state == State::Open,
        Verdict::Agrees => SHOWN.contains(&criterion.name),
        Verdict::Disagrees => criterion.state == State::Failed,
    }
}

fn criteria(
    evidence: &Evidence<'_>,
    thresholds: &Thresholds,
    open: Option<Insufficiency>,
) -> Vec<Criterion> {
    let is_enough = open.is_none();
    let mut all = vec![sufficiency(open)];
    all.extend(evidence.prior.fitted.map(judged_apart));
    if let (true, Some(decision)) = (is_enough, &evidence.prior.decision) {
        all.extend(scene(decision, evidence, thresholds));
    }
    all.push(level(evidence, thresholds));
    all.push(drift(evidence));
    all.extend_from_slice(&evidence.prior.sensor);
    all
}

fn judged_apart(share: FittedShare) -> Criterion {
    let asked = Question(
        "judged_apart",
        "Judged by other frames than it was fitted to",
        &[],
    );
    let FittedShare { fitted, of } = share;
    if fitted == 0 {
        let found = "The scene was calibrated on another recording.";
        return asked.answered(State::Met, found);
    }
    let all = frames(of);
    if share.is_apart() {
        let rest = share.rest();
        let found =
            format!("The scene was fitted to {fitted} of {all} and judged by the other {rest}.");
        return asked.answered(State::Met, found);
    }
    let found =
        format!("The scene was fitted to {fitted} of these {all}, so they cannot confirm it.");
    asked.with_next(
        State::Open,
        found,
        "Compare with another recording of the scene, or fit to one half of this one (`grideye calibrate --half first`) and compare again: the other half is then judged.",
    )
}

const LONGER: &str = "Record the same scene for longer.";
const WARMER: &str = "Record again with a person or another warm object of the scene in view. If it stands out little, measure the empty room with `grideye characterize` and compare with `--profile`.";
/// Why the recording cannot tell, and what to do.
type Insufficiency = (String, &'static str);

fn sufficiency(open: Option<Insufficiency>) -> Criterion {
    let asked = Question(
        "enough_to_tell",
        "The recording shows enough to tell",
        &["frames_min"],
    );
    let found = "The recording shows more than noise.";
    match open {
        Some((reason, remedy)) => asked.with_next(State::Open, reason, remedy),
        None => asked.answered(State::Met, found),
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
    let reason = "The recording shows only the room and noise, which fits an empty room as well as the scene.";
    is_empty.then(|| (reason.to_owned(), WARMER))
}
