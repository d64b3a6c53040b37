//! Profiles, thresholds and scripts of faults.

use crate::error::{InputError, shown};
use crate::text::text;
use amg8833_emulator::script::Script;
use grideye_scene::profile::{BUILT_IN, Profile};
use grideye_validator::thresholds::ThresholdSet;
use std::path::Path;

/// Where any TOML file will do.
pub const TOML_HINT: &str = "name a TOML file";

/// A sensor's profile.
/// # Errors
/// What is wrong, where, and what to do.
pub fn profile(path: &Path, hint: &str) -> Result<Profile, InputError> {
    let text = text(path, "the profile", hint)?;
    Ok(Profile::parse(&text, &shown(path))?)
}

/// The built-in profile of this name, or the one in this file.
/// # Errors
/// As [`profile`].
pub fn profile_or_built_in(named: &Path) -> Result<Profile, InputError> {
    if let Some((name, text)) = BUILT_IN.iter().find(|(name, _)| named == Path::new(name)) {
        return Ok(Profile::parse(text, name)?);
    }
    let names = BUILT_IN.map(|(name, _)| name).join(", ");
    let hint = format!("name a file, or one of the built-in profiles: {names}");
    profile(named, &hint)
}

/// The thresholds in a file, or the shipped ones.
/// # Errors
/// What is wrong, where, and what to do.
pub fn thresholds(path: Option<&Path>) -> Result<ThresholdSet, InputError> {
    let Some(path) = path else {
        return Ok(ThresholdSet::shipped());
    };
    let text = text(path, "the thresholds", TOML_HINT)?;
    Ok(ThresholdSet::parse(&text, &shown(path))?)
}

/// The script of faults in a file. The default seed, 1, leaves the script its own.
/// # Errors
/// What is wrong, where, and what to do.
pub fn faults(path: &Path, seed: u64) -> Result<Script, InputError> {
    let hint =
        "name a file that you may read; crates/amg8833-emulator/scripts/README.md describes it";
    let text = text(path, "the script of faults", hint)?;
    faults_of(&text, &shown(path), seed)
}

/// The same of a text.
/// # Errors
/// What is wrong, where, and what to do.
pub fn faults_of(text: &str, origin: &str, seed: u64) -> Result<Script, InputError> {
    let script = Script::from_toml(text, origin)?;
    let seed = script.seed().wrapping_add(seed).wrapping_sub(1);
    Ok(script.with_seed(seed))
}
