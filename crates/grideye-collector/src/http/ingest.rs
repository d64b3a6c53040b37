//! `POST /v1/frames`: taken whole or not at all, and answered after it is on disk.

use crate::alarm::Alarm;
use crate::auth::Caller;
use crate::connections::Connection;
use crate::counters::{Counters, add};
use crate::http::authorize::{Asked, Line, Need, check_device};
use crate::http::bodies::Room;
use crate::http::body::{check_announced, check_is_json, collect, essence, in_body_time};
use crate::http::headers::OF_NO_PAGE;
use crate::http::middleware::Passing;
use crate::http::refusal::Refusal;
use crate::http::state::AppState;
use crate::log::{Level, LogEvent};
use crate::router::Answer;
use crate::store::Appended;
use axum::BoxError;
use axum::body::{Body, Bytes, HttpBody};
use axum::extract::{Request, State};
use axum::http::{self, HeaderMap, StatusCode};
use axum::response::{IntoResponse as _, Response};
use grideye_recording::wire::{self, BINARY_TYPE, BINARY_TYPE_PLAIN, Batch, WireError};
use http_body_util::{Either, Full};
use hyper::body::Incoming;
use std::pin::pin;
use std::sync::Arc;

/// Answers, and passes the guard by itself: on the way through the router, which looks for the route and boxes every layer,
/// a post costs an eighth more.
pub(crate) async fn guarded_frames(
    state: &AppState,
    line: Line,
    alarm: &Alarm,
    connection: &Connection,
    request: http::Request<Incoming>,
) -> Answer {
    let (parts, body) = request.into_parts();
    let asked = Asked {
        line,
        method: &parts.method,
        uri: &parts.uri,
        headers: &parts.headers,
    };
    let passing = Passing::of(state, line, Some(connection));
    let caller = match passing.admit(Need::Ingest, asked) {
        Err(refusal) => return passing.finish(*refusal).map(Either::Right),
        Ok(caller) => caller,
    };
    // Held here and lent on: every function that took it would have room for it of its own.
    let room = state.0.bodies.room(caller.as_ref(), line.peer);
    let taken = pin!(take(state, caller.as_ref(), &parts.headers, body, room));
    match passing.in_time(alarm, taken).await {
        Ok(Ok(acknowledgement)) => passing
            .finish(acknowledge(acknowledgement))
            .map(Either::Left),
        Ok(Err(refusal)) | Err(refusal) => {
            passing.finish(refusal.into_response()).map(Either::Right)
        }
    }
}

pub(crate) async fn frames(
    State(state): State<AppState>,
    request: Request,
) -> Result<Response, Refusal> {
    let line = Line::of(&request);
    let (parts, body) = request.into_parts();
    let caller = parts.extensions.get();
    let room = state.0.bodies.room(caller, line.peer);
    let taken = take(&state, caller, &parts.headers, body, room).await?;
    Ok(acknowledge(taken).map(Body::new))
}

/// The answer to a post that was taken. No browser shows it: it is spared the page's headers, ten times as long as what it
/// says.
fn acknowledge(acknowledgement: Vec<u8>) -> Response<Full<Bytes>> {
    let mut response = Response::new(Full::from(acknowledgement));
    response.headers_mut().clone_from(&OF_NO_PAGE);
    response
}

/// Takes a batch, and gives what is acknowledged of it, as JSON.
async fn take<B>(
    state: &AppState,
    caller: Option<&Caller>,
    headers: &HeaderMap,
    body: B,
    mut room: Room<'_>,
) -> Result<Vec<u8>, Refusal>
where
    B: HttpBody<Data = Bytes, Error: Into<BoxError>>,
{
    let form = Form::of(headers)?;
    let shared = &state.0;
    let bytes_max = shared.limits.body_bytes_max;
    check_announced(headers, bytes_max)?;
    let body = collect(body, bytes_max, |bytes| room.grow(bytes));
    let body = in_body_time(&shared.limits, body).await?;
    let (batch, compact) = form.read(body, &shared.limits.batch)?;
    check_device(caller, &batch.device)?;
    if !shared.live.has_room_for(&batch) {
        return Err(too_many_sensors(shared.limits.sensors_max));
    }
    let t_arrival_ns = shared.clock.utc_ns();
    let now = shared.clock.monotonic();
    if let Some(step_ns) = shared.wall_steps.look(t_arrival_ns, now) {
        let event = LogEvent::new(Level::Warning, "clock_stepped");
        let event = event.with("by_s", step_ns / 1_000_000_000);
        shared.seldom.say("", now, event);
    }
    let (store, kept) = (&shared.store, Arc::clone(&batch));
    let appended = match compact {
        Some(compact) => store.append_compact(kept, compact, t_arrival_ns),
        None => store.append(kept, t_arrival_ns),
    };
    let appended = appended.await?;
    // Held until here: a batch that waits for the disk takes memory as its body did.
    drop(room);
    let answer = appended.acknowledgement().map_err(|error| {
        let what = format!("the answer cannot be written: {error}");
        Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "answer_failed", what)
    })?;
    count(&shared.counters, &batch, &appended);
    shared.agents.heard(&batch.device, headers);
    shared.live.take(&batch, appended, t_arrival_ns);
    Ok(answer)
}

fn count(counters: &Counters, batch: &Batch, appended: &Appended) {
    let all: usize = batch.sensors.iter().map(|part| part.frames.len()).sum();
    let fresh: usize = appended.sensors.iter().map(|part| part.fresh.len()).sum();
    add(&counters.frames_stored, fresh);
    add(&counters.frames_again, all.saturating_sub(fresh));
}

/// The form of a body of frames, which its content type says; without one it is JSON.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Json,
    Binary,
}

impl Form {
    fn of(headers: &HeaderMap) -> Result<Self, Refusal> {
        let is_binary = |essence: &str| {
            let types = [BINARY_TYPE, BINARY_TYPE_PLAIN];
            types.iter().any(|kind| essence.eq_ignore_ascii_case(kind))
        };
        if essence(headers).is_some_and(is_binary) {
            return Ok(Self::Binary);
        }
        check_is_json(headers).map(|()| Self::Json)
    }

    /// The batch, and the body where a store may keep it as it is.
    fn read(
        self,
        body: Bytes,
        limits: &wire::Limits,
    ) -> Result<(Arc<Batch>, Option<Bytes>), WireError> {
        Ok(match self {
            Self::Json => (Arc::new(Batch::from_json(&body, limits)?), None),
            Self::Binary => (Arc::new(Batch::from_binary(&body, limits)?), Some(body)),
        })
    }
}

fn too_many_sensors(limit: usize) -> Refusal {
    let what = format!("{limit} sensors are known, and no more are taken");
    Refusal::new(StatusCode::INSUFFICIENT_STORAGE, "too_many_sensors", what)
        .hint("check that no agent makes up names, or raise `sensors_max`")
}
