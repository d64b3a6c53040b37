//! The sensors' current state, and whether the counts balance.

use crate::auth::Caller;
use crate::http::client::Client;
use crate::http::recordings::not_written;
use crate::http::refusal::Refusal;
use crate::http::state::AppState;
use crate::live::stream_json;
use crate::shares::Sender;
use crate::store::StreamSummary;
use axum::Extension;
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse as _, Json, Response};
use serde_json::{Value, json};

pub(crate) async fn sensors(State(state): State<AppState>) -> Json<Value> {
    Json(state.0.live.sensors_json())
}

/// The counts of the streams added to last (read = stored + dropped + spooled), and the devices whose name several
/// agents use. Few at once, and off the threads that serve: with 20,000 streams the answer takes 10 MB.
pub(crate) async fn audit(
    State(state): State<AppState>,
    Extension(caller): Extension<Caller>,
    Extension(client): Extension<Client>,
) -> Result<Response, Refusal> {
    let sender = Sender::of(Some(&caller), client.peer.address);
    let turn = state.0.audits.take(sender, 1).map_err(|_denied| {
        let what = "other audits are being answered";
        Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "busy", what).hint("retry in a second")
    })?;
    let streams = state.store().streams().await?;
    let in_all = state.store().usage().await?.streams;
    let (rivals, now_ns) = (state.0.live.rivals_json(), state.0.clock.utc_ns());
    let written = tokio::task::spawn_blocking(move || {
        let _turn = turn;
        let unlisted = in_all.saturating_sub(u64::try_from(streams.len()).unwrap_or(u64::MAX));
        let mut unaccounted = streams.iter().filter_map(StreamSummary::unaccounted);
        let balanced = unaccounted.all(|frames| frames == 0);
        let streams = streams.iter().map(|stream| {
            let mut json = stream_json(stream);
            let since_ns = now_ns.saturating_sub(stream.t_last_arrival_ns).max(0);
            json.insert(
                "last_report_s".to_owned(),
                (since_ns / 1_000_000_000).into(),
            );
            Value::Object(json)
        });
        let streams: Vec<Value> = streams.collect();
        let audit = json!({ "balanced": balanced, "rivals": rivals, "unlisted": unlisted, "streams": streams });
        audit.to_string()
    });
    let body = written.await.map_err(not_written)?;
    Ok(([(header::CONTENT_TYPE, "application/json")], body).into_response())
}
