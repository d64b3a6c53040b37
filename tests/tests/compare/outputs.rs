//! What `grideye compare` writes beside its verdict: JUnit XML as an independent parser reads it, JSON; and which
//! thresholds and profiles it takes.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::comparing::{compare, simulate};
use grideye_tests::programs::{is_part_left_out, run};
use grideye_tests::python::{WITHOUT_PEERS, peer};
use serde_json::Value;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const SCENE: &str = "scenes/experiment-1.toml";

/// What the scene's own sensor would record.
fn recording(folder: &TempDir, scene: &str, frames: u32) -> PathBuf {
    let path = folder.path().join("recording & <1>.csv");
    simulate(scene, 1007, frames, &path);
    path
}

/// The cases of a report by Python's parser; `None` if Python is left out.
fn cases(xml: &Path) -> Option<Value> {
    let what = "JUnit as another parser reads it";
    if is_part_left_out(WITHOUT_PEERS, what) {
        return None;
    }
    let mut python = peer("junit.py", &[xml.to_str().unwrap()], what)?;
    let ended = run(&mut python);
    assert_eq!(ended.code, 0, "{ended:?}");
    Some(serde_json::from_str(&ended.stdout).unwrap())
}

#[test]
fn junit_is_what_servers_read_and_says_what_the_exit_code_says() {
    let folder = tempfile::tempdir().unwrap();
    let xml = folder.path().join("result.xml");
    let xml_option = xml.to_str().unwrap();
    let right = recording(&folder, SCENE, 40);
    for (scene, code, verdict) in [
        (SCENE, 0, "passed"),
        ("scenes/experiment-2.toml", 1, "failure"),
    ] {
        let ended = compare(scene, &right, &["--junit", xml_option]);
        assert_eq!(ended.code, code, "{ended:?}");
        if let Some(cases) = cases(&xml) {
            assert_eq!(cases["verdict"], verdict, "{cases}");
            for name in [
                "right",
                "contrast",
                "told_apart",
                "level",
                "drift",
                "moving_pixels",
                "steps",
                "thermistor",
                "frame_rate",
            ] {
                assert!(cases[name].is_string(), "{name}: {cases}");
            }
            let green = |outcome: &Value| outcome == "passed" || outcome == "skipped";
            assert_eq!(
                cases.as_object().unwrap().values().all(green),
                code == 0,
                "{cases}"
            );
        }
    }
    let one = recording(&folder, SCENE, 1);
    let ended = compare(SCENE, &one, &["--junit", xml_option]);
    assert_eq!(ended.code, 3, "{ended:?}");
    if let Some(cases) = cases(&xml) {
        assert_eq!(
            (&cases["verdict"], &cases["enough_to_tell"]),
            (&"error".into(), &"error".into())
        );
    }
}

#[test]
fn thresholds_of_a_file_decide_and_are_printed_with_their_source() {
    let folder = tempfile::tempdir().unwrap();
    let right = recording(&folder, SCENE, 40);
    let file = folder.path().join("strict.toml");
    std::fs::write(
        &file,
        "[offset_max_c]\nvalue = 0\nsource = \"nobody is perfect\"\n",
    )
    .unwrap();
    let json = folder.path().join("out.json");
    let report = folder.path().join("out.html");
    let more = [
        "--thresholds",
        file.to_str().unwrap(),
        "--json",
        json.to_str().unwrap(),
        "--report",
        report.to_str().unwrap(),
    ];
    let ended = compare(SCENE, &right, &more);
    assert_eq!(ended.code, 1, "{ended:?}");
    let found: Value = serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
    let line = found["thresholds"]
        .as_array()
        .unwrap()
        .iter()
        .find(|line| line["key"] == "offset_max_c")
        .unwrap();
    assert_eq!(
        (&line["value"], &line["source"]),
        (&serde_json::json!(0.0), &"nobody is perfect".into())
    );
    let page = std::fs::read_to_string(report).unwrap();
    assert!(page.contains("nobody is perfect") && page.contains("strict.toml"));

    std::fs::write(&file, "[right_min]\nvalue = 7\nsource = \"x\"\n").unwrap();
    let ended = compare(SCENE, &right, &["--thresholds", file.to_str().unwrap()]);
    assert_eq!((ended.code, ended.stdout.as_str()), (2, ""), "{ended:?}");
    assert!(
        ended
            .stderr
            .contains("strict.toml:2:9: `right_min.value` is 7, expected 0.005 to 0.5\nhint: "),
        "{ended:?}"
    );
}

/// The shipped example is one that the program takes.
#[test]
fn the_shipped_thresholds_and_profiles_are_taken() {
    let folder = tempfile::tempdir().unwrap();
    let right = recording(&folder, SCENE, 40);
    let more = [
        "--thresholds",
        "crates/grideye-validator/thresholds.toml",
        "--profile",
        "scenes/profiles/ideal.toml",
    ];
    let ended = compare(SCENE, &right, &more);
    assert_eq!(ended.code, 0, "{ended:?}");
    let ended = compare(SCENE, &right, &["--profile", SCENE]);
    assert_eq!((ended.code, ended.stdout.as_str()), (2, ""), "{ended:?}");
}

#[test]
fn a_report_under_the_name_of_a_pdf_is_refused_with_the_way_to_print_one() {
    let folder = tempfile::tempdir().unwrap();
    let right = recording(&folder, SCENE, 40);
    let pdf = folder.path().join("report.pdf");
    let ended = compare(SCENE, &right, &["--report", pdf.to_str().unwrap()]);
    assert_eq!((ended.code, ended.stdout.as_str()), (2, ""), "{ended:?}");
    let hint = format!(
        "hint: write --report {} and print it from a browser",
        pdf.with_extension("html").display()
    );
    assert!(ended.stderr.contains(&hint), "{ended:?}");
    assert!(!pdf.exists());
}
