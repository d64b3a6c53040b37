//! Reading what the user named, and writing results so that no half-written file ever carries its final name.
//!
//! | room | holds |
//! |---|---|
//! | `apart` | that no result comes to lie over what is read |
//! | `text` | texts, bounded and in UTF-8 |
//! | `whole` | write, sync and rename, for every file that a command writes |

mod apart;
mod text;
mod whole;

pub(crate) use apart::keep_apart;
pub(crate) use text::{read_text, text};
pub(crate) use whole::{Pending, fill, rename, replace, target, write_text, write_whole};

use crate::exit::bad_input;
use anyhow::{Result, anyhow};
use grideye_scene::{Files, Model, Scene, Simulator};
use std::cell::RefCell;
use std::fs::{self, File};
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};

/// The scene that the demonstration shows unless another is named: the paper's experiment 1.
pub(crate) const DEFAULT_SCENE: &str = include_str!("../../../scenes/experiment-1.toml");

/// Files beside the scene file, as a scene names them; those that were read are remembered.
#[derive(Default)]
pub(crate) struct Beside {
    folder: PathBuf,
    read: RefCell<Vec<PathBuf>>,
}

impl Files for Beside {
    fn read(&self, relative: &str) -> io::Result<String> {
        let path = self.folder.join(relative);
        let text = read_text(File::open(&path)?)?;
        self.read.borrow_mut().push(path);
        Ok(text)
    }
}

/// A scene, and what a report has to say of where it came from.
pub(crate) struct LoadedScene {
    /// The scene.
    pub(crate) scene: Scene,
    /// What was done to it while it was read: an object outside its room, for example.
    pub(crate) warnings: Vec<String>,
    /// The other files that it is made of.
    pub(crate) trajectories: Vec<PathBuf>,
}

/// A scene file as it is written, and where it finds what it names.
pub(crate) struct SceneText {
    pub(crate) text: String,
    /// The file's name for messages.
    pub(crate) origin: String,
    pub(crate) files: Beside,
}

/// The text of a scene file, and its place.
pub(crate) fn read_scene(path: &Path) -> Result<SceneText> {
    let folder = path.parent().unwrap_or(Path::new(""));
    Ok(SceneText {
        text: scene_text(path)?,
        origin: path.display().to_string(),
        files: Beside {
            folder: folder.to_path_buf(),
            read: RefCell::default(),
        },
    })
}

/// The scene in `path`, or the built-in one; its warnings go to standard error.
pub(crate) fn load_scene(path: Option<&Path>) -> Result<LoadedScene> {
    load_scene_as(None, path)
}

/// The same by the given model, whatever the file says.
pub(crate) fn load_scene_as(model: Option<Model>, path: Option<&Path>) -> Result<LoadedScene> {
    let text = match path {
        Some(path) => read_scene(path)?,
        None => SceneText {
            text: DEFAULT_SCENE.to_owned(),
            origin: "scenes/experiment-1.toml (built in)".to_owned(),
            files: Beside::default(),
        },
    };
    let loaded = parse_scene(model, text)?;
    for warning in &loaded.warnings {
        eprintln!("warning: {warning}");
    }
    Ok(loaded)
}

/// The scene that a text stands for; nothing is said of its warnings.
pub(crate) fn parse_scene(model: Option<Model>, text: SceneText) -> Result<LoadedScene> {
    let SceneText {
        text,
        origin,
        files: beside,
    } = text;
    let loaded = Scene::parse_as(model, &text, &origin, &beside).map_err(bad_input)?;
    Ok(LoadedScene {
        warnings: loaded.warnings.iter().map(ToString::to_string).collect(),
        scene: loaded.scene,
        trajectories: beside.read.into_inner(),
    })
}

/// The text of a scene file.
pub(crate) fn scene_text(path: &Path) -> Result<String> {
    let hint = "scenes/ holds some, and scenes/README.md describes the format";
    text(path, "the scene", hint)
}

/// The simulator of one sensor of the scene: the named one, or the only one.
pub(crate) fn simulator(scene: &Scene, sensor: Option<&str>) -> Result<Simulator> {
    Simulator::new(scene, &sensor_name(scene, sensor)?).map_err(bad_input)
}

/// The named sensor, or the scene's only one.
pub(crate) fn sensor_name(scene: &Scene, sensor: Option<&str>) -> Result<String> {
    if let Some(name) = sensor {
        return Ok(name.to_owned());
    }
    match scene.sensors() {
        [only] => Ok(only.name.clone()),
        sensors => {
            let names: Vec<&str> = sensors.iter().map(|sensor| sensor.name.as_str()).collect();
            Err(bad_input(anyhow!(
                "the scene has {} sensors\nhint: choose one with --sensor: {}",
                sensors.len(),
                names.join(", ")
            )))
        }
    }
}

/// Opens a file that the user named for reading.
pub(crate) fn open(path: &Path) -> Result<BufReader<File>> {
    let opened = if path.is_dir() {
        Err(io::ErrorKind::IsADirectory.into())
    } else {
        File::open(path)
    };
    opened.map(BufReader::new).map_err(|error| {
        bad_input(anyhow!(
            "cannot open {}: {error}\nhint: name an existing file that you may read",
            path.display()
        ))
    })
}

/// Creates the folder with all its parents, and proves that files can be written into it.
pub(crate) fn writable_folder(folder: &Path) -> Result<()> {
    let refuse = |error: io::Error| {
        anyhow!(
            "cannot write into the folder {}: {error}\nhint: name a folder of your own with --out",
            folder.display()
        )
    };
    fs::create_dir_all(folder).map_err(refuse)?;
    Pending::of(&folder.join(".grideye-write-test")).map_err(refuse)?;
    Ok(())
}
