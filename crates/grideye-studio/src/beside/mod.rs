//! A real sensor beside a simulated one on the live page: scenes, what their sensors would see, and how well that
//! matches.
//!
//! | GET | returns |
//! |---|---|
//! | `/v1/scenes` | the folder's scenes, with their sensors |
//! | `/v1/scenes/{scene}/room?at_s=12` | the room and who is where, to be drawn from any side |
//! | `/v1/scenes/{scene}/sensors/{sensor}/frames?at_s=12` | five seconds of simulated frames, with the agents' positions |
//! | `/v1/scenes/{scene}/sensors/{sensor}/comparison?device=…&of=…` | scores, floors, ceilings and verdict for the last seconds; POST: of frames that the collector does not have |
//!
//! The collector knows nothing of scenes: it is given these routes, and requires the same tokens as for its own.

mod frames;
mod verdict;
mod window;

use crate::assets;
use crate::catalogue::{Catalogue, LoadedScene, SceneEntry, unusable};
use crate::outline;
use crate::queue::Queue;
use axum::Router;
use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, Path as PathOf, Query, State};
use axum::http::StatusCode;
use axum::response::Json;
use axum::routing::get;
use grideye_collector::{Annex, Inside, Refusal};
use grideye_frame::{COLUMNS, ROWS};
use grideye_recording::Record;
use grideye_recording::wire::Batch;
use serde::Deserialize;
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::Duration;
use verdict::{Question, Verdicts};

/// The routes for the scenes of a catalogue, and the panel on the live page; `demonstration` names the scene and its sensor that
/// the panel opens with.
pub(crate) fn annex(
    catalogue: impl Fn() -> Catalogue + Send + Sync + 'static,
    demonstration: Option<[&str; 2]>,
) -> Annex {
    Annex::new("scenes", move |inside| {
        let beside = Arc::new(Beside {
            inside: inside.clone(),
            catalogue: Arc::new(catalogue()),
            queue: Queue::new(),
            verdicts: Verdicts::new(),
        });
        Router::new()
            .route("/v1/scenes", get(scenes))
            .route("/v1/scenes/{scene}/room", get(room))
            .route("/v1/scenes/{scene}/sensors/{sensor}/frames", get(simulated))
            .route(
                "/v1/scenes/{scene}/sensors/{sensor}/comparison",
                get(comparison)
                    .post(comparison)
                    .layer(DefaultBodyLimit::max(SENT_BYTES_MAX)),
            )
            .with_state(beside)
    })
    .described_by(include_str!("../../openapi/scenes.json"))
    .with_assets(&assets::BESIDE)
    .on_the_page(head(demonstration))
}

/// Frames of a minute as JSON are a third of this.
const SENT_BYTES_MAX: usize = 1024 * 1024;
const TEMPLATE: &str = "<template id=\"beside-panel\"";

fn head(demonstration: Option<[&str; 2]>) -> String {
    let Some(names) = demonstration else {
        return assets::BESIDE_HEAD.to_owned();
    };
    let [scene, sensor] = names.map(|name| name.replace('&', "&amp;").replace('"', "&quot;"));
    let named = format!("{TEMPLATE} data-scene=\"{scene}\" data-sensor=\"{sensor}\"");
    assets::BESIDE_HEAD.replace(TEMPLATE, &named)
}

struct Beside {
    inside: Inside,
    catalogue: Arc<Catalogue>,
    queue: Queue,
    verdicts: Verdicts,
}

type Shared = State<Arc<Beside>>;

async fn scenes(State(beside): Shared) -> Result<Json<Value>, Refusal> {
    let catalogue = Arc::clone(&beside.catalogue);
    let listed = beside.queue.run(move || catalogue.list()).await?;
    let listed = listed.map_err(|error| folder_failed(&error))?;
    let scenes: Vec<Value> = listed.iter().map(|scene| entry(scene)).collect();
    Ok(Json(json!({ "scenes": scenes })))
}

fn entry(scene: &SceneEntry) -> Value {
    let loaded = scene.loaded.as_ref();
    let sensors = loaded.map(|loaded| loaded.scene.sensors());
    let sensors: Vec<Value> = sensors
        .unwrap_or_default()
        .iter()
        .map(|sensor| {
            let is_fit = (sensor.columns, sensor.rows) == (COLUMNS, ROWS);
            json!({ "name": sensor.name, "columns": sensor.columns, "rows": sensor.rows, "fits": is_fit })
        })
        .collect();
    json!({
        "name": scene.name,
        "title": scene.title,
        "starts_utc": loaded.ok().and_then(|loaded| Some(loaded.scene.starts_utc()?.to_string())),
        "moves": loaded.is_ok_and(|loaded| !loaded.scene.is_static()),
        "seconds": loaded.map_or(0.0, |loaded| loaded.scene.duration().as_secs_f64()),
        "sensors": sensors,
        "error": loaded.err(),
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct At {
    /// A second of the scene.
    at_s: f64,
}

async fn room(
    State(beside): Shared,
    PathOf(scene): PathOf<String>,
    Query(At { at_s }): Query<At>,
) -> Result<Json<Value>, Refusal> {
    let scene = beside.find(scene).await?;
    scene.usable()?;
    let at = Duration::try_from_secs_f64(at_s).unwrap_or_default();
    let drawn = beside.queue.run(move || match &scene.loaded {
        Ok(loaded) => outline::room_at(&loaded.scene, at.min(loaded.scene.duration())),
        Err(_) => Value::Null,
    });
    Ok(Json(drawn.await?))
}

async fn simulated(
    State(beside): Shared,
    PathOf((scene, sensor)): PathOf<(String, String)>,
    Query(At { at_s }): Query<At>,
) -> Result<Json<Value>, Refusal> {
    let scene = beside.find(scene).await?;
    let loaded = scene.usable()?;
    check_sensor(loaded, &sensor)?;
    let number = frames::piece_at(at_s, loaded);
    let catalogue = Arc::clone(&beside.catalogue);
    let made = beside.queue.run(move || {
        let loaded = scene
            .loaded
            .as_ref()
            .map_err(|error| anyhow::anyhow!("{error}"))?;
        frames::piece(&catalogue, &scene, loaded, &sensor, number)
    });
    let piece = made.await?;
    Ok(Json(
        piece.map_err(|error| unusable(&format!("{error:#}")))?,
    ))
}

async fn comparison(
    State(beside): Shared,
    PathOf((scene, sensor)): PathOf<(String, String)>,
    Query(question): Query<Question>,
    body: Bytes,
) -> Result<Json<Value>, Refusal> {
    let scene = beside.find(scene).await?;
    check_sensor(scene.usable()?, &sensor)?;
    let sent = (!body.is_empty()).then(|| sent(&body)).transpose()?;
    let answer = beside
        .verdicts
        .answer(&beside.inside, (scene, sensor), question, sent);
    Ok(Json(answer.await?))
}

/// The frames of a body as that of `POST /v1/frames`.
fn sent(body: &[u8]) -> Result<Vec<Record>, Refusal> {
    let batch = Batch::from_json(body).map_err(|error| {
        Refusal::new(
            StatusCode::UNPROCESSABLE_ENTITY,
            "wrong_body",
            error.to_string(),
        )
    })?;
    let frames = batch.sensors.into_iter().flat_map(|one| one.frames);
    Ok(frames.collect())
}

impl Beside {
    async fn find(&self, name: String) -> Result<Arc<SceneEntry>, Refusal> {
        let catalogue = Arc::clone(&self.catalogue);
        let asked = name.clone();
        let found = self.queue.run(move || catalogue.find(&asked)).await?;
        let found = found.map_err(|error| folder_failed(&error))?;
        found.ok_or_else(|| {
            let what = format!("there is no scene {name:?} in the folder");
            Refusal::new(StatusCode::NOT_FOUND, "no_such_scene", what)
                .hint("GET /v1/scenes lists them; a scene's name is its file name without .toml")
        })
    }
}

fn check_sensor(loaded: &LoadedScene, name: &str) -> Result<(), Refusal> {
    let sensor = loaded.scene.sensor(name);
    let sensor = sensor.map_err(|error| {
        Refusal::new(StatusCode::NOT_FOUND, "no_such_sensor", error.to_string()).field("sensor")
    })?;
    if (sensor.columns, sensor.rows) == (COLUMNS, ROWS) {
        return Ok(());
    }
    let what = format!(
        "the sensor {name} has {} x {} pixels, but a frame has {COLUMNS} x {ROWS}",
        sensor.columns, sensor.rows
    );
    Err(unusable(&what).field("sensor"))
}

fn folder_failed(error: &anyhow::Error) -> Refusal {
    let what = format!("{error:#}");
    Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "no_scenes", what)
}
