//! What else a picture shows: warmth that is not claimed, how it lies, how warm it is all over.

use crate::align::Orientation;
use crate::expected::ScoreDistribution;
use crate::expected::units::{Pick, Scale};
use crate::metrics::foreground::RoomSource;
use crate::metrics::unclaimed::WarmBlock;
use crate::thresholds::{Thresholds, too_few};
use crate::verdict::types::{Evidence, PROFILE, Question, State, Weighed};
use grideye_draw::text::fixed;

pub(crate) fn unclaimed(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Weighed {
    let asked = Question {
        name: "nothing_unclaimed",
        title: "Nothing is warm that the scene does not have",
        keys: &["unclaimed_min_c", "false_alarm_max", "pattern_spread_c"],
    };
    let limits = limits_c(evidence, thresholds);
    let found = &evidence.found.unclaimed;
    let seen = [found.still, found.moving]
        .into_iter()
        .zip(limits)
        .filter_map(|(block, limit_c)| Some((block?, limit_c?)))
        .max_by(|a, b| (a.0.celsius - a.1).total_cmp(&(b.0.celsius - b.1)));
    let Some((block, limit_c)) = seen.filter(|_| !too_few(evidence.real_frames, thresholds)) else {
        let why = "Too few frames tell warmth from noise.";
        return asked.weighed(State::NotAsked, why, "");
    };
    let (celsius, limit) = (block.celsius, fixed(limit_c, 2));
    if celsius > limit_c {
        let sentence = format!(
            "{} the recording is {} °C warmer than the scene has it there or nearby; noise and pattern reach {limit} °C.",
            place(evidence, &block),
            fixed(celsius, 2),
        );
        let turn = "a scene that has something warm there, or a recording without it";
        return asked.weighed(State::Failed, sentence, turn);
    }
    let hidden_c = limits.into_iter().flatten().fold(limit_c, f64::max);
    let prior = evidence.prior;
    let claims_nobody = !prior.nobody.is_empty() && !prior.shows_people;
    if claims_nobody && hidden_c > thresholds.unclaimed_min_c {
        let unit = "noise, nor from this unit's pattern, of which nothing is known";
        let quiet = "a sensor with less noise, or a scene with people to look for";
        let (than, turn) = match prior.pattern.from {
            RoomSource::Scene => (unit, PROFILE),
            _ => ("noise", quiet),
        };
        let hidden = fixed(hidden_c, 2);
        let sentence = format!(
            "The scene shows nobody, and somebody who is up to {hidden} °C warmer on four pixels would not be told from {than}."
        );
        return asked.weighed(State::Open, sentence, turn);
    }
    let most = fixed(celsius.max(0.0), 2);
    let sentence = format!(
        "Beyond what the scene has there or nearby, no four pixels of the recording are warmer by more than {most} °C; {limit} °C would be needed."
    );
    asked.weighed(State::Met, sentence, "")
}

/// How warm noise and pattern make the warmest block that stays, and the warmest that comes and goes, °C.
fn limits_c(evidence: &Evidence<'_>, thresholds: &Thresholds) -> [Option<f64>; 2] {
    let picks: [Pick; 2] = [
        |statistics| statistics.unclaimed.still.map(|block| block.celsius),
        |statistics| statistics.unclaimed.moving.map(|block| block.celsius),
    ];
    picks.map(|pick| {
        let draws = evidence.expected.right.iter().map(pick);
        let law = ScoreDistribution::of(Scale::Plain, draws)?;
        let limit_c = law.high_of_largest(thresholds.false_alarm_max);
        Some(limit_c.max(thresholds.unclaimed_min_c))
    })
}

fn place(evidence: &Evidence<'_>, block: &WarmBlock) -> String {
    let (row, column) = (block.row + 1, block.column + 1);
    let (next_row, next_column) = (row + 1, column + 1);
    let place = format!("n rows {row} and {next_row}, columns {column} and {next_column},");
    match block.frame.and_then(|frame| evidence.times.get(frame)) {
        Some(time) => {
            let after_s = time.as_secs_f64();
            format!("{after_s:.1} s after the first frame, i{place}")
        }
        None => format!("I{place}"),
    }
}

pub(crate) fn orientation(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Weighed {
    let asked = Question {
        name: "orientation",
        title: "The image lies as the scene has it",
        keys: &["false_alarm_max", "pattern_spread_c"],
    };
    let found = &evidence.found.upright;
    if found.is_empty() {
        let why = "Nothing in the scene or in the recording tells how the image lies.";
        return asked.weighed(State::NotAsked, why, "");
    }
    let rate = thresholds.false_alarm_max;
    let low = |orientation: Orientation| {
        let law = evidence.expected.upright(orientation);
        law.map_or(0.0, |law| law.low(rate))
    };
    // What is so much alike that right recordings, too, are as like it, is the same to this sensor.
    let is_same = |orientation: &Orientation| {
        evidence.alike.contains(orientation) && low(*orientation) <= 0.0
    };
    let (same, other): (Vec<_>, Vec<_>) = found
        .iter()
        .copied()
        .partition(|(orientation, _)| is_same(orientation));
    let turned = other
        .iter()
        .filter(|(orientation, by)| *by < low(*orientation).min(0.0))
        .min_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((orientation, by)) = turned {
        let by = fixed(by.abs(), 2);
        let sentence = format!(
            "The image is {orientation}: so it resembles the scene more than as it was recorded, by {by} of likeness, and recordings of the scene as it is hardly ever do."
        );
        return asked.weighed(State::Failed, sentence, "the image turned back");
    }
    let names = |all: &[(Orientation, f64)]| {
        let names: Vec<String> = all.iter().map(|(name, _)| name.to_string()).collect();
        names.join(", or ")
    };
    let untold: Vec<(Orientation, f64)> = other
        .into_iter()
        .filter(|(orientation, by)| *by < -low(orientation.inverse()))
        .collect();
    if !untold.is_empty() {
        let names = names(&untold);
        let sentence = format!(
            "The image may as well be {names}: this scene looks too much alike both ways for this recording to tell."
        );
        let turn = "a recording of somebody who walks off the middle of the view";
        return asked.weighed(State::Open, sentence, turn);
    }
    asked.weighed(State::Met, upright(evidence, &names(&same)), "")
}

fn upright(evidence: &Evidence<'_>, same: &str) -> String {
    let mut text = match evidence.prior.turned_back {
        Some(orientation) => format!("The image is {orientation}, and was turned back as asked."),
        None => "The image lies as the scene has it.".to_owned(),
    };
    if !same.is_empty() {
        text.push_str(&format!(
            " Were it {same}, it would look the same: the scene is symmetric that way within the noise, and this recording does not tell."
        ));
    }
    text
}

pub(crate) fn level(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Weighed {
    let offset_c = evidence.offset_c;
    let (most_c, limit, whose, keys): (f64, String, &str, &[&str]) = match evidence.prior.level_c {
        Some(own_c) => {
            let whose = " by this unit's profile";
            (own_c, fixed(own_c, 2), whose, &["level_margin_c"])
        }
        None => {
            let most_c = thresholds.offset_max_c;
            (most_c, fixed(most_c, 1), "", &["offset_max_c"])
        }
    };
    let asked = Question {
        name: "level",
        title: "The level is the scene's",
        keys,
    };
    let (state, relation, turn) = if offset_c.abs() <= most_c {
        (State::Met, "within", "beyond")
    } else {
        (State::Failed, "beyond", "within")
    };
    let size = fixed(offset_c.abs(), 2);
    let direction = if offset_c < 0.0 { "colder" } else { "warmer" };
    let sentence = match size.as_str() {
        "0.00" => "The recording is as warm as the scene all over.".to_owned(),
        _ => format!(
            "The recording is {size} °C {direction} than the scene all over, {relation} the {limit} °C that are allowed{whose}."
        ),
    };
    let turn = format!("a common offset {turn} {limit} °C");
    asked.weighed(state, sentence, turn)
}
