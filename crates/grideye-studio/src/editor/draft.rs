//! A scene being edited: applies edits to its text, and shows the resulting objects and what every sensor would see.

use super::edit::{self, EDITS_MAX, Edit};
use super::fault::{Fault, ORIGIN};
use super::outline;
use super::shelf::{Shelf, TEXT_BYTES_MAX, version_of};
use super::way::{self, WayEdit};
use crate::rounding::hundredths;
use axum::http::StatusCode;
use grideye_collector::Refusal;
use grideye_scene::{Files, Loaded, Scene, Sensor, Simulator, Warning};
use serde::Deserialize;
use serde_json::{Value, json};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;
use std::time::Duration;

/// Maximum sensors with frames; others are not shown.
const SENSORS_MAX: usize = 32;
/// Maximum pixels of a shown frame; a Lepton has 4,800.
const PIXELS_MAX: usize = 20_000;
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
    Way(WayEdit),
}

/// A draft after parsing, or its error.
pub(super) struct Sheet {
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
pub(super) fn sheet(shelf: &Shelf, draft: Draft) -> Result<Sheet, Refusal> {
    check(&draft)?;
    let Draft {
        mut text,
        mut files,
        edits,
        at_s,
    } = draft;
    let done = edits.iter().try_for_each(|change| match change {
        Change::Text(edit) => edit::edited(&text, edit).map(|made| text = made),
        Change::Way(edit) => edit_way(shelf, &mut files, edit),
    });
    let beside = Overlay {
        shelf,
        files: &files,
        read: RefCell::default(),
    };
    let loaded = done.and_then(|()| {
        Scene::parse(&text, ORIGIN, &beside).map_err(|error| Fault::of_scene(&error))
    });
    let read = beside.read.into_inner();
    let at = Duration::try_from_secs_f64(at_s).unwrap_or_default();
    Ok(Sheet {
        text,
        files,
        read,
        loaded,
        at,
    })
}

fn check(draft: &Draft) -> Result<(), Refusal> {
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

fn edit_way(
    shelf: &Shelf,
    files: &mut BTreeMap<String, String>,
    edit: &WayEdit,
) -> Result<(), Fault> {
    let file = edit.file();
    if !files.contains_key(file) {
        // A name that leads elsewhere is not a trajectory; the scene would reject it too.
        let text = shelf
            .file(file)
            .map_err(|_refusal| Fault::of_file(file, 1, "this file cannot be edited here"))?;
        if let Some(text) = text {
            files.insert(file.to_owned(), text);
        }
    }
    let made = way::edited(files.get(file).map(String::as_str), edit)?;
    files.insert(file.to_owned(), made);
    Ok(())
}

/// The files beside a scene: the page's take precedence over the disk's.
struct Overlay<'a> {
    shelf: &'a Shelf,
    files: &'a BTreeMap<String, String>,
    read: RefCell<BTreeMap<String, String>>,
}

impl Files for Overlay<'_> {
    fn read(&self, relative: &str) -> io::Result<String> {
        if let Some(text) = self.files.get(relative) {
            return Ok(text.clone());
        }
        let text = self.shelf.read(relative)?;
        if relative.ends_with(".csv") && text.len() <= TEXT_BYTES_MAX {
            self.read
                .borrow_mut()
                .insert(relative.to_owned(), text.clone());
        }
        Ok(text)
    }
}

impl Sheet {
    pub(super) fn to_json(&self) -> Value {
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
                    .map(|sensor| frame(scene, sensor, at))
                    .collect();
                let unseen = scene.unseen(None).into_iter();
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

/// What a sensor sees, without noise; no pixels if it has too many.
fn frame(scene: &Scene, sensor: &Sensor, at: Duration) -> Value {
    let is_fit = sensor.columns * sensor.rows <= PIXELS_MAX;
    let simulator = is_fit
        .then(|| Simulator::new(scene, &sensor.name).ok())
        .flatten();
    let celsius = simulator.map(|simulator| simulator.image(at).celsius);
    let celsius: Option<Vec<f64>> = celsius.map(|all| all.into_iter().map(hundredths).collect());
    json!({ "sensor": sensor.name, "columns": sensor.columns, "rows": sensor.rows, "celsius": celsius })
}
