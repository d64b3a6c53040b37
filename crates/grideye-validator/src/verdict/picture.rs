//! What else a picture shows: warmth that is not claimed, how it lies, how warm it is all over.

use super::judge::Weighed;
use super::{Criterion, Evidence, State, Thresholds};
use crate::align::Orientation;
use crate::expected::{Block, Law, Scale};
use crate::text::fixed;
use crate::thresholds::too_few;

/// Something warm where the scene has nothing warm.
pub(super) fn unclaimed(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Weighed {
    let weighed = |state, sentence: String, turn: &str| Weighed {
        criterion: Criterion {
            name: "nothing_unclaimed",
            title: "Nothing is warm that the scene does not claim",
            state,
            sentence,
            keys: &["unclaimed_min_c", "false_alarm_max", "pattern_spread_c"],
            asked: None,
        },
        margin: None,
        turn: turn.to_owned(),
    };
    let (found, expected) = (&evidence.found.unclaimed, evidence.expected);
    let laws = [
        expected.right(Scale::Plain, |statistics| {
            statistics.unclaimed.still.map(|block| block.celsius)
        }),
        expected.right(Scale::Plain, |statistics| {
            statistics.unclaimed.moving.map(|block| block.celsius)
        }),
    ];
    let limit = |law: Option<Law>| {
        law.map(|law| {
            law.high_of_largest(thresholds.false_alarm_max)
                .max(thresholds.unclaimed_min_c)
        })
    };
    let seen = [found.still, found.moving]
        .into_iter()
        .zip(laws)
        .filter_map(|(block, law)| Some((block?, limit(law)?)))
        .max_by(|a, b| (a.0.celsius - a.1).total_cmp(&(b.0.celsius - b.1)));
    match seen {
        _ if too_few(evidence.real_frames, thresholds) => weighed(
            State::NotAsked,
            "One frame does not tell warmth from noise.".to_owned(),
            "",
        ),
        None => weighed(
            State::NotAsked,
            "The scene claims something warm all over the view.".to_owned(),
            "",
        ),
        Some((block, limit_c)) if block.celsius > limit_c => weighed(
            State::Failed,
            format!(
                "{} the recording is {} °C warmer than the scene, which has nothing warm there; noise and pattern reach {} °C.",
                place(evidence, &block),
                fixed(block.celsius, 2),
                fixed(limit_c, 2)
            ),
            "a scene that has something warm there, or a recording without it",
        ),
        Some((block, limit_c)) => weighed(
            State::Met,
            format!(
                "Where the scene has nothing warm, no four pixels of the recording are more than {} °C warmer than it; {} °C would be needed.",
                fixed(block.celsius, 2),
                fixed(limit_c, 2)
            ),
            "",
        ),
    }
}

/// Rows and columns as they are counted on the page, from 1.
fn place(evidence: &Evidence<'_>, block: &Block) -> String {
    let (row, column) = (block.row + 1, block.column + 1);
    let place = format!(
        "n rows {row} and {}, columns {column} and {},",
        row + 1,
        column + 1
    );
    match block.frame.and_then(|frame| evidence.times.get(frame)) {
        Some(time) => format!(
            "{:.1} s after the first frame, i{place}",
            time.as_secs_f64()
        ),
        None => format!("I{place}"),
    }
}

/// How the image lies.
pub(super) fn orientation(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Weighed {
    let weighed = |state, sentence: String, turn: String| Weighed {
        criterion: Criterion {
            name: "orientation",
            title: "The image lies as the scene has it",
            state,
            sentence,
            keys: &["false_alarm_max", "pattern_spread_c"],
            asked: None,
        },
        margin: None,
        turn,
    };
    let found = &evidence.found.upright;
    if found.is_empty() {
        let why = "Nothing in the scene or in the recording tells how the image lies.";
        return weighed(State::NotAsked, why.to_owned(), String::new());
    }
    let rate = thresholds.false_alarm_max;
    let low = |orientation: Orientation| {
        let law = evidence.expected.upright(orientation);
        law.map_or(0.0, |law| law.low(rate))
    };
    let turned = found
        .iter()
        .filter(|(orientation, by)| *by < low(*orientation).min(0.0))
        .min_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((orientation, by)) = turned {
        let sentence = format!(
            "The image is {orientation}: so it resembles the scene more than as it was recorded, by {} of likeness, and recordings of the scene as it is hardly ever do.",
            fixed(by.abs(), 2)
        );
        return weighed(State::Failed, sentence, "the image turned back".to_owned());
    }
    let untold: Vec<String> = found
        .iter()
        .filter(|(orientation, by)| *by < -low(orientation.inverse()))
        .map(|(orientation, _)| orientation.to_string())
        .collect();
    if !untold.is_empty() {
        let sentence = format!(
            "The image may as well be {}: this scene looks too much alike both ways for this recording to tell.",
            untold.join(", or ")
        );
        let turn = "a recording of somebody who walks off the middle of the view".to_owned();
        return weighed(State::Open, sentence, turn);
    }
    weighed(State::Met, upright(evidence), String::new())
}

fn upright(evidence: &Evidence<'_>) -> String {
    let mut text = match evidence.beside.turned_back {
        Some(orientation) => format!("The image is {orientation}, and was turned back as asked."),
        None => "The image lies as the scene has it.".to_owned(),
    };
    if !evidence.same.is_empty() {
        let names: Vec<String> = evidence.same.iter().map(ToString::to_string).collect();
        text.push_str(&format!(
            " Were it {}, it would look the same: the scene is symmetric that way, and no recording of it tells.",
            names.join(", or ")
        ));
    }
    text
}

pub(super) fn level(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Weighed {
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
            state: if passed { State::Met } else { State::Failed },
            sentence,
            keys: if own.is_some() {
                &["level_margin_c"]
            } else {
                &["offset_max_c"]
            },
            asked: None,
        },
        margin: None,
        turn: if passed {
            format!("a common offset beyond {limit} °C")
        } else {
            format!("a common offset within {limit} °C")
        },
    }
}
