//! Our frames beside those that numpy and Embree make of the same scene by casting every ray (`tests/peers`).

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::programs::{grideye, root, run};
use grideye_tests::python::peer;
use serde_json::Value;

const SCENE: &str = "crates/grideye-scene/benches/reference.toml";

/// What the script says of the frames that one model makes of the reference work, every `every`th of them.
fn report(model: &str, every: &str) -> Option<Value> {
    let folder = tempfile::tempdir().unwrap();
    let frames = folder.path().join("frames.npz");
    let frames = frames.to_str().unwrap();
    let scene = root().join(SCENE);
    let what = "our frames beside those of numpy and Embree";
    let arguments = [scene.to_str().unwrap(), frames, "--every", every, "--json"];
    let mut script = peer("ray_casting.py", &arguments, what)?;
    let ended = run(grideye().args(["simulate", SCENE, "--model", model, "--out", frames]));
    assert_eq!(ended.code, 0, "{ended:?}");
    let ended = run(&mut script);
    assert_eq!(ended.code, 0, "{ended:?}");
    Some(serde_json::from_str(&ended.stdout).unwrap())
}

fn difference_c(report: &Value, peer: &str) -> f64 {
    report["largest_difference_c"][peer].as_f64().unwrap()
}

#[test]
fn numpy_and_embree_cast_the_same_frames() {
    let Some(report) = report("paper-grid", "2") else {
        return;
    };
    assert!(report["frames"].as_u64().unwrap() > 50, "{report}");
    assert!(report["contrast_c"].as_f64().unwrap() > 4.0, "{report}");
    // Frames are written in single precision, which has steps of 1.9 µK at 31 °C.
    assert!(difference_c(&report, "numpy f64") < 2e-6, "{report}");
    // In single precision a ray along an edge may go either way: a point weighs 1/1406 of a pixel at most.
    for peer in ["numpy f32", "embreex"] {
        assert!(difference_c(&report, peer) < 0.02, "{report}");
    }
}

#[test]
fn without_a_grid_the_frames_are_those_of_the_rays_but_for_the_grids_own_steps() {
    let Some(report) = report("paper", "5") else {
        return;
    };
    let difference_c = difference_c(&report, "numpy f64");
    assert!((1e-4..0.15).contains(&difference_c), "{report}");
}
