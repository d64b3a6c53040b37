//! Labels of recordings, over HTTP.

use crate::http::body::read_object;
use crate::http::recordings::fields::{check_text, csv_headers, not_written, parse_id, text_of};
use crate::http::refusal::Refusal;
use crate::http::state::AppState;
use crate::limits::Limits;
use crate::live::Event;
use crate::store::{KeptLabel, Label, LabelSpan, Members, RecordingId};
use axum::extract::{Path, Request, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Json, Response};
use grideye_recording::labels::{LabeledFrames, to_csv};
use serde::Deserialize as _;
use serde_json::{Map, Value, json};

const HINT: &str = r#"send {"name": "two people", "spans": [{"device": "pi-1", "sensor": "i2c-1:0x69", "boot": "b1", "first_seq": 10, "last_seq": 25}]}"#;

pub(crate) async fn list(
    State(state): State<AppState>,
    Path(id): Path<String>,
) -> Result<Json<Value>, Refusal> {
    let labels = state.store().labels(parse_id(&id)?).await?;
    Ok(Json(json!({ "labels": labels })))
}

pub(crate) async fn add(
    State(state): State<AppState>,
    Path(id): Path<String>,
    request: Request,
) -> Result<Response, Refusal> {
    let id = parse_id(&id)?;
    let fields = read_object(&state, request, &["name", "spans"], HINT).await?;
    let label = label_in(&fields, state.limits())?;
    let members = state.store().members(id).await?;
    for (index, span) in label.spans.iter().enumerate() {
        check_span(index, span, &members)?;
    }
    let label = state.store().add_label(id, label).await?;
    tell(&state, id);
    let place = format!("/v1/recordings/{id}/labels/{}", label.number);
    let place = [(header::LOCATION, place)];
    Ok((StatusCode::CREATED, place, Json(json!(label))).into_response())
}

pub(crate) async fn remove(
    State(state): State<AppState>,
    Path((id, number)): Path<(String, String)>,
) -> Result<StatusCode, Refusal> {
    let id = parse_id(&id)?;
    let number = number.parse().map_err(|_not_a_number| {
        let what = "labels are known by number";
        Refusal::new(StatusCode::NOT_FOUND, "no_such_label", what)
            .hint(format!("GET /v1/recordings/{id}/labels lists them"))
    })?;
    state.store().remove_label(id, number).await?;
    tell(&state, id);
    Ok(StatusCode::NO_CONTENT)
}

pub(crate) async fn csv(
    State(state): State<AppState>,
    Path(id): Path<String>,
) -> Result<Response, Refusal> {
    let id = parse_id(&id)?;
    let recording = state.store().members(id).await?.recording;
    let labels = state.store().labels(id).await?;
    let text = to_csv(labels.iter().flat_map(ranges)).map_err(not_written)?;
    Ok((csv_headers(&recording.name, "labels.csv"), text).into_response())
}

fn ranges(kept: &KeptLabel) -> impl Iterator<Item = LabeledFrames<'_>> {
    kept.label.spans.iter().map(|span| LabeledFrames {
        number: kept.number,
        label: &kept.label.name,
        device: &span.device,
        sensor: &span.sensor,
        boot: &span.boot,
        first_seq: span.first_seq,
        last_seq: span.last_seq,
    })
}

/// Makes pages that play the recording reload its labels.
fn tell(state: &AppState, id: RecordingId) {
    let changed = json!({ "recording": id.0 });
    state.0.live.tell(Event::new("labels", &changed));
}

/// The label in the body; does not check that its frames exist.
fn label_in(fields: &Map<String, Value>, limits: &Limits) -> Result<Label, Refusal> {
    let name = text_of(fields, "name", HINT)?;
    if name.is_empty() {
        return Err(Refusal::wrong_value("name", "a label needs a name", HINT));
    }
    check_text("name", &name, limits.label_name_chars_max)
        .map_err(|what| Refusal::wrong_value("name", what, HINT))?;
    let spans = fields.get("spans").and_then(Value::as_array);
    let spans =
        spans.ok_or_else(|| Refusal::wrong_value("spans", "expected spans to be a list", HINT))?;
    if spans.is_empty() || spans.len() > limits.label_spans_max {
        let (found, most) = (spans.len(), limits.label_spans_max);
        let what = format!("a label has 1 to {most} spans, found {found}");
        return Err(Refusal::wrong_value("spans", what, HINT));
    }
    let spans = spans.iter().enumerate().map(|(index, span)| {
        let read = LabelSpan::deserialize(span);
        read.map_err(|error| Refusal::wrong_value(span_at(index), error.to_string(), HINT))
    });
    Ok(Label {
        name,
        spans: spans.collect::<Result<_, _>>()?,
    })
}

/// A label may cover only numbers that the recording spans, including missing frames.
fn check_span(index: usize, span: &LabelSpan, members: &Members) -> Result<(), Refusal> {
    let wrong = |what: String| Refusal::wrong_value(span_at(index), what, HINT);
    let (first, last) = (span.first_seq, span.last_seq);
    if first > last {
        return Err(wrong(format!("first_seq {first} is after last_seq {last}")));
    }
    let id = members.recording.id;
    let found = members.spans.iter().find(|member| {
        let stream = &member.stream;
        (&stream.device, &stream.sensor, &stream.boot) == (&span.device, &span.sensor, &span.boot)
    });
    let Some(member) = found else {
        return Err(wrong(format!(
            "recording {id} has no frames of sensor {} of {}, boot {}",
            span.sensor, span.device, span.boot
        )));
    };
    let (from, to) = member.seqs();
    if first < from || last > to {
        return Err(wrong(format!(
            "recording {id} has frames {from} to {to} of this sensor, which do not include all of {first} to {last}"
        )));
    }
    Ok(())
}

fn span_at(index: usize) -> String {
    format!("spans[{index}]")
}
