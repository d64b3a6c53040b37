//! What was found about time and place, in sentences.

use crate::align::{
    Alignment, OFFSET_MAX_PX, OffsetFound, Orientation, OrientationFound, TimeAlignment, TimeFound,
};
use crate::scene_comparison::types::Options;
use grideye_draw::text::fixed;

pub(crate) fn alignment(found: &Alignment, rows: usize, options: &Options) -> Vec<String> {
    let mut notes: Vec<String> = found
        .left_out
        .iter()
        .map(|left| {
            format!(
                "{} of {rows} rows of the recording were left out, {}; the first is {}.",
                left.rows, left.reason, left.first_seq
            )
        })
        .collect();
    if found.drift_c > 0.0 {
        notes.push(format!(
            "A slow drift of {} °C that all pixels share was taken out.",
            fixed(found.drift_c, 2)
        ));
    }
    notes.push(start(options));
    match &found.time {
        Some(time) => notes.extend(self::time(time)),
        None => notes.push("Time was not aligned.".to_owned()),
    }
    notes.extend(found.offset.as_ref().and_then(offset));
    notes
}

fn start(options: &Options) -> String {
    format!(
        "The recording's first frame is taken for second {} of the scene.",
        fixed(options.start.as_secs_f64(), 1)
    )
}

fn time(time: &TimeFound) -> Vec<String> {
    let chance = time
        .chance
        .map_or_else(|| "not known".to_owned(), |chance| fixed(chance, 2));
    let likeness = format!(
        "what moves resembles the scene by {} with it and by {} without; films that are not the scene reach {chance} ({} tried)",
        fixed(time.likeness, 2),
        fixed(time.likeness_before, 2),
        time.decoys
    );
    if time.at_bound {
        return vec![format!(
            "The best alignment of time lies beyond its bounds, and none was applied: {likeness}. If the recording is known to start later or earlier than the scene, or its clock to be off by more, allow it with --max-shift or --max-rate."
        )];
    }
    if !time.applied {
        return vec![format!(
            "No alignment of time is better than chance, and none was applied: {likeness}."
        )];
    }
    let mut notes = vec![format!("{}: {likeness}.", applied(time))];
    if let Some([right, down]) = time.rival_offset_px {
        notes.push(format!(
            "A sensor turned so that its image lies {} pixels to the right and {} down would explain the recording as well as the delay does: this walk cannot tell the two apart, one that also comes back could.",
            fixed(right, 1),
            fixed(down, 1)
        ));
    }
    notes
}

fn applied(time: &TimeFound) -> String {
    let mut text = match (&time.law, time.asked) {
        (Some(law), _) => format!(
            "Time was aligned: the walk begins {} s and ends {} s later than the scene has it, ease {}, lean {}",
            fixed(law.begins_late_s, 2),
            fixed(law.ends_late_s, 2),
            fixed(law.ease, 2),
            fixed(law.lean, 2)
        ),
        (None, TimeAlignment::Shift) => {
            format!("Time was aligned: the scene is {}", shift(time))
        }
        (None, _) => format!(
            "Time was aligned: the scene is {}, and passes {}",
            shift(time),
            rate(time)
        ),
    };
    if let Some(warp) = &time.warp {
        text.push_str(&format!(
            ", on a path that departs from that by up to {} s",
            fixed(warp.departure_max_s(), 2)
        ));
    }
    text
}

fn shift(time: &TimeFound) -> String {
    let direction = if time.shift_s < 0.0 {
        "behind"
    } else {
        "ahead of"
    };
    format!(
        "{}{} s {direction} the recording at its first frame",
        fixed(time.shift_s.abs(), 3),
        error(time.shift_error_s, 1.0, 3)
    )
}

fn rate(time: &TimeFound) -> String {
    if time.rate == 0.0 {
        return "as fast".to_owned();
    }
    let direction = if time.rate < 0.0 { "slower" } else { "faster" };
    format!(
        "{}{} % {direction} than its clock",
        fixed(100.0 * time.rate.abs(), 2),
        error(time.rate_error, 100.0, 2)
    )
}

fn error(error: Option<f64>, scale: f64, decimals: usize) -> String {
    error.map_or_else(String::new, |error| {
        format!(" ± {}", fixed(scale * error, decimals))
    })
}

/// What to do about an image that was found, and judged, not to lie as the scene has it.
pub(crate) fn orientation(found: &OrientationFound, is_failed: bool) -> Option<String> {
    if found.orientation == Orientation::Upright || !(is_failed || found.applied) {
        return None;
    }
    let likeness = format!(
        "it fits the scene by {} so, and by {} as it was recorded",
        fixed(found.likeness, 2),
        fixed(found.upright, 2)
    );
    if found.applied {
        return Some(format!(
            "The image is {}, and was turned back as asked: {likeness}.",
            found.orientation
        ));
    }
    let check = if found.orientation.is_mirrored() {
        "no mounting mirrors an image: check in which order the reading program stores rows and columns"
    } else {
        "check how the sensor is mounted, or the sensor's azimuth_deg and roll_deg"
    };
    Some(format!(
        "The image is {}: {likeness}; {check}. It was compared as it was recorded (--align orientation turns it).",
        found.orientation
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
            "of that, {OFFSET_MAX_PX} pixel each way was taken out as asked; the rest is another pose"
        )
    } else if found.applied {
        "this was taken out as asked".to_owned()
    } else {
        "it was compared where it is (--align pose takes out up to half a pixel)".to_owned()
    };
    Some(format!("{place}; {what}."))
}
