//! Reading what the user named, and writing results so that no half-written file ever carries its final name.

use crate::exit::{bad_input, is_bad_input};
use crate::progress::say;
use anyhow::{Context as _, Result, anyhow};
use grideye_inputs::LoadedScene;
use grideye_recording::whole::identity;
pub(crate) use grideye_recording::whole::{Pending, rename};
use grideye_scene::profile::Profile;
use grideye_scene::{Model, Scene, Sensor, Simulator};
use std::fmt::Display;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

/// The scene in `path`; its warnings go to standard error.
pub(crate) fn load_scene(path: &Path) -> Result<LoadedScene> {
    load_scene_as(None, path)
}

/// The same by the given model.
pub(crate) fn load_scene_as(model: Option<Model>, path: &Path) -> Result<LoadedScene> {
    let loaded = grideye_inputs::scene(model, path).map_err(bad_input)?;
    warned(&loaded.warnings);
    Ok(loaded)
}

pub(crate) fn warned(warnings: &[impl Display]) {
    for warning in warnings {
        say(&format_args!("warning: {warning}"));
    }
}

/// What the sensor never sees goes to standard error; returned as one list.
pub(crate) fn say_unseen(loaded: &LoadedScene, sensor: Option<&str>) -> Vec<String> {
    let [warnings, notes] = loaded.unseen(sensor);
    warned(&warnings);
    for note in &notes {
        say(&format_args!("note: {note}"));
    }
    [warnings, notes].concat()
}

pub(crate) fn load_profile(path: &Path, hint: &str) -> Result<Profile> {
    grideye_inputs::profile(path, hint).map_err(bad_input)
}

pub(crate) fn simulator(scene: &Scene, sensor: Option<&str>) -> Result<Simulator> {
    Simulator::new(scene, &sensor_name(scene, sensor)?).map_err(bad_input)
}

pub(crate) fn sensor_name(scene: &Scene, sensor: Option<&str>) -> Result<String> {
    grideye_inputs::sensor_name(scene, sensor).map_err(bad_input)
}

pub(crate) fn sensors<'a>(scene: &'a Scene, names: &[String]) -> Result<Vec<&'a Sensor>> {
    if names.is_empty() {
        return Ok(scene.sensors().iter().collect());
    }
    let named = names.iter().map(|name| scene.sensor(name));
    named.collect::<Result<_, _>>().map_err(bad_input)
}

pub(crate) fn open(path: &Path) -> Result<BufReader<File>> {
    grideye_inputs::open(path).map_err(bad_input)
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

pub(crate) fn text(path: &Path, what: &str, hint: &str) -> Result<String> {
    grideye_inputs::text(path, what, hint).map_err(bad_input)
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
