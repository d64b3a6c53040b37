//! Opens and saves the files of the scenes' folder: by plain names only, whole or not at all, and never over another
//! person's changes.

use crate::catalogue::{SCENES_MAX, scene_files};
use crate::disk::{Disk, Named, open_below};
use axum::http::StatusCode;
use grideye_collector::Refusal;
use ring::digest::{SHA256, digest};
use serde::Deserialize;
use serde_json::{Value, json};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Maximum bytes of an editable scene or trajectory.
pub(super) const TEXT_BYTES_MAX: usize = 512 * 1024;
const FILES_MAX: usize = 100;
const NAME_CHARACTERS_MAX: usize = 100;

pub(super) struct SceneStore {
    folder: PathBuf,
    disk: Disk,
    /// Locked from the version check until the file is written.
    writing: Mutex<()>,
}

/// A text to save, and the version it is based on.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Text {
    pub(super) text: String,
    /// The version when opened; `None` for a new file.
    pub(super) version: Option<String>,
}

/// A scene to save.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Save {
    pub(super) text: String,
    /// The version when opened; `None` for a new scene.
    pub(super) version: Option<String>,
    /// The trajectories, by the names in the scene.
    #[serde(default)]
    pub(super) files: BTreeMap<String, Text>,
}

impl SceneStore {
    pub(super) const fn new(folder: PathBuf, disk: Disk) -> Self {
        Self {
            folder,
            disk,
            writing: Mutex::new(()),
        }
    }

    /// The text of a scene.
    ///
    /// # Errors
    /// 404 if there is none, 422 if it is too long or not text.
    pub(super) fn open(&self, name: &str) -> Result<String, Refusal> {
        let path = self.scene_path(name)?;
        self.text_of(&path)?.ok_or_else(|| {
            let what = format!("the folder has no scene {name:?}");
            Refusal::new(StatusCode::NOT_FOUND, "no_such_scene", what).field("scene")
        })
    }

    /// The text of a file that a scene names; `None` if there is none.
    ///
    /// # Errors
    /// 422 if the name leads out of the folder, or the text is too long.
    pub(super) fn file(&self, relative: &str) -> Result<Option<String>, Refusal> {
        self.text_of(&self.file_path(relative)?)
    }

    /// The files that a scene names.
    pub(super) fn named<'a>(&'a self, of_the_page: &'a BTreeMap<String, String>) -> Named<'a> {
        Named {
            folder: &self.folder,
            disk: self.disk,
            of_the_page,
            read: RefCell::default(),
        }
    }

    /// Writes the changed trajectories, then the scene. A replaced file is kept as `NAME.toml~`.
    ///
    /// # Errors
    /// 409 if one of the files changed since it was opened; then nothing is written. 500 if writing fails.
    pub(super) fn save(&self, name: &str, save: &Save) -> Result<Value, Refusal> {
        let scene = self.scene_path(name)?;
        let mut writes = self.changed_files(&save.files)?;
        let _writing = self.writing.lock().unwrap_or_else(PoisonError::into_inner);
        self.check_count(&scene)?;
        self.check_is_as_opened(&scene, save.version.as_deref())?;
        for (path, text) in &writes {
            self.check_is_as_opened(path, text.version.as_deref())?;
        }
        let of_scene = Text {
            text: save.text.clone(),
            version: save.version.clone(),
        };
        writes.push((scene, &of_scene));
        for (path, text) in &writes {
            self.keep_old(path)
                .and_then(|()| self.write(path, &mut text.text.as_bytes()))
                .map_err(|error| failed(path, &error))?;
        }
        let versions: BTreeMap<&String, String> = save
            .files
            .iter()
            .map(|(file, text)| (file, version_of(&text.text)))
            .collect();
        Ok(json!({ "name": name, "version": version_of(&save.text), "files": versions }))
    }

    /// The files with a text other than the opened one.
    fn changed_files<'a>(
        &self,
        files: &'a BTreeMap<String, Text>,
    ) -> Result<Vec<(PathBuf, &'a Text)>, Refusal> {
        if files.len() > FILES_MAX {
            let what = format!("{} trajectories, expected at most {FILES_MAX}", files.len());
            return Err(unusable("files", what));
        }
        let changed = files
            .iter()
            .filter(|(_, text)| text.version.as_deref() != Some(&version_of(&text.text)));
        let paths = changed.map(|(file, text)| {
            if !file.ends_with(".csv") {
                return Err(unusable(
                    "files",
                    format!("{file:?} is not a trajectory: its name must end in .csv"),
                ));
            }
            Ok((self.file_path(file)?, text))
        });
        paths.collect()
    }

    fn check_count(&self, scene: &Path) -> Result<(), Refusal> {
        let scenes = scene_files(&self.folder).map_or(0, |scenes| scenes.len());
        if scene.exists() || scenes < SCENES_MAX {
            return Ok(());
        }
        let what = format!("the folder has {scenes} scenes already, expected at most {SCENES_MAX}");
        Err(
            Refusal::new(StatusCode::INSUFFICIENT_STORAGE, "too_many_scenes", what)
                .hint("move some to another folder"),
        )
    }

    fn check_is_as_opened(&self, path: &Path, version: Option<&str>) -> Result<(), Refusal> {
        let now = self.text_of(path)?.map(|text| version_of(&text));
        if now.as_deref() == version {
            return Ok(());
        }
        let file = path.strip_prefix(&self.folder).unwrap_or(path).display();
        let (what, hint) = match (version, now) {
            (None, _) => (
                format!("the file {file} already exists"),
                "save under another name, or open that file",
            ),
            (Some(_), None) => (
                format!("{file} was deleted after you opened it"),
                "save under another name to keep yours",
            ),
            (Some(_), Some(_)) => (
                format!("{file} changed on disk after you opened it"),
                "save under another name to keep both, or open it again to get the other version",
            ),
        };
        Err(
            Refusal::new(StatusCode::CONFLICT, "changed_meanwhile", what)
                .field(file.to_string())
                .hint(hint),
        )
    }

    fn scene_path(&self, name: &str) -> Result<PathBuf, Refusal> {
        let is_plain = !name.starts_with('.')
            && !name.contains(|sign: char| sign.is_control() || matches!(sign, '/' | '\\'))
            && (1..=NAME_CHARACTERS_MAX).contains(&name.chars().count());
        if is_plain {
            return Ok(self.folder.join(format!("{name}.toml")));
        }
        Err(
            unusable("scene", format!("{name:?} is not a scene name")).hint(format!(
                "use 1 to {NAME_CHARACTERS_MAX} letters, digits, spaces, - and _"
            )),
        )
    }

    /// The path of a file below the folder, even if a link is in the way.
    fn file_path(&self, relative: &str) -> Result<PathBuf, Refusal> {
        let below = Path::new(relative);
        let is_plain = below.components().all(|part| match part {
            Component::Normal(name) => !name.as_encoded_bytes().starts_with(b"."),
            _ => false,
        });
        let path = self.folder.join(below);
        let mut parents = path.ancestors().skip(1);
        let standing = parents.find(|parent| parent.exists());
        let is_below = standing.is_some_and(|parent| {
            match (parent.canonicalize(), self.folder.canonicalize()) {
                (Ok(parent), Ok(folder)) => parent.starts_with(folder),
                _ => false,
            }
        });
        let is_text = !relative.contains(|sign: char| sign.is_control() || sign == '\\');
        if is_plain && is_below && is_text && !relative.is_empty() {
            return Ok(path);
        }
        Err(unusable(
            "files",
            format!("{relative:?} is not a file in the scenes folder"),
        ))
    }

    fn text_of(&self, path: &Path) -> Result<Option<String>, Refusal> {
        let opened = open_below(&self.folder, path);
        let (bytes, file) = match opened.and_then(|file| Ok((file.metadata()?.len(), file))) {
            Ok(opened) => opened,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => {
                return Err(unusable("scene", format!("{}: {error}", path.display())));
            }
            Err(error) => return Err(failed(path, &error)),
        };
        let bytes = usize::try_from(bytes).unwrap_or(usize::MAX);
        if bytes > TEXT_BYTES_MAX {
            let what = format!(
                "{} has {bytes} bytes, expected at most {TEXT_BYTES_MAX}",
                path.display()
            );
            return Err(unusable("scene", what)
                .hint("use a text editor, or move meshes into files of their own"));
        }
        match (self.disk.read)(file) {
            Ok(text) => Ok(Some(text)),
            Err(error) if error.kind() == io::ErrorKind::InvalidData => {
                Err(unusable("scene", format!("{}: {error}", path.display())))
            }
            Err(error) => Err(failed(path, &error)),
        }
    }

    /// Keeps a copy of the file that is about to be replaced.
    fn keep_old(&self, path: &Path) -> Result<(), io::Error> {
        let mut old = match open_below(&self.folder, path) {
            Ok(old) => old,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            Err(error) => return Err(error),
        };
        let mut name = path.file_name().unwrap_or_default().to_os_string();
        name.push("~");
        let kept = path.with_file_name(name);
        (self.disk.replace)(&kept, &mut old)
    }

    fn write(&self, path: &Path, content: &mut dyn Read) -> Result<(), io::Error> {
        fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))?;
        (self.disk.replace)(path, content)
    }
}

/// A hash that identifies a text.
pub(super) fn version_of(text: &str) -> String {
    let digest = digest(&SHA256, text.as_bytes());
    let bytes = digest.as_ref().iter();
    bytes.take(16).map(|byte| format!("{byte:02x}")).collect()
}

fn failed(path: &Path, error: &io::Error) -> Refusal {
    let what = format!("{}: {error:#}", path.display());
    Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "folder_failed", what)
        .hint("check that the collector may write to the scenes folder and that its disk has space")
}

fn unusable(field: &'static str, what: String) -> Refusal {
    Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, "unusable_name", what).field(field)
}
