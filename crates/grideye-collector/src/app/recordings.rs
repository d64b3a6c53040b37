//! Recordings: start, stop, list, download.

use super::AppState;
use super::answer::Refusal;
use super::ingest::read_json_body;
use crate::live::Event;
use crate::store::{FrameStore, Members, Recording, RecordingId, Span, StoreError};
use axum::body::{Body, Bytes};
use axum::extract::{Path, Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Json, Response};
use grideye_recording::csv::{Row, STREAMS_MAX, Writer};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

/// Pages of a download that are ready before the peer takes them.
const PAGES_READY_MAX: usize = 2;

/// `POST /v1/recordings`.
pub(super) async fn start(
    State(state): State<AppState>,
    request: Request,
) -> Result<Response, Refusal> {
    let limits = state.limits();
    let body = read_json_body(&state, request, limits.small_body_bytes_max).await?;
    let name = name_in(&body, limits.recording_name_chars_max)?;
    let recording = state
        .store()
        .start_recording(name, state.0.clock.utc_ns())
        .await?;
    state.0.live.tell(Event::new("recordings", &json!({})));
    let place = format!("/v1/recordings/{}", recording.id);
    Ok((
        StatusCode::CREATED,
        [(header::LOCATION, place)],
        Json(recording_json(&recording)),
    )
        .into_response())
}

/// `POST /v1/recordings/{id}/stop`.
pub(super) async fn stop(
    State(state): State<AppState>,
    Path(id): Path<String>,
) -> Result<Json<Value>, Refusal> {
    let id = parse_id(&id)?;
    let recording = state
        .store()
        .stop_recording(id, state.0.clock.utc_ns())
        .await?;
    state.0.live.tell(Event::new("recordings", &json!({})));
    Ok(Json(recording_json(&recording)))
}

/// `GET /v1/recordings`.
pub(super) async fn list(State(state): State<AppState>) -> Result<Json<Value>, Refusal> {
    let recordings = state.store().recordings().await?;
    let recordings: Vec<Value> = recordings.iter().map(recording_json).collect();
    Ok(Json(json!({ "recordings": recordings })))
}

/// `GET /v1/recordings/{id}` and `GET /v1/recordings/{id}.csv`.
pub(super) async fn one(
    State(state): State<AppState>,
    Path(file): Path<String>,
) -> Result<Response, Refusal> {
    let (id, as_csv) = match file.strip_suffix(".csv") {
        Some(id) => (parse_id(id)?, true),
        None => (parse_id(&file)?, false),
    };
    let members = state.store().members(id).await?;
    if !as_csv {
        return Ok(Json(recording_json(&members.recording)).into_response());
    }
    if members.spans.len() > STREAMS_MAX {
        let what =
            format!("recording {id} holds more than {STREAMS_MAX} streams, too many for one file");
        return Err(Refusal::new(
            StatusCode::UNPROCESSABLE_ENTITY,
            "too_many_streams",
            what,
        ));
    }
    let disposition = attachment(&members.recording.name);
    let (pages, ready) = mpsc::channel(PAGES_READY_MAX);
    tokio::spawn(download(state, members, pages));
    let headers = [
        (
            header::CONTENT_TYPE,
            HeaderValue::from_static("text/csv; charset=utf-8; header=present"),
        ),
        (header::CONTENT_DISPOSITION, disposition),
    ];
    Ok((headers, Body::from_stream(ReceiverStream::new(ready))).into_response())
}

fn recording_json(recording: &Recording) -> Value {
    json!({
        "id": recording.id.0,
        "name": recording.name,
        "running": recording.t_stop_ns.is_none(),
        "t_start_ns": recording.t_start_ns,
        "t_stop_ns": recording.t_stop_ns,
        "frames": recording.frames,
        "missing": recording.missing,
        "sensors": recording.sensors,
        "csv": format!("/v1/recordings/{}.csv", recording.id),
    })
}

fn parse_id(text: &str) -> Result<RecordingId, Refusal> {
    text.parse().map_err(|_not_a_number| {
        Refusal::new(
            StatusCode::NOT_FOUND,
            "no_such_recording",
            "recordings are known by number",
        )
        .hint("GET /v1/recordings lists them")
    })
}

/// The name in `{"name": "..."}`, and nothing beside it.
fn name_in(body: &Bytes, chars_max: usize) -> Result<String, Refusal> {
    let wrong = |what: String| {
        Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, "wrong_value", what)
            .field("name")
            .hint(r#"send {"name": "kitchen, evening"}"#)
    };
    let json: Value = serde_json::from_slice(body).map_err(|error| {
        Refusal::new(
            StatusCode::BAD_REQUEST,
            "not_json",
            format!("the body is not JSON: {error}"),
        )
        .field("body")
        .hint(r#"send {"name": "kitchen, evening"}"#)
    })?;
    let fields = json
        .as_object()
        .ok_or_else(|| wrong("expected an object with a name".to_owned()))?;
    if let Some(unknown) = fields.keys().find(|field| *field != "name") {
        return Err(wrong(format!("unknown field {unknown:?}; expected only name")).field(unknown));
    }
    let name = fields.get("name").and_then(Value::as_str);
    let name = name
        .ok_or_else(|| wrong("expected name to be a string".to_owned()))?
        .trim();
    check_name(name, chars_max).map_err(wrong)?;
    Ok(name.to_owned())
}

/// A recording's name becomes a file's name.
fn check_name(name: &str, chars_max: usize) -> Result<(), String> {
    if name.is_empty() {
        return Err("a recording needs a name".to_owned());
    }
    let chars = name.chars().count();
    if chars > chars_max {
        return Err(format!(
            "the name has {chars} characters, and {chars_max} are allowed"
        ));
    }
    if name.starts_with('.') {
        return Err("the name may not begin with a full stop".to_owned());
    }
    match name
        .chars()
        .find(|character| character.is_control() || r#"/\:*?"<>|"#.contains(*character))
    {
        Some(character) => Err(format!(
            "the name may not contain {character:?}, which no file name should"
        )),
        None => Ok(()),
    }
}

/// RFC 6266: a plain name for old programs, the exact one for the others.
fn attachment(name: &str) -> HeaderValue {
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
    let disposition =
        format!(r#"attachment; filename="{plain}.csv"; filename*=UTF-8''{exact}.csv"#);
    HeaderValue::from_str(&disposition).unwrap_or(HeaderValue::from_static("attachment"))
}

type Pages = mpsc::Sender<io::Result<Bytes>>;

/// Sends a recording page by page; an error cuts the transfer, so that nobody takes a part for the whole.
async fn download(state: AppState, members: Members, pages: Pages) {
    let mut stopping = state.0.stopping.subscribe();
    let written = tokio::select! {
        written = write_pages(&state, members, &pages) => written,
        _ = stopping.wait_for(|stopping| *stopping) => Err(io::Error::other("the collector is stopping")),
    };
    if let Err(error) = written {
        // The one who asked may have gone.
        let _ = pages.send(Err(error)).await;
    }
}

async fn write_pages(state: &AppState, members: Members, pages: &Pages) -> io::Result<()> {
    let text = PageBuffer::default();
    let mut writer = Writer::new(text.clone()).map_err(io::Error::other)?;
    for span in members.spans {
        let mut after_seq = None;
        while let Some(last) = write_page(state, &span, after_seq, &mut writer).await? {
            after_seq = Some(last);
            send(pages, text.take()).await?;
        }
    }
    writer.finish().map_err(io::Error::other)?;
    send(pages, text.take()).await
}

/// Writes the next page of a span, and answers its last sequence number; `None` after the end.
async fn write_page(
    state: &AppState,
    span: &Span,
    after_seq: Option<u64>,
    writer: &mut Writer<PageBuffer>,
) -> io::Result<Option<u64>> {
    let page = next_page(state.store(), span, after_seq, state.limits().page_rows).await;
    let page = page.map_err(io::Error::other)?;
    for row in &page {
        writer.write(row).map_err(io::Error::other)?;
    }
    Ok(page.last().map(|row| row.record.seq))
}

async fn next_page(
    store: &dyn FrameStore,
    span: &Span,
    after_seq: Option<u64>,
    rows: usize,
) -> Result<Vec<Row>, StoreError> {
    let stored = store.page(span.clone(), after_seq, rows.max(1)).await?;
    let rows = stored.into_iter().map(|stored| Row {
        stream: (*stored.stream).clone(),
        record: stored.record,
        t_arrival_ns: Some(stored.t_arrival_ns),
    });
    Ok(rows.collect())
}

async fn send(pages: &Pages, page: Vec<u8>) -> io::Result<()> {
    if page.is_empty() {
        return Ok(());
    }
    let sent = pages.send(Ok(page.into())).await;
    sent.map_err(|_gone| io::Error::from(io::ErrorKind::BrokenPipe))
}

/// What the writer writes into, and the download takes from.
#[derive(Debug, Clone, Default)]
struct PageBuffer(Arc<Mutex<Vec<u8>>>);

impl PageBuffer {
    fn take(&self) -> Vec<u8> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl io::Write for PageBuffer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut page = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        page.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
