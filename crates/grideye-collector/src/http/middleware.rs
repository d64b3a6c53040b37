//! What every request passes: admission, time limit, and the headers of every response.

use crate::auth::{Caller, TokenRecord};
use crate::http::authorize::{Need, authorize, named};
use crate::http::client::Client;
use crate::http::headers::protect;
use crate::http::origin::check_origin;
use crate::http::refusal::{Refusal, RefusedCode};
use crate::http::state::AppState;
use crate::log::{Level, LogEvent};
use crate::shares::Sender;
use axum::extract::{MatchedPath, Request, State};
use axum::http::StatusCode;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;

pub(crate) async fn around(
    State((state, time_max)): State<(AppState, Duration)>,
    request: Request,
    next: Next,
) -> Response {
    let client = Client::of(&request);
    let route = request.extensions().get::<MatchedPath>();
    let need = Need::of(request.method(), route.map(MatchedPath::as_str));
    let answer = |caller, mut request: Request| {
        if let Some(caller) = caller {
            request.extensions_mut().insert::<Caller>(caller);
        }
        next.run(request)
    };
    pass(&state, &client, (need, time_max), request, answer).await
}

/// For the routes of annexes, whose work takes long: nobody has more than a share of it.
pub(crate) async fn in_shares(
    State(state): State<AppState>,
    request: Request,
    next: Next,
) -> Response {
    let (client, caller) = (Client::of(&request), request.extensions().get());
    let sender = Sender::of(caller, client.peer.address);
    match state.0.annexed.take(sender, 1) {
        Ok(_share) => next.run(request).await,
        Err(_denied) => {
            let what = "other requests like this one are being answered";
            Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "busy", what)
                .hint("retry in a second, or close other pages")
                .into_response()
        }
    }
}

/// Answers a request if the caller is admitted, within a time.
pub(crate) async fn pass<A: Future<Output = Response>>(
    state: &AppState,
    client: &Client,
    (need, time_max): (Need, Duration),
    request: Request,
    answer: impl FnOnce(Option<Caller>, Request) -> A,
) -> Response {
    // On the monotonic clock.
    let began = state.0.clock.monotonic();
    let is_read = need == Need::Read;
    let mut response = match admit(state, client, need, &request, began) {
        Err(refusal) => *refusal,
        Ok(caller) => {
            let record = caller.as_ref().and_then(Caller::record).cloned();
            let answered = client.alarm.within(time_max, answer(caller, request));
            let answered = answered.await;
            let answered = answered.unwrap_or_else(|| too_slow(time_max, is_read).into_response());
            named(answered, record.as_ref())
        }
    };
    establish_unproven(state, client, &response, began);
    protect(&mut response);
    count(state, &response, began, client.peer.address);
    response
}

/// The caller, if known, or the response that rejects the request.
fn admit(
    state: &AppState,
    client: &Client,
    need: Need,
    request: &Request,
    began: Duration,
) -> Result<Option<Caller>, Box<Response>> {
    check_origin(&state.0.hosts, client.peer, request)
        .map_err(|refusal| Box::new(refusal.into_response()))?;
    let caller = authorize(state, need, client.peer, request, began)?;
    if let (Some(connection), Some(Caller::Holder { .. })) = (&client.connection, &caller) {
        connection.establish(|| Sender::of(caller.as_ref(), client.peer.address));
    }
    Ok(caller)
}

fn too_slow(time_max: Duration, is_read: bool) -> Refusal {
    let what = format!("the request was not done within {time_max:?}");
    Refusal::new(StatusCode::GATEWAY_TIMEOUT, "too_slow", what).hint(match is_read {
        true => "ask again when the collector has less to do; long recordings: download the CSV and run `grideye convert`",
        false => "frames that were sent may or may not be stored; sending them again does no harm",
    })
}

/// If no tokens are required, a request without an error is the only evidence of a good sender.
fn establish_unproven(state: &AppState, client: &Client, response: &Response, began: Duration) {
    let unproven = client.connection.as_ref();
    let unproven = unproven.filter(|connection| !connection.is_established());
    let Some(connection) = unproven else { return };
    let is_good = response.status() < StatusCode::BAD_REQUEST;
    if is_good && !state.0.authenticator.asks_for_tokens(began) {
        connection.establish(|| Sender::of(None, client.peer.address));
    }
}

/// Counts the response, and logs rejections that may be an attack or a misconfigured device.
fn count(state: &AppState, response: &Response, began: Duration, peer: IpAddr) {
    let (shared, status) = (&state.0, response.status());
    let now = shared.clock.monotonic();
    let took = now.saturating_sub(began);
    shared.counters.answered(status.as_u16(), took);
    let Some(RefusedCode(code)) = response.extensions().get().copied() else {
        return;
    };
    shared.counters.refused(code);
    let is_worth_logging = matches!(
        status,
        StatusCode::UNAUTHORIZED
            | StatusCode::FORBIDDEN
            | StatusCode::CONFLICT
            | StatusCode::PAYLOAD_TOO_LARGE
            | StatusCode::TOO_MANY_REQUESTS
    ) || status.is_server_error();
    if is_worth_logging {
        let level = match status {
            StatusCode::INSUFFICIENT_STORAGE | StatusCode::INTERNAL_SERVER_ERROR => Level::Error,
            _ => Level::Warning,
        };
        let mut event = LogEvent::new(level, "refused")
            .with("code", code)
            .with("status", status.as_u16())
            .with("peer", peer);
        if let Some(record) = response.extensions().get::<Arc<TokenRecord>>() {
            event = event.with("token", &record.id).with("name", &record.name);
        }
        shared.seldom.say(code, now, event);
    }
}
