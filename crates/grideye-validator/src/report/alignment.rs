//! The alignment in time and place, as a section of the page and as JSON.

use crate::align::{Alignment, TimeFound};
use crate::compare::Comparison;
use crate::report::text::{rows_table, with_error};
use grideye_draw::text::{fixed, signed};
use serde_json::{Value, json};

pub(crate) fn section(comparison: &Comparison) -> String {
    let Some(found) = &comparison.alignment else {
        return String::new();
    };
    let left_out: Vec<String> = found
        .left_out
        .iter()
        .map(|left| format!("{} {}", left.rows, left.reason))
        .collect();
    let left_out = match left_out.is_empty() {
        true => "none".to_owned(),
        false => left_out.join("; "),
    };
    let drift = fixed(found.drift_c, 2);
    let mut rows = vec![
        ("Frames left out", left_out),
        (
            "Slow drift removed",
            format!("{drift} °C, largest minus smallest"),
        ),
    ];
    rows.extend(time_rows(found.time.as_ref()));
    let unknown = "this recording does not tell".to_owned();
    let lies = found.orientation.map_or(unknown, |found| {
        let applied = if found.applied { ", corrected" } else { "" };
        let (likeness, upright) = (fixed(found.likeness, 2), fixed(found.upright, 2));
        let orientation = found.orientation;
        format!("{orientation}{applied}; likeness {likeness}, as recorded {upright}")
    });
    rows.push(("Orientation", lies));
    let unknown = "not searched, or this recording does not tell".to_owned();
    let place = found.offset.map_or(unknown, |offset| {
        let [right, down] = offset.right_down_px.map(|px| signed(px, 2));
        let what = match offset.applied {
            true => "removed",
            false => "not corrected",
        };
        format!("{right} pixels to the right, {down} down, {what}")
    });
    rows.push(("Image offset", place));
    format!(
        "<h2>Alignment</h2>\n<p>Found before scoring. Likeness is the correlation of everything that moves, over all pixels and frames; \
         of the image if nothing moves.</p>\n{}",
        rows_table(rows)
    )
}

fn time_rows(time: Option<&TimeFound>) -> Vec<(&'static str, String)> {
    let Some(time) = time else {
        let why = "not aligned: nothing moves, or not asked for";
        return vec![("Time", why.to_owned())];
    };
    let unknown = "unknown: every decoy equals the scene".to_owned();
    let chance = time.chance.map_or(unknown, |chance| {
        let (chance, decoys) = (fixed(chance, 2), time.decoys);
        format!("{chance} (best of {decoys} decoys, aligned the same way)")
    });
    let state = match (time.applied, time.at_bound) {
        (true, _) => "applied",
        (false, true) => "not applied: a better one is beyond the bounds",
        (false, false) => "not applied: no better than chance",
    };
    let shift = with_error(signed(time.shift_s, 3), time.shift_error_s, 3);
    let percent = time.rate_error.map(|error| 100.0 * error);
    let rate = with_error(signed(100.0 * time.rate, 2), percent, 2);
    let (before, after) = (fixed(time.likeness_before, 2), fixed(time.likeness, 2));
    let mut rows = vec![
        ("Time", format!("{}, {state}", time.asked.name())),
        ("Delay", format!("{shift} s")),
        ("Clock", format!("{rate} %")),
        ("Likeness", format!("{before} without, {after} with it")),
        ("Chance reaches", chance),
    ];
    if let Some([right, down]) = time.rival_offset_px {
        let (right, down) = (signed(right, 1), signed(down, 1));
        let image = format!("an image {right} pixels to the right and {down} down");
        rows.push(("Explains it as well", image));
    }
    rows
}

pub(crate) fn json(found: &Alignment) -> Value {
    let left_out = found.left_out.iter();
    let left_out: Vec<Value> = left_out
        .map(|left| {
            json!({
                "reason": left.reason.name(),
                "text": left.reason.to_string(),
                "rows": left.rows,
                "first_seq": left.first_seq,
            })
        })
        .collect();
    json!({
        "left_out": left_out,
        "drift_c": found.drift_c,
        "time": found.time.as_ref().map(time),
        "orientation": found.orientation,
        "offset": found.offset.map(|found| json!({
            "right_px": found.right_down_px[0],
            "down_px": found.right_down_px[1],
            "likeness_before": found.likeness[0],
            "likeness": found.likeness[1],
            "applied": found.applied,
        })),
    })
}

fn time(time: &TimeFound) -> Value {
    let mut found = json!(time);
    if let Some(warp) = &time.warp {
        found["warp"]["departure_max_s"] = json!(warp.departure_max_s());
    }
    found
}
