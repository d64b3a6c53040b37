//! How recording and scene were brought into step, as a section of the page and as JSON.

use crate::align::{Alignment, OffsetFound, OrientationFound, TimeFound};
use crate::compare::Comparison;
use grideye_draw::text::{escape, fixed, signed};
use serde_json::{Value, json};

pub(crate) fn section(comparison: &Comparison) -> String {
    let Some(found) = &comparison.alignment else {
        return String::new();
    };
    let mut rows = vec![("Frames left out".to_owned(), left_out(found))];
    rows.push((
        "Slow drift taken out".to_owned(),
        format!("{} °C from its least to its most", fixed(found.drift_c, 2)),
    ));
    rows.extend(time_rows(found.time.as_ref()));
    rows.push((
        "How the image lies".to_owned(),
        found.orientation.as_ref().map_or_else(
            || "cannot be told from this recording".to_owned(),
            |found| {
                format!(
                    "{}{}; likeness {} so, {} as it was recorded",
                    found.orientation,
                    if found.applied { ", turned back" } else { "" },
                    fixed(found.likeness, 2),
                    fixed(found.upright, 2)
                )
            },
        ),
    ));
    rows.push((
        "Where the image lies".to_owned(),
        found.offset.as_ref().map_or_else(
            || "not looked for, or cannot be told".to_owned(),
            |offset| {
                format!(
                    "{} pixels to the right, {} down, {}",
                    signed(offset.right_down_px[0], 2),
                    signed(offset.right_down_px[1], 2),
                    if offset.applied {
                        "taken out"
                    } else {
                        "left as it is"
                    }
                )
            },
        ),
    ));
    let rows: String = rows
        .iter()
        .map(|(name, found)| {
            format!(
                "<tr><th scope=\"row\">{name}</th><td>{}</td></tr>\n",
                escape(found)
            )
        })
        .collect();
    format!(
        "<h2>Alignment</h2>\n<p>What was found before anything was scored. Likeness is the correlation of what moves over \
         all pixels and frames, or of the image where nothing moves.</p>\n<table class=\"list\">\n<tbody>\n{rows}</tbody>\n</table>\n"
    )
}

fn left_out(found: &Alignment) -> String {
    let reasons: Vec<String> = found
        .left_out
        .iter()
        .map(|left| format!("{} {}", left.rows, left.reason))
        .collect();
    if reasons.is_empty() {
        "none".to_owned()
    } else {
        reasons.join("; ")
    }
}

fn time_rows(time: Option<&TimeFound>) -> Vec<(String, String)> {
    let Some(time) = time else {
        return vec![(
            "Time".to_owned(),
            "not aligned: nothing moves, or it was not asked for".to_owned(),
        )];
    };
    let error = |error: Option<f64>, scale: f64, decimals| {
        error.map_or_else(String::new, |error| {
            format!(" ± {}", fixed(scale * error, decimals))
        })
    };
    let chance = time.chance.map_or_else(
        || "not known: every decoy is the scene itself".to_owned(),
        |chance| {
            format!(
                "{} ({} films that are not the scene, aligned alike)",
                fixed(chance, 2),
                time.decoys
            )
        },
    );
    let state = match (time.applied, time.at_bound) {
        (true, _) => "applied",
        (false, true) => "not applied: a better one lies beyond the bounds",
        (false, false) => "not applied: no better than chance",
    };
    let mut rows = vec![
        ("Time".to_owned(), format!("{}, {state}", time.asked.name())),
        (
            "Delay".to_owned(),
            format!(
                "{}{} s",
                signed(time.shift_s, 3),
                error(time.shift_error_s, 1.0, 3)
            ),
        ),
        (
            "Clock".to_owned(),
            format!(
                "{}{} %",
                signed(100.0 * time.rate, 2),
                error(time.rate_error, 100.0, 2)
            ),
        ),
        (
            "Likeness".to_owned(),
            format!(
                "{} without, {} with it",
                fixed(time.likeness_before, 2),
                fixed(time.likeness, 2)
            ),
        ),
        ("Chance reaches".to_owned(), chance),
    ];
    if let Some([right, down]) = time.rival_offset_px {
        rows.push((
            "Would explain it as well".to_owned(),
            format!(
                "an image {} pixels to the right and {} down",
                signed(right, 1),
                signed(down, 1)
            ),
        ));
    }
    rows
}

pub(crate) fn json(found: Option<&Alignment>) -> Value {
    found.map_or(Value::Null, |found| {
        let left_out: Vec<Value> = found
            .left_out
            .iter()
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
            "orientation": found.orientation.as_ref().map(orientation),
            "offset": found.offset.as_ref().map(offset),
        })
    })
}

fn time(time: &TimeFound) -> Value {
    json!({
        "asked": time.asked.name(),
        "applied": time.applied,
        "shift_s": time.shift_s,
        "shift_error_s": time.shift_error_s,
        "rate": time.rate,
        "rate_error": time.rate_error,
        "likeness_before": time.likeness_before,
        "likeness": time.likeness,
        "chance": time.chance,
        "decoys": time.decoys,
        "at_bound": time.at_bound,
        "rival_offset_px": time.rival_offset_px,
        "law": time.law.as_ref().map(|law| json!({
            "begins_late_s": law.begins_late_s,
            "ends_late_s": law.ends_late_s,
            "ease": law.ease,
            "lean": law.lean,
        })),
        "warp": time.warp.as_ref().map(|warp| json!({
            "departure_max_s": warp.departure_max_s(),
            "knots_s": warp.knots,
        })),
    })
}

fn orientation(found: &OrientationFound) -> Value {
    json!({
        "found": found.orientation.name(),
        "likeness": found.likeness,
        "likeness_upright": found.upright,
        "applied": found.applied,
    })
}

fn offset(found: &OffsetFound) -> Value {
    json!({
        "right_px": found.right_down_px[0],
        "down_px": found.right_down_px[1],
        "likeness_before": found.likeness[0],
        "likeness": found.likeness[1],
        "applied": found.applied,
    })
}
