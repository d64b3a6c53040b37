//! The live page: files that are part of the program.

use super::answer::Refusal;
use axum::extract::Path;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

const JAVASCRIPT: &str = "text/javascript; charset=utf-8";

/// Name, type and text.
const ASSETS: [(&str, &str, &str); 9] = [
    (
        "style.css",
        "text/css; charset=utf-8",
        include_str!("../../assets/style.css"),
    ),
    (
        "favicon.svg",
        "image/svg+xml",
        include_str!("../../assets/favicon.svg"),
    ),
    ("main.js", JAVASCRIPT, include_str!("../../assets/main.js")),
    ("feed.js", JAVASCRIPT, include_str!("../../assets/feed.js")),
    (
        "heatmap.js",
        JAVASCRIPT,
        include_str!("../../assets/heatmap.js"),
    ),
    (
        "palette.js",
        JAVASCRIPT,
        include_str!("../../assets/palette.js"),
    ),
    (
        "recordings.js",
        JAVASCRIPT,
        include_str!("../../assets/recordings.js"),
    ),
    (
        "sensor.js",
        JAVASCRIPT,
        include_str!("../../assets/sensor.js"),
    ),
    (
        "words.js",
        JAVASCRIPT,
        include_str!("../../assets/words.js"),
    ),
];

pub(super) async fn page() -> Response {
    file(
        "text/html; charset=utf-8",
        include_str!("../../assets/index.html"),
    )
}

pub(super) async fn asset(Path(name): Path<String>) -> Result<Response, Refusal> {
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
