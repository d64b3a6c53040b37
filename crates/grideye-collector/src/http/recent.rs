//! `GET /v1/recent?device=…&sensor=…`: the last minutes of one sensor as a few figures, for a page that opens later.

use crate::http::refusal::Refusal;
use crate::http::state::AppState;
use axum::Json;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, State};
use axum::http::StatusCode;
use grideye_frame::word;
use grideye_frame::{PIXELS, Reading, RecordedFrame};
use grideye_recording::Record;
use serde::Deserialize;
use serde_json::{Value, json};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Asked {
    device: String,
    sensor: String,
}

/// Oldest first: boot time, then minimum, mean and maximum temperature in °C of each frame, `null` for a missing one.
pub(crate) async fn recent(
    State(state): State<AppState>,
    asked: Result<Query<Asked>, QueryRejection>,
) -> Result<Json<Value>, Refusal> {
    let Query(Asked { device, sensor }) = asked.map_err(|rejection| {
        Refusal::new(
            StatusCode::BAD_REQUEST,
            "wrong_query",
            rejection.body_text(),
        )
        .hint("ask for ?device=pi-1&sensor=i2c-1:0x69; GET /v1/sensors lists them")
    })?;
    let found = state.0.live.recent().of(&device, &sensor);
    let (stream, records) = found.unzip();
    let rows: Vec<Value> = records.iter().flatten().map(row).collect();
    let boot = stream.map(|stream| stream.boot);
    Ok(Json(json!({
        "device": device,
        "sensor": sensor,
        "boot": boot,
        "columns": ["t_boot_ns", "min_celsius", "mean_celsius", "max_celsius"],
        "rows": rows,
    })))
}

fn row(record: &Record) -> Value {
    let at = record.stamp.t_boot_ns;
    match &record.reading {
        Reading::NoData(_) => json!([at, null, null, null]),
        Reading::Frame(raw) => {
            let [min, mean, max] = figures(raw);
            json!([at, min, mean, max])
        }
    }
}

/// Minimum, mean and maximum temperature of a frame in °C.
fn figures(raw: &RecordedFrame) -> [f64; 3] {
    let steps = raw.pixels.map(|pixel| i32::from(word::pixel_steps(pixel)));
    let least = steps.iter().copied().min().unwrap_or(0);
    let greatest = steps.iter().copied().max().unwrap_or(0);
    let sum: i32 = steps.iter().sum();
    let mean = f64::from(sum) / PIXELS_IN_ALL;
    [f64::from(least), mean, f64::from(greatest)]
        .map(|steps| steps * f64::from(word::PIXEL_STEP.get()))
}

const PIXELS_IN_ALL: f64 = 64.0;
const _: () = assert!(PIXELS == 64);
