//! The live page: files that are part of the program.

use crate::http::Refusal;
use axum::extract::Path;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

const JAVASCRIPT: &str = "text/javascript; charset=utf-8";

/// A file of `assets/` with its type.
macro_rules! file {
    ($name:literal, $kind:expr) => {
        ($name, $kind, include_str!(concat!("../../assets/", $name)))
    };
}

/// Name, type and text.
const ASSETS: [(&str, &str, &str); 52] = [
    file!("style.css", "text/css; charset=utf-8"),
    file!("editor.css", "text/css; charset=utf-8"),
    file!("favicon.svg", "image/svg+xml"),
    file!("advice.js", JAVASCRIPT),
    file!("ask.js", JAVASCRIPT),
    file!("beside.js", JAVASCRIPT),
    file!("cover.js", JAVASCRIPT),
    file!("devices.js", JAVASCRIPT),
    file!("difference.js", JAVASCRIPT),
    file!("draft.js", JAVASCRIPT),
    file!("editor.js", JAVASCRIPT),
    file!("exports.js", JAVASCRIPT),
    file!("feed.js", JAVASCRIPT),
    file!("fields.js", JAVASCRIPT),
    file!("floor-plan.js", JAVASCRIPT),
    file!("hatch.js", JAVASCRIPT),
    file!("heatmap.js", JAVASCRIPT),
    file!("history.js", JAVASCRIPT),
    file!("keep.js", JAVASCRIPT),
    file!("keys.js", JAVASCRIPT),
    file!("labels.js", JAVASCRIPT),
    file!("library.js", JAVASCRIPT),
    file!("login.js", JAVASCRIPT),
    file!("look.js", JAVASCRIPT),
    file!("main.js", JAVASCRIPT),
    file!("names.js", JAVASCRIPT),
    file!("new-things.js", JAVASCRIPT),
    file!("note.js", JAVASCRIPT),
    file!("orientation.js", JAVASCRIPT),
    file!("palettes.js", JAVASCRIPT),
    file!("picture.js", JAVASCRIPT),
    file!("plan.js", JAVASCRIPT),
    file!("playback.js", JAVASCRIPT),
    file!("played-sensor.js", JAVASCRIPT),
    file!("player.js", JAVASCRIPT),
    file!("recorded.js", JAVASCRIPT),
    file!("recordings.js", JAVASCRIPT),
    file!("room-view.js", JAVASCRIPT),
    file!("scale.js", JAVASCRIPT),
    file!("scene-text.js", JAVASCRIPT),
    file!("scores.js", JAVASCRIPT),
    file!("seen.js", JAVASCRIPT),
    file!("sensor.js", JAVASCRIPT),
    file!("sign-out.js", JAVASCRIPT),
    file!("simulation.js", JAVASCRIPT),
    file!("smooth.js", JAVASCRIPT),
    file!("thing-list.js", JAVASCRIPT),
    file!("things.js", JAVASCRIPT),
    file!("timeline.js", JAVASCRIPT),
    file!("track.js", JAVASCRIPT),
    file!("troubles.js", JAVASCRIPT),
    file!("words.js", JAVASCRIPT),
];

pub(crate) async fn page() -> Response {
    file(
        "text/html; charset=utf-8",
        include_str!("../../assets/index.html"),
    )
}

/// The page on which scenes are edited.
pub(crate) async fn editor() -> Response {
    file(
        "text/html; charset=utf-8",
        include_str!("../../assets/editor.html"),
    )
}

/// The page for signing in.
pub(crate) fn login() -> Response {
    file(
        "text/html; charset=utf-8",
        include_str!("../../assets/login.html"),
    )
}

pub(crate) async fn asset(Path(name): Path<String>) -> Result<Response, Refusal> {
    let found = ASSETS.iter().find(|(asset, ..)| *asset == name);
    let (_, content_type, text) = found.ok_or_else(|| {
        Refusal::new(
            StatusCode::NOT_FOUND,
            "unknown_path",
            "the page has no such part",
        )
    })?;
    Ok(file(content_type, text))
}

/// The files change with the program, so the browser asks for them anew each time.
fn file(content_type: &'static str, text: &'static str) -> Response {
    let headers = [
        (header::CONTENT_TYPE, content_type),
        (header::CACHE_CONTROL, "no-cache"),
    ];
    (headers, text).into_response()
}
