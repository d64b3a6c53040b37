//! A scene being edited: applies edits to its text, and shows the resulting objects and what every sensor would see.

use super::edit::{self, EDITS_MAX, Edit};
use super::fault::{Fault, ORIGIN};
use super::store::{SceneStore, TEXT_BYTES_MAX, version_of};
use super::trajectory::{self, TrajectoryEdit};
use crate::outline;
use crate::rounding::hundredths;
use axum::http::StatusCode;
use grideye_collector::Refusal;
use grideye_scene::{Loaded, Scene, Sensor, Simulator, Warning};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Maximum sensors with frames; others are not shown.
const SENSORS_MAX: usize = 32;
/// Maximum pixels of a shown frame; a Lepton has 4,800.
const PIXELS_MAX: usize = 20_000;
/// Maximum time for frames and for what no frame shows, because other pages wait.
const TIME_MAX: Duration = Duration::from_secs(2);
/// Maximum files sent with a draft.
const FILES_MAX: usize = 100;

/// The page's state, and the edits to apply.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Draft {
    pub(super) text: String,
    /// Trajectories that differ from the disk, or were read from it before.
    #[serde(default)]
    pub(super) files: BTreeMap<String, String>,
    #[serde(default)]
    pub(super) edits: Vec<Change>,
    /// The second of the scene to show.
    #[serde(default)]
    pub(super) at_s: f64,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum Change {
    Text(Edit),
    Trajectory(TrajectoryEdit),
}

/// A draft after parsing, or its error.
pub(super) struct Checked {
    pub(super) text: String,
    pub(super) files: BTreeMap<String, String>,
    /// Trajectories just read from the disk.
    read: BTreeMap<String, String>,
    pub(super) loaded: Result<Loaded, Fault>,
    at: Duration,
}

/// Applies the edits and parses the result; blocks on files.
///
/// # Errors
/// 422 if the draft is too large. An invalid scene is a normal answer.
pub(super) fn check(store: &SceneStore, draft: Draft) -> Result<Checked, Refusal> {
    check_length(&draft)?;
    let Draft {
        mut text,
        mut files,
        edits,
        at_s,
    } = draft;
    let done = edits.iter().try_for_each(|change| match change {
        Change::Text(edit) => edit::edited(&text, edit).map(|made| text = made),
        Change::Trajectory(edit) => edit_trajectory(store, &mut files, edit),
    });
    let beside = store.named(&files);
    let loaded = done.and_then(|()| {
        Scene::parse(&text, ORIGIN, &beside).map_err(|error| Fault::of_scene(&error))
    });
    let mut read = beside.read.into_inner();
    read.retain(|file, text| file.ends_with(".csv") && text.len() <= TEXT_BYTES_MAX);
    let at = Duration::try_from_secs_f64(at_s).unwrap_or_default();
    Ok(Checked {
        text,
        files,
        read,
        loaded,
        at,
    })
}

fn check_length(draft: &Draft) -> Result<(), Refusal> {
    let of_files: usize = draft.files.values().map(String::len).sum();
    for (what, found, most) in [
        ("bytes of text", draft.text.len(), TEXT_BYTES_MAX),
        ("bytes of trajectories", of_files, TEXT_BYTES_MAX),
        ("trajectories", draft.files.len(), FILES_MAX),
        ("edits", draft.edits.len(), EDITS_MAX),
    ] {
        if found > most {
            let what = format!("{found} {what}, expected at most {most}");
            let status = StatusCode::UNPROCESSABLE_ENTITY;
            return Err(Refusal::new(status, "too_much", what));
        }
    }
    Ok(())
}

fn edit_trajectory(
    store: &SceneStore,
    files: &mut BTreeMap<String, String>,
    edit: &TrajectoryEdit,
) -> Result<(), Fault> {
    let file = edit.file();
    if !files.contains_key(file) {
        // A name that leads elsewhere is not a trajectory; the scene would reject it too.
        let text = store
            .file(file)
            .map_err(|_refusal| Fault::of_file(file, 1, "this file cannot be edited here"))?;
        if let Some(text) = text {
            files.insert(file.to_owned(), text);
        }
    }
    let made = trajectory::edited(files.get(file).map(String::as_str), edit)?;
    files.insert(file.to_owned(), made);
    Ok(())
}

impl Checked {
    /// `goes_on` says whether the page still waits. What is not done within [`TIME_MAX`] is left out.
    pub(super) fn to_json(&self, goes_on: impl Fn() -> bool) -> Value {
        let began = Instant::now();
        let goes_on = || goes_on() && began.elapsed() < TIME_MAX;
        let read: BTreeMap<&String, Value> = self
            .read
            .iter()
            .map(|(file, text)| (file, json!({ "text": text, "version": version_of(text) })))
            .collect();
        let mut answer = json!({ "text": self.text, "files": self.files, "read": read });
        match &self.loaded {
            Err(fault) => answer["fault"] = fault.to_json(),
            Ok(loaded) => {
                let scene = &loaded.scene;
                let at = self.at.min(scene.duration());
                answer["at_s"] = json!(at.as_secs_f64());
                answer["scene"] = outline::outline(&self.text, scene, at);
                answer["frames"] = scene
                    .sensors()
                    .iter()
                    .take(SENSORS_MAX)
                    .map(|sensor| frame(scene, sensor, at, goes_on()))
                    .collect();
                let unseen = scene.unseen_while(None, &goes_on).into_iter();
                let unseen = unseen.map(|one| {
                    let why = one.warning(&self.text, ORIGIN);
                    Fault::said(&why.to_string(), Some(&why.place)).to_json()
                });
                let warnings = loaded.warnings.iter().map(warning);
                answer["warnings"] = warnings.chain(unseen).collect();
            }
        }
        answer
    }
}

fn warning(warning: &Warning) -> Value {
    Fault::said(&warning.to_string(), Some(warning.place())).to_json()
}

/// What a sensor sees, without noise; no pixels if it has too many or there is no time.
fn frame(scene: &Scene, sensor: &Sensor, at: Duration, has_time: bool) -> Value {
    let is_fit = has_time && sensor.columns * sensor.rows <= PIXELS_MAX;
    let simulator = is_fit
        .then(|| Simulator::new(scene, &sensor.name).ok())
        .flatten();
    let celsius = simulator.map(|simulator| simulator.image(at).celsius);
    let celsius: Option<Vec<f64>> = celsius.map(|all| all.into_iter().map(hundredths).collect());
    json!({ "sensor": sensor.name, "columns": sensor.columns, "rows": sensor.rows, "celsius": celsius })
}
