//! A recording compared with a scene, and what the report says of both.

use crate::error::InputError;
use crate::read::{TOML_HINT, profile, thresholds};
use crate::scene::{LoadedScene, sensor_name};
use crate::text::open;
use grideye_plan::drawing::{Drawing, perspective};
use grideye_scene::Scene;
use grideye_validator::report::{self, Context, Input};
use grideye_validator::{Comparison, KnownUnit, Options, Thinned, compare_scene};
use sha2::{Digest as _, Sha256};
use std::io;
use std::path::{Path, PathBuf};

/// What is compared, as people named it.
#[derive(Debug, Clone)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Sides<'a> {
    pub loaded: &'a LoadedScene,
    /// The scene's name in the report.
    pub scene: &'a str,
    pub sensor: Option<&'a str>,
    pub recording: &'a Path,
    /// The recording's hash, if it is in no file.
    pub held: Option<Input>,
    pub profile: Option<&'a Path>,
    pub thresholds: Option<&'a Path>,
}

/// The result, and the rest of the report.
#[derive(Debug, Clone)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Compared {
    pub comparison: Comparison,
    pub context: Context,
}

/// Compares a recording with a scene. `how` has no thresholds and no unit: both come from `sides`; `context` has the
/// command and the program.
/// # Errors
/// If a file is no profile or no thresholds, or the two cannot be compared.
pub fn compare(
    sides: &Sides<'_>,
    recording: &Thinned,
    how: Options,
    context: Context,
) -> Result<Compared, InputError> {
    let (loaded, scene) = (sides.loaded, &sides.loaded.scene);
    let sensor = sensor_name(scene, sides.sensor)?;
    let thresholds = thresholds(sides.thresholds)?;
    let unit = sides
        .profile
        .map(|path| profile(path, TOML_HINT))
        .transpose()?;
    let how = Options {
        thresholds: thresholds.thresholds,
        unit: unit.as_ref().map(KnownUnit::of),
        ..how
    };
    let mut comparison = compare_scene(&recording.records, scene, &sensor, &how)?;
    comparison.notes.extend(recording.note());
    let read = loaded.files.iter().map(PathBuf::as_path);
    let given = [sides.profile, sides.thresholds].into_iter().flatten();
    let recording = sides.held.is_none().then_some(sides.recording);
    let inputs = read.chain(recording).chain(given).map(hashed);
    let context = Context {
        scene: sides.scene.to_owned(),
        recording: sides.recording.display().to_string(),
        sensor: sensor.clone(),
        seeds: vec![("simulation".to_owned(), how.seed)],
        inputs: inputs
            .chain(sides.held.clone().map(Ok))
            .collect::<Result<_, _>>()?,
        assumptions: loaded.warnings.clone(),
        experiment: scene.paper_experiment(),
        thresholds: thresholds.lines,
        room: room(scene, &sensor, &comparison),
        ..context
    };
    Ok(Compared {
        comparison,
        context,
    })
}

/// The room as the report shows it beside its frames, with what each pixel sees in the color of the real frame.
#[must_use]
pub fn room(scene: &Scene, sensor: &str, comparison: &Comparison) -> String {
    let number = scene.sensors().iter().position(|one| one.name == sensor);
    let Some((time, colors)) = report::key_colors(comparison) else {
        return String::new();
    };
    let drawing = Drawing {
        time,
        frame: number.map(|number| (number, &colors[..])),
        ..Drawing::new("")
    };
    perspective(scene, &drawing)
}

/// A file with the hash of its bytes.
/// # Errors
/// If it cannot be read.
pub fn hashed(path: &Path) -> Result<Input, InputError> {
    let name = path.display().to_string();
    let mut hasher = Sha256::new();
    io::copy(&mut open(path)?, &mut hasher)
        .map_err(|error| InputError::new(format!("cannot read {name}: {error}")).of(path))?;
    Ok(input(name, hasher))
}

/// What is in no file.
#[must_use]
pub fn hashed_text(name: &str, text: impl AsRef<[u8]>) -> Input {
    input(name.to_owned(), Sha256::new_with_prefix(text))
}

fn input(name: String, hasher: Sha256) -> Input {
    let bytes = hasher.finalize();
    let digits: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    let hash = format!("sha256:{digits}");
    Input { name, hash }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hash_is_the_published_one_of_its_text() {
        // FIPS 180-2, appendix B.1.
        assert_eq!(
            hashed_text("abc", "abc").hash,
            "sha256:ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
    }
}
