//! From the numbers to the verdict.

use super::{Criterion, Evidence, Judgement, State, Thresholds, Verdict};
use crate::text::{fixed, frames};
use crate::thresholds::too_few;
use crate::{Measure, Score};

/// Weighs the evidence.
pub(crate) fn judge(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Judgement {
    let open = nothing_to_tell_from(evidence, thresholds);
    let weighed = weighed(evidence, thresholds, open.as_ref());
    let failed = weighed
        .iter()
        .any(|weighed| weighed.criterion.state == State::Failed);
    let has_frames = !too_few(evidence.real_frames, thresholds);
    let verdict = match (&open, failed && has_frames) {
        (_, true) => Verdict::Disagrees,
        (Some(_), false) => Verdict::CannotTell,
        (None, false) => Verdict::Agrees,
    };
    Judgement {
        verdict,
        headline: headline(verdict).to_owned(),
        reasons: reasons(verdict, &weighed),
        would_change: match (verdict, open) {
            (Verdict::CannotTell, Some(open)) => open.remedy.to_owned(),
            _ => would_change(verdict, &weighed),
        },
        criteria: weighed
            .into_iter()
            .map(|weighed| weighed.criterion)
            .collect(),
    }
}

/// A criterion, and what would turn it.
struct Weighed {
    criterion: Criterion,
    /// How far a skill is above its threshold.
    margin: Option<f64>,
    /// What would break it if it is met, and mend it if it failed.
    turn: String,
}

/// Why the recording cannot tell.
struct Open {
    reason: String,
    remedy: &'static str,
}

const fn headline(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Agrees => "The simulated scene agrees with the recording.",
        Verdict::Disagrees => "The simulated scene disagrees with the recording.",
        Verdict::CannotTell => "This recording cannot tell whether the simulated scene is right.",
    }
}

/// What failed comes first: it is what the reader has to act on. A verdict that cannot be given has its one reason.
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
    let sought = if verdict == Verdict::Agrees {
        State::Met
    } else {
        State::Failed
    };
    let turns: Vec<&str> = weighed
        .iter()
        .filter(|weighed| weighed.criterion.state == sought)
        .map(|weighed| weighed.turn.as_str())
        .filter(|turn| !turn.is_empty())
        .collect();
    if verdict != Verdict::Agrees {
        return format!("To agree, it takes {}.", joined(&turns, "and"));
    }
    let nearest = weighed
        .iter()
        .filter_map(|weighed| Some((weighed.margin?, weighed.criterion.title)))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let nearest = nearest.map_or_else(String::new, |(margin, title)| {
        format!(
            " Nearest to its threshold is “{title}”, by {} of skill.",
            fixed(margin, 2)
        )
    });
    format!("Any of: {}.{nearest}", joined(&turns, "or"))
}

fn joined(pieces: &[&str], word: &str) -> String {
    match pieces {
        [] => "nothing that was asked".to_owned(),
        [one] => (*one).to_owned(),
        [others @ .., last] => format!("{}, {word} {last}", others.join(", ")),
    }
}

fn weighed(evidence: &Evidence<'_>, thresholds: &Thresholds, open: Option<&Open>) -> Vec<Weighed> {
    let mut all = vec![enough(evidence, open)];
    if open.is_none() {
        all.extend([
            skill(
                evidence,
                Measure::Correlation,
                thresholds.correlation_skill_min,
            ),
            skill(evidence, Measure::Gain, thresholds.gain_skill_min),
        ]);
        all.extend(above_room(evidence, thresholds));
        all.extend(nobody(evidence, thresholds));
    }
    all.push(offset(evidence, thresholds));
    all.extend(evidence.beside.sensor.iter().map(|criterion| Weighed {
        turn: match criterion.state {
            State::Failed => format!("“{}” to hold", criterion.title),
            _ => String::new(),
        },
        criterion: criterion.clone(),
        margin: None,
    }));
    all
}

fn enough(evidence: &Evidence<'_>, open: Option<&Open>) -> Weighed {
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
        },
        margin: None,
        turn: String::new(),
    }
}

fn nothing_to_tell_from(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Option<Open> {
    if too_few(evidence.real_frames, thresholds) {
        return Some(Open {
            reason: format!(
                "The recording holds {} to compare; at least {} are needed to know what the sensor's noise is worth.",
                frames(evidence.real_frames),
                thresholds.frames_min
            ),
            remedy: "A longer recording of the same scene.",
        });
    }
    if evidence.warm.real < thresholds.warm_pixels_min {
        return Some(Open {
            reason: nothing_warm(evidence),
            remedy: "A recording with a person, or another warm thing of the scene, in view.",
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

fn no_headroom(evidence: &Evidence<'_>, measure: Measure, least: f64) -> Option<Open> {
    let score = evidence.scores.get(measure);
    let remedy =
        "A recording of at least a second at 10 Hz without gaps, with more contrast or less noise.";
    let Some(ceiling) = score.ceiling else {
        let reason = format!(
            "The recording has no frame {} after another to measure its own repeat with, so {measure} has no ceiling.",
            frames(evidence.lag_frames)
        );
        return Some(Open { reason, remedy });
    };
    let chance = score.chance()?;
    // Written so that a value that is not a number falls on the side of "cannot tell".
    let rises = ceiling - chance >= least;
    (!rises).then(|| Open {
        reason: format!(
            "The recording does not even resemble itself {} later: {measure} reaches {} where chance reaches {}.",
            frames(evidence.lag_frames), fixed(ceiling, 2), fixed(chance, 2)
        ),
        remedy,
    })
}

fn skill(evidence: &Evidence<'_>, measure: Measure, least: f64) -> Weighed {
    let score = evidence.scores.get(measure);
    let skill = skill_or_nothing(&score);
    let passed = skill >= least;
    let relation = if passed { "at least" } else { "less than" };
    let value = score
        .value
        .map_or_else(|| "not defined".to_owned(), |value| fixed(value, 2));
    let sentence = format!(
        "{measure} is {value}, {} of the way from the floor ({}) to the ceiling ({}), {relation} the {} asked for.",
        fixed(skill, 2),
        fixed(score.floor().unwrap_or(0.0), 2),
        fixed(score.ceiling.unwrap_or(0.0), 2),
        fixed(least, 2)
    );
    let (name, title, short, keys): (_, _, _, &'static [&'static str]) = match measure {
        Measure::Correlation => (
            "correlation",
            "C reaches for the sensor's own repeat",
            "C",
            &["correlation_skill_min"],
        ),
        _ => (
            "gain",
            "Better than a blank frame",
            "gain",
            &["gain_skill_min"],
        ),
    };
    Weighed {
        criterion: Criterion {
            name,
            title,
            state: state(passed),
            sentence,
            keys,
        },
        margin: Some(skill - least),
        turn: turn(&format!("a skill in {short}"), passed, least),
    }
}

/// What would turn a skill that has to reach `least`.
fn turn(what: &str, passed: bool, least: f64) -> String {
    let relation = if passed { "below" } else { "of" };
    format!("{what} {relation} {}", fixed(least, 2))
}

/// An image without any contrast has no correlation, and so has explained nothing.
fn skill_or_nothing(score: &Score) -> f64 {
    score.skill().unwrap_or(0.0)
}

const fn state(passed: bool) -> State {
    if passed { State::Met } else { State::Failed }
}

/// C of the people alone.
fn above_room(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Option<Weighed> {
    let above = evidence.above?;
    let least = thresholds.above_room_skill_min;
    let ceiling = above.ceiling.unwrap_or_default();
    let weighed = |state, sentence, margin, turn| Weighed {
        criterion: Criterion {
            name: "correlation_above_room",
            title: "C without the empty room",
            state,
            sentence,
            keys: &["above_room_skill_min", "nobody_headroom_min"],
        },
        margin,
        turn,
    };
    if ceiling < thresholds.nobody_headroom_min {
        let sentence = format!(
            "Nothing of the people stands out of the recording beside the empty room: its own repeat reaches C {}.",
            fixed(ceiling, 2)
        );
        return Some(weighed(State::NotAsked, sentence, None, String::new()));
    }
    // A claim of nobody, where somebody is, explains nothing.
    let value = above.value.unwrap_or_default();
    let skill = (value / ceiling).clamp(0.0, 1.0);
    let passed = skill >= least;
    let sentence = format!(
        "With the empty room taken out ({}), C is {}, {} of the way from 0 to the ceiling ({}), {} the {} asked for.",
        above.from.in_words(),
        fixed(value, 2),
        fixed(skill, 2),
        fixed(ceiling, 2),
        if passed { "at least" } else { "less than" },
        fixed(least, 2)
    );
    let turn = turn("a skill in C without the empty room", passed, least);
    Some(weighed(state(passed), sentence, Some(skill - least), turn))
}

/// Better than the same scene without its people; a scene without any has to explain as much as can be explained.
fn nobody(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Option<Weighed> {
    let nobody = evidence.nobody?;
    let score = evidence.scores.get(Measure::Gain);
    let (floor, ceiling) = (nobody.gain.unwrap_or(0.0), score.ceiling?);
    let value = score.value.unwrap_or(0.0);
    let least = thresholds.nobody_skill_min;
    let (state, sentence, margin) = if ceiling - floor < thresholds.nobody_headroom_min {
        let sentence = format!(
            "The scene without its people already reaches a gain of {} where the ceiling is {}: its people cannot be judged by that.",
            fixed(floor, 2),
            fixed(ceiling, 2)
        );
        (State::NotAsked, sentence, None)
    } else if nobody.has_people {
        let skill = (value - floor) / (ceiling - floor);
        let sentence = format!(
            "Without its people, the scene would have a gain of {}; with them it has {}, {} of the way from there to the ceiling ({}), {} the {} asked for.",
            fixed(floor, 2),
            fixed(value, 2),
            fixed(skill, 2),
            fixed(ceiling, 2),
            if skill >= least {
                "at least"
            } else {
                "less than"
            },
            fixed(least, 2)
        );
        (state(skill >= least), sentence, Some(skill - least))
    } else {
        let sentence = format!(
            "The scene has nobody in it, and its gain of {} stays {} below the ceiling ({}): the recording shows something that the scene does not claim.",
            fixed(value, 2),
            fixed(ceiling - floor, 2),
            fixed(ceiling, 2)
        );
        (State::Failed, sentence, Some(-least))
    };
    let turn = turn(
        "a skill over the scene without its people",
        state == State::Met,
        least,
    );
    Some(Weighed {
        criterion: Criterion {
            name: "better_than_nobody",
            title: "Better than the scene without its people",
            state,
            sentence,
            keys: &["nobody_skill_min", "nobody_headroom_min"],
        },
        margin,
        turn,
    })
}

fn offset(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Weighed {
    let own = evidence.beside.level_c;
    let most_c = own.unwrap_or(thresholds.offset_max_c);
    let (offset_c, limit) = (
        evidence.offset_c,
        fixed(most_c, if own.is_some() { 2 } else { 1 }),
    );
    let passed = offset_c.abs() <= most_c;
    let size = fixed(offset_c.abs(), 2);
    let relation = if passed { "within" } else { "beyond" };
    let whose = if own.is_some() {
        " by this unit's profile"
    } else {
        ""
    };
    let sentence = match size.as_str() {
        "0.00" => "The recording is as warm as the scene all over.".to_owned(),
        _ => {
            let direction = if offset_c < 0.0 { "colder" } else { "warmer" };
            format!(
                "The recording is {size} °C {direction} than the scene all over, {relation} the {limit} °C that are allowed{whose}."
            )
        }
    };
    Weighed {
        criterion: Criterion {
            name: "level",
            title: "The level is the scene's",
            state: state(passed),
            sentence,
            keys: if own.is_some() {
                &["level_margin_c"]
            } else {
                &["offset_max_c"]
            },
        },
        margin: None,
        turn: if passed {
            format!("a common offset beyond {limit} °C")
        } else {
            format!("a common offset within {limit} °C")
        },
    }
}
