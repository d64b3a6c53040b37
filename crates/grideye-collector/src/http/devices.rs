//! `GET /v1/devices` and `/v1/devices/{device}`: the figures of `GET /v1/sensors` per device, with its agent's
//! configuration.

use crate::auth::Caller;
use crate::http::agents::Said;
use crate::http::authorize::check_own;
use crate::http::refusal::Refusal;
use crate::http::state::AppState;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::{Extension, Json};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};

pub(crate) async fn devices(State(state): State<AppState>) -> Json<Value> {
    let devices: Vec<Value> = by_device(&state)
        .into_iter()
        .map(|(device, sensors)| device_json(&device, &sensors, &state.0.agents.of(&device)))
        .collect();
    let recent = crate::live::RECENT_WITHIN.as_secs();
    Json(json!({ "devices": devices, "faults_recent_s": recent }))
}

/// `GET /v1/devices/{device}`: also open to the device's own token, so that an agent can confirm that its frames
/// arrived.
pub(crate) async fn device(
    State(state): State<AppState>,
    caller: Option<Extension<Caller>>,
    Path(device): Path<String>,
) -> Result<Json<Value>, Refusal> {
    check_own(caller.as_deref(), &device)?;
    let sensors = by_device(&state).remove(&device).ok_or_else(|| {
        let what = "no frame of this device has arrived yet";
        Refusal::new(StatusCode::NOT_FOUND, "no_such_device", what)
            .field("device")
            .hint("GET /v1/devices lists the devices that have sent frames")
    })?;
    let said = state.0.agents.of(&device);
    Ok(Json(device_json(&device, &sensors, &said)))
}

fn by_device(state: &AppState) -> BTreeMap<String, Vec<Value>> {
    let mut sensors = state.0.live.sensors_json();
    let sensors = match sensors["sensors"].take() {
        Value::Array(sensors) => sensors,
        _ => Vec::new(),
    };
    let mut by_device: BTreeMap<String, Vec<Value>> = BTreeMap::new();
    for sensor in sensors {
        let device = sensor["device"].as_str().unwrap_or_default().to_owned();
        by_device.entry(device).or_default().push(sensor);
    }
    by_device
}

/// Sums over the sensors; boot and clock come from the sensor with the newest record.
fn device_json(device: &str, sensors: &[Value], said: &Said) -> Value {
    let age = |sensor: &&Value| sensor["age_s"].as_f64().unwrap_or(f64::INFINITY);
    let newest = sensors.iter().min_by(|a, b| age(a).total_cmp(&age(b)));
    let sum = |key: &str| {
        sensors
            .iter()
            .filter_map(|sensor| sensor[key].as_u64())
            .fold(0, u64::saturating_add)
    };
    let rates = sensors
        .iter()
        .filter_map(|sensor| sensor["rate_hz"].as_f64());
    let version = said
        .program
        .as_deref()
        .and_then(|program| program.split_once('/'));
    json!({
        "device": device,
        "boot": newest.map(|sensor| &sensor["boot"]),
        "agent_version": version.map(|(_, version)| version),
        "age_s": newest.map(|sensor| &sensor["age_s"]),
        "clock": newest.map(clock),
        "rate_hz": rates.reduce(|sum, rate| sum + rate),
        "backlog": sum("spooled"),
        "read": sum("read"),
        "stored": sum("stored"),
        "missing": sum("missing"),
        "dropped": counts(sensors, "dropped"),
        "errors": counts(sensors, "errors"),
        "recent_faults": recent_faults(sensors),
        "rivals": sensors.iter().map(|sensor| &sensor["rivals"]).find(|rivals| !rivals.is_null()),
        "configuration": said.configuration,
        "sensors": sensors.iter().map(|sensor| sensor_json(sensor, said)).collect::<Vec<_>>(),
    })
}

fn sensor_json(sensor: &Value, said: &Said) -> Value {
    let name = sensor["sensor"].as_str().unwrap_or_default();
    let set_up = said
        .configuration
        .as_ref()
        .and_then(|set_up| set_up.sensors.get(name));
    let mut json = Map::new();
    for key in [
        "sensor", "boot", "age_s", "rate_hz", "backlog", "read", "stored", "missing", "balanced",
        "dropped", "errors",
    ] {
        let of = if key == "backlog" { "spooled" } else { key };
        json.insert(key.to_owned(), sensor[of].clone());
    }
    let missing_now = sensor["no_frame_now"]["missing"].clone();
    let part = set_up.map(|set_up| set_up.part.as_str());
    json.insert("clock".to_owned(), clock(sensor).clone());
    json.insert("missing_now".to_owned(), missing_now);
    json.insert("part".to_owned(), part.into());
    Value::Object(json)
}

/// `unsynced`, `synced` or `stepped` in the newest record.
fn clock(sensor: &Value) -> &Value {
    match &sensor["no_frame_now"]["clock"] {
        Value::Null => &sensor["frame"]["clock"],
        newer => newer,
    }
}

/// The recent faults of all sensors, in alphabetical order.
fn recent_faults(sensors: &[Value]) -> BTreeSet<&str> {
    let of_each = sensors
        .iter()
        .filter_map(|sensor| sensor["recent_faults"].as_array());
    of_each.flatten().filter_map(Value::as_str).collect()
}

fn counts(sensors: &[Value], key: &str) -> BTreeMap<String, u64> {
    let mut sums = BTreeMap::new();
    for (reason, count) in sensors
        .iter()
        .filter_map(|sensor| sensor[key].as_object())
        .flatten()
    {
        let sum: &mut u64 = sums.entry(reason.clone()).or_default();
        *sum = sum.saturating_add(count.as_u64().unwrap_or(0));
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_the_sum_of_its_sensors_and_its_clock_that_of_the_newest_record() {
        let sensor = |name: &str, age_s: f64, clock: &str, nack: u64| {
            json!({
                "device": "d", "sensor": name, "boot": "b", "age_s": age_s, "rate_hz": 9.5, "spooled": 3, "read": 10,
                "stored": 6, "missing": 2, "balanced": true, "dropped": {"ring-full": 1}, "errors": {"nack": nack},
                "recent_faults": [name, "nack"], "no_frame_now": null, "frame": {"clock": clock},
            })
        };
        let mut older = sensor("y", 4.0, "unsynced", 2);
        older["no_frame_now"] = json!({"missing": "nack", "clock": "stepped"});
        let said = Said {
            program: Some("grideye-agent/1.2.3".to_owned()),
            configuration: serde_json::from_value(json!({
                "post_every_ms": 500, "ring_frames": 10000, "spool": "outage",
                "sensors": {"x": {"part": "AMG8833", "rate_hz": 10, "moving_average": false}},
            }))
            .unwrap(),
            ..Said::default()
        };
        let json = device_json("d", &[older, sensor("x", 0.5, "synced", 1)], &said);
        for (key, expected) in [
            ("agent_version", json!("1.2.3")),
            ("age_s", json!(0.5)),
            ("clock", json!("synced")),
            ("rate_hz", json!(19.0)),
            ("backlog", json!(6)),
            ("read", json!(20)),
            ("stored", json!(12)),
            ("missing", json!(4)),
            ("dropped", json!({"ring-full": 2})),
            ("errors", json!({"nack": 3})),
            ("recent_faults", json!(["nack", "x", "y"])),
        ] {
            assert_eq!(json[key], expected, "{key}");
        }
        let of =
            |place: usize| ["clock", "missing_now", "part"].map(|key| &json["sensors"][place][key]);
        assert_eq!(of(0), [&json!("stepped"), &json!("nack"), &Value::Null]);
        assert_eq!(of(1), [&json!("synced"), &Value::Null, &json!("AMG8833")]);
    }
}
