//! The page's files, compiled into the program.

use crate::http::{Annex, Asset, Refusal};
use axum::body::Bytes;
use axum::http::{HeaderName, StatusCode, header};
use axum::response::{IntoResponse, Response};
use std::collections::BTreeSet;
use std::sync::Arc;

const HTML: &str = "text/html; charset=utf-8";
const JAVASCRIPT: &str = "text/javascript; charset=utf-8";

macro_rules! file {
    ($name:literal, $kind:expr) => {
        Asset {
            name: $name,
            kind: $kind,
            text: include_str!(concat!("../../assets/", $name)),
        }
    };
}

const ASSETS: [Asset; 34] = [
    file!("style.css", "text/css; charset=utf-8"),
    file!("favicon.svg", "image/svg+xml"),
    file!("advice.js", JAVASCRIPT),
    file!("ask.js", JAVASCRIPT),
    file!("brought.js", JAVASCRIPT),
    file!("devices.js", JAVASCRIPT),
    file!("exports.js", JAVASCRIPT),
    file!("feed.js", JAVASCRIPT),
    file!("heatmap.js", JAVASCRIPT),
    file!("history.js", JAVASCRIPT),
    file!("keep.js", JAVASCRIPT),
    file!("keys.js", JAVASCRIPT),
    file!("labels.js", JAVASCRIPT),
    file!("library.js", JAVASCRIPT),
    file!("login.js", JAVASCRIPT),
    file!("look.js", JAVASCRIPT),
    file!("main.js", JAVASCRIPT),
    file!("note.js", JAVASCRIPT),
    file!("orientation.js", JAVASCRIPT),
    file!("palettes.js", JAVASCRIPT),
    file!("picture.js", JAVASCRIPT),
    file!("playback.js", JAVASCRIPT),
    file!("played-sensor.js", JAVASCRIPT),
    file!("player.js", JAVASCRIPT),
    file!("recorded.js", JAVASCRIPT),
    file!("recordings.js", JAVASCRIPT),
    file!("scale.js", JAVASCRIPT),
    file!("sensor.js", JAVASCRIPT),
    file!("sign-out.js", JAVASCRIPT),
    file!("smooth.js", JAVASCRIPT),
    file!("timeline.js", JAVASCRIPT),
    file!("track.js", JAVASCRIPT),
    file!("troubles.js", JAVASCRIPT),
    file!("words.js", JAVASCRIPT),
];

/// The placeholder for the annexes' parts of the page.
const ANNEXES: &str = "  <!-- annexes -->\n";

pub(crate) fn page(annexes: &[Annex]) -> impl IntoResponse + Clone + use<> {
    let heads: String = annexes.iter().map(|annex| &*annex.head).collect();
    let page = include_str!("../../assets/index.html").replace(ANNEXES, &heads);
    file(HTML, Bytes::from(page))
}

/// The files of all pages.
///
/// # Panics
/// If two of them have the same name.
pub(crate) fn parts(annexes: &[Annex]) -> Arc<[Asset]> {
    let brought = annexes.iter().flat_map(|annex| annex.assets);
    let parts: Arc<[Asset]> = ASSETS.iter().chain(brought).copied().collect();
    let names: BTreeSet<&str> = parts.iter().map(|part| part.name).collect();
    assert_eq!(
        names.len(),
        parts.len(),
        "two files of the pages have the same name"
    );
    parts
}

pub(crate) fn login() -> Response {
    file(HTML, include_str!("../../assets/login.html")).into_response()
}

pub(crate) fn asset(parts: &[Asset], name: &str) -> Result<impl IntoResponse + use<>, Refusal> {
    let found = parts.iter().find(|asset| asset.name == name);
    let Asset { kind, text, .. } = found.ok_or_else(|| {
        Refusal::new(
            StatusCode::NOT_FOUND,
            "unknown_path",
            "the page has no such part",
        )
    })?;
    Ok(file(kind, *text))
}

/// The files change with the program, so browsers revalidate them each time.
fn file<T>(kind: &'static str, text: T) -> ([(HeaderName, &'static str); 2], T) {
    let headers = [
        (header::CONTENT_TYPE, kind),
        (header::CACHE_CONTROL, "no-cache"),
    ];
    (headers, text)
}
