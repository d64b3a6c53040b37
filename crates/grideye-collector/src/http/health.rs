//! The collector's health: for supervisors, for programs, and for Prometheus.

use crate::counters::{TIME_CLASSES_S, load};
use crate::http::state::AppState;
use crate::store::{StoreError, StoreUsage};
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Json, Response};
use grideye_recording::prometheus::{CONTENT_TYPE, Text};
use serde_json::{Value, json};
use std::fmt::Display;

/// For each sensor figure: its key in `GET /v1/sensors`, then kind, name and help of the metric family.
const OF_SENSORS: &str = "\
age_s gauge grideye_sensor_age_seconds Age of the newest row.
rate_hz gauge grideye_sensor_rate_hertz Frames a second.
spooled gauge grideye_sensor_spooled_frames Frames that the agent holds.
unaccounted gauge grideye_sensor_unaccounted_frames Frames that are nowhere.
never_came gauge grideye_sensor_never_came_frames Numbers that never came, in this boot.
read counter grideye_sensor_read_total Frames that the agent read, in this boot.
stored counter grideye_sensor_stored_total Frames kept, in this boot.
missing counter grideye_sensor_missing_total Rows without a frame, in this boot.
dropped counter grideye_sensor_dropped_total Frames that the agent gave up.
errors counter grideye_sensor_errors_total Errors of the bus and the sensor.
people gauge grideye_people People in view, 3 for three and more.
entered counter grideye_people_entered_total People who crossed the line from left to right.
left counter grideye_people_left_total People who crossed the line from right to left.";

/// `GET /healthz`: whether the store is readable and the last write succeeded, and what will need somebody soon. Needs
/// no token.
pub(crate) async fn alive(State(state): State<AppState>) -> Response {
    let version = env!("CARGO_PKG_VERSION");
    match state.store().ping().await {
        Ok(()) => {
            let usage = state.store().usage().await.ok();
            let warnings = warnings(&limits_used(&state, usage), usage);
            let body = json!({ "status": "ok", "version": version, "warnings": warnings });
            Json(body).into_response()
        }
        Err(error) => {
            let body = json!({ "status": status_name(&error), "version": version, "store": error.to_string() });
            (StatusCode::SERVICE_UNAVAILABLE, Json(body)).into_response()
        }
    }
}

/// Limits, how much of each is used, and how much may be.
type LimitsUsed = Vec<(&'static str, u64, u64)>;

fn limits_used(state: &AppState, usage: Option<StoreUsage>) -> LimitsUsed {
    let (shared, limits) = (&state.0, state.limits());
    let of = |number: usize| u64::try_from(number).unwrap_or(u64::MAX);
    let (connections, sensors) = (of(limits.connections_max), of(limits.sensors_max));
    let open = load(&shared.counters.connections_open);
    let mut used = vec![
        ("connections", open, connections),
        (
            "live_clients",
            of(shared.live_clients.held()),
            of(limits.live_clients_max),
        ),
        ("sensors", of(shared.live.sensors_count()), sensors),
        (
            "new_boots",
            shared.new_streams.most_taken(shared.clock.monotonic()),
            limits.new_streams_burst_max.into(),
        ),
    ];
    if let Some(usage) = usage {
        used.push(("recordings", usage.recordings, of(limits.recordings_max)));
        used.extend(
            usage
                .bytes_max
                .map(|most| ("store_bytes", usage.bytes, most)),
        );
    }
    used
}

/// Limits of which four fifths are used, and what may not be deleted.
fn warnings(used: &LimitsUsed, usage: Option<StoreUsage>) -> Vec<String> {
    let is_near = |(_, now, most): &&(_, u64, u64)| now.saturating_mul(5) >= most.saturating_mul(4);
    let near = used.iter().filter(is_near);
    let mut warnings: Vec<String> = near
        .map(|(what, now, most)| format!("{what}: {now} of at most {most}"))
        .collect();
    let held = usage.map_or(0, |usage| usage.held);
    if held > 0 {
        warnings.push(format!(
            "frames: {held} would be deleted by --keep-days or --keep-bytes, but belong to recordings"
        ));
    }
    warnings
}

/// `GET /v1/health`: all counters, without device names and secrets.
pub(crate) async fn health(State(state): State<AppState>) -> Response {
    let fault = state.store().ping().await.err();
    let usage = state.store().usage().await.ok();
    let (shared, limits) = (&state.0, state.limits());
    let now = shared.clock.monotonic();
    let status = fault.as_ref().map_or("ok", status_name);
    let body = json!({
        "status": status,
        "version": env!("CARGO_PKG_VERSION"),
        "uptime_s": now.saturating_sub(shared.started_at).as_secs(),
        "store": {
            "fault": fault.as_ref().map(ToString::to_string),
            "bytes": usage.map(|usage| usage.bytes),
            "bytes_max": usage.and_then(|usage| usage.bytes_max),
            "deleted_by_age": usage.map(|usage| usage.deleted_by_age),
            "deleted_by_size": usage.map(|usage| usage.deleted_by_size),
            "held_by_recordings": usage.map(|usage| usage.held),
        },
        "warnings": warnings(&limits_used(&state, usage), usage),
        "frames": {
            "stored": load(&shared.counters.frames_stored),
            "again": load(&shared.counters.frames_again),
        },
        "sensors": shared.live.sensors_count(),
        "live_clients": shared.live_clients.held(),
        "connections": {
            "open": load(&shared.counters.connections_open),
            "max": limits.connections_max,
            "displaced": load(&shared.counters.displaced),
            "turned_away": load(&shared.counters.turned_away),
            "tls_failed": load(&shared.counters.tls_failed),
        },
        "refused": shared.counters.refusals(),
        "access": {
            "asks_for_tokens": shared.authenticator.asks_for_tokens(now),
            "fault": shared.authenticator.fault(),
        },
    });
    let code = match fault {
        None => StatusCode::OK,
        Some(_) => StatusCode::SERVICE_UNAVAILABLE,
    };
    (code, Json(body)).into_response()
}

/// `GET /metrics`: the same and the sensors, in Prometheus' text format 0.0.4.
pub(crate) async fn metrics(State(state): State<AppState>) -> Response {
    let is_failing = state.store().ping().await.is_err();
    let usage = state.store().usage().await.ok();
    let mut text = Text::new();
    of_the_program(&mut text, &state);
    of_the_store(&mut text, is_failing, usage);
    let used = limits_used(&state, usage);
    let family = "gauge grideye_limit_used How much of a limit is in use. From four fifths on, /healthz warns.";
    begin(&mut text, family);
    for (limit, now, _) in &used {
        text.sample(&[("limit", limit)], now);
    }
    begin(&mut text, "gauge grideye_limit_max The limit.");
    for (limit, _, most) in &used {
        text.sample(&[("limit", limit)], most);
    }
    of_the_sensors(&mut text, &state.0.live.sensors_json());
    let headers = [(header::CONTENT_TYPE, CONTENT_TYPE)];
    (headers, text.into_string()).into_response()
}

/// `full` if someone must free space, `failing` for every other error.
fn status_name(error: &StoreError) -> &'static str {
    match error {
        StoreError::Full | StoreError::QuotaReached { .. } => "full",
        _ => "failing",
    }
}

fn of_the_program(text: &mut Text, state: &AppState) {
    let (shared, counters) = (&state.0, &state.0.counters);
    let now = shared.clock.monotonic();
    begin(text, "gauge grideye_build_info The program's version.");
    text.sample(&[("version", env!("CARGO_PKG_VERSION"))], 1);
    let uptime_s = now.saturating_sub(shared.started_at).as_secs();
    let family = "gauge grideye_uptime_seconds Seconds since the start.";
    one(text, family, uptime_s);
    let family = "counter grideye_http_requests_total Answers by class of status.";
    begin(text, family);
    let classes = ["1xx", "2xx", "3xx", "4xx", "5xx"];
    for (class, count) in classes.iter().zip(counters.by_class()) {
        text.sample(&[("class", class)], count);
    }
    text.histogram(
        "grideye_http_request_seconds",
        "Time from the headers to the beginning of the answer.",
        &TIME_CLASSES_S,
        &counters.by_time(),
        counters.time_s(),
    );
    let family = "counter grideye_refused_total Requests that were refused, by reason.";
    begin(text, family);
    for (code, count) in counters.refusals() {
        text.sample(&[("code", code)], count);
    }
    const OF_COUNTERS: &str = "\
counter grideye_frames_stored_total Frames that were new.
counter grideye_frames_again_total Frames that were there already.
gauge grideye_connections_open Connections open now.
counter grideye_connections_total Connections that were taken.
counter grideye_connections_displaced_total Connections that were closed to make room for a newer one.
counter grideye_connections_turned_away_total Connections above a limit.
counter grideye_tls_failed_total Connections that did not agree on TLS.";
    let of_counters = [
        &counters.frames_stored,
        &counters.frames_again,
        &counters.connections_open,
        &counters.connections,
        &counters.displaced,
        &counters.turned_away,
        &counters.tls_failed,
    ];
    for (family, counter) in OF_COUNTERS.lines().zip(of_counters) {
        one(text, family, load(counter));
    }
    let family = "gauge grideye_live_clients Pages that follow.";
    one(text, family, shared.live_clients.held());
    let family = "gauge grideye_asks_for_tokens 1 where a token is asked for.";
    let asks = shared.authenticator.asks_for_tokens(now);
    one(text, family, u8::from(asks));
}

fn one(text: &mut Text, family: &'static str, value: impl Display) {
    begin(text, family);
    text.sample(&[], value);
}

/// Begins the family with this kind, name and help.
fn begin(text: &mut Text, family: &'static str) {
    let (kind, family) = family.split_once(' ').unwrap_or_default();
    let (name, help) = family.split_once(' ').unwrap_or_default();
    match kind {
        "counter" => text.counter(name, help),
        _ => text.gauge(name, help),
    }
}

fn of_the_store(text: &mut Text, is_failing: bool, usage: Option<StoreUsage>) {
    let family =
        "gauge grideye_store_up 1 while the store can be read and its last write went well.";
    one(text, family, u8::from(!is_failing));
    let Some(usage) = usage else { return };
    let family = "gauge grideye_store_bytes Bytes that the store takes.";
    one(text, family, usage.bytes);
    let family = "counter grideye_frames_deleted_total Frames that were deleted because they were too old, or the store was too large.";
    begin(text, family);
    text.sample(&[("reason", "age")], usage.deleted_by_age);
    text.sample(&[("reason", "size")], usage.deleted_by_size);
    let family =
        "gauge grideye_frames_held Frames that would be deleted too, if no recording held them.";
    one(text, family, usage.held);
    if let Some(bytes_max) = usage.bytes_max {
        let family = "gauge grideye_store_bytes_max Bytes that the store may take.";
        one(text, family, bytes_max);
    }
}

/// Reads the output of `GET /v1/sensors`, so that the two cannot differ.
fn of_the_sensors(text: &mut Text, sensors: &Value) {
    let sensors = sensors["sensors"].as_array().map_or(&[][..], Vec::as_slice);
    for (key, family) in OF_SENSORS.lines().filter_map(|line| line.split_once(' ')) {
        begin(text, family);
        for sensor in sensors {
            let [device, name] = names(sensor);
            let labels = [("device", device), ("sensor", name)];
            match &sensor[key] {
                Value::Number(value) => text.sample(&labels, value),
                Value::Object(by_reason) => {
                    for (reason, count) in by_reason {
                        text.sample(&[labels[0], labels[1], ("reason", reason)], count);
                    }
                }
                _ => {}
            }
        }
    }
}

fn names(sensor: &Value) -> [&str; 2] {
    ["device", "sensor"].map(|key| sensor[key].as_str().unwrap_or_default())
}
