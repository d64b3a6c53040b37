//! The scenes of a folder, read on request and again when one of their files changes.

use crate::disk::{Disk, Named};
use crate::recently::Recently;
use anyhow::{Context as _, Result, anyhow};
use axum::http::StatusCode;
use grideye_collector::Refusal;
use grideye_scene::{Film, Scene};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::SystemTime;

/// Maximum scenes listed, by name.
pub(crate) const SCENES_MAX: usize = 500;
/// Maximum bytes of a scene file; a larger one is listed as unusable.
const SCENE_BYTES_MAX: u64 = 4 << 20;
/// A title ends once it is longer than this.
const TITLE_BYTES_MIN: usize = 200;
/// Films of scenes' sensors in the cache, and the bytes of each: some three minutes of frames.
const FILMS_MAX: usize = 16;
const FILM_BYTES: usize = 1 << 20;

/// The scenes of a folder, after the one that the page opens with.
pub(crate) struct Catalogue {
    folder: Option<PathBuf>,
    demonstration: Option<Arc<SceneEntry>>,
    disk: Disk,
    scenes: Mutex<Vec<Arc<SceneEntry>>>,
    films: Recently<FilmKey, Arc<OnceLock<Arc<Film>>>>,
}

/// Scene, its sensor, and its edition.
type FilmKey = (String, String, u64);

/// One scene file, as last read.
pub(crate) struct SceneEntry {
    /// The file's name without extension.
    pub(crate) name: String,
    /// The file's first comment, or empty.
    pub(crate) title: String,
    /// The scene, or why it is unusable.
    pub(crate) loaded: Result<LoadedScene, String>,
    /// Counts the readings, so that results of earlier ones can be recognized.
    pub(crate) edition: u64,
    /// The scene file and the files it names, with marks that reveal changes.
    seen: Vec<(PathBuf, Option<Mark>)>,
}

/// Changes when a file is written.
type Mark = (SystemTime, u64);

impl Catalogue {
    pub(crate) fn new(
        folder: Option<PathBuf>,
        demonstration: Option<Arc<SceneEntry>>,
        disk: Disk,
    ) -> Self {
        Self {
            folder,
            demonstration,
            disk,
            scenes: Mutex::default(),
            films: Recently::new(FILMS_MAX),
        }
    }

    /// Every scene of the folder, by name; blocks on files.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub(crate) fn list(&self) -> Result<Vec<Arc<SceneEntry>>> {
        let demonstration = self.demonstration.as_slice();
        let Some(folder) = &self.folder else {
            return Ok(demonstration.to_vec());
        };
        let mut paths = scene_files(folder)?;
        paths.retain(|path| {
            demonstration
                .iter()
                .all(|scene| scene.name != name_of(path))
        });
        paths.truncate(SCENES_MAX);
        let mut scenes = self.scenes.lock().unwrap_or_else(PoisonError::into_inner);
        *scenes = paths
            .iter()
            .map(|path| {
                let name = name_of(path);
                let known = scenes.iter().find(|known| known.name == name);
                match known {
                    Some(known) if known.is_fresh() => Arc::clone(known),
                    _ => {
                        let edition = known.map_or(0, |known| known.edition + 1);
                        Arc::new(SceneEntry::read(folder, self.disk, path, name, edition))
                    }
                }
            })
            .collect();
        Ok(demonstration.iter().chain(&*scenes).cloned().collect())
    }

    /// The scene with this name, if the folder has it; blocks on files.
    ///
    /// # Errors
    /// As [`list`](Self::list).
    pub(crate) fn find(&self, name: &str) -> Result<Option<Arc<SceneEntry>>> {
        let scenes = self.list()?;
        Ok(scenes.into_iter().find(|scene| scene.name == name))
    }

    /// What one of the scene's sensors sees; the first call is slow.
    ///
    /// # Errors
    /// If the scene has no such sensor.
    pub(crate) fn film(
        &self,
        scene: &SceneEntry,
        loaded: &LoadedScene,
        sensor: &str,
    ) -> Result<Arc<Film>> {
        let key = (scene.name.clone(), sensor.to_owned(), scene.edition);
        let slot = self.films.get_or(key, |_| Arc::default());
        if let Some(film) = slot.get() {
            return Ok(Arc::clone(film));
        }
        let film = Arc::new(Film::new(&loaded.scene, sensor, FILM_BYTES)?);
        Ok(Arc::clone(slot.get_or_init(|| film)))
    }
}

impl SceneEntry {
    /// A scene that lies in no folder, and does not change.
    pub(crate) fn fixed(name: String, title: String, scene: Scene) -> Self {
        let trajectories = Vec::new();
        Self {
            name,
            title,
            loaded: Ok(LoadedScene {
                scene,
                trajectories,
            }),
            edition: 0,
            seen: Vec::new(),
        }
    }

    fn read(folder: &Path, disk: Disk, path: &Path, name: String, edition: u64) -> Self {
        let text = text_of(folder, disk, path);
        let title = text.as_ref().map(|text| title_of(text));
        let title = title.unwrap_or_default();
        let loaded = text.and_then(|text| LoadedScene::read(folder, disk, path, &text));
        let others = loaded.as_ref().map(|loaded| loaded.trajectories.clone());
        let seen = std::iter::once(path.to_owned()).chain(others.unwrap_or_default());
        let seen = seen.map(|path| (mark_of(&path), path));
        Self {
            name,
            title,
            edition,
            seen: seen.map(|(mark, path)| (path, mark)).collect(),
            loaded: loaded.map_err(|error| format!("{error:#}")),
        }
    }

    /// The scene.
    ///
    /// # Errors
    /// 422 with the reason why it is unusable.
    pub(crate) fn usable(&self) -> Result<&LoadedScene, Refusal> {
        self.loaded.as_ref().map_err(|error| unusable(error))
    }

    fn is_fresh(&self) -> bool {
        let mut seen = self.seen.iter();
        seen.all(|(path, mark)| mark.is_some() && mark_of(path) == *mark)
    }
}

/// A response for an unusable scene; `error` may contain a hint on its own line.
pub(crate) fn unusable(error: &str) -> Refusal {
    Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, "unusable_scene", error)
}

/// A scene, and the files it uses besides its own.
pub(crate) struct LoadedScene {
    pub(crate) scene: Scene,
    pub(crate) trajectories: Vec<PathBuf>,
}

impl LoadedScene {
    fn read(folder: &Path, disk: Disk, path: &Path, text: &str) -> Result<Self> {
        let files = Named {
            folder,
            disk,
            of_the_page: &BTreeMap::new(),
            read: RefCell::default(),
        };
        let loaded = Scene::parse(text, &path.display().to_string(), &files)
            // The error contains its cause.
            .map_err(|error| anyhow!("{error}"))?;
        let read = files.read.into_inner().into_keys();
        Ok(Self {
            scene: loaded.scene,
            trajectories: read.map(|relative| folder.join(relative)).collect(),
        })
    }
}

fn text_of(folder: &Path, disk: Disk, path: &Path) -> Result<String> {
    let shown = path.display();
    let bytes = fs::metadata(path).map_or(0, |about| about.len());
    if bytes > SCENE_BYTES_MAX {
        return Err(anyhow!(
            "the scene {shown} has {bytes} bytes, expected at most {SCENE_BYTES_MAX}\nhint: move meshes into files of their own"
        ));
    }
    disk.read_below(folder, path).map_err(|error| match error.kind() {
        io::ErrorKind::InvalidData => anyhow!("{shown}: {error}\nhint: save the scene as UTF-8"),
        _ => anyhow!("cannot read the scene {shown}: {error}\nhint: scenes/ has examples, and scenes/README.md describes the format"),
    })
}

fn mark_of(path: &Path) -> Option<Mark> {
    let about = fs::metadata(path).ok()?;
    Some((about.modified().ok()?, about.len()))
}

fn name_of(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// The first sentence of the comment at the start of a file, if any.
fn title_of(text: &str) -> String {
    let remark = text.lines().map_while(|line| line.strip_prefix('#'));
    let mut title = String::new();
    for line in remark.map(str::trim) {
        if !title.is_empty() {
            title.push(' ');
        }
        title.push_str(line);
        if line.is_empty() || line.ends_with('.') || title.len() > TITLE_BYTES_MIN {
            break;
        }
    }
    title
}

/// The scene files of a folder, by name.
///
/// # Errors
/// If it cannot be read.
pub(crate) fn scene_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let listed = fs::read_dir(folder).with_context(|| {
        format!(
            "cannot read the scenes folder {}\nhint: choose one with --scenes",
            folder.display()
        )
    })?;
    let paths = listed.filter_map(|entry| Some(entry.ok()?.path()));
    let mut paths: Vec<PathBuf> = paths
        .filter(|path| path.extension().is_some_and(|end| end == "toml") && path.is_file())
        .collect();
    paths.sort();
    Ok(paths)
}
