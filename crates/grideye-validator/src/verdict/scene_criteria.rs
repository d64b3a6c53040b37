//! Whether the recording is the scene's, by the decision; and whether its level is.

use crate::decision::{
    Alternative, Alternatively, Contrast, Decision, Finding, Statistic, contrast_in_words,
};
use crate::frames::RoomSource;
use crate::thresholds::Thresholds;
use crate::verdict::types::{Criterion, Evidence, PROFILE, Question, State, WHOLE, joined};
use grideye_draw::text::{fixed, upper};

/// Alternatives named in one sentence.
const NAMED_MOST: usize = 3;

pub(crate) fn scene(
    decision: &Decision,
    evidence: &Evidence<'_>,
    thresholds: &Thresholds,
) -> [Criterion; 3] {
    [
        right(decision, thresholds),
        contrast(decision),
        told_apart(decision, evidence),
    ]
}

fn right(decision: &Decision, thresholds: &Thresholds) -> Criterion {
    let asked = Question(
        "right",
        "A right recording may look like this",
        &["right_min", "background_spread_c"],
    );
    if decision.right > thresholds.right_min {
        return asked.answered(State::Met, as_claimed(decision));
    }
    let step = match decision.cause {
        _ if decision.is_empty => NOBODY,
        _ if decision.contrasts.iter().any(Contrast::is_absent) => ELSEWHERE,
        Statistic::Contrast(_) => WARMTH,
        Statistic::Lag => {
            "Check at which second of the scene the recording starts (`--start`), and the clocks."
        }
        Statistic::Somewhere
        | Statistic::Block {
            is_warmer: true, ..
        } => {
            "Check what is warm there: a person or an object that the scene lacks, or that is elsewhere."
        }
        Statistic::Block { .. } => {
            "Check that what the scene has there was there, and its place and temperature."
        }
        Statistic::Misfit | Statistic::Likeness(_) => {
            "Check that people, objects and sensor are where the scene has them; mark uncertain values with `[[uncertain]]` and run `grideye calibrate`."
        }
    };
    asked.failed(upper(&decision.worst) + ".", step)
}

/// What was found, and what of another kind would have been noticed.
fn as_claimed(decision: &Decision) -> String {
    let later = fixed(decision.delay_range_s[1], 2);
    // A scene in which nothing moves is the same at any time.
    let moves = later != "0.00";
    let people = decision.contrasts.iter();
    let people: Vec<&String> = people.filter_map(|one| one.of.as_ref()).collect();
    let who = match people.as_slice() {
        [] => "Everything warm is".to_owned(),
        [one] => format!("`{one}` is"),
        [_, _] => "Both people are".to_owned(),
        more => format!("All {} people are", more.len()),
    };
    let place = if moves { "where and when" } else { "where" };
    let excludes = |sought: fn(&Alternative) -> bool| {
        let alternatives = decision.alternatives.iter();
        let mut all = alternatives.filter(|one| sought(&one.of)).peekable();
        all.peek().is_some() && all.all(|one| one.finding() == Finding::Excluded)
    };
    let more = |one: &Alternative| matches!(one, Alternative::More(_) | Alternative::Follower(_));
    let nobody = |one: &Alternative| *one == Alternative::Nobody;
    let noticed = [
        decision
            .refused_aside_m
            .map(|aside_m| format!("a person {} m aside", fixed(aside_m, 2))),
        moves.then(|| format!("a start {later} s later")),
        excludes(more).then(|| "one more person".to_owned()),
        (people.is_empty() && excludes(nobody)).then(|| "a room with nothing warm".to_owned()),
    ];
    let noticed: Vec<String> = noticed.into_iter().flatten().collect();
    let noticed: Vec<&str> = noticed.iter().map(String::as_str).collect();
    let rest = match noticed.as_slice() {
        [] => String::new(),
        some => {
            let noticed = upper(&joined(some, "or"));
            format!(" {noticed} would have been noticed.")
        }
    };
    format!("{who} {place} the scene says.{rest}")
}

const WARMTH: &str =
    "Check the temperatures of people and objects, and what the people wear (`person.clothing`).";

const NOBODY: &str = "Check that the people and objects of the scene were there, and at which second of the scene the recording starts (`--start`).";

const ELSEWHERE: &str = "Check at which second of the scene the recording starts (`--start`), where people and sensor are, and how the image lies (`--align orientation`).";

fn contrast(decision: &Decision) -> Criterion {
    let asked = Question("contrast", "As warm as in the scene", &[]);
    let in_words = |one: &Contrast| {
        let [low, high] = one.range.map(|end| fixed(end, 2));
        let found = upper(&contrast_in_words(one.of.as_deref(), one.found));
        format!("{found}; {low} to {high} is allowed.")
    };
    if let Some(off) = decision.off_contrast() {
        let step = match off.is_absent() {
            _ if decision.is_empty => NOBODY,
            true => ELSEWHERE,
            false => WARMTH,
        };
        return asked.failed(in_words(off), step);
    }
    let found: Vec<String> = decision.contrasts.iter().map(in_words).collect();
    asked.answered(State::Met, found.join(" "))
}

fn told_apart(decision: &Decision, evidence: &Evidence<'_>) -> Criterion {
    let asked = Question(
        "told_apart",
        "Nothing else explains it",
        &["background_spread_c"],
    );
    let listed = |all: &[&Alternatively]| {
        let mut named: Vec<&str> = all.iter().map(|one| one.what.as_str()).collect();
        let more = format!("{} more", all.len().saturating_sub(NAMED_MOST));
        if all.len() > NAMED_MOST {
            named.truncate(NAMED_MOST);
            named.push(&more);
        }
        joined(&named, "or")
    };
    let alike: Vec<&Alternatively> = decision.found(Finding::Same).collect();
    let same = match alike.as_slice() {
        [] => String::new(),
        alike => format!(
            " To this sensor, the scene looks the same as {}.",
            listed(alike)
        ),
    };
    let is_unknown = evidence.prior.pattern.from == RoomSource::Scene;
    if is_unknown && !evidence.prior.has_people {
        let sentence = "The scene has no people, but without a profile of this sensor a person who is little warmer than the room would not be noticed.";
        return asked.with_next(State::Open, sentence, PROFILE);
    }
    let untold: Vec<&Alternatively> = decision.found(Finding::Open).collect();
    if untold.is_empty() {
        let excluded: Vec<&Alternatively> = decision.found(Finding::Excluded).collect();
        let none = match excluded.as_slice() {
            [] => "Nothing else was simulated.".to_owned(),
            others => format!("The recording would not fit {}.", listed(others)),
        };
        return asked.answered(State::Met, none + &same);
    }
    let sentence = format!(
        "The recording fits the scene, but it would also fit {}.{same}",
        listed(&untold)
    );
    asked.with_next(State::Open, sentence, tells_apart(evidence))
}

/// What would tell.
fn tells_apart(evidence: &Evidence<'_>) -> String {
    if evidence.prior.torn().is_some() {
        return WHOLE.to_owned();
    }
    let step = match evidence.prior.pattern.from {
        RoomSource::Scene => PROFILE,
        _ => "Record for longer, with people who walk through the whole view.",
    };
    format!("{step} If you know the scene more exactly, give a smaller `sd` in `[[uncertain]]`.")
}

pub(crate) fn level(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Criterion {
    let offset_c = evidence.offset_c;
    let (most_c, limit, source, keys): (f64, String, &str, &[&str]) = match evidence.prior.level_c {
        Some(own_c) => {
            let source = "this sensor's profile";
            (own_c, fixed(own_c, 2), source, &["ambient_spread_c"])
        }
        None => {
            let (most_c, source) = (thresholds.offset_max_c, "the sensor's accuracy");
            (most_c, fixed(most_c, 1), source, &["offset_max_c"])
        }
    };
    let asked = Question("level", "The level is the scene's", keys);
    let size = fixed(offset_c.abs(), 2);
    let direction = if offset_c < 0.0 { "colder" } else { "warmer" };
    let sentence = match size.as_str() {
        "0.00" => "The recording is as warm as the scene overall.".to_owned(),
        _ => format!(
            "The recording is {size} °C {direction} than the scene overall; {source} allows {limit} °C."
        ),
    };
    let step = "Measure the air in the room and set `ambient_c` in the scene. If it is right already, measure the sensor's level with `grideye characterize`.";
    asked.met_or(offset_c.abs() <= most_c, sentence, step)
}

pub(crate) fn drift(evidence: &Evidence<'_>) -> Criterion {
    let asked = Question(
        "drift",
        "The level keeps to the scene's",
        &["drift_max_c", "drift_max_c_per_min"],
    );
    let [found_c, most_c] = evidence.prior.drift_c;
    let (found, most) = (fixed(found_c, 2), fixed(most_c, 2));
    let sentence = format!(
        "All pixels together drift by {found} °C against the scene; {most} °C is usual in this time."
    );
    let step = "Let the sensor warm up before recording, or add to the scene what heats or cools the room.";
    asked.met_or(found_c <= most_c, sentence, step)
}
