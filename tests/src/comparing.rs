//! Recordings that a scene's own sensor would make, and `grideye compare` over them.

use crate::programs::{Ended, grideye, run};
use std::path::Path;

/// Writes what the scene's own sensor would record.
///
/// # Panics
/// When `grideye simulate` refuses.
pub fn simulate(scene: &str, seed: u64, frames: u32, path: &Path) {
    let (seed, frames) = (seed.to_string(), frames.to_string());
    let ended = run(grideye()
        .args([
            "simulate", scene, "--seed", &seed, "--frames", &frames, "--out",
        ])
        .arg(path));
    assert_eq!(ended.code, 0, "{ended:?}");
}

/// `grideye compare` of a scene and a recording, however it ends.
#[must_use]
pub fn compare(scene: &str, recording: &Path, more: &[&str]) -> Ended {
    run(grideye()
        .args(["compare", "--scene", scene, "--recording"])
        .arg(recording)
        .args(more))
}
