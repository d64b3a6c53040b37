//! The page's files, compiled into the program.

use crate::http::{Annex, Asset, Refusal};
use axum::body::Bytes;
use axum::http::{HeaderName, StatusCode, header};
use axum::response::{IntoResponse, Response};
use std::collections::BTreeSet;
use std::sync::Arc;

const HTML: &str = "text/html; charset=utf-8";

macro_rules! files {
    ($($name:literal)*) => {
        [$(Asset { name: $name, kind: kind_of($name), text: include_str!(concat!("../../assets/", $name)) }),*]
    };
}

const ASSETS: [Asset; 36] = files! {
    "style.css" "favicon.svg" "advice.js" "ask.js" "brought.js" "devices.js" "exports.js" "feed.js" "files.js" "heatmap.js"
    "history.js" "keep.js" "keys.js" "labels.js" "library.js" "login.js" "look.js" "main.js" "note.js"
    "orientation.js" "palettes.js" "picture.js" "playback.js" "played-sensor.js" "player.js" "recorded.js"
    "recordings.js" "scale.js" "sensor.js" "sign-out.js" "smooth.js" "timeline.js" "track.js" "troubles.js" "wall.js"
    "words.js"
};

const fn kind_of(name: &str) -> &'static str {
    match name.as_bytes() {
        [.., b'.', b'c', b's', b's'] => "text/css; charset=utf-8",
        [.., b'.', b's', b'v', b'g'] => "image/svg+xml",
        _ => "text/javascript; charset=utf-8",
    }
}

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
