//! What every request passes: who may ask, how long it may take, and the headers of every answer.

use crate::alarm::Alarm;
use crate::auth::Caller;
use crate::connections::Connection;
use crate::http::authorize::{self, Asked, Line, Need};
use crate::http::headers::protect;
use crate::http::origin::check_origin;
use crate::http::refusal::{Refusal, RefusedCode};
use crate::http::state::AppState;
use crate::log::{Level, LogEvent};
use axum::extract::{MatchedPath, Request, State};
use axum::http::StatusCode;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::future::Future;
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;

/// Around every route of the router.
pub(crate) async fn guard(
    State(state): State<AppState>,
    mut request: Request,
    next: Next,
) -> Response {
    let route = request.extensions().get::<MatchedPath>();
    let need = Need::of(request.method(), route.map(MatchedPath::as_str));
    let connection = request.extensions().get::<Arc<Connection>>().cloned();
    let passing = Passing::of(&state, Line::of(&request), connection.as_deref());
    match passing.admit(need, Asked::of(&request)) {
        Err(refusal) => passing.finish(*refusal),
        Ok(caller) => {
            if let Some(caller) = caller {
                request.extensions_mut().insert(caller);
            }
            let alarm = Alarm::default();
            let answer = passing.in_time(&alarm, next.run(request)).await;
            passing.finish(answer.unwrap_or_else(Refusal::into_response))
        }
    }
}

/// A request on its way through.
#[derive(Clone, Copy)]
pub(crate) struct Passing<'s> {
    state: &'s AppState,
    peer: IpAddr,
    /// On the monotonic clock.
    began: Duration,
    /// The connection that it came by; none without a server.
    connection: Option<&'s Connection>,
}

impl<'s> Passing<'s> {
    pub(crate) fn of(state: &'s AppState, line: Line, connection: Option<&'s Connection>) -> Self {
        Self {
            state,
            peer: line.peer,
            began: state.0.clock.monotonic(),
            connection,
        }
    }

    /// Who asks, if that is known, or why nothing is answered.
    pub(crate) fn admit(
        self,
        need: Need,
        asked: Asked<'_>,
    ) -> Result<Option<Caller>, Box<Response>> {
        check_origin(&self.state.0.hosts, asked)
            .map_err(|refusal| Box::new(refusal.into_response()))?;
        let caller = authorize::pass(self.state, need, asked, self.began)?;
        if let (Some(connection), Some(Caller::Holder { .. })) = (self.connection, &caller) {
            connection.establish();
        }
        Ok(caller)
    }

    /// What the work gives, or that it took too long.
    pub(crate) async fn in_time<T>(
        self,
        alarm: &Alarm,
        work: impl Future<Output = T>,
    ) -> Result<T, Refusal> {
        let time_max = self.state.limits().handler_time_max;
        alarm.within(time_max, work).await.ok_or_else(|| {
            let what = format!("the request was not done within {time_max:?}");
            Refusal::new(StatusCode::GATEWAY_TIMEOUT, "too_slow", what).hint(
                "frames that were sent may or may not be stored; sending them again does no harm",
            )
        })
    }

    /// The answer as it goes out.
    pub(crate) fn finish<B>(self, mut response: Response<B>) -> Response<B> {
        // Where no tokens are required, a request without an error is all that can be known of a sender.
        let unproven = self.connection.filter(|found| !found.is_established());
        if let Some(connection) = unproven {
            let is_good = response.status() < StatusCode::BAD_REQUEST;
            if is_good && !self.state.0.authenticator.asks_for_tokens(self.began) {
                connection.establish();
            }
        }
        protect(&mut response);
        count(self.state, &response, self.began, self.peer);
        response
    }
}

/// Counts the answer, and says a refusal that may be an attack or a device that was set up wrongly.
fn count<B>(state: &AppState, response: &Response<B>, began: Duration, peer: IpAddr) {
    let (shared, status) = (&state.0, response.status());
    let now = shared.clock.monotonic();
    let took = now.saturating_sub(began);
    shared.counters.answered(status.as_u16(), took);
    let Some(RefusedCode(code)) = response.extensions().get().copied() else {
        return;
    };
    shared.counters.refused(code);
    let is_worth_saying = matches!(
        status,
        StatusCode::UNAUTHORIZED
            | StatusCode::FORBIDDEN
            | StatusCode::CONFLICT
            | StatusCode::PAYLOAD_TOO_LARGE
            | StatusCode::TOO_MANY_REQUESTS
    ) || status.is_server_error();
    if is_worth_saying {
        let level = match status {
            StatusCode::INSUFFICIENT_STORAGE | StatusCode::INTERNAL_SERVER_ERROR => Level::Error,
            _ => Level::Warning,
        };
        let event = LogEvent::new(level, "refused")
            .with("code", code)
            .with("status", status.as_u16())
            .with("peer", peer);
        shared.seldom.say(code, now, event);
    }
}
