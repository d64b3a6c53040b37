//! What the requests about recordings have in common: numbers and texts.

use crate::http::refusal::Refusal;
use crate::store::RecordingId;
use axum::http::StatusCode;
use serde_json::{Map, Value};
pub(super) fn parse_id(text: &str) -> Result<RecordingId, Refusal> {
    text.parse().map_err(|_not_a_number| {
        Refusal::new(
            StatusCode::NOT_FOUND,
            "no_such_recording",
            "recordings are known by number",
        )
        .hint("GET /v1/recordings lists them")
    })
}

/// The text of a field, without white space around it.
pub(super) fn text_of(
    fields: &Map<String, Value>,
    field: &'static str,
    hint: &str,
) -> Result<String, Refusal> {
    let text = fields.get(field).and_then(Value::as_str);
    let text =
        text.ok_or_else(|| wrong_value(field, format!("expected {field} to be a string"), hint))?;
    Ok(text.trim().to_owned())
}

pub(super) fn wrong_value(field: impl Into<String>, what: String, hint: &str) -> Refusal {
    Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, "wrong_value", what)
        .field(field)
        .hint(hint)
}
