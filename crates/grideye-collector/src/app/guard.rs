//! What every request passes: who may ask, how long it may take, and the headers of every answer.

use crate::alarm::Alarm;
use crate::app::AppState;
use crate::app::answer::{Refusal, RefusedCode};
use crate::app::gate::{self, Asked, Line, Need};
use crate::auth::Caller;
use crate::connections::Connection;
use crate::log::{Level, LogEvent};
use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::future::Future;
use std::net::IpAddr;
use std::sync::{Arc, LazyLock};
use std::time::Duration;

/// Nothing but what this server itself serves, and no script or style inside the page.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const HEADERS: [(HeaderName, &str); 6] = [
    (header::CONTENT_SECURITY_POLICY, POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (
        HeaderName::from_static("cross-origin-resource-policy"),
        "same-origin",
    ),
    (
        HeaderName::from_static("cross-origin-opener-policy"),
        "same-origin",
    ),
];

/// What an answer that no browser shows may do.
const POLICY_OF_NO_PAGE: &str = "default-src 'none'; frame-ancestors 'none'";

/// All headers of such an answer, in JSON: those that bind what is no page.
pub(super) static OF_NO_PAGE: LazyLock<HeaderMap> = LazyLock::new(|| {
    of([
        (header::CONTENT_TYPE, "application/json"),
        (header::CACHE_CONTROL, "no-store"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::CONTENT_SECURITY_POLICY, POLICY_OF_NO_PAGE),
    ])
});

fn of(headers: impl IntoIterator<Item = (HeaderName, &'static str)>) -> HeaderMap {
    let headers = headers.into_iter();
    headers
        .map(|(name, value)| (name, HeaderValue::from_static(value)))
        .collect()
}

/// Around every route of the router.
pub(super) async fn guard(
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
pub(super) struct Passing<'s> {
    state: &'s AppState,
    peer: IpAddr,
    /// On the monotonic clock.
    began: Duration,
    /// The connection that it came by; none without a server.
    connection: Option<&'s Connection>,
}

impl<'s> Passing<'s> {
    pub(super) fn of(state: &'s AppState, line: Line, connection: Option<&'s Connection>) -> Self {
        Self {
            state,
            peer: line.peer,
            began: state.0.clock.monotonic(),
            connection,
        }
    }

    /// Who asks, if that is known, or why nothing is answered.
    pub(super) fn admit(
        self,
        need: Need,
        asked: Asked<'_>,
    ) -> Result<Option<Caller>, Box<Response>> {
        check_origin(&self.state.0.hosts, asked)
            .map_err(|refusal| Box::new(refusal.into_response()))?;
        let caller = gate::pass(self.state, need, asked, self.began)?;
        if let (Some(connection), Some(Caller::Holder { .. })) = (self.connection, &caller) {
            connection.establish();
        }
        Ok(caller)
    }

    /// What the work gives, or that it took too long.
    pub(super) async fn in_time<T>(
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
    pub(super) fn finish<B>(self, mut response: Response<B>) -> Response<B> {
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

/// The headers of every answer, but for one that has [`OF_NO_PAGE`]; what the answer says itself stands.
fn protect<B>(response: &mut Response<B>) {
    static EVERY: LazyLock<HeaderMap> = LazyLock::new(|| {
        let every = HEADERS.into_iter();
        of(every.chain([(header::CACHE_CONTROL, "no-store")]))
    });
    let policy = response.headers().get(header::CONTENT_SECURITY_POLICY);
    if policy.is_some_and(|policy| policy == POLICY_OF_NO_PAGE) {
        return;
    }
    // A copy of the whole is cheaper than one header after another.
    let own = std::mem::replace(response.headers_mut(), EVERY.clone());
    response.headers_mut().extend(own);
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

/// A page of another site must neither read here by a name that it controls (DNS rebinding), nor write.
fn check_origin(hosts: &Hosts, asked: Asked<'_>) -> Result<(), Refusal> {
    let host = host_of(asked.uri, asked.headers)?;
    let mut origins = asked.headers.get_all(header::ORIGIN).iter();
    let origin = origins.next();
    if origins.next().is_some() {
        let what = "the request must name its origin at most once";
        return Err(Refusal::new(StatusCode::BAD_REQUEST, "two_origins", what).field("origin"));
    }
    if !hosts.accepts(host) {
        let what = format!("this server does not answer for the host {host:?}");
        return Err(Refusal::new(StatusCode::FORBIDDEN, "unknown_host", what)
            .field("host")
            .hint("use 127.0.0.1 or the address that it listens on, or start it with the name (`--host-name pi.local`)"));
    }
    if matches!(*asked.method, Method::GET | Method::HEAD | Method::OPTIONS) {
        return Ok(());
    }
    let Some(origin) = origin else {
        return Ok(());
    };
    let scheme = if asked.line.is_encrypted {
        "https"
    } else {
        "http"
    };
    let own = format!("{scheme}://{host}");
    if origin.as_bytes().eq_ignore_ascii_case(own.as_bytes()) {
        return Ok(());
    }
    let what = "a page of another site may not do this";
    Err(Refusal::new(StatusCode::FORBIDDEN, "foreign_origin", what).field("origin"))
}

/// The host and port that the request is for, which must be named exactly once.
fn host_of<'r>(uri: &'r Uri, headers: &'r HeaderMap) -> Result<&'r str, Refusal> {
    let mut named = headers.get_all(header::HOST).iter();
    let host = match (named.next(), named.next(), uri.authority()) {
        (Some(host), None, None) => host.to_str().ok(),
        (Some(host), None, Some(authority)) => host
            .to_str()
            .ok()
            .filter(|host| authority.as_str().eq_ignore_ascii_case(host)),
        (None, _, Some(authority)) => Some(authority.as_str()),
        _ => None,
    };
    host.ok_or_else(|| {
        let what = "the request must name its host exactly once";
        Refusal::new(StatusCode::BAD_REQUEST, "no_host", what).field("host")
    })
}

/// The names that this server answers to.
#[derive(Debug, Clone)]
pub(crate) struct Hosts {
    listen: IpAddr,
    names: Vec<String>,
}

impl Hosts {
    /// Loopback names always, the address listened on, and `names`.
    pub(crate) fn new(listen: IpAddr, names: &[String]) -> Self {
        Self {
            listen,
            names: names.to_vec(),
        }
    }

    /// Whatever the port: it may be forwarded.
    fn accepts(&self, host_and_port: &str) -> bool {
        let Some(host) = without_port(host_and_port) else {
            return false;
        };
        // The name may be an address as well: that of this machine beyond a NAT, as QEMU's guests see it.
        let mut names = self.names.iter();
        let is_named = names.any(|name| name.eq_ignore_ascii_case(host));
        let is_own = match host.parse::<IpAddr>() {
            // Rebinding needs a name: where every address is listened on, every address may be asked for.
            Ok(address) => {
                address.is_loopback() || address == self.listen || self.listen.is_unspecified()
            }
            Err(_name) => host.eq_ignore_ascii_case("localhost"),
        };
        is_named || is_own
    }
}

fn without_port(host: &str) -> Option<&str> {
    if let Some(bracketed) = host.strip_prefix('[') {
        let (address, port) = bracketed.split_once(']')?;
        return is_port(port).then_some(address);
    }
    let end = host.find(':').unwrap_or(host.len());
    is_port(&host[end..]).then_some(&host[..end])
}

/// Nothing, or a colon and digits.
fn is_port(text: &str) -> bool {
    text.is_empty()
        || text
            .strip_prefix(':')
            .is_some_and(|port| port.bytes().all(|byte| byte.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loopback_and_the_own_address_are_answered_for_and_names_of_others_are_not() {
        let hosts = Hosts::new(IpAddr::from([192, 168, 1, 7]), &["Pi.local".to_owned()]);
        for own in [
            "127.0.0.1",
            "127.0.0.1:8080",
            "127.9.9.9:1",
            "localhost",
            "localhost:80",
            "LocalHost",
            "[::1]",
            "[::1]:8080",
            "192.168.1.7:8080",
            "pi.local:8080",
            "PI.LOCAL:8080",
        ] {
            assert!(hosts.accepts(own), "{own}");
        }
        for foreign in [
            "evil.example",
            "evil.example:8080",
            "localhost.evil.example",
            "127.0.0.1.evil.example",
            "192.168.1.8",
            "",
            ":80",
            "[::1",
            "[::1]x",
            "127.0.0.1:x",
            "localhost:80:80",
            "[2001:db8::1]",
            "user@127.0.0.1",
        ] {
            assert!(!hosts.accepts(foreign), "{foreign}");
        }
    }

    #[test]
    fn an_address_that_was_named_is_answered_for_and_its_neighbour_is_not() {
        let hosts = Hosts::new(IpAddr::from([127, 0, 0, 1]), &["10.0.2.2".to_owned()]);
        assert!(hosts.accepts("10.0.2.2:8833"));
        assert!(!hosts.accepts("10.0.2.3:8833"));
        let unnamed = Hosts::new(IpAddr::from([127, 0, 0, 1]), &[]);
        assert!(!unnamed.accepts("10.0.2.2:8833"));
    }

    #[test]
    fn where_every_address_is_listened_on_every_address_is_answered_for() {
        let hosts = Hosts::new(IpAddr::from([0, 0, 0, 0]), &[]);
        assert!(hosts.accepts("192.168.1.8:8080"));
        assert!(hosts.accepts("[2001:db8::1]:8080"));
        assert!(!hosts.accepts("evil.example"));
    }
}
