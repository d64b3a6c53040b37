//! The studio's routes through the collector's own router, without a socket.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

mod beside;
mod demonstration;
mod editor;

use axum::body::{Body, to_bytes};
use axum::http::{Method, Request, header};
use grideye_collector::{
    AppState, Clock, Limits, Routes, SqliteStore, StoreLocation, SystemClock, app_with,
};
use grideye_studio::{Demonstration, Disk, annexes};
use serde_json::Value;
use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::Path;
use std::sync::Arc;
use tower::ServiceExt as _;

/// Reads without a limit, and does not sync.
const DISK: Disk = Disk {
    read: |mut file| {
        let mut text = String::new();
        file.read_to_string(&mut text).map(|_bytes| text)
    },
    replace: |path, content| {
        let partial = path.with_extension("partial");
        io::copy(content, &mut File::create(&partial)?)?;
        fs::rename(partial, path)
    },
};

/// The routes on a folder of scenes.
pub(crate) async fn app(folder: &Path, clock: Arc<dyn Clock>) -> Routes {
    app_of(Some(folder), None, clock).await
}

pub(crate) async fn app_of(
    folder: Option<&Path>,
    demonstration: Option<&Demonstration>,
    clock: Arc<dyn Clock>,
) -> Routes {
    let annexes = annexes(folder, demonstration, DISK).unwrap();
    let limits = Limits::default();
    let store = SqliteStore::open(&StoreLocation::Memory, &limits).unwrap();
    let state = AppState::new(Arc::new(store), limits, clock).await;
    app_with(state.unwrap(), &annexes)
}

/// The status, and the body as JSON, or else as text.
pub(crate) async fn ask(
    app: &Routes,
    method: Method,
    path: &str,
    body: Option<&Value>,
) -> (u16, Value) {
    let request = Request::builder()
        .method(method)
        .uri(path)
        .header(header::HOST, "127.0.0.1:8833")
        .header(header::CONTENT_TYPE, "application/json")
        .body(body.map_or(Body::empty(), |body| Body::from(body.to_string())))
        .unwrap();
    let response = app.clone().oneshot(request).await.unwrap();
    let status = response.status().as_u16();
    let bytes = to_bytes(response.into_body(), 16 << 20).await.unwrap();
    let text = || String::from_utf8_lossy(&bytes).into_owned();
    (
        status,
        serde_json::from_slice(&bytes).unwrap_or_else(|_| text().into()),
    )
}

/// Asserts that an answer's text contains these words.
pub(crate) fn says(said: &Value, words: &str) {
    let said = said.as_str().unwrap();
    assert!(said.contains(words), "{words}: {said}");
}

/// Every file that the pages and their scripts name is served, and every served file is named.
#[tokio::test]
async fn the_pages_are_made_of_files_that_are_there() {
    let folder = tempfile::tempdir().unwrap();
    let demonstration = demonstration::demonstration();
    let clock = Arc::new(SystemClock::new());
    let app = app_of(Some(folder.path()), Some(&demonstration), clock).await;
    let text_at = async |path: &str| {
        let (status, text) = ask(&app, Method::GET, path, None).await;
        assert_eq!(status, 200, "{path}");
        text.as_str().unwrap().to_owned()
    };
    let mut named: Vec<String> = Vec::new();
    for page in ["/", "/editor"] {
        let html = text_at(page).await;
        let parts = html
            .split('"')
            .filter_map(|text| text.strip_prefix("/assets/"));
        named.extend(parts.map(str::to_owned));
    }
    let mut seen = 0;
    while let Some(name) = named.get(seen).cloned() {
        seen += 1;
        let text = text_at(&format!("/assets/{name}")).await;
        let imports = text.split("from \"./").skip(1);
        for import in imports.filter_map(|rest| rest.split('"').next()) {
            if !named.iter().any(|known| known == import) {
                named.push(import.to_owned());
            }
        }
    }
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    for asset in fs::read_dir(assets).unwrap() {
        let name = asset.unwrap().file_name().into_string().unwrap();
        let is_page = name.ends_with(".html");
        assert!(is_page || named.contains(&name), "{name}");
    }
}
