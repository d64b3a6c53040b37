//! Handlers that start, stop, annotate, list and return recordings.

use crate::http::body::read_object;
use crate::http::recordings::fields::{check_text, parse_id, text_of};
use crate::http::recordings::{csv, frames};
use crate::http::refusal::Refusal;
use crate::http::state::AppState;
use crate::live::Event;
use crate::store::Recording;
use axum::extract::{Path, Request, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Json, Response};
use serde_json::{Value, json};

const HINT: &str = r#"send {"name": "kitchen, evening"}"#;
const NOTE_HINT: &str = r#"send {"note": "two people, window open"}, or {"note": ""} for none"#;

pub(crate) async fn start(
    State(state): State<AppState>,
    request: Request,
) -> Result<Response, Refusal> {
    let name = text_in(&state, request, "name", HINT).await?;
    check_name(&name, state.limits().recording_name_chars_max)
        .map_err(|what| Refusal::wrong_value("name", what, HINT))?;
    let now_ns = state.0.clock.utc_ns();
    let recording = state.store().start_recording(name, now_ns).await?;
    let place = [(header::LOCATION, format!("/v1/recordings/{}", recording.id))];
    let told = tell(&state, &recording);
    Ok((StatusCode::CREATED, place, told).into_response())
}

pub(crate) async fn stop(
    State(state): State<AppState>,
    Path(id): Path<String>,
) -> Result<Json<Value>, Refusal> {
    let id = parse_id(&id)?;
    let now_ns = state.0.clock.utc_ns();
    let recording = state.store().stop_recording(id, now_ns).await?;
    Ok(tell(&state, &recording))
}

/// `POST /v1/recordings/{id}/renew`: from now on the recording ends by itself if it is not renewed in time.
pub(crate) async fn renew(
    State(state): State<AppState>,
    Path(id): Path<String>,
) -> Result<Json<Value>, Refusal> {
    state.store().renew_recording(parse_id(&id)?).await?;
    let lease_s = state.limits().recording_lease.as_secs();
    Ok(Json(json!({ "lease_s": lease_s })))
}

pub(crate) async fn delete(
    State(state): State<AppState>,
    Path(id): Path<String>,
) -> Result<StatusCode, Refusal> {
    state.store().delete_recording(parse_id(&id)?).await?;
    state.0.live.tell(Event::new("recordings", &json!({})));
    Ok(StatusCode::NO_CONTENT)
}

pub(crate) async fn list(State(state): State<AppState>) -> Result<Json<Value>, Refusal> {
    let recordings = state.store().recordings().await?;
    let recordings: Vec<Value> = recordings.iter().map(recording_json).collect();
    Ok(Json(json!({ "recordings": recordings })))
}

pub(crate) async fn note(
    State(state): State<AppState>,
    Path(id): Path<String>,
    request: Request,
) -> Result<Json<Value>, Refusal> {
    let id = parse_id(&id)?;
    let note = text_in(&state, request, "note", NOTE_HINT).await?;
    check_text("note", &note, state.limits().recording_note_chars_max)
        .map_err(|what| Refusal::wrong_value("note", what, NOTE_HINT))?;
    let recording = state.store().note_recording(id, note).await?;
    Ok(tell(&state, &recording))
}

/// Returns the recording to the caller, and tells all pages that one changed.
fn tell(state: &AppState, recording: &Recording) -> Json<Value> {
    state.0.live.tell(Event::new("recordings", &json!({})));
    Json(recording_json(recording))
}

/// `GET /v1/recordings/{id}`, `/v1/recordings/{id}.csv` and `/v1/recordings/{id}.frames`.
pub(crate) async fn one(
    State(state): State<AppState>,
    Path(file): Path<String>,
) -> Result<Response, Refusal> {
    let (id, form) = match file.rsplit_once('.') {
        Some((id, form @ ("csv" | "frames"))) => (id, form),
        _ => (file.as_str(), ""),
    };
    let members = state.store().members(parse_id(id)?).await?;
    match form {
        "csv" => csv::answer(state, members),
        "frames" => frames::answer(state, members),
        _ => Ok(Json(recording_json(&members.recording)).into_response()),
    }
}

fn recording_json(recording: &Recording) -> Value {
    json!({
        "id": recording.id.0,
        "name": recording.name,
        "note": recording.note,
        "running": recording.t_stop_ns.is_none(),
        "t_start_ns": recording.t_start_ns,
        "t_stop_ns": recording.t_stop_ns,
        "frames": recording.frames,
        "missing": recording.missing,
        "sensors": recording.sensors,
        "csv": format!("/v1/recordings/{}.csv", recording.id),
    })
}

/// The text of the body's only field, trimmed.
async fn text_in(
    state: &AppState,
    request: Request,
    field: &'static str,
    hint: &str,
) -> Result<String, Refusal> {
    let fields = read_object(state, request, &[field], hint).await?;
    text_of(&fields, field, hint)
}

/// A recording's name becomes a file name.
fn check_name(name: &str, chars_max: usize) -> Result<(), String> {
    if name.is_empty() {
        return Err("a recording needs a name".to_owned());
    }
    if name.starts_with('.') {
        return Err("the name may not begin with a full stop".to_owned());
    }
    if let Some(character) = name.chars().find(|it| r#"/\:*?"<>|"#.contains(*it)) {
        return Err(format!(
            "the name may not contain {character:?}, because it becomes a file name"
        ));
    }
    check_text("name", name, chars_max)
}
