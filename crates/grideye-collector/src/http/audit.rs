//! The sensors' current state, and whether the counts balance.

use crate::http::refusal::Refusal;
use crate::http::state::AppState;
use crate::live::stream_json;
use axum::extract::State;
use axum::response::Json;
use serde_json::{Value, json};

pub(crate) async fn sensors(State(state): State<AppState>) -> Json<Value> {
    Json(state.0.live.sensors_json())
}

/// The counts of the streams added to last (read = stored + dropped + spooled), and the devices whose name several agents use.
pub(crate) async fn audit(State(state): State<AppState>) -> Result<Json<Value>, Refusal> {
    let streams = state.store().streams().await?;
    let in_all = state.store().usage().await?.streams;
    let unlisted = in_all.saturating_sub(u64::try_from(streams.len()).unwrap_or(u64::MAX));
    let unbalanced = streams
        .iter()
        .filter(|stream| stream.unaccounted().is_some_and(|frames| frames != 0))
        .count();
    let streams: Vec<Value> = streams
        .iter()
        .map(|stream| Value::Object(stream_json(stream)))
        .collect();
    Ok(Json(
        json!({ "balanced": unbalanced == 0, "rivals": state.0.live.rivals_json(), "unlisted": unlisted,
            "streams": streams }),
    ))
}
