//! The page that opens with a scene, and what was recorded of it.

use crate::{app_of, ask, says};
use axum::http::Method;
use grideye_collector::{Routes, SystemClock};
use grideye_scene::Scene;
use grideye_studio::{Demonstration, Recorded};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;

const EMPTY: &str = "[room]\nsize_mm = [4000, 4000, 2700]\nambient_c = 20\n";

pub(crate) fn demonstration() -> Demonstration {
    let none = |_name: &str| Err(std::io::ErrorKind::NotFound.into());
    let text = format!(
        "{EMPTY}[[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\nposition_mm = [2000, 2000, 2700]\nelevation_deg = 90\nazimuth_deg = 0\n"
    );
    Demonstration {
        name: "a\"b".to_owned(),
        title: "The scene of the demonstration.".to_owned(),
        scene: Scene::parse(&text, "scene", &none).unwrap().scene,
        sensor: "ceiling".to_owned(),
        recorded: Arc::default(),
    }
}

async fn served(folder: Option<&Path>, demonstration: &Demonstration) -> Routes {
    app_of(folder, Some(demonstration), Arc::new(SystemClock::new())).await
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
        let app = served(folder, &demonstration()).await;
        let get = async |path| ask(&app, Method::GET, path, None).await.1;
        let scenes = get("/v1/scenes").await["scenes"].take();
        let scenes = scenes.as_array().unwrap();
        let names: Vec<&Value> = scenes.iter().map(|scene| &scene["name"]).collect();
        assert_eq!(json!(names), wanted);
        assert_eq!(scenes[0]["sensors"][0]["name"], "ceiling");
        let frames = get("/v1/scenes/a%22b/sensors/ceiling/frames?at_s=0").await;
        assert_eq!(frames["frames"][0].as_array().map(Vec::len), Some(64));
        says(
            &get("/").await,
            "data-scene=\"a&quot;b\" data-sensor=\"ceiling\"",
        );
    }
}

#[tokio::test]
async fn the_report_is_served_once_the_recording_is_complete() {
    let demonstration = demonstration();
    let app = served(None, &demonstration).await;
    let get = async |path| ask(&app, Method::GET, path, None).await;
    assert_eq!(get("/report").await.0, 404);
    assert_eq!(get("/v1/opening").await.1, json!({ "recorded": null }));
    let recorded = Recorded {
        recording: 1,
        name: "demo-b1".to_owned(),
        frames: 100,
        report: "<p>report</p>".to_owned(),
    };
    assert!(demonstration.recorded.set(recorded).is_ok());
    assert_eq!(get("/report").await, (200, json!("<p>report</p>")));
    let told = json!({ "recording": 1, "name": "demo-b1", "frames": 100 });
    assert_eq!(get("/v1/opening").await.1, json!({ "recorded": told }));
}
