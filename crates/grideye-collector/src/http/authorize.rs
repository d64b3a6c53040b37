//! Access control over HTTP: the token or cookie of each request, its scope, and its rate.

use crate::auth::{Caller, Presented, Scope, TokenRecord, Unknown};
use crate::http::refusal::Refusal;
use crate::http::state::AppState;
use crate::peer::{AddressGroup, Peer};
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, header};
use axum::response::{IntoResponse, Redirect, Response};
use std::sync::Arc;
use std::time::Duration;

/// What a request needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Need {
    /// Nothing: for the liveness check and the sign-in page.
    Nothing,
    /// Any valid token.
    Token,
    /// A token for frames. Its devices are checked when the batch is read.
    Ingest,
    /// A token that may read.
    Read,
    /// A token that may change things.
    Admin,
}

impl Need {
    /// Decided by the matched route, not by the path, which has many spellings.
    pub(crate) fn of(method: &Method, route: Option<&str>) -> Self {
        match (route, method) {
            (Some("/healthz" | "/login" | "/v1/login" | "/assets/{name}"), _) => Self::Nothing,
            // The device is checked when its name is read.
            (Some("/v1/whoami" | "/v1/logout" | "/v1/devices/{device}"), _) => Self::Token,
            (Some("/v1/frames"), _) => Self::Ingest,
            (_, &Method::GET | &Method::HEAD | &Method::OPTIONS) => Self::Read,
            _ => Self::Admin,
        }
    }

    fn is_met_by(self, scope: &Scope) -> bool {
        match (self, scope) {
            (Self::Nothing | Self::Token, _)
            | (Self::Ingest, Scope::Ingest { .. })
            | (Self::Read, Scope::Read | Scope::Admin)
            | (Self::Admin, Scope::Admin) => true,
            (Self::Ingest | Self::Read | Self::Admin, _) => false,
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Nothing | Self::Token => "any",
            Self::Ingest => "ingest",
            Self::Read => "read",
            Self::Admin => "admin",
        }
    }
}

/// Admits the request, with the caller if known, or returns the response that rejects it. `now` is on the monotonic
/// clock.
pub(crate) fn authorize(
    state: &AppState,
    need: Need,
    peer: Peer,
    request: &Request,
    now: Duration,
) -> Result<Option<Caller>, Box<Response>> {
    let caller = match authenticate(state, peer, request.headers(), now) {
        Ok(caller) => caller,
        Err(unknown) => {
            // Only unknown callers are limited by address: one bad client must not stop good ones at the same address.
            // So a sign-in counts only if its token is bad, and who opens pages is counted apart from bad tokens.
            let is_sign_in = need == Need::Nothing && request.method() == Method::POST;
            let is_bad = need != Need::Nothing && !is_person(request);
            if !is_sign_in {
                check_unknown_rate(state, peer, is_bad).map_err(boxed)?;
            }
            return match need {
                Need::Nothing => Ok(None),
                _ => Err(Box::new(refuse_unknown(request, unknown))),
            };
        }
    };
    match check(state, &caller, need, request) {
        Ok(()) => Ok(Some(caller)),
        Err(refusal) => Err(Box::new(named(refusal.into_response(), caller.record()))),
    }
}

/// Names the token in the log's line about a refusal.
pub(crate) fn named(mut response: Response, record: Option<&Arc<TokenRecord>>) -> Response {
    if let Some(record) = record {
        response.extensions_mut().insert(Arc::clone(record));
    }
    response
}

fn boxed(refusal: Refusal) -> Box<Response> {
    Box::new(refusal.into_response())
}

/// Whether the caller may post frames of this device.
pub(crate) fn check_device(caller: Option<&Caller>, device: &str) -> Result<(), Refusal> {
    let record = match caller {
        Some(Caller::Anyone) => return Ok(()),
        Some(Caller::Holder { record, .. }) => record,
        // Every admitted caller was authenticated; nobody else may post.
        None => return Err(not_authenticated()),
    };
    let speaks_for_it = match &record.scope {
        Scope::Ingest { devices } => devices.contains(device),
        Scope::Read | Scope::Admin => false,
    };
    if speaks_for_it {
        return Ok(());
    }
    let what = "this token does not speak for that device";
    Err(Refusal::new(StatusCode::FORBIDDEN, "foreign_device", what)
        .field("device")
        .hint("set the agent's `device` to the name it was enrolled with, or enroll it: `grideye enroll DEVICE`"))
}

/// Whether the caller may read this device's state: allowed with a token that may read, and for the device itself.
pub(crate) fn check_own(caller: Option<&Caller>, device: &str) -> Result<(), Refusal> {
    match caller {
        Some(Caller::Holder { record, .. }) if !matches!(record.scope, Scope::Ingest { .. }) => {
            Ok(())
        }
        other => check_device(other, device),
    }
}

fn not_authenticated() -> Refusal {
    let what = "nobody was recognized for this request";
    Refusal::new(StatusCode::UNAUTHORIZED, "no_token", what)
}

/// The page's cookie. With TLS, its prefix makes browsers enforce that only this host sets it and that it is never sent
/// in the clear.
pub(crate) const fn cookie_name(peer: Peer) -> &'static str {
    if peer.is_encrypted {
        "__Host-grideye-session"
    } else {
        "grideye-session"
    }
}

/// Seconds since 1970-01-01 UTC.
pub(crate) fn now_s(state: &AppState) -> i64 {
    state.0.clock.utc_ns().div_euclid(1_000_000_000)
}

fn authenticate(
    state: &AppState,
    peer: Peer,
    headers: &HeaderMap,
    now: Duration,
) -> Result<Caller, Unknown> {
    let presented = match bearer(headers)? {
        Some(token) => Presented::Token(token),
        None => cookie(headers, cookie_name(peer)).map_or(Presented::Nothing, Presented::Cookie),
    };
    let authenticator = &state.0.authenticator;
    authenticator.authenticate(presented, now, || now_s(state))
}

/// The token of `authorization: Bearer TOKEN`. Another scheme counts as an unknown token, and so do two headers.
fn bearer(headers: &HeaderMap) -> Result<Option<&str>, Unknown> {
    let mut all = headers.get_all(header::AUTHORIZATION).iter();
    let (first, second) = (all.next(), all.next());
    if second.is_some() {
        return Err(Unknown::BadToken);
    }
    Ok(first.map(|value| {
        let text = value.to_str().unwrap_or_default();
        let (scheme, token) = text.split_once(' ').unwrap_or((text, ""));
        let is_bearer = scheme.eq_ignore_ascii_case("bearer");
        if is_bearer { token.trim() } else { "" }
    }))
}

fn cookie<'a>(headers: &'a HeaderMap, name: &str) -> Option<&'a str> {
    let all = headers.get_all(header::COOKIE).iter();
    all.filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(';'))
        .filter_map(|pair| pair.trim().split_once('='))
        .find_map(|(found, value)| (found == name).then_some(value))
}

fn is_person(request: &Request) -> bool {
    let accepts = request.headers().get(header::ACCEPT);
    let accepts = accepts.and_then(|accept| accept.to_str().ok());
    request.method() == Method::GET && accepts.is_some_and(|accept| accept.contains("text/html"))
}

/// Redirects a person to the sign-in page; tells a program the error.
fn refuse_unknown(request: &Request, unknown: Unknown) -> Response {
    if is_person(request) {
        return Redirect::to("/login").into_response();
    }
    let (code, what) = match &unknown {
        Unknown::NoToken => ("no_token", "this collector requires a token"),
        Unknown::BadToken => ("bad_token", "this token is unknown"),
        Unknown::Revoked(_) => ("bad_token", "this token was revoked"),
        Unknown::BadCookie => ("signed_out", "you are signed out"),
    };
    let refusal = Refusal::new(StatusCode::UNAUTHORIZED, code, what)
        .field("authorization")
        .hint("send the header `authorization: Bearer TOKEN`; people sign in at /login; `grideye enroll` and `grideye token` make tokens");
    let mut response = refusal.into_response();
    response
        .headers_mut()
        .insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    match unknown {
        Unknown::Revoked(record) => named(response, Some(&record)),
        _ => response,
    }
}

fn check(state: &AppState, caller: &Caller, need: Need, request: &Request) -> Result<(), Refusal> {
    let Caller::Holder { record, by_cookie } = caller else {
        return Ok(());
    };
    let now = state.0.clock.monotonic();
    if let Err(wait) = state.0.rates.take(record.id.clone(), now) {
        let limit = state.limits().requests_per_second_max;
        let what = format!("more than {limit} requests per second with this token");
        return Err(too_many(what, wait).hint(
            "send larger batches less often, or start the collector with a larger `--requests-per-second`",
        ));
    }
    if !need.is_met_by(&record.scope) {
        let (has, needs) = (record.scope.name(), need.name());
        let what = format!("this needs a token of scope {needs}, and this one has {has}");
        return Err(Refusal::new(StatusCode::FORBIDDEN, "wrong_scope", what)
            .field("authorization")
            .hint("`grideye token make NAME --scope read` or `--scope admin` makes one; `grideye enroll DEVICE` one for frames"));
    }
    let is_write = !matches!(*request.method(), Method::GET | Method::HEAD);
    // A browser sends `Origin` with every write; it was checked before.
    if *by_cookie && is_write && !request.headers().contains_key(header::ORIGIN) {
        let what = "a write with the page's cookie needs an `origin` header";
        return Err(Refusal::new(StatusCode::FORBIDDEN, "no_origin", what).field("origin"));
    }
    Ok(())
}

/// Limits callers without a valid token by address; those whose token `is_bad` or missing apart from those who only open
/// pages.
pub(crate) fn check_unknown_rate(
    state: &AppState,
    peer: Peer,
    is_bad: bool,
) -> Result<(), Refusal> {
    let now = state.0.clock.monotonic();
    if !state.0.authenticator.asks_for_tokens(now) {
        return Ok(());
    }
    let group = (AddressGroup::of(peer.address), is_bad);
    state.0.unknown_rates.take(group, now).map_err(|wait| {
        too_many("too many requests without a valid token", wait)
            .hint("check the token: `grideye token list` shows the valid ones")
    })
}

fn too_many(what: impl Into<String>, wait: Duration) -> Refusal {
    Refusal::new(StatusCode::TOO_MANY_REQUESTS, "too_many_requests", what).retry_after(wait)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn needs_follow_the_route_and_unknown_routes_need_the_most() {
        for (method, route, need) in [
            (Method::GET, Some("/healthz"), Need::Nothing),
            (Method::GET, Some("/assets/{name}"), Need::Nothing),
            (Method::POST, Some("/v1/login"), Need::Nothing),
            (Method::POST, Some("/v1/frames"), Need::Ingest),
            (Method::GET, Some("/v1/frames"), Need::Ingest),
            (Method::GET, Some("/"), Need::Read),
            (Method::GET, Some("/metrics"), Need::Read),
            (Method::GET, None, Need::Read),
            (Method::POST, Some("/v1/recordings"), Need::Admin),
            (Method::POST, Some("/v1/recordings/{id}/stop"), Need::Admin),
            (Method::DELETE, Some("/v1/recordings/{id}"), Need::Admin),
            (Method::POST, None, Need::Admin),
            (Method::POST, Some("/v1/logout"), Need::Token),
            (Method::GET, Some("/v1/devices/{device}"), Need::Token),
            (Method::GET, Some("/v1/devices"), Need::Read),
        ] {
            assert_eq!(Need::of(&method, route), need, "{method} {route:?}");
        }
    }

    #[test]
    fn each_scope_allows_only_its_own() {
        let ingest = Scope::Ingest {
            devices: ["pi-1".to_owned()].into(),
        };
        let met =
            |need: Need| [&ingest, &Scope::Read, &Scope::Admin].map(|scope| need.is_met_by(scope));
        assert_eq!(met(Need::Token), [true, true, true]);
        assert_eq!(met(Need::Ingest), [true, false, false]);
        assert_eq!(met(Need::Read), [false, true, true]);
        assert_eq!(met(Need::Admin), [false, false, true]);
    }

    #[test]
    fn cookies_are_found_among_others_by_their_whole_name() {
        let mut headers = HeaderMap::new();
        headers.append(
            header::COOKIE,
            HeaderValue::from_static("a=b; xgrideye-session=no"),
        );
        headers.append(
            header::COOKIE,
            HeaderValue::from_static("grideye-session=yes.1.2 ; c=d"),
        );
        assert_eq!(cookie(&headers, "grideye-session"), Some("yes.1.2"));
        assert_eq!(cookie(&headers, "session"), None);
    }
}
