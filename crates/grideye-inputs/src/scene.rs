//! A scene's file, and the files that it names.

use crate::error::{InputError, shown};
use crate::text::{read_text, regular, text};
use grideye_scene::profile::BUILT_IN;
use grideye_scene::{Files, Model, Scene, Unseen};
use std::cell::RefCell;
use std::io;
use std::path::{Path, PathBuf};

/// Names and texts of files that the program holds.
pub type Held = &'static [(&'static str, &'static str)];

/// Files that a scene names, and the list of those it has read.
#[derive(Debug, Default)]
pub struct Beside {
    folder: PathBuf,
    read: RefCell<Vec<PathBuf>>,
    /// Of a scene that the program holds, the texts beside it; it holds the profiles too.
    held: Option<Held>,
}

impl Beside {
    /// Files in a folder, none read yet.
    #[must_use]
    pub fn of_folder(folder: &Path) -> Self {
        Self {
            folder: folder.to_path_buf(),
            ..Self::default()
        }
    }
}

impl Files for Beside {
    fn read(&self, relative: &str) -> io::Result<String> {
        if let Some(held) = self.held {
            let profiles = BUILT_IN.map(|(name, text)| (format!("profiles/{name}.toml"), text));
            let held = held.iter().map(|(name, text)| ((*name).to_owned(), *text));
            let found = held.chain(profiles).find(|(name, _)| name == relative);
            return Ok(found.ok_or(io::ErrorKind::NotFound)?.1.to_owned());
        }
        let path = self.folder.join(relative);
        let text = read_text(regular(&path)?)?;
        self.read.borrow_mut().push(path);
        Ok(text)
    }
}

/// A scene as it was read.
#[derive(Debug, Clone)]
pub struct LoadedScene {
    /// The scene.
    pub scene: Scene,
    /// What reading changed, for example an object outside the room.
    pub warnings: Vec<String>,
    /// The files that were read, the scene's own first.
    pub files: Vec<PathBuf>,
    text: String,
    origin: String,
}

impl LoadedScene {
    /// What this sensor never sees, or what none does: warnings, then notes.
    #[must_use]
    pub fn unseen(&self, sensor: Option<&str>) -> [Vec<String>; 2] {
        let found = self.scene.unseen(sensor);
        let (doubtful, notes): (Vec<Unseen>, _) = found.into_iter().partition(Unseen::is_doubtful);
        [doubtful, notes].map(|found| {
            let said = found
                .iter()
                .map(|one| one.warning(&self.text, &self.origin).to_string());
            said.collect()
        })
    }
}

/// A scene's text, and where it is from.
#[derive(Debug)]
pub struct SceneText {
    /// The TOML.
    pub text: String,
    /// Its name in messages.
    pub origin: String,
    /// The files that it may name.
    pub files: Beside,
}

impl SceneText {
    /// A scene that the program holds, with the files that it names.
    #[must_use]
    pub fn built_in(name: &str, text: &str, files: Held) -> Self {
        Self {
            text: text.to_owned(),
            origin: format!("scenes/{name}.toml (built in)"),
            files: Beside {
                held: Some(files),
                ..Beside::default()
            },
        }
    }

    /// Reads a file.
    /// # Errors
    /// If it cannot be read, is too long, or is not UTF-8.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let hint = "scenes/ holds some, and scenes/README.md describes the format";
        Ok(Self {
            text: text(path, "the scene", hint)?,
            origin: shown(path),
            files: Beside {
                read: RefCell::new(vec![path.to_path_buf()]),
                ..Beside::of_folder(path.parent().unwrap_or(Path::new("")))
            },
        })
    }

    /// Checks it; with `model` by this one in place of the file's.
    /// # Errors
    /// What is wrong, where, and what to do.
    pub fn parse(self, model: Option<Model>) -> Result<LoadedScene, InputError> {
        let loaded = Scene::parse_as(model, &self.text, &self.origin, &self.files)?;
        Ok(LoadedScene {
            warnings: loaded.warnings.iter().map(ToString::to_string).collect(),
            scene: loaded.scene,
            files: self.files.read.into_inner(),
            text: self.text,
            origin: self.origin,
        })
    }
}

/// Reads and checks the scene in a file.
/// # Errors
/// What is wrong, where, and what to do.
pub fn scene(model: Option<Model>, path: &Path) -> Result<LoadedScene, InputError> {
    SceneText::read(path)?.parse(model)
}

/// The asked sensor, or the scene's only one.
/// # Errors
/// If none is asked for and there are several.
pub fn sensor_name(scene: &Scene, sensor: Option<&str>) -> Result<String, InputError> {
    if let Some(name) = sensor {
        return Ok(name.to_owned());
    }
    match scene.sensors() {
        [only] => Ok(only.name.clone()),
        sensors => {
            let names: Vec<&str> = sensors.iter().map(|sensor| sensor.name.as_str()).collect();
            let (count, names) = (names.len(), names.join(", "));
            Err(InputError::new(format!(
                "the scene has {count} sensors\nhint: choose one with --sensor: {names}"
            )))
        }
    }
}
