//! Reading what the user named, and writing results so that no half-written file ever carries its final name.

use crate::exit::{bad_input, is_bad_input};
use anyhow::{Context as _, Result, anyhow};
use grideye_recording::whole::identity;
pub(crate) use grideye_recording::whole::{Pending, rename};
use grideye_scene::limits::TEXT_BYTES_MAX;
use grideye_scene::profile::Profile;
use grideye_scene::{Files, Model, Scene, Sensor, Simulator};
use std::cell::RefCell;
use std::fmt::Display;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

/// The demonstration's default scene: the paper's experiment 1.
pub(crate) const DEFAULT_SCENE: &str = include_str!("../../../scenes/experiment-1.toml");

/// Files that a scene names, and the list of those it has read.
#[derive(Default)]
pub(crate) struct Beside {
    folder: PathBuf,
    read: RefCell<Vec<PathBuf>>,
    /// Beside the scene are the profiles that the program holds.
    is_built_in: bool,
}

impl Files for Beside {
    fn read(&self, relative: &str) -> io::Result<String> {
        if self.is_built_in {
            let is_it = |name: &str| format!("profiles/{name}.toml") == relative;
            let mut profiles = grideye_scene::profile::BUILT_IN.iter();
            let found = profiles.find(|(name, _)| is_it(name));
            return Ok(found.ok_or(io::ErrorKind::NotFound)?.1.to_owned());
        }
        let path = self.folder.join(relative);
        let text = read_text(File::open(&path)?)?;
        self.read.borrow_mut().push(path);
        Ok(text)
    }
}

pub(crate) struct LoadedScene {
    pub(crate) scene: Scene,
    /// What reading changed, for example an object outside the room.
    pub(crate) warnings: Vec<String>,
    /// The files that were read, the scene's own first.
    pub(crate) files: Vec<PathBuf>,
}

pub(crate) struct SceneText {
    pub(crate) text: String,
    pub(crate) origin: String,
    pub(crate) files: Beside,
}

impl SceneText {
    /// A scene that the program holds.
    pub(crate) fn built_in(name: &str, text: &str) -> Self {
        Self {
            text: text.to_owned(),
            origin: format!("scenes/{name}.toml (built in)"),
            files: Beside {
                is_built_in: true,
                ..Beside::default()
            },
        }
    }
}

pub(crate) fn read_scene(path: &Path) -> Result<SceneText> {
    let hint = "scenes/ holds some, and scenes/README.md describes the format";
    Ok(SceneText {
        text: text(path, "the scene", hint)?,
        origin: path.display().to_string(),
        files: Beside {
            folder: path.parent().unwrap_or(Path::new("")).to_path_buf(),
            read: RefCell::new(vec![path.to_path_buf()]),
            is_built_in: false,
        },
    })
}

/// The scene in `path`, or the built-in one; its warnings go to standard error.
pub(crate) fn load_scene(path: Option<&Path>) -> Result<LoadedScene> {
    load_scene_as(None, path)
}

/// The same by the given model.
pub(crate) fn load_scene_as(model: Option<Model>, path: Option<&Path>) -> Result<LoadedScene> {
    let loaded = load_scene_quietly(model, path)?;
    warned(&loaded.warnings);
    Ok(loaded)
}

/// The same; the caller prints the warnings.
pub(crate) fn load_scene_quietly(model: Option<Model>, path: Option<&Path>) -> Result<LoadedScene> {
    let file = match path {
        Some(path) => read_scene(path)?,
        None => SceneText::built_in("experiment-1", DEFAULT_SCENE),
    };
    let loaded = Scene::parse_as(model, &file.text, &file.origin, &file.files);
    let loaded = loaded.map_err(bad_input)?;
    Ok(LoadedScene {
        warnings: loaded.warnings.iter().map(ToString::to_string).collect(),
        scene: loaded.scene,
        files: file.files.read.into_inner(),
    })
}

pub(crate) fn warned(warnings: &[impl Display]) {
    for warning in warnings {
        eprintln!("warning: {warning}");
    }
}

pub(crate) fn load_profile(path: &Path, hint: &str) -> Result<Profile> {
    let text = text(path, "the profile", hint)?;
    Profile::parse(&text, &path.display().to_string()).map_err(bad_input)
}

pub(crate) fn simulator(scene: &Scene, sensor: Option<&str>) -> Result<Simulator> {
    Simulator::new(scene, &sensor_name(scene, sensor)?).map_err(bad_input)
}

pub(crate) fn sensor_name(scene: &Scene, sensor: Option<&str>) -> Result<String> {
    if let Some(name) = sensor {
        return Ok(name.to_owned());
    }
    match scene.sensors() {
        [only] => Ok(only.name.clone()),
        sensors => {
            let names: Vec<&str> = sensors.iter().map(|sensor| sensor.name.as_str()).collect();
            let (count, names) = (names.len(), names.join(", "));
            Err(bad_input(anyhow!(
                "the scene has {count} sensors\nhint: choose one with --sensor: {names}"
            )))
        }
    }
}

pub(crate) fn sensors<'a>(scene: &'a Scene, names: &[String]) -> Result<Vec<&'a Sensor>> {
    if names.is_empty() {
        return Ok(scene.sensors().iter().collect());
    }
    let named = names.iter().map(|name| scene.sensor(name));
    named.collect::<Result<_, _>>().map_err(bad_input)
}

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

/// The bytes of a short file, such as a password or a certificate.
pub(crate) fn short(path: &Path, bytes_max: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let read = open(path)?.take(bytes_max).read_to_end(&mut bytes);
    read.map_err(|error| {
        let shown = path.display();
        bad_input(anyhow!(
            "{shown}: {error}\nhint: a short text file is wanted"
        ))
    })?;
    Ok(bytes)
}

pub(crate) fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

pub(crate) fn end(path: &Path) -> Option<&str> {
    path.extension().and_then(|end| end.to_str())
}

pub(crate) fn unknown_end(path: &Path, ends: &str) -> anyhow::Error {
    bad_input(anyhow!(
        "cannot tell what to write from the name {}\nhint: end it with {ends}",
        path.display()
    ))
}

/// Creates the folder with its parents, and checks that files can be written to it.
pub(crate) fn writable_folder(folder: &Path) -> Result<()> {
    let refuse = |error: io::Error| {
        bad_input(anyhow!(
            "cannot write into the folder {}: {error}\nhint: name a folder of your own with --out",
            folder.display()
        ))
    };
    fs::create_dir_all(folder).map_err(refuse)?;
    Pending::of(&folder.join(".grideye-write-test")).map_err(refuse)?;
    Ok(())
}

/// Refuses to write over an input, or two outputs to one file. Devices, pipes and `-` may be named repeatedly.
pub(crate) fn keep_apart<'a>(
    inputs: impl IntoIterator<Item = &'a PathBuf>,
    outputs: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<()> {
    let is_stream = |path: &Path| path == Path::new("-");
    let known = |path: &'a PathBuf| {
        let identity = identity(path).filter(|_| !is_stream(path))?;
        Some((identity, path.display()))
    };
    let inputs: Vec<_> = inputs.into_iter().filter_map(known).collect();
    let mut others = Vec::new();
    for (output, shown) in outputs.into_iter().filter_map(known) {
        if let Some((_, input)) = inputs.iter().find(|(input, _)| *input == output) {
            return Err(bad_input(anyhow!(
                "the output {shown} is the input {input}, and would be written over it\nhint: name another output; nothing was changed"
            )));
        }
        if let Some((_, other)) = others.iter().find(|(other, _)| *other == output) {
            return Err(bad_input(anyhow!(
                "the outputs {other} and {shown} are one file\nhint: give each a name of its own; nothing was changed"
            )));
        }
        others.push((output, shown));
    }
    Ok(())
}

const MIB: usize = 1 << 20;

/// The place of the first invalid byte, from 1.
#[derive(Debug, thiserror::Error)]
#[error("line {line}, column {column}: the byte {byte:#04x} is not UTF-8")]
struct NotUtf8 {
    line: usize,
    column: usize,
    byte: u8,
}

pub(crate) fn read_text(input: impl Read) -> io::Result<String> {
    let mut bytes = Vec::new();
    let limit = u64::try_from(TEXT_BYTES_MAX).unwrap_or(u64::MAX);
    input
        .take(limit.saturating_add(1))
        .read_to_end(&mut bytes)?;
    if bytes.len() > TEXT_BYTES_MAX {
        let told = format!("it has more than {} MiB", TEXT_BYTES_MAX / MIB);
        return Err(io::Error::new(io::ErrorKind::InvalidInput, told));
    }
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let (before, after) = error.as_bytes().split_at(at);
        let before = String::from_utf8_lossy(before);
        let line = before.rsplit('\n').next().unwrap_or_default();
        let place = NotUtf8 {
            line: before.matches('\n').count() + 1,
            column: line.chars().count() + 1,
            byte: after.first().copied().unwrap_or_default(),
        };
        io::Error::new(io::ErrorKind::InvalidData, place)
    })
}

pub(crate) fn text(path: &Path, what: &str, hint: &str) -> Result<String> {
    let shown = path.display();
    File::open(path).and_then(read_text).map_err(|error| {
        let place = error.get_ref().and_then(|error| error.downcast_ref());
        bad_input(match place {
            Some(NotUtf8 { line, column, byte }) => anyhow!(
                "{shown}:{line}:{column}: the byte {byte:#04x} is not UTF-8\nhint: save {what} as UTF-8"
            ),
            None => anyhow!("cannot read {what} {shown}: {error}\nhint: {hint}"),
        })
    })
}

/// Writes a file that the user named. A link stays a link; devices and pipes are written directly.
pub(crate) fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> Result<()>,
) -> Result<()> {
    let there = fs::metadata(path);
    if there.is_ok_and(|about| !about.is_file() && !about.is_dir()) {
        let stream = || fill(&OpenOptions::new().write(true).open(path)?, write);
        return written(path, stream());
    }
    replace(&target(path), write)
}

/// A link's target; any other path unchanged.
pub(crate) fn target(path: &Path) -> PathBuf {
    match fs::canonicalize(path) {
        Ok(target) if path.is_symlink() => target,
        _ => path.to_owned(),
    }
}

pub(crate) fn write_text(path: &Path, text: &str) -> Result<()> {
    write_whole(path, |out| Ok(out.write_all(text.as_bytes())?))
}

/// Replaces whatever has that name, also a link.
pub(crate) fn replace(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> Result<()>,
) -> Result<()> {
    let shown = path.display();
    let pending = Pending::of(path).map_err(|error| {
        bad_input(anyhow!(
            "cannot write {shown}: {error}\nhint: name a file in a folder that exists and that you may write to"
        ))
    })?;
    let filled = fill(pending.file(), write);
    written(path, filled.and_then(|()| Ok(pending.put()?)))
}

/// Blames the file for a failure, unless the input was bad.
fn written(path: &Path, result: Result<()>) -> Result<()> {
    match result {
        Err(error) if is_bad_input(&error) => Err(error),
        other => other.with_context(|| {
            let shown = path.display();
            format!("cannot write {shown}\nhint: is there room on the disk, and is this the name of a file?")
        }),
    }
}

/// Writes through a buffer, whose rest is not written after an error.
pub(crate) fn fill(
    file: &File,
    write: impl FnOnce(&mut BufWriter<&File>) -> Result<()>,
) -> Result<()> {
    let mut out = BufWriter::new(file);
    let written = write(&mut out).and_then(|()| Ok(out.flush()?));
    drop(out.into_parts());
    written
}

pub(crate) fn folder_of(path: &Path) -> &Path {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_read_to_its_limit_and_no_further() {
        let longest = vec![b'a'; TEXT_BYTES_MAX];
        assert_eq!(read_text(longest.as_slice()).unwrap().len(), TEXT_BYTES_MAX);
        let error = read_text(io::repeat(0)).unwrap_err().to_string();
        assert_eq!(error, "it has more than 16 MiB");
    }

    #[test]
    fn a_link_stays_one_unless_it_is_replaced_and_a_device_stays_a_device() {
        let folder = tempfile::tempdir().unwrap();
        let (path, link) = (folder.path().join("a.csv"), folder.path().join("b.csv"));
        fs::write(&path, b"old").unwrap();
        std::os::unix::fs::symlink(&path, &link).unwrap();
        write_text(&link, "new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert!(link.is_symlink());
        replace(&link, |out| Ok(out.write_all(b"other")?)).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert!(!link.is_symlink());
        let null = folder.path().join("null");
        std::os::unix::fs::symlink("/dev/null", &null).unwrap();
        write_text(&null, "nothing").unwrap();
        assert!(null.is_symlink() && !null.is_file());
    }
}
