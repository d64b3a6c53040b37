//! `GET /v1/live`: server-sent events for the live page.

use crate::auth::Caller;
use crate::http::client::Client;
use crate::http::refusal::Refusal;
use crate::http::state::AppState;
use crate::live::Event;
use crate::shares::{Denied, Sender, Share};
use axum::Extension;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::sse::{Event as SseEvent, Sse};
use serde_json::json;
use std::convert::Infallible;
use std::time::Duration;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::{broadcast, mpsc};
use tokio_stream::Stream;
use tokio_stream::wrappers::ReceiverStream;

/// How soon a browser reconnects after the connection broke.
const RETRY: Duration = Duration::from_secs(1);
/// Events buffered for one client besides those in the broadcast.
const IN_FLIGHT_MAX: usize = 4;

type Feed = mpsc::Sender<Result<SseEvent, Infallible>>;

/// Sends `snapshot`, `frames` for each batch, `recordings`, and `alive` in silence; a client that was too slow gets
/// `lagged` and a new `snapshot`.
pub(crate) async fn live(
    State(state): State<AppState>,
    Extension(caller): Extension<Caller>,
    Extension(client): Extension<Client>,
) -> Result<Sse<impl Stream<Item = Result<SseEvent, Infallible>>>, Refusal> {
    let sender = Sender::of(Some(&caller), client.peer.address);
    let seat = state.0.live_clients.take(sender, 1).map_err(|denied| {
        let open = match denied {
            Denied::All => state.limits().live_clients_max,
            Denied::Own(open) => open,
        };
        let what = format!("{open} live pages are already open");
        let status = StatusCode::SERVICE_UNAVAILABLE;
        Refusal::new(status, "too_many_live_clients", what).hint("close one")
    })?;
    let (feed, events) = mpsc::channel(IN_FLIGHT_MAX);
    tokio::spawn(follow(state, caller, feed, seat));
    Ok(Sse::new(ReceiverStream::new(events)))
}

/// Feeds one client until it leaves, its token is revoked, or the collector stops.
async fn follow(state: AppState, caller: Caller, feed: Feed, _seat: Share) {
    let mut stopping = state.0.stopping.subscribe();
    // Listening starts before the snapshot, so that nothing is missed in between.
    let events = state.0.live.listen();
    tokio::select! {
        _ = stopping.wait_for(|stopping| *stopping) => {}
        () = feed.closed() => {}
        () = revoked(&state, &caller) => {}
        () = relay(&state, &feed, events) => {}
    }
}

/// Ready once the caller would no longer be admitted.
async fn revoked(state: &AppState, caller: &Caller) {
    loop {
        tokio::time::sleep(state.limits().live_keep_alive).await;
        let now = state.0.clock.monotonic();
        if !state.0.authenticator.still_knows(caller, now) {
            return;
        }
    }
}

async fn relay(state: &AppState, feed: &Feed, mut events: broadcast::Receiver<Event>) {
    let mut next = snapshot(state).retry(RETRY);
    while feed.send(Ok(next)).await.is_ok() {
        let heard = tokio::time::timeout(state.limits().live_keep_alive, events.recv()).await;
        next = match heard {
            Err(_silence) => alive(state).await,
            Ok(Ok(event)) => SseEvent::default().event(event.name).data(&*event.data),
            Ok(Err(RecvError::Lagged(missed))) => {
                let lagged = json!({ "missed": missed }).to_string();
                let told = SseEvent::default().event("lagged").data(lagged);
                if feed.send(Ok(told)).await.is_err() {
                    return;
                }
                snapshot(state)
            }
            Ok(Err(RecvError::Closed)) => return,
        };
    }
}

/// Reports that the collector is alive, and why the store takes nothing, if so: silence alone could mean either.
async fn alive(state: &AppState) -> SseEvent {
    let fault = state.store().ping().await.err();
    let fault = fault.map(|fault| fault.to_string());
    let reason = fault.as_deref().and_then(|fault| fault.lines().next());
    SseEvent::default()
        .comment("still here")
        .event("alive")
        .data(json!({ "store": reason }).to_string())
}

fn snapshot(state: &AppState) -> SseEvent {
    let snapshot = state.0.live.snapshot().to_string();
    SseEvent::default().event("snapshot").data(snapshot)
}
