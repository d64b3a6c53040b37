//! `grideye coverage`: what it prints and writes, and what it refuses.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../scenes/{name}.toml"))
}

fn coverage(scene: &Path, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_grideye"))
        .arg("coverage")
        .arg(scene)
        .args(more)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn json(scene: &Path, more: &[&str]) -> serde_json::Value {
    let output = coverage(scene, &[&["--json"], more].concat());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

const FEW: [&str; 6] = [
    "--candidates",
    "ceiling,corners",
    "--spacing-mm",
    "1200",
    "--cell-mm",
    "300",
];

#[test]
fn the_picked_poses_pasted_into_the_scene_do_there_what_was_promised() {
    let folder = tempfile::tempdir().unwrap();
    let best = folder.path().join("best.toml");
    let picked = json(
        &scene("bedroom"),
        &[&FEW[..], &["--write", best.to_str().unwrap()]].concat(),
    );
    assert_eq!(picked["sensors"].as_array().unwrap().len(), 2);
    let own = fs::read_to_string(scene("bedroom")).unwrap();
    let (room, _) = own.split_once("[[sensor]]").unwrap();
    let pasted = folder.path().join("pasted.toml");
    fs::write(
        &pasted,
        format!("{room}{}", fs::read_to_string(best).unwrap()),
    )
    .unwrap();
    let again = json(&pasted, &["--cell-mm", "300"]);
    assert_eq!(again["totals"], picked["totals"]);
    assert_eq!(again["cells"], picked["cells"]);
    assert_eq!(picked["sensors"][1]["with_all_before"], picked["totals"]);
    // The share that is reached is the objective of the last pose.
    let share = |value: &serde_json::Value| value.as_f64().unwrap();
    let reached = share(&picked["totals"]["detected_share"]);
    assert!((share(&picked["sensors"][1]["objective"]) - reached).abs() < 1e-12);
}

#[test]
fn the_outputs_are_the_same_on_any_number_of_threads_and_say_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let mut all = Vec::new();
    for threads in ["1", "5"] {
        let outs = [file("map.svg"), file("map.csv")];
        let more = ["--threads", threads, "--out", &outs[0], "--out", &outs[1]];
        let output = coverage(&scene("bedroom"), &[&FEW[..], &more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        all.push((text(&output.stdout), outs.map(|out| fs::read(out).unwrap())));
    }
    assert_eq!(all[0], all[1]);
    let (printed, [svg, csv]) = &all[0];
    let (svg, csv) = (text(svg), text(csv));
    assert!(printed.contains("k=1: ") && printed.contains("k=2: "));
    assert!(svg.starts_with("<svg ") && svg.contains("wardrobe") && svg.contains("not detected"));
    // A row for each of 14 x 12 cells, and the share of the table in the CSV's own words.
    assert_eq!(csv.lines().count(), 1 + 14 * 12);
    let rows: Vec<Vec<&str>> = csv
        .lines()
        .skip(1)
        .map(|row| row.split(',').collect())
        .collect();
    let places: Vec<f64> = rows
        .iter()
        .filter(|row| row[3] == "place")
        .map(|row| row[7].parse().unwrap())
        .collect();
    let detected = places.iter().filter(|contrast| **contrast >= 3.0).count();
    let share = 100.0 * f64::from(u32::try_from(detected).unwrap())
        / f64::from(u32::try_from(places.len()).unwrap());
    assert!(printed.contains(&format!("k=2: {share:.1} %")), "{printed}");
}

#[test]
fn the_scenes_own_sensors_stay_if_they_are_to() {
    let alone = json(&scene("bedroom"), &["--cell-mm", "300"]);
    let kept = json(
        &scene("bedroom"),
        &[&FEW[..], &["--keep", "--best", "1"]].concat(),
    );
    let sensors = kept["sensors"].as_array().unwrap();
    assert_eq!((sensors.len(), &sensors[0]["name"]), (2, &"ceiling".into()));
    assert_eq!(sensors[0]["with_all_before"], alone["totals"]);
    assert!(sensors[0]["objective"].is_null() && sensors[1]["objective"].is_number());
    // Of the name that the scene's own sensor has, a picked one is another.
    assert_ne!(sensors[1]["name"], "ceiling");
}

#[test]
fn an_exit_code_says_whether_enough_is_covered() {
    let code = |percent: &str| {
        coverage(&scene("bedroom"), &["--at-least", percent])
            .status
            .code()
    };
    assert_eq!((code("1"), code("100")), (Some(0), Some(1)));
}

#[test]
fn what_cannot_be_done_is_said_with_a_hint() {
    let folder = tempfile::tempdir().unwrap();
    let bare = folder.path().join("bare.toml");
    fs::write(
        &bare,
        "[room]\nsize_mm = [4000, 3000, 2500]\nambient_c = 20\n",
    )
    .unwrap();
    let bedroom = scene("bedroom");
    for (scene, more, words) in [
        (&bare, &[][..], "the scene has no sensor"),
        (
            &bare,
            &["--candidates", "walls", "--heights-mm", "2600"],
            "no candidate pose",
        ),
        (
            &bedroom,
            &["--candidates", "all", "--spacing-mm", "20"],
            "20000",
        ),
        (&bedroom, &["--cell-mm", "1"], "cells of the floor"),
        (&bedroom, &["--out", "map.png"], ".svg or .csv"),
        (&bedroom, &["--agent", "nobody"], "it has person"),
        (&bedroom, &["--sensors", "nothing"], "no sensor `nothing`"),
        (
            &bedroom,
            &["--candidates", "ceiling", "--sensors", "ceiling"],
            "add --keep",
        ),
        (&bedroom, &["--spacing-mm", "700"], "--candidates"),
        (&bedroom, &["--preset", "lepton"], "--candidates"),
        (
            &bedroom,
            &["--candidates", "all", "--preset", "grid-ear"],
            "grid-eye-wide",
        ),
        (
            &bedroom,
            &["--candidates", "all", "--like", "grid-ear"],
            "no sensor `grid-ear`",
        ),
        (&bedroom, &["--person-height-mm", "300"], "500 to 2800"),
        (&bedroom, &["--clothing", "none"], "indoor"),
        (
            &bedroom,
            &["--person-height-mm", "2700"],
            "no place for a person standing",
        ),
        (
            &bedroom,
            &["--candidates", "all", "--best", "0"],
            "1 to 100",
        ),
        (&bedroom, &["--sigma", "0"], "above 0"),
        (&bedroom, &["--best", "3"], "--candidates"),
        (&bedroom, &["--at-least", "101"], "from 0 to 100"),
        (&bedroom, &["--threads", "0"], "1 to 256"),
    ] {
        let output = coverage(scene, more);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{more:?}: {said}");
        assert!(said.contains(words), "{more:?}: {said}");
    }
}
