//! Criteria on the image: warmth that the scene lacks, orientation, and level.

use crate::align::Orientation;
use crate::expected::ScoreDistribution;
use crate::expected::units::{Pick, Scale};
use crate::metrics::foreground::RoomSource;
use crate::metrics::unclaimed::WarmBlock;
use crate::thresholds::{Thresholds, too_few};
use crate::verdict::types::{Evidence, Next, PROFILE, Question, State, Weighed};
use grideye_draw::text::fixed;

pub(crate) fn unclaimed(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Weighed {
    let asked = Question {
        name: "nothing_unclaimed",
        title: "Nothing is warm that the scene lacks",
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
        let why = "Too few frames to tell warmth from noise.";
        return asked.weighed(State::NotAsked, why, Next::default());
    };
    let (celsius, limit) = (block.celsius, fixed(limit_c, 2));
    if celsius > limit_c {
        let sentence = format!(
            "{} the recording is {} °C warmer than the scene there or nearby; noise and fixed pattern explain at most {limit} °C.",
            place(evidence, &block),
            fixed(celsius, 2),
        );
        let next = (
            "Add the warm person or object to the scene, or correct its position; or record again without it.",
            "a scene that has something warm there, or a recording without it",
        );
        return asked.weighed(State::Failed, sentence, next);
    }
    let hidden_c = limits.into_iter().flatten().fold(limit_c, f64::max);
    let prior = evidence.prior;
    let claims_nobody = !prior.nobody.is_empty() && !prior.shows_people;
    if claims_nobody && hidden_c > thresholds.unclaimed_min_c {
        let quiet = (
            "Record with a person in view and compare with a scene that has this person, or use a sensor with less noise.",
            "a sensor with less noise, or a scene with people to look for",
        );
        let (hides, next) = match prior.pattern.from {
            RoomSource::Scene => (
                "noise and the unknown fixed pattern of this sensor",
                PROFILE,
            ),
            _ => ("noise", quiet),
        };
        let hidden = fixed(hidden_c, 2);
        let sentence = format!(
            "The scene shows nobody, but {hides} could hide a person who makes four pixels up to {hidden} °C warmer."
        );
        return asked.weighed(State::Open, sentence, next);
    }
    let most = fixed(celsius.max(0.0), 2);
    let sentence = format!(
        "No four pixels are more than {most} °C warmer than the scene there or nearby; noise and fixed pattern explain {limit} °C."
    );
    asked.weighed(State::Met, sentence, Next::default())
}

/// The warmth that noise and fixed pattern explain, °C: of a block that stays, and of one that comes and goes.
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
        title: "The image has the scene's orientation",
        keys: &["false_alarm_max", "pattern_spread_c"],
    };
    let found = &evidence.found.upright;
    if found.is_empty() {
        let why = "Neither scene nor recording shows an orientation.";
        return asked.weighed(State::NotAsked, why, Next::default());
    }
    let rate = thresholds.false_alarm_max;
    let low = |orientation: Orientation| {
        let law = evidence.expected.upright(orientation);
        law.map_or(0.0, |law| law.low(rate))
    };
    // An orientation that also fits right recordings as well is the same to this sensor.
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
    if let Some(&(orientation, by)) = turned {
        let turned_by = low(orientation.inverse());
        return turned_image(&asked, orientation, (by.abs(), turned_by), thresholds);
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
        let sentence = format!("The image may be {names}: the scene looks too similar both ways.");
        let next = (
            "Record a person who walks away from the middle of the view.",
            "a recording of a person who walks away from the middle of the view",
        );
        return asked.weighed(State::Open, sentence, next);
    }
    let upright = upright(evidence, &names(&same));
    asked.weighed(State::Met, upright, Next::default())
}

/// A sensor that is mounted this way would fit better by `turned_by` at least. A person elsewhere than in the scene makes
/// some orientation fit better too, but by less.
fn turned_image(
    asked: &Question,
    orientation: Orientation,
    (by, turned_by): (f64, f64),
    thresholds: &Thresholds,
) -> Weighed {
    let is_weak = by < thresholds.correlation_skill_min * turned_by;
    let (better, usual) = (fixed(by, 2), fixed(turned_by, 2));
    let doubt = if is_weak {
        ", so something else is wrong"
    } else {
        ""
    };
    let sentence = format!(
        "If the image were {orientation}, it would fit the scene better by {better} of correlation; a sensor mounted so gives at least {usual}{doubt}."
    );
    let step = if is_weak {
        "Check the positions of people and objects first."
    } else if orientation.is_mirrored() {
        "Check in which order the reading program stores rows and columns (no mounting mirrors an image), or compare with --align orientation."
    } else {
        "Check how the sensor is mounted, and azimuth_deg and roll_deg in the scene; or compare with --align orientation."
    };
    let mut weighed = asked.weighed(State::Failed, sentence, (step, "the image turned back"));
    weighed.is_weak = is_weak;
    weighed
}

fn upright(evidence: &Evidence<'_>, same: &str) -> String {
    let mut text = match evidence.prior.turned_back {
        Some(orientation) => format!("The image is {orientation}, which was corrected as asked."),
        None => "The image has the scene's orientation.".to_owned(),
    };
    if !same.is_empty() {
        text.push_str(&format!(
            " The scene is symmetric within the noise: an image {same} would look the same."
        ));
    }
    text
}

pub(crate) fn level(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Weighed {
    let offset_c = evidence.offset_c;
    let (most_c, limit, source, keys): (f64, String, &str, &[&str]) = match evidence.prior.level_c {
        Some(own_c) => {
            let source = "this sensor's profile";
            (own_c, fixed(own_c, 2), source, &["level_margin_c"])
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
