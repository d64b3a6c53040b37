//! How the collector does: for supervisors, for programs, and for Prometheus.

use crate::counters::{TIME_CLASSES_S, load};
use crate::http::state::AppState;
use crate::store::{StoreError, StoreUsage};
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Json, Response};
use grideye_recording::prometheus::{CONTENT_TYPE, Text};
use serde_json::{Value, json};

/// Of each sensor: its key in `GET /v1/sensors`, the family, and what it says.
type Families<const N: usize> = [(&'static str, &'static str, &'static str); N];

const NUMBERS: Families<5> = [
    (
        "age_s",
        "grideye_sensor_age_seconds",
        "Age of the newest row.",
    ),
    ("rate_hz", "grideye_sensor_rate_hertz", "Frames a second."),
    (
        "spooled",
        "grideye_sensor_spooled_frames",
        "Frames that the agent holds.",
    ),
    (
        "unaccounted",
        "grideye_sensor_unaccounted_frames",
        "Frames that are nowhere.",
    ),
    (
        "never_came",
        "grideye_sensor_never_came_frames",
        "Numbers that never came, in this boot.",
    ),
];
const COUNTS: Families<3> = [
    (
        "read",
        "grideye_sensor_read_total",
        "Frames that the agent read, in this boot.",
    ),
    (
        "stored",
        "grideye_sensor_stored_total",
        "Frames kept, in this boot.",
    ),
    (
        "missing",
        "grideye_sensor_missing_total",
        "Rows without a frame, in this boot.",
    ),
];
const BY_REASON: Families<2> = [
    (
        "dropped",
        "grideye_sensor_dropped_total",
        "Frames that the agent gave up.",
    ),
    (
        "errors",
        "grideye_sensor_errors_total",
        "Errors of the bus and the sensor.",
    ),
];

/// `GET /healthz`: whether the store can be read and its last write went well. Needs no token and tells nothing else.
pub(crate) async fn alive(State(state): State<AppState>) -> Response {
    let version = env!("CARGO_PKG_VERSION");
    match state.store().ping().await {
        Ok(()) => Json(json!({ "status": "ok", "version": version })).into_response(),
        Err(error) => {
            let body = json!({ "status": status_name(&error), "version": version, "store": error.to_string() });
            (StatusCode::SERVICE_UNAVAILABLE, Json(body)).into_response()
        }
    }
}

/// `GET /v1/health`: everything that is counted, without names of devices and without secrets.
pub(crate) async fn health(State(state): State<AppState>) -> Response {
    let fault = state.store().ping().await.err();
    let usage = state.store().usage().await;
    let (shared, limits) = (&state.0, state.limits());
    let now = shared.clock.monotonic();
    let status = fault.as_ref().map_or("ok", status_name);
    let body = json!({
        "status": status,
        "version": env!("CARGO_PKG_VERSION"),
        "uptime_s": now.saturating_sub(shared.started_at).as_secs(),
        "store": {
            "fault": fault.as_ref().map(ToString::to_string),
            "bytes": usage.as_ref().ok().map(|usage| usage.bytes),
            "bytes_max": usage.as_ref().ok().and_then(|usage| usage.bytes_max),
            "deleted_by_age": usage.as_ref().ok().map(|usage| usage.deleted_by_age),
            "deleted_by_size": usage.as_ref().ok().map(|usage| usage.deleted_by_size),
        },
        "frames": {
            "stored": load(&shared.counters.frames_stored),
            "again": load(&shared.counters.frames_again),
        },
        "sensors": shared.live.sensors_count(),
        "live_clients": live_clients(&state),
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
    of_the_sensors(&mut text, &state.0.live.sensors_json());
    let headers = [(header::CONTENT_TYPE, CONTENT_TYPE)];
    (headers, text.into_string()).into_response()
}

/// `full` where somebody has to make room, `failing` for every other fault.
fn status_name(error: &StoreError) -> &'static str {
    match error {
        StoreError::Full | StoreError::QuotaReached { .. } => "full",
        _ => "failing",
    }
}

fn live_clients(state: &AppState) -> usize {
    let free = state.0.live_clients.available_permits();
    state.limits().live_clients_max.saturating_sub(free)
}

fn of_the_program(text: &mut Text, state: &AppState) {
    let (shared, counters) = (&state.0, &state.0.counters);
    let now = shared.clock.monotonic();
    text.gauge("grideye_build_info", "The program's version.");
    text.sample(&[("version", env!("CARGO_PKG_VERSION"))], 1);
    text.gauge("grideye_uptime_seconds", "Seconds since the start.");
    text.sample(&[], now.saturating_sub(shared.started_at).as_secs());
    text.counter("grideye_http_requests_total", "Answers by class of status.");
    for (class, count) in ["1xx", "2xx", "3xx", "4xx", "5xx"]
        .iter()
        .zip(counters.by_class())
    {
        text.sample(&[("class", class)], count);
    }
    text.histogram(
        "grideye_http_request_seconds",
        "Time from the headers to the beginning of the answer.",
        &TIME_CLASSES_S,
        &counters.by_time(),
        counters.time_s(),
    );
    text.counter(
        "grideye_refused_total",
        "Requests that were refused, by reason.",
    );
    for (code, count) in counters.refusals() {
        text.sample(&[("code", code)], count);
    }
    text.counter("grideye_frames_stored_total", "Frames that were new.");
    text.sample(&[], load(&counters.frames_stored));
    text.counter(
        "grideye_frames_again_total",
        "Frames that were there already.",
    );
    text.sample(&[], load(&counters.frames_again));
    text.gauge("grideye_connections_open", "Connections open now.");
    text.sample(&[], load(&counters.connections_open));
    text.counter("grideye_connections_total", "Connections that were taken.");
    text.sample(&[], load(&counters.connections));
    text.counter(
        "grideye_connections_displaced_total",
        "Connections that were closed to make room for a newer one.",
    );
    text.sample(&[], load(&counters.displaced));
    text.counter(
        "grideye_connections_turned_away_total",
        "Connections above a limit.",
    );
    text.sample(&[], load(&counters.turned_away));
    text.counter(
        "grideye_tls_failed_total",
        "Connections that did not agree on TLS.",
    );
    text.sample(&[], load(&counters.tls_failed));
    text.gauge("grideye_live_clients", "Pages that follow.");
    text.sample(&[], live_clients(state));
    text.gauge("grideye_asks_for_tokens", "1 where a token is asked for.");
    text.sample(&[], u8::from(shared.authenticator.asks_for_tokens(now)));
}

fn of_the_store(text: &mut Text, is_failing: bool, usage: Option<StoreUsage>) {
    text.gauge(
        "grideye_store_up",
        "1 while the store can be read and its last write went well.",
    );
    text.sample(&[], u8::from(!is_failing));
    let Some(usage) = usage else { return };
    text.gauge("grideye_store_bytes", "Bytes that the store takes.");
    text.sample(&[], usage.bytes);
    text.counter(
        "grideye_frames_deleted_total",
        "Frames that were deleted because they were too old, or the store was too large.",
    );
    text.sample(&[("reason", "age")], usage.deleted_by_age);
    text.sample(&[("reason", "size")], usage.deleted_by_size);
    if let Some(bytes_max) = usage.bytes_max {
        text.gauge("grideye_store_bytes_max", "Bytes that the store may take.");
        text.sample(&[], bytes_max);
    }
}

/// From what `GET /v1/sensors` answers, so that the two cannot differ.
fn of_the_sensors(text: &mut Text, sensors: &Value) {
    let sensors = sensors["sensors"].as_array().map_or(&[][..], Vec::as_slice);
    for (key, name, help) in NUMBERS {
        text.gauge(name, help);
        numbers(text, sensors, key);
    }
    for (key, name, help) in COUNTS {
        text.counter(name, help);
        numbers(text, sensors, key);
    }
    for (key, name, help) in BY_REASON {
        text.counter(name, help);
        for sensor in sensors {
            let [device, name] = names(sensor);
            let reasons = sensor[key].as_object().into_iter().flatten();
            for (reason, count) in reasons {
                let labels = [("device", device), ("sensor", name), ("reason", reason)];
                text.sample(&labels, count);
            }
        }
    }
}

/// One sample for each sensor that has this number.
fn numbers(text: &mut Text, sensors: &[Value], key: &str) {
    for sensor in sensors {
        let [device, name] = names(sensor);
        if let Some(value) = sensor[key].as_number() {
            text.sample(&[("device", device), ("sensor", name)], value);
        }
    }
}

fn names(sensor: &Value) -> [&str; 2] {
    ["device", "sensor"].map(|key| sensor[key].as_str().unwrap_or_default())
}
