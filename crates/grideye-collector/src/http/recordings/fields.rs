//! What the requests about recordings have in common: numbers, texts, and what a file is called.

use crate::http::refusal::Refusal;
use crate::store::RecordingId;
use axum::http::{HeaderValue, StatusCode};
use serde_json::{Map, Value};
use std::fmt::Write as _;

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

/// The header `content-disposition`: a plain name for old programs, the exact one for the others (RFC 6266).
#[must_use]
pub fn attachment(name: &str, extension: &str) -> HeaderValue {
    let plain: String = name
        .chars()
        .map(|character| {
            if matches!(character, ' '..='~') && character != '%' {
                character
            } else {
                '_'
            }
        })
        .collect();
    let mut exact = String::new();
    for byte in name.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
            exact.push(char::from(byte));
        } else {
            let _ = write!(exact, "%{byte:02X}");
        }
    }
    let disposition = format!(
        r#"attachment; filename="{plain}.{extension}"; filename*=UTF-8''{exact}.{extension}"#
    );
    HeaderValue::from_str(&disposition).unwrap_or(HeaderValue::from_static("attachment"))
}
