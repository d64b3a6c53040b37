//! The scene that the live page opens with, and what was recorded of it: `grideye demo`.

use crate::assets;
use crate::catalogue::Shelved;
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
pub struct Opening {
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

/// A complete recording of the opening scene.
#[derive(Debug)]
pub struct Recorded {
    /// Its number in the collector.
    pub recording: i64,
    /// Its name.
    pub name: String,
    /// Its frames.
    pub frames: usize,
    /// The verdict of its comparison with the scene.
    pub verdict: String,
    /// The comparison's report, a whole HTML page.
    pub report: String,
}

impl Opening {
    pub(crate) fn names(&self) -> [&str; 2] {
        [&self.name, &self.sensor]
    }

    pub(crate) fn annex(&self) -> Annex {
        let recorded = Arc::clone(&self.recorded);
        Annex::new("opening", move |_inside| {
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

impl From<&Opening> for Shelved {
    fn from(opening: &Opening) -> Self {
        let Opening {
            name, title, scene, ..
        } = opening;
        Self::fixed(name.clone(), title.clone(), scene.clone())
    }
}

fn answer(recorded: Option<&Recorded>) -> Value {
    let recorded = recorded.map(|recorded| {
        json!({
            "recording": recorded.recording,
            "name": recorded.name,
            "frames": recorded.frames,
            "verdict": recorded.verdict,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{annexes, disk, testing};
    use axum::http::Method;
    use grideye_collector::SystemClock;
    use std::path::Path;

    const EMPTY: &str = "[room]\nsize_mm = [4000, 4000, 2700]\nambient_c = 20\n";

    fn opening() -> Opening {
        let none = |_name: &str| Err(std::io::ErrorKind::NotFound.into());
        let text = format!(
            "{EMPTY}[[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\nposition_mm = [2000, 2000, 2700]\nelevation_deg = 90\nazimuth_deg = 0\n"
        );
        Opening {
            name: "a\"b".to_owned(),
            title: "The scene of the demonstration.".to_owned(),
            scene: Scene::parse(&text, "scene", &none).unwrap().scene,
            sensor: "ceiling".to_owned(),
            recorded: Arc::default(),
        }
    }

    async fn served(folder: Option<&Path>, opening: &Opening) -> grideye_collector::Routes {
        let annexes = annexes(folder, Some(opening), disk::plain()).unwrap();
        testing::app(&annexes, Arc::new(SystemClock::new())).await
    }

    #[tokio::test]
    async fn the_opening_scene_comes_first_hides_its_namesake_and_needs_no_folder() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a\"b.toml", "a.toml"] {
            std::fs::write(folder.path().join(name), EMPTY).unwrap();
        }
        for (folder, wanted) in [
            (Some(folder.path()), json!(["a\"b", "a"])),
            (None, json!(["a\"b"])),
        ] {
            let app = served(folder, &opening()).await;
            let get = async |path| testing::ask(&app, Method::GET, path, None).await.1;
            let scenes = get("/v1/scenes").await["scenes"].take();
            let scenes = scenes.as_array().unwrap();
            let names: Vec<&Value> = scenes.iter().map(|scene| &scene["name"]).collect();
            assert_eq!(json!(names), wanted);
            assert_eq!(scenes[0]["sensors"][0]["name"], "ceiling");
            let frames = get("/v1/scenes/a%22b/sensors/ceiling/frames?at_s=0").await;
            assert_eq!(frames["frames"][0].as_array().map(Vec::len), Some(64));
            testing::says(
                &get("/").await,
                "data-scene=\"a&quot;b\" data-sensor=\"ceiling\"",
            );
        }
    }

    #[tokio::test]
    async fn the_report_is_served_once_the_recording_is_complete() {
        let opening = opening();
        let app = served(None, &opening).await;
        let get = async |path| testing::ask(&app, Method::GET, path, None).await;
        assert_eq!(get("/report").await.0, 404);
        assert_eq!(get("/v1/opening").await.1, json!({ "recorded": null }));
        let recorded = Recorded {
            recording: 1,
            name: "demo-b1".to_owned(),
            frames: 100,
            verdict: "agrees".to_owned(),
            report: "<p>report</p>".to_owned(),
        };
        assert!(opening.recorded.set(recorded).is_ok());
        assert_eq!(get("/report").await, (200, json!("<p>report</p>")));
        let told = json!({ "recording": 1, "name": "demo-b1", "frames": 100, "verdict": "agrees" });
        assert_eq!(get("/v1/opening").await.1, json!({ "recorded": told }));
    }
}
