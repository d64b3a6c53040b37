use crate::align::{Alignment, OffsetFound, OrientationFound, TimeFound};
use serde_json::{Value, json};

/// What was aligned and left out, for programs; `null` if nothing was looked for.
pub(super) fn json(found: Option<&Alignment>) -> Value {
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
