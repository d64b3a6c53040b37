//! Sentences about alignment and background, for the report.

use crate::align::{
    Alignment, OFFSET_MAX_PX, OffsetFound, Orientation, OrientationFound, TimeAlignment, TimeFound,
};
use crate::frames::timeline::{Joined, Timeline};
use crate::frames::{LeftOut, RoomSource};
use crate::report::text::with_error;
use crate::scene_comparison::types::{LearnedRoom, Options};
use crate::verdict::types::KnownPattern;
use grideye_draw::text::fixed;
use grideye_recording::{Record, level};
use grideye_scene::{Model, Scene};

pub(crate) fn alignment(found: &Alignment, rows: usize, timeline: &Timeline) -> Vec<String> {
    let left_out = found.left_out.iter().map(|left| {
        let (left_out, reason, first) = (left.rows, left.reason, left.first_seq);
        let hint = match left.reason {
            LeftOut::OutsideScene => {
                " Give the last waypoint a longer `dwell_s` if people stay there."
            }
            _ => "",
        };
        format!("Left out {left_out} of {rows} rows ({reason}); the first is {first}.{hint}")
    });
    let mut notes: Vec<String> = left_out.collect();
    if found.drift_c > 0.0 {
        let drift = fixed(found.drift_c, 2);
        notes.push(format!(
            "A slow drift of {drift} °C common to all pixels was removed."
        ));
    }
    notes.push(begins(timeline));
    match &found.time {
        Some(time) => notes.extend(self::time(time)),
        None => notes.push("Time was not aligned.".to_owned()),
    }
    notes.extend(found.offset.as_ref().and_then(offset));
    notes
}

/// A scene of the paper stays as the paper has it.
pub(crate) fn model(scene: &Scene) -> Option<String> {
    let is_of_sensor = scene.model() == Model::Physical || scene.paper_experiment().is_some();
    (!is_of_sensor).then(|| {
        "The scene has the paper's model; for a real sensor set `model = \"physical\"`.".to_owned()
    })
}

/// The warning of values that are hardly degrees Celsius.
pub(crate) fn level(records: &[Record]) -> Option<String> {
    level::doubt_of(records).map(|doubt| doubt.to_string())
}

/// Which background the comparison took.
pub(crate) fn background(
    pattern: &KnownPattern,
    learned: Option<&LearnedRoom>,
    options: &Options,
) -> String {
    let is_measured = options.unit.is_some_and(|unit| unit.has_background);
    let unknown = fixed(options.thresholds.background_spread_c, 2);
    match (pattern.from, learned) {
        (RoomSource::Recording, Some(room)) => {
            let frames = room.frames;
            format!("Background: from {frames} empty frames of this recording.")
        }
        (RoomSource::Profile, _) if is_measured => {
            "Background: from the profile, measured in an empty room.".to_owned()
        }
        (RoomSource::Profile, _) => format!(
            "Background: unknown, σ {unknown} °C per pixel. The profile has the unit's pattern only."
        ),
        _ => format!("Background: unknown, σ {unknown} °C per pixel, as are unit and room."),
    }
}

fn begins(timeline: &Timeline) -> String {
    let start_s = timeline.start_s();
    let start = fixed(start_s, 1);
    let taken = format!("The recording's first frame is taken as second {start} of the scene");
    match timeline.joined() {
        Joined::Given => format!("{taken}."),
        Joined::ClockNeverSet => format!(
            "{taken}, because the device's clock was never set: the trajectory's UTC was not used."
        ),
        Joined::Utc => {
            let by = fixed(start_s.abs(), 3);
            let side = if start_s < 0.0 { "before" } else { "after" };
            format!("By UTC, the recording begins {by} s {side} the scene's start.")
        }
    }
}

fn time(time: &TimeFound) -> Vec<String> {
    let chance = time.chance.map(|chance| fixed(chance, 2));
    let chance = chance.unwrap_or("not known".to_owned());
    let (with, without) = (fixed(time.likeness, 2), fixed(time.likeness_before, 2));
    let likeness = format!(
        "likeness of the motion is {with} with it and {without} without; decoys reach {chance} ({} tried)",
        time.decoys
    );
    if time.at_bound {
        return vec![format!(
            "The best alignment of time lies beyond the bounds, so none was applied: {likeness}. If you know that the recording starts earlier or later than the scene, or that its clock is off by more, allow it with --max-shift or --max-rate. The scores depend on it, the verdict does not."
        )];
    }
    if !time.applied {
        return vec![format!(
            "No alignment of time beats chance, so none was applied: {likeness}."
        )];
    }
    vec![format!("{}: {likeness}.", applied(time))]
}

fn applied(time: &TimeFound) -> String {
    let passes = match time.asked {
        TimeAlignment::Shift => String::new(),
        _ => format!(", and passes {}", rate(time)),
    };
    format!("Time was aligned: the scene is {}{passes}", shift(time))
}

fn shift(time: &TimeFound) -> String {
    let direction = if time.shift_s < 0.0 {
        "behind"
    } else {
        "ahead of"
    };
    let shift = with_error(fixed(time.shift_s.abs(), 3), time.shift_error_s, 3);
    format!("{shift} s {direction} the recording at its first frame")
}

fn rate(time: &TimeFound) -> String {
    if time.rate == 0.0 {
        return "as fast".to_owned();
    }
    let direction = if time.rate < 0.0 { "slower" } else { "faster" };
    let percent = time.rate_error.map(|error| 100.0 * error);
    let rate = with_error(fixed(100.0 * time.rate.abs(), 2), percent, 2);
    format!("{rate} % {direction} than its clock")
}

/// Advice on an image that was judged not to lie as in the scene.
pub(crate) fn orientation(found: &OrientationFound, is_failed: bool) -> Option<String> {
    if found.orientation == Orientation::Upright || !(is_failed || found.applied) {
        return None;
    }
    let (so, upright) = (fixed(found.likeness, 2), fixed(found.upright, 2));
    let likeness = format!("likeness {so} in this orientation, {upright} as recorded");
    let lies = found.orientation;
    if found.applied {
        return Some(format!(
            "The image is {lies}, and was turned back as requested: {likeness}."
        ));
    }
    let check = if found.orientation.is_mirrored() {
        "no mounting mirrors an image: check in which order the reading program stores rows and columns"
    } else {
        "check how the sensor is mounted, or the sensor's azimuth_deg and roll_deg"
    };
    Some(format!(
        "The image is {lies}: {likeness}; {check}. It was compared as recorded (--align orientation turns it back)."
    ))
}

fn offset(found: &OffsetFound) -> Option<String> {
    let [right, down] = found.right_down_px;
    if !found.applied && right.abs().max(down.abs()) < OFFSET_MAX_PX / 5.0 {
        return None;
    }
    let place = format!(
        "The image lies {} pixels to the right and {} down of the scene's",
        fixed(right, 2),
        fixed(down, 2)
    );
    let what = if found.applied && found.is_another_pose() {
        format!(
            "{OFFSET_MAX_PX} pixel each way of this was removed as requested; the rest is a different pose"
        )
    } else if found.applied {
        "this was removed as requested".to_owned()
    } else {
        "it was compared as recorded (--align pose removes up to half a pixel)".to_owned()
    };
    Some(format!("{place}; {what}."))
}
