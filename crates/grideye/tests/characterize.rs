//! `grideye characterize`: the table, the files, and what it says of recordings that tell nothing.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn session_3() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../recordings/linaige/Session3_2021-07-06_RoomA_v2.csv")
}

fn characterize(arguments: &[&Path]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_grideye"))
        .arg("characterize")
        .args(arguments)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn a_real_session_gives_a_table_a_json_and_a_profile() {
    let folder = tempfile::tempdir().unwrap();
    let (json, profile) = (
        folder.path().join("out.json"),
        folder.path().join("out.toml"),
    );
    let output = characterize(&[
        &session_3(),
        Path::new("--json"),
        &json,
        Path::new("--profile"),
        &profile,
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    assert!(table.contains("−804.5 s at frame 1056"), "{table}");
    let json: serde_json::Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    assert_eq!(json["frames"], 1672);
    let written = fs::read_to_string(profile).unwrap();
    let read = grideye_scene::profile::Profile::parse(&written, "out.toml").unwrap();
    assert!(
        read.noise_sigma_c
            .iter()
            .all(|sigma| (0.2..0.55).contains(sigma))
    );
    assert!(
        written.contains("grideye characterize ") && written.contains("--profile"),
        "{written}"
    );
}

#[test]
fn json_on_standard_output_stands_alone() {
    let output = characterize(&[&session_3(), Path::new("--json"), Path::new("-")]);
    let json: serde_json::Value = serde_json::from_str(&text(&output.stdout)).unwrap();
    assert_eq!(json["format"], "grideye-characterization");
}

#[test]
fn too_few_frames_are_no_answer_and_no_recording_is_bad_input() {
    let folder = tempfile::tempdir().unwrap();
    let short = folder.path().join("Session3_2021-07-06_short.csv");
    let whole = fs::read_to_string(session_3()).unwrap();
    let lines: Vec<&str> = whole.lines().take(31).collect();
    fs::write(&short, lines.join("\n")).unwrap();
    let output = characterize(&[&short]);
    assert_eq!(output.status.code(), Some(3));
    let said = text(&output.stderr);
    assert!(
        said.contains("30 frames, expected at least 50") && said.contains("hint: "),
        "{said}"
    );

    let output = characterize(&[&folder.path().join("none.csv")]);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
}

#[test]
fn the_empty_room_becomes_the_pattern_and_the_page_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let (profile, page) = (
        folder.path().join("out.toml"),
        folder.path().join("page.html"),
    );
    let with = |empty: &str| {
        characterize(&[
            &session_3(),
            Path::new("--empty"),
            Path::new(empty),
            Path::new("--profile"),
            &profile,
            Path::new("--report"),
            &page,
        ])
    };
    let output = with("auto");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(
        text(&output.stderr).contains("empty room: "),
        "{}",
        text(&output.stderr)
    );
    let found = |path: &Path| {
        let written = fs::read_to_string(path).unwrap();
        grideye_scene::profile::Profile::parse(&written, "out.toml")
            .unwrap()
            .fixed_pattern
            .offset_c
    };
    let by_itself = found(&profile);
    // The stretch that the recording's source names as empty, rows 988 to 1055 before the clock jumps: 6.7 s of them.
    assert_eq!(with("99.5s..105s").status.code(), Some(0));
    let named = found(&profile);
    let square: f64 = by_itself
        .iter()
        .zip(named)
        .map(|(found, named)| (found - named).powi(2))
        .sum();
    assert!((square / 64.0).sqrt() < 0.12, "{square}");
    assert!(fs::read_to_string(&page).unwrap().contains("</html>"));

    for (empty, said) in [
        ("9000..9001", "hint: seconds count from"),
        ("5..3", "such as 12s..40s"),
    ] {
        let output = with(empty);
        assert_eq!(output.status.code(), Some(2), "{empty}");
        assert!(
            text(&output.stderr).contains(said),
            "{}",
            text(&output.stderr)
        );
    }
}
