//! Reads request bodies within limits of time and size; also JSON objects with known fields.

use crate::http::refusal::Refusal;
use crate::http::state::AppState;
use crate::limits::Limits;
use axum::body::{Body, Bytes};
use axum::extract::Request;
use axum::http::{HeaderMap, StatusCode, header};
use grideye_recording::wire::JSON_TYPE;
use http_body_util::BodyExt as _;
use serde_json::{Map, Value};
use std::future::poll_fn;
use std::pin::pin;
use std::task::Poll;

/// Reads a small body that is one JSON object with only these fields, within limits of time and size.
pub(crate) async fn read_object(
    state: &AppState,
    request: Request,
    fields: &[&str],
    hint: &str,
) -> Result<Map<String, Value>, Refusal> {
    let limits = state.limits();
    check_is_json(request.headers())?;
    let body = request.into_body();
    let body = collect(body, limits.small_body_bytes_max, |_bytes| Ok(()));
    let body = in_body_time(limits, body).await?;
    object(&body, fields, hint)
}

/// The body, or a rejection because it comes too slowly.
pub(crate) async fn in_body_time(
    limits: &Limits,
    body: impl Future<Output = Result<Bytes, Refusal>>,
) -> Result<Bytes, Refusal> {
    let mut body = pin!(body);
    // Nearly every body arrives with its header, and needs no timer.
    let read = match poll_fn(|cx| Poll::Ready(body.as_mut().poll(cx))).await {
        Poll::Ready(read) => return read,
        Poll::Pending => tokio::time::timeout(limits.body_time_max, body).await,
    };
    read.unwrap_or_else(|_elapsed| {
        Err(Refusal::new(
            StatusCode::REQUEST_TIMEOUT,
            "body_too_slow",
            format!("the body did not come within {:?}", limits.body_time_max),
        ))
    })
}

/// Rejects a body announced as too large before it arrives.
pub(crate) fn check_announced(headers: &HeaderMap, bytes_max: usize) -> Result<(), Refusal> {
    let announced = headers
        .get(header::CONTENT_LENGTH)
        .and_then(|length| length.to_str().ok()?.parse::<usize>().ok());
    match announced {
        Some(length) if length > bytes_max => Err(too_large(bytes_max)),
        Some(_) | None => Ok(()),
    }
}

/// Another content type may mean another format; a missing one counts as JSON.
pub(crate) fn check_is_json(headers: &HeaderMap) -> Result<(), Refusal> {
    match essence(headers) {
        None => return Ok(()),
        Some(essence) if essence.eq_ignore_ascii_case(JSON_TYPE) => return Ok(()),
        Some(_other) => {}
    }
    let what = "the body must be JSON";
    Err(
        Refusal::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, "not_json", what)
            .field("content-type")
            .hint("send the header `content-type: application/json` (curl: --json)"),
    )
}

pub(crate) fn essence(headers: &HeaderMap) -> Option<&str> {
    let whole = headers.get(header::CONTENT_TYPE)?;
    let whole = whole.to_str().unwrap_or_default();
    Some(whole.split(';').next().unwrap_or_default().trim())
}

/// The whole body; `count` is called for each piece that arrives.
pub(crate) async fn collect(
    mut body: Body,
    bytes_max: usize,
    mut count: impl FnMut(usize) -> Result<(), Refusal>,
) -> Result<Bytes, Refusal> {
    // Nearly every body is one piece, which is not copied. Several pieces are copied into one buffer, because pieces of
    // one byte would take far more memory than they count.
    let (mut first, mut whole) = (Bytes::new(), Vec::new());
    while let Some(frame) = body.frame().await {
        let frame = frame.map_err(|error| {
            let what = format!("the body could not be read: {error}");
            Refusal::new(StatusCode::BAD_REQUEST, "body_cut", what)
        })?;
        let Ok(piece) = frame.into_data() else {
            continue;
        };
        if piece.len() > bytes_max - first.len().max(whole.len()) {
            return Err(too_large(bytes_max));
        }
        count(piece.len())?;
        if first.is_empty() {
            first = piece;
            continue;
        }
        if whole.is_empty() {
            whole.extend_from_slice(&first);
        }
        whole.extend_from_slice(&piece);
    }
    Ok(if whole.is_empty() {
        first
    } else {
        Bytes::from(whole)
    })
}

pub(crate) fn too_large(bytes_max: usize) -> Refusal {
    let what = format!("the body is larger than {bytes_max} bytes");
    Refusal::new(StatusCode::PAYLOAD_TOO_LARGE, "body_too_large", what)
        .hint("send less at once; nothing of this request was stored")
}

/// The body as an object that has only these fields. It nests at most 128 deep, which is the parser's limit.
fn object(body: &[u8], fields: &[&str], hint: &str) -> Result<Map<String, Value>, Refusal> {
    let json: Value = serde_json::from_slice(body).map_err(|error| {
        let what = format!("the body is not JSON: {error}");
        let refusal = Refusal::new(StatusCode::BAD_REQUEST, "not_json", what);
        refusal.field("body").hint(hint)
    })?;
    let names = fields.join(", ");
    let Value::Object(object) = json else {
        let what = format!("expected an object with {names}");
        let field = fields.first().copied().unwrap_or("body");
        return Err(Refusal::wrong_value(field, what, hint));
    };
    let Some(unknown) = object.keys().find(|key| !fields.contains(&key.as_str())) else {
        return Ok(object);
    };
    let shown: String = unknown.chars().take(64).collect();
    let what = format!("unknown field {shown:?}; expected only {names}");
    Err(Refusal::wrong_value(shown, what, hint))
}
