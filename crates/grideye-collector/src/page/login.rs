//! Signing in to the page with a token, and signing out.

use crate::auth::{Caller, Presented, Scope};
use crate::http::body::read_object;
use crate::http::client::Client;
use crate::http::{AppState, Refusal, authorize};
use crate::page::assets;
use crate::peer::Peer;
use axum::Extension;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Json, Response};
use serde_json::{Value, json};

const HINT: &str =
    r#"send {"token": "grideye-…"}; `grideye token make NAME --scope read` makes one"#;

pub(crate) async fn page() -> Response {
    assets::login()
}

/// `POST /v1/login`: takes `{"token": "…"}` and returns the page's cookie.
pub(crate) async fn login(
    State(state): State<AppState>,
    request: Request,
) -> Result<Response, Refusal> {
    let peer = Client::of(&request).peer;
    let token = read_object(&state, request, &["token"], HINT).await?;
    let token = token.get("token").and_then(Value::as_str);
    let token = token.ok_or_else(|| Refusal::wrong_value("token", "expected a token", HINT))?;
    let (shown, now) = (Presented::Token(token.trim()), state.0.clock.monotonic());
    let authenticator = &state.0.authenticator;
    let known = authenticator.authenticate(shown, now, || authorize::now_s(&state));
    let record = match known {
        // No tokens are required, so there is nothing to sign in to.
        Ok(Caller::Anyone) => return Ok(StatusCode::NO_CONTENT.into_response()),
        Ok(Caller::Holder { record, .. }) => record,
        Err(_unknown) => {
            authorize::check_unknown_rate(&state, peer, true)?;
            let what = "this token is unknown or was revoked";
            return Err(Refusal::new(StatusCode::UNAUTHORIZED, "bad_token", what)
                .field("token")
                .hint(
                    "`grideye token make NAME --scope read` on the collector's machine makes one",
                ));
        }
    };
    if matches!(record.scope, Scope::Ingest { .. }) {
        let what = "this token is for a device's frames; it does not open the page";
        return Err(Refusal::new(StatusCode::FORBIDDEN, "wrong_scope", what)
            .field("token")
            .hint(
                "`grideye token make NAME --scope read` or `--scope admin` makes one that does",
            ));
    }
    let time_max_s = i64::try_from(state.limits().session_time_max.as_secs()).unwrap_or(i64::MAX);
    let t_end_s = authorize::now_s(&state).saturating_add(time_max_s);
    let cookie = authenticator.cookie(&record, t_end_s)?;
    let headers = set_cookie(&cookie, time_max_s, peer);
    Ok((StatusCode::NO_CONTENT, headers).into_response())
}

/// `POST /v1/logout`: deletes the cookie.
pub(crate) async fn logout(request: Request) -> Response {
    let headers = set_cookie("", 0, Client::of(&request).peer);
    (StatusCode::NO_CONTENT, headers).into_response()
}

/// `GET /v1/whoami`: the caller's scope and name.
pub(crate) async fn whoami(Extension(caller): Extension<Caller>) -> Json<Value> {
    Json(match caller {
        Caller::Anyone => json!({ "scope": "open" }),
        Caller::Holder { record, by_cookie } => json!({
            "scope": record.scope.name(),
            "id": record.id.to_string(),
            "name": record.name,
            "devices": match &record.scope {
                Scope::Ingest { devices } => Some(devices),
                Scope::Read | Scope::Admin => None,
            },
            "signed_in": by_cookie,
        }),
    })
}

/// Hidden from scripts and other sites, and with TLS never sent in the clear.
fn set_cookie(value: &str, max_age_s: i64, peer: Peer) -> HeaderMap {
    let secure = if peer.is_encrypted { "; Secure" } else { "" };
    let name = authorize::cookie_name(peer);
    let cookie =
        format!("{name}={value}; Path=/; Max-Age={max_age_s}; HttpOnly; SameSite=Strict{secure}");
    let mut headers = HeaderMap::new();
    // Hexadecimal digits and dots are always a valid header value.
    if let Ok(cookie) = HeaderValue::try_from(cookie) {
        headers.insert(header::SET_COOKIE, cookie);
    }
    headers
}
