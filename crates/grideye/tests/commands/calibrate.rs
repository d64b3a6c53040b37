//! `grideye calibrate`: from a scene with unknowns and a recording to a scene with their values.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes")
}

fn grideye(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_grideye"))
        .args(arguments)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A folder with the scene, its trajectory, and a recording of the true one.
fn prepared() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("trajectories")).unwrap();
    for file in ["calibration.toml", "trajectories/straight-across.csv"] {
        fs::copy(scenes().join(file), folder.path().join(file)).unwrap();
    }
    let (truth, walk) = (
        scenes().join("experiment-3.toml"),
        folder.path().join("walk.csv"),
    );
    let output = grideye(&[
        "simulate",
        truth.to_str().unwrap(),
        "--out",
        walk.to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    folder
}

/// experiment-3.toml has what calibration.toml does not know. What is found must be a scene that agrees with another
/// recording; the one it was fitted to cannot tell.
#[test]
fn the_unknowns_of_the_shipped_scene_are_those_of_experiment_3() {
    let folder = prepared();
    let file = |name: &str| folder.path().join(name).display().to_string();
    let (scene, walk, new, profile) = (
        file("calibration.toml"),
        file("walk.csv"),
        file("new.toml"),
        file("unit.toml"),
    );
    let output = grideye(&[
        "calibrate",
        "--scene",
        &scene,
        "--recording",
        &walk,
        "--out",
        &new,
        "--write-profile",
        &profile,
        "--json",
        "-",
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["format"], "grideye-calibration");
    let truths = [
        ("room.ambient_c", 23.5, 0.1),
        ("agent.person.temperature_c", 27.0, 0.4),
        ("object.fan-coil.temperature_c", 27.5, 2.0),
        ("sensor.ceiling.position_mm.x", 1200.0, 40.0),
        ("sensor.ceiling.position_mm.y", 1350.0, 40.0),
        ("sensor.ceiling.elevation_deg", 90.0, 1.5),
        ("sensor.ceiling.azimuth_deg", -90.0, 3.0),
        ("recording.start_s", 0.0, 0.05),
    ];
    for (found, (key, truth, slack)) in json["found"].as_array().unwrap().iter().zip(truths) {
        assert_eq!(found["key"], key);
        let value = found["value"].as_f64().unwrap();
        assert!((value - truth).abs() < slack, "{found}");
    }
    let written = fs::read_to_string(&new).unwrap();
    assert_eq!(written.matches("# found: ").count(), 8, "{written}");
    grideye_scene::profile::Profile::parse(&fs::read_to_string(&profile).unwrap(), "unit.toml")
        .unwrap();
    let (truth, second) = (scenes().join("experiment-3.toml"), file("second.csv"));
    let truth = truth.to_str().unwrap();
    grideye(&["simulate", truth, "--seed", "9", "--out", &second]);
    for (recording, code) in [(&walk, 3), (&second, 0)] {
        let compared = grideye(&["compare", "--scene", &new, "--recording", recording]);
        let said = text(&compared.stdout);
        assert_eq!(compared.status.code(), Some(code), "{said}");
        let cannot = "they cannot confirm it";
        assert_eq!(said.contains(cannot), code == 3, "{said}");
    }
}

#[test]
fn one_half_is_fitted_and_the_other_judged() {
    let folder = prepared();
    let file = |name: &str| folder.path().join(name).display().to_string();
    let (scene, walk, new) = (file("calibration.toml"), file("walk.csv"), file("new.toml"));
    let both = ["--recording", &walk, "--scene"];
    let fit = ["--half", "second", "--out", &new, "--json", "-"];
    let output = grideye(&[&["calibrate"], &both[..], &[&scene], &fit[..]].concat());
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["half"], "second");
    let compared = grideye(&[&["compare"], &both[..], &[&new]].concat());
    let said = text(&compared.stdout);
    assert!(
        said.contains("frames that the scene was not fitted to."),
        "{said}"
    );
}

#[test]
fn what_cannot_be_calibrated_is_bad_input_with_a_hint() {
    let folder = prepared();
    let file = |name: &str| folder.path().join(name).display().to_string();
    let (walk, truth) = (
        file("walk.csv"),
        scenes().join("experiment-3.toml").display().to_string(),
    );
    let output = grideye(&["calibrate", "--scene", &truth, "--recording", &walk]);
    assert_eq!(output.status.code(), Some(2));
    let said = text(&output.stderr);
    assert!(
        said.contains("marks no number to find")
            && said.contains("hint: add an [[uncertain]] table"),
        "{said}"
    );

    let scene = file("calibration.toml");
    let bent = fs::read_to_string(&scene)
        .unwrap()
        .replace("bounds = [70, 90]", "bounds = [70, 95]");
    fs::write(&scene, bent).unwrap();
    let output = grideye(&["calibrate", "--scene", &scene, "--recording", &walk]);
    assert_eq!(output.status.code(), Some(2));
    let said = text(&output.stderr);
    assert!(
        said.contains("the upper bound 95 of `sensor.ceiling.elevation_deg`"),
        "{said}"
    );
    assert!(said.contains("calibration.toml:31:17"), "{said}");
}
