//! The scene that the live page opens with, and what was recorded of it: `grideye demo`.

use crate::assets;
use crate::catalogue::SceneEntry;
use axum::Router;
use axum::http::{StatusCode, header};
use axum::response::{Html, IntoResponse, Json, Response};
use axum::routing::get;
use grideye_collector::{Annex, Refusal};
use grideye_scene::Scene;
use serde_json::{Value, json};
use std::sync::{Arc, OnceLock};

/// The report has its styles in itself. It runs no script and loads nothing.
const REPORT_POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// A scene that the page shows beside the sensor at once, before those of the folder.
#[derive(Debug)]
pub struct Demonstration {
    /// The scene's name in the page's list.
    pub name: String,
    /// One sentence about it.
    pub title: String,
    /// The scene.
    pub scene: Scene,
    /// The sensor of the scene that stands for the real one.
    pub sensor: String,
    /// The recording, once it is complete.
    pub recorded: Arc<OnceLock<Recorded>>,
}

/// A complete recording of the demonstration scene.
#[derive(Debug)]
pub struct Recorded {
    /// Its number in the collector.
    pub recording: i64,
    /// Its name.
    pub name: String,
    /// Its frames.
    pub frames: usize,
    /// The comparison's report, a whole HTML page.
    pub report: String,
}

impl Demonstration {
    pub(crate) fn names(&self) -> [&str; 2] {
        [&self.name, &self.sensor]
    }

    pub(crate) fn annex(&self) -> Annex {
        let recorded = Arc::clone(&self.recorded);
        Annex::new("demonstration", move |_inside| {
            let [state, page] = [&recorded, &recorded].map(Arc::clone);
            Router::new()
                .route(
                    "/v1/opening",
                    get(move || async move { Json(answer(state.get())) }),
                )
                .route("/report", get(move || async move { report(page.get()) }))
        })
        .described_by(include_str!("../openapi/opening.json"))
        .with_assets(&assets::OPENING)
        .on_the_page(assets::OPENING_HEAD)
    }
}

impl From<&Demonstration> for SceneEntry {
    fn from(demonstration: &Demonstration) -> Self {
        let Demonstration {
            name, title, scene, ..
        } = demonstration;
        Self::fixed(name.clone(), title.clone(), scene.clone())
    }
}

fn answer(recorded: Option<&Recorded>) -> Value {
    let recorded = recorded.map(|recorded| {
        json!({
            "recording": recorded.recording,
            "name": recorded.name,
            "frames": recorded.frames,
        })
    });
    json!({ "recorded": recorded })
}

fn report(recorded: Option<&Recorded>) -> Result<Response, Refusal> {
    let recorded = recorded.ok_or_else(|| {
        let what = "the recording is not complete yet";
        Refusal::new(StatusCode::NOT_FOUND, "no_report", what)
    })?;
    let policy = [(header::CONTENT_SECURITY_POLICY, REPORT_POLICY)];
    Ok((policy, Html(recorded.report.clone())).into_response())
}
