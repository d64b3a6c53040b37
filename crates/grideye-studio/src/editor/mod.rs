//! The scene editor's routes: open, try and save scenes for the page `/editor`.
//!
//! | method | path | does |
//! |---|---|---|
//! | GET | `/editor` | the page |
//! | GET | `/v1/editor/scenes/{scene}` | a scene's text with its version |
//! | POST | `/v1/editor/draft` | applies edits to a text; returns the resulting objects and what every sensor would see |
//! | POST | `/v1/editor/coverage` | where a draft's sensors see a person |
//! | PUT | `/v1/editor/scenes/{scene}` | saves a text, unless another person saved it meanwhile |
//!
//! The page sends the text with each request: the server keeps no drafts. An invalid draft gets a normal response with
//! the error and its place, because a draft may be invalid for a while.

mod coverage;
mod draft;
mod edit;
mod fault;
mod store;
mod trajectory;

use crate::assets;
use crate::catalogue::{Catalogue, SceneEntry, unusable};
use crate::disk::Disk;
use crate::queue::Queue;
use axum::Router;
use axum::body::Bytes;
use axum::extract::rejection::BytesRejection;
use axum::extract::{DefaultBodyLimit, Path as PathOf, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Json};
use axum::routing::{get, post};
use draft::Draft;
use grideye_collector::{Annex, Refusal};
use grideye_scene::keys;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use store::{Save, SceneStore, version_of};

/// Maximum bytes of a request: the longest scene and its trajectories, with room for JSON escapes.
const BODY_BYTES_MAX: usize = 4 * 1024 * 1024;
const MAPS_WAITING_MAX: usize = 4;

/// The routes for a folder of scenes, and the page.
pub(crate) fn annex(folder: PathBuf, disk: Disk) -> Annex {
    Annex::new("editor", move |_inside| {
        let editor = Arc::new(Editor {
            store: SceneStore::new(folder.clone(), disk),
            catalogue: Catalogue::new(Some(folder.clone()), None, disk),
            drafts: Queue::new(),
            maps: Queue::with_waiting(MAPS_WAITING_MAX),
        });
        Router::new()
            .route("/editor", get(page))
            .route("/v1/editor/scenes/{scene}", get(open).put(save))
            .route("/v1/editor/draft", post(draft))
            .route("/v1/editor/coverage", post(coverage))
            .layer(DefaultBodyLimit::max(BODY_BYTES_MAX))
            .with_state(editor)
    })
    .described_by(include_str!("../../openapi/editor.json"))
    .with_assets(&assets::EDITOR)
    .on_the_page(assets::EDITOR_HEAD)
}

struct Editor {
    store: SceneStore,
    catalogue: Catalogue,
    drafts: Queue,
    /// Separate, so that no drag waits for a map.
    maps: Queue,
}

type Shared = State<Arc<Editor>>;

/// The page changes with the program, so browsers revalidate it each time.
async fn page() -> impl IntoResponse {
    let headers = [
        (header::CONTENT_TYPE, "text/html; charset=utf-8"),
        (header::CACHE_CONTROL, "no-cache"),
    ];
    let keys = keys().to_string();
    (headers, assets::EDITOR_PAGE.replace("{{keys}}", &keys))
}

/// What the page's fields say of each key of a table, by the rows that read scene files.
fn keys() -> Value {
    let tables = [
        ("room", &keys::ROOM),
        ("object", &keys::OBJECT),
        ("mosaic", &keys::MOSAIC),
        ("agent", &keys::AGENT),
        ("person", &keys::PERSON),
        ("sensor", &keys::SENSOR),
    ];
    let tables = tables.into_iter().map(|(table, rows)| {
        let of = rows.all().map(|row| {
            let says = json!({ "unit": row.unit, "words": row.words(), "numbers": row.ends(), "doc": row.doc });
            (row.name().to_owned(), says)
        });
        (table.to_owned(), of.collect::<Value>())
    });
    tables.collect()
}

async fn open(State(editor): Shared, PathOf(name): PathOf<String>) -> Result<Json<Value>, Refusal> {
    let here = Arc::clone(&editor);
    let work = move || {
        let text = here.store.open(&name)?;
        let version = version_of(&text);
        Ok(Json(
            json!({ "name": name, "version": version, "shared": here.shared(&name), "text": text }),
        ))
    };
    editor.drafts.run(work).await?
}

async fn draft(State(editor): Shared, body: Body) -> Result<Json<Value>, Refusal> {
    let draft: Draft = read(body)?;
    let here = Arc::clone(&editor);
    let waiting = GivenUp::default();
    let is_given_up = Arc::clone(&waiting.0);
    let work = move || {
        let goes_on = || !is_given_up.load(Ordering::Relaxed);
        Ok(Json(draft::check(&here.store, draft)?.to_json(goes_on)))
    };
    editor.drafts.run(work).await?
}

async fn coverage(State(editor): Shared, body: Body) -> Result<Json<Value>, Refusal> {
    let draft: Draft = read(body)?;
    let here = Arc::clone(&editor);
    // Set when the page sends a newer request, which drops this one.
    let waiting = GivenUp::default();
    let is_given_up = Arc::clone(&waiting.0);
    let work = move || {
        let checked = draft::check(&here.store, draft)?;
        let made = checked
            .loaded
            .and_then(|loaded| coverage::map(&loaded.scene, &is_given_up));
        Ok(Json(match made {
            Ok(map) => json!({ "map": map }),
            Err(fault) => json!({ "fault": fault.to_json() }),
        }))
    };
    editor.maps.run(work).await?
}

async fn save(
    State(editor): Shared,
    PathOf(name): PathOf<String>,
    body: Body,
) -> Result<Json<Value>, Refusal> {
    let save: Save = read(body)?;
    let here = Arc::clone(&editor);
    let work = move || {
        here.check_is_scene(&save)?;
        here.store.save(&name, &save).map(Json)
    };
    editor.drafts.run(work).await?
}

type Body = Result<Bytes, BytesRejection>;

fn read<T: DeserializeOwned>(body: Body) -> Result<T, Refusal> {
    let bytes = body.map_err(|rejected| {
        let what = format!(
            "{}; expected at most {BODY_BYTES_MAX} bytes",
            rejected.body_text()
        );
        Refusal::new(rejected.status(), "no_body", what)
    })?;
    serde_json::from_slice(&bytes).map_err(|error| {
        let what = format!("cannot read the request: {error}");
        Refusal::new(StatusCode::BAD_REQUEST, "not_understood", what)
            .hint("see crates/grideye-studio/README.md for examples")
    })
}

impl Editor {
    /// Saves only what can be opened again.
    fn check_is_scene(&self, save: &Save) -> Result<(), Refusal> {
        let files = save.files.iter();
        let draft = Draft {
            text: save.text.clone(),
            files: files
                .map(|(file, text)| (file.clone(), text.text.clone()))
                .collect(),
            edits: Vec::new(),
            at_s: 0.0,
        };
        match draft::check(&self.store, draft)?.loaded {
            Ok(_) => Ok(()),
            Err(fault) => Err(unusable(&fault.to_string())),
        }
    }

    /// The other scenes that share trajectories with this one: saving changes them too.
    fn shared(&self, name: &str) -> Value {
        let scenes = self.catalogue.list().unwrap_or_default();
        let trajectories = |scene: &SceneEntry| {
            let loaded = scene.loaded.as_ref();
            loaded
                .map(|loaded| loaded.trajectories.clone())
                .unwrap_or_default()
        };
        let own = scenes.iter().find(|scene| scene.name == name);
        let own = own.map(|scene| trajectories(scene)).unwrap_or_default();
        let others = scenes.iter().filter(|scene| scene.name != name);
        let shared = others.filter(|scene| trajectories(scene).iter().any(|one| own.contains(one)));
        shared.map(|scene| scene.name.clone()).collect()
    }
}

/// Tells the computation that the request was dropped.
#[derive(Default)]
struct GivenUp(Arc<AtomicBool>);

impl Drop for GivenUp {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}
