//! Whether the recording is the scene's, by the decision; and whether its level is.

use crate::decision::{Alternative, Alternatively, Contrast, Decision, Finding, Statistic};
use crate::frames::RoomSource;
use crate::thresholds::Thresholds;
use crate::verdict::types::{
    Evidence, Next, PROFILE, Question, State, WHOLE, Weighed, joined, upper,
};
use grideye_draw::text::fixed;

/// Alternatives named in one sentence.
const NAMED_MOST: usize = 3;

pub(crate) fn scene(
    decision: &Decision,
    evidence: &Evidence<'_>,
    thresholds: &Thresholds,
) -> [Weighed; 3] {
    [
        right(decision, thresholds),
        contrast(decision),
        told_apart(decision, evidence),
    ]
}

fn right(decision: &Decision, thresholds: &Thresholds) -> Weighed {
    let asked = Question {
        name: "right",
        title: "A right recording may look like this",
        keys: &["right_min", "background_spread_c"],
    };
    if decision.right > thresholds.right_min {
        let aside = decision
            .refused_aside_m
            .map(|aside_m| format!("a person {} m aside", fixed(aside_m, 2)));
        let [earlier, later] = decision.delay_range_s.map(|by_s| fixed(by_s.abs(), 2));
        // A scene in which nothing moves is the same at any time.
        let delay = (later != "0.00")
            .then(|| format!("a recording more than {earlier} s earlier or {later} s later"));
        let turns: Vec<String> = aside.into_iter().chain(delay).collect();
        return asked.weighed(State::Met, as_claimed(decision), ("", turns.join(", ")));
    }
    let step = match decision.cause {
        _ if decision.is_empty => NOBODY,
        _ if decision.contrasts.iter().any(Contrast::is_absent) => ELSEWHERE,
        Statistic::Contrast(_) => WARMTH,
        Statistic::Lag => {
            "Check in which second of the scene the recording starts (`--start`), and the clocks."
        }
        Statistic::Somewhere
        | Statistic::Block {
            is_warmer: true, ..
        } => {
            "Check what is warm there: a person or an object that the scene lacks, or that is elsewhere."
        }
        Statistic::Block { .. } => {
            "Check whether what the scene has there was there, and its place and temperature."
        }
        Statistic::Misfit | Statistic::Likeness(_) => {
            "Check that people, objects and sensor are where the scene has them; mark uncertain values with [[uncertain]] and run `grideye calibrate`."
        }
    };
    asked.weighed(
        State::Failed,
        upper(&decision.worst) + ".",
        (step, "a recording nearer to the scene"),
    )
}

/// What was found, and what of another kind would have been noticed.
fn as_claimed(decision: &Decision) -> String {
    let later = fixed(decision.delay_range_s[1], 2);
    let moves = later != "0.00";
    let people = decision.contrasts.iter();
    let people: Vec<&String> = people.filter_map(|one| one.of.as_ref()).collect();
    let (who, them) = match people.as_slice() {
        [] => ("What is warm is".to_owned(), "it"),
        [one] => (format!("`{one}` is"), "them"),
        [_, _] => ("Both people are".to_owned(), "them"),
        more => (format!("All {} people are", more.len()), "them"),
    };
    let place = if moves { "where and when" } else { "where" };
    let excludes = |sought: fn(&Alternative) -> bool| {
        let mut all = decision
            .alternatives
            .iter()
            .filter(|one| sought(&one.of))
            .peekable();
        all.peek().is_some() && all.all(|one| one.finding() == Finding::Excluded)
    };
    let more = |one: &Alternative| matches!(one, Alternative::More(_) | Alternative::Follower(_));
    let nobody = |one: &Alternative| *one == Alternative::Nobody;
    let noticed = [
        decision
            .refused_aside_m
            .map(|aside_m| format!("{} m aside", fixed(aside_m, 2))),
        moves.then(|| format!("{later} s later")),
        excludes(more).then(|| "one more person".to_owned()),
        (people.is_empty() && excludes(nobody)).then(|| "a room with nothing warm".to_owned()),
    ];
    let noticed: Vec<String> = noticed.into_iter().flatten().collect();
    let noticed: Vec<&str> = noticed.iter().map(String::as_str).collect();
    let rest = match noticed.as_slice() {
        [] => String::new(),
        some => format!(": {} would have been noticed", joined(some, "or")),
    };
    format!("{who} {place} the scene has {them}{rest}.")
}

const WARMTH: &str =
    "Check the temperatures of people and objects, and what the people wear (person.clothing).";

const NOBODY: &str = "Check whether what the scene has was there when this was recorded, and the second of the scene at which the recording starts (`--start`).";

const ELSEWHERE: &str = "Check the second of the scene at which the recording starts (`--start`), the places of people and sensor, and how the image lies (`--align orientation`).";

fn contrast(decision: &Decision) -> Weighed {
    let asked = Question {
        name: "contrast",
        title: "As warm as in the scene",
        keys: &[],
    };
    let name = |one: &Contrast| match &one.of {
        Some(name) => format!("`{name}`"),
        None => "What is warm".to_owned(),
    };
    let range = |one: &Contrast| one.range.map(|end| fixed(end, 2));
    if let Some(off) = decision.off_contrast() {
        let [low, high] = range(off);
        let (name, found) = (name(off), fixed(off.found, 2));
        let (why, step) = match off.is_absent() {
            _ if decision.is_empty => (": the recording shows only the room", NOBODY),
            true => (": it is not where or when the scene has it", ELSEWHERE),
            false => ("", WARMTH),
        };
        let sentence = format!(
            "{name} has {found} times the scene's contrast{why}; {low} to {high} is what the scene leaves open."
        );
        let turn = format!("{low} to {high} times the scene's contrast");
        return asked.weighed(State::Failed, sentence, (step, turn));
    }
    let found = decision.contrasts.iter().map(|one| {
        let [low, high] = range(one);
        format!(
            "{} has {} times the scene's contrast ({low} to {high})",
            name(one),
            fixed(one.found, 2)
        )
    });
    let found: Vec<String> = found.collect();
    let first = decision.contrasts.first().map(range).unwrap_or_default();
    let turn = format!("a contrast below {} or above {}", first[0], first[1]);
    asked.weighed(State::Met, found.join("; ") + ".", ("", turn))
}

fn told_apart(decision: &Decision, evidence: &Evidence<'_>) -> Weighed {
    let asked = Question {
        name: "told_apart",
        title: "Nothing else explains it",
        keys: &["background_spread_c"],
    };
    let listed = |all: &[&Alternatively]| {
        let named: Vec<&str> = all
            .iter()
            .take(NAMED_MOST)
            .map(|one| one.what.as_str())
            .collect();
        let more = match all.len().saturating_sub(NAMED_MOST) {
            0 => String::new(),
            more => format!(", or {more} more"),
        };
        named.join(", or ") + &more
    };
    let alike: Vec<&Alternatively> = decision.found(Finding::Same).collect();
    let same = match alike.as_slice() {
        [] => String::new(),
        alike => format!(" This sensor cannot tell it from {}.", listed(alike)),
    };
    let is_unknown = evidence.prior.pattern.from == RoomSource::Scene;
    if is_unknown && !evidence.prior.has_people {
        let sentence = "The scene has no people, and an unknown unit and room may hide one who is little warmer.";
        return asked.weighed(State::Open, sentence, PROFILE);
    }
    let untold: Vec<&Alternatively> = decision.found(Finding::Open).collect();
    if untold.is_empty() {
        let number = decision.alternatives.len() - alike.len();
        let sentence = format!("No other explanation fits ({number} considered).{same}");
        return asked.weighed(State::Met, sentence, Next::default());
    }
    let sentence = format!("It could also be {}.{same}", listed(&untold));
    asked.weighed(State::Open, sentence, tells_apart(evidence))
}

/// What would tell.
fn tells_apart(evidence: &Evidence<'_>) -> Next {
    if evidence.prior.torn().is_some() {
        return WHOLE.into();
    }
    let (step, turns) = match evidence.prior.pattern.from {
        RoomSource::Scene => PROFILE,
        _ => (
            "Record for longer, with people who walk through the whole view.",
            "a longer recording, with people who walk through the whole view",
        ),
    };
    let known = "If you know more than the scene leaves open, give a smaller sd in [[uncertain]].";
    (format!("{step} {known}"), turns).into()
}

pub(crate) fn level(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Weighed {
    let offset_c = evidence.offset_c;
    let (most_c, limit, source, keys): (f64, String, &str, &[&str]) = match evidence.prior.level_c {
        Some(own_c) => {
            let source = "this sensor's profile";
            (own_c, fixed(own_c, 2), source, &["ambient_spread_c"])
        }
        None => {
            let most_c = thresholds.offset_max_c;
            (
                most_c,
                fixed(most_c, 1),
                "the sensor's accuracy",
                &["offset_max_c"],
            )
        }
    };
    let asked = Question {
        name: "level",
        title: "The level is the scene's",
        keys,
    };
    let (state, step, turn) = if offset_c.abs() <= most_c {
        (State::Met, "", "beyond")
    } else {
        let step = "Measure the air in the room and set ambient_c in the scene. If it is right already, measure the sensor's level with `grideye characterize`.";
        (State::Failed, step, "within")
    };
    let size = fixed(offset_c.abs(), 2);
    let direction = if offset_c < 0.0 { "colder" } else { "warmer" };
    let sentence = match size.as_str() {
        "0.00" => "The recording is as warm as the scene overall.".to_owned(),
        _ => format!(
            "The recording is {size} °C {direction} than the scene overall; {source} allows {limit} °C."
        ),
    };
    let turn = format!("a common offset {turn} {limit} °C");
    asked.weighed(state, sentence, (step, turn))
}

pub(crate) fn drift(evidence: &Evidence<'_>) -> Weighed {
    let asked = Question {
        name: "drift",
        title: "The level keeps to the scene's",
        keys: &["drift_max_c", "drift_max_c_per_min"],
    };
    let [found_c, most_c] = evidence.prior.drift_c;
    let (found, most) = (fixed(found_c, 2), fixed(most_c, 2));
    let sentence = format!(
        "The recording drifts by {found} °C against the scene, all pixels together; {most} °C is usual in this time."
    );
    if found_c <= most_c {
        return asked.weighed(State::Met, sentence, Next::default());
    }
    let step = "Let the sensor warm up before recording; or add to the scene what heats or cools the room.";
    asked.weighed(State::Failed, sentence, (step, "a steady level"))
}
