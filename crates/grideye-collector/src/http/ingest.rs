//! `POST /v1/frames`: stores a batch whole or not at all, and answers once it is on disk.

use crate::auth::Caller;
use crate::counters::{Counters, add};
use crate::http::authorize::check_device;
use crate::http::bodies::Room;
use crate::http::body::{check_announced, check_is_json, collect, essence, in_body_time};
use crate::http::client::Client;
use crate::http::headers::OF_NO_PAGE;
use crate::http::refusal::Refusal;
use crate::http::state::AppState;
use crate::log::{Level, LogEvent};
use crate::shares::Sender;
use crate::store::Appended;
use axum::body::Body;
use axum::extract::Request;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse as _, Response};
use grideye_recording::wire::{Account, BINARY_TYPE, Batch, SensorBatch, WireError};
use std::sync::Arc;
use std::time::Duration;

/// A boot that sent no frame for this long is over, if its agent has begun another.
const SILENT_NS: u64 = 30_000_000_000;

pub(crate) async fn frames(
    state: &AppState,
    client: &Client,
    caller: Option<Caller>,
    request: Request,
) -> Response {
    let (parts, body) = request.into_parts();
    let room = Room::new(&state.0.bodies, caller.as_ref(), client.peer.address);
    match take(state, caller.as_ref(), &parts.headers, body, room).await {
        Ok(taken) => acknowledge(taken),
        Err(refusal) => refusal.into_response(),
    }
}

/// The response to a stored batch. No browser shows it, so it omits the page's headers, which are ten times as long.
fn acknowledge(acknowledgement: Vec<u8>) -> Response {
    let mut response = Response::new(Body::from(acknowledgement));
    response.headers_mut().clone_from(&OF_NO_PAGE);
    response
}

/// Stores a batch and returns the acknowledgment as JSON.
async fn take(
    state: &AppState,
    caller: Option<&Caller>,
    headers: &HeaderMap,
    body: Body,
    mut room: Room<'_>,
) -> Result<Vec<u8>, Refusal> {
    let form = Form::of(headers)?;
    let shared = &state.0;
    let bytes_max = shared.limits.body_bytes_max;
    check_announced(headers, bytes_max)?;
    let body = collect(body, bytes_max, |bytes| room.grow(bytes));
    let body = in_body_time(&shared.limits, body).await?;
    let batch = Arc::new(form.read(&body)?);
    check_device(caller, &batch.device)?;
    let answer = store(state, &batch, &room.sender()).await?;
    // Kept until here: a batch that waits for the disk takes memory just as its body did.
    drop(room);
    shared.agents.heard(&batch.device, headers);
    if shared
        .agents
        .leaves_nothing(&batch.device, &batch.boot, headers)
    {
        tokio::spawn(end_boots_before(state.clone(), batch));
    }
    Ok(answer)
}

/// Stores a batch, shows it, and returns the acknowledgment as JSON.
pub(crate) async fn store(
    state: &AppState,
    batch: &Arc<Batch>,
    sender: &Sender,
) -> Result<Vec<u8>, Refusal> {
    let shared = &state.0;
    let t_arrival_ns = shared.clock.utc_ns();
    let now = shared.clock.monotonic();
    if !shared.live.shows_boot_of(batch) {
        let looked = shared.new_streams.look(sender.clone(), now);
        looked.map_err(too_many_new_streams)?;
    }
    if let Some(step_ns) = shared.wall_steps.look(t_arrival_ns, now) {
        let event = LogEvent::new(Level::Warning, "clock_stepped");
        let event = event.with("by_s", step_ns / 1_000_000_000);
        shared.seldom.say("", now, event);
    }
    let appended = shared.store.append(Arc::clone(batch), t_arrival_ns).await?;
    for _new in appended.sensors.iter().filter(|part| part.is_new) {
        // Of the last batch before there are too many, all streams are taken.
        let _ = shared.new_streams.take(sender.clone(), now);
    }
    let answer = appended.acknowledgement().map_err(|error| {
        let what = format!("the answer cannot be written: {error}");
        Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "answer_failed", what)
    })?;
    count(&shared.counters, batch, &appended);
    shared.live.take(batch, appended, t_arrival_ns);
    Ok(answer)
}

/// Ends the earlier boots of an agent without a disk, once they are silent: what they held in memory is lost. An agent with
/// a disk reports for them itself.
async fn end_boots_before(state: AppState, batch: Arc<Batch>) {
    let (agents, store) = (&state.0.agents, state.store());
    let now_ns = state.0.clock.utc_ns();
    let Ok(streams) = store.streams().await else {
        return;
    };
    let mut is_done = true;
    for stream in streams {
        let account = stream.account.as_ref();
        let is_earlier = stream.id.device == batch.device && stream.id.boot != batch.boot;
        if !is_earlier || account.is_none_or(|account| account.ended) {
            continue;
        }
        let end = Account {
            ended: true,
            ..Account::default()
        };
        let end = Batch {
            device: stream.id.device.clone(),
            boot: stream.id.boot.clone(),
            t_sent_boot_ns: None,
            sensors: vec![SensorBatch {
                sensor: stream.id.sensor.clone(),
                account: Some(end),
                frames: Vec::new(),
            }],
        };
        is_done &= now_ns.abs_diff(stream.t_last_arrival_ns) >= SILENT_NS
            && store.append(Arc::new(end), now_ns).await.is_ok();
    }
    if is_done {
        agents.settled(&batch.device, &batch.boot);
    }
}

fn count(counters: &Counters, batch: &Batch, appended: &Appended) {
    let all: usize = batch.sensors.iter().map(|part| part.frames.len()).sum();
    let fresh: usize = appended.sensors.iter().map(|part| part.fresh.len()).sum();
    add(&counters.frames_stored, fresh);
    add(&counters.frames_again, all.saturating_sub(fresh));
}

/// The format of a body of frames, from its content type; JSON without one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Json,
    Binary,
}

impl Form {
    fn of(headers: &HeaderMap) -> Result<Self, Refusal> {
        let is_binary = |essence: &str| essence.eq_ignore_ascii_case(BINARY_TYPE);
        if essence(headers).is_some_and(is_binary) {
            return Ok(Self::Binary);
        }
        check_is_json(headers).map(|()| Self::Json)
    }

    fn read(self, body: &[u8]) -> Result<Batch, WireError> {
        match self {
            Self::Json => Batch::from_json(body),
            Self::Binary => Batch::from_binary(body),
        }
    }
}

fn too_many_new_streams(wait: Duration) -> Refusal {
    let what = "this sender began too many boots; frames of boots that are known already are taken";
    Refusal::new(StatusCode::TOO_MANY_REQUESTS, "too_many_boots", what)
        .hint("look why the agent starts so often (`journalctl -u grideye-agent`), and send this batch again later")
        .retry_after(wait)
}
