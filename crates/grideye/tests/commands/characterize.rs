//! `grideye characterize`: the table, the files, and what it says of recordings that tell nothing.

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

/// A recording of `frames` rows of session 3 in which nobody was counted, in the layout of the whole.
fn empty_rows(folder: &Path, frames: usize) -> PathBuf {
    let path = folder.join("Session3_2021-07-06_empty.csv");
    let whole = fs::read_to_string(session_3()).unwrap();
    let lines: Vec<&str> = whole.lines().collect();
    let rows = [323..434, 605..694, 715..795, 823..938, 1569..1672]
        .into_iter()
        .flatten()
        .take(frames)
        .map(|row| lines[row + 1]);
    let text: Vec<&str> = std::iter::once(lines[0]).chain(rows).collect();
    fs::write(&path, text.join("\n") + "\n").unwrap();
    path
}

fn offsets(path: &Path) -> [f64; 64] {
    let written = fs::read_to_string(path).unwrap();
    let profile = grideye_scene::profile::Profile::parse(&written, "out.toml").unwrap();
    profile.fixed_pattern.offset_c
}

fn sd(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / 64.0;
    (values
        .iter()
        .map(|value| (value - mean).powi(2))
        .sum::<f64>()
        / 64.0)
        .sqrt()
}

/// The README's way to a profile. What is not smooth in this room has a standard deviation of 0.235 °C, the whole 0.27.
#[test]
fn an_empty_recording_gives_its_whole_background_unasked() {
    let folder = tempfile::tempdir().unwrap();
    let (empty, profile) = (
        empty_rows(folder.path(), 498),
        folder.path().join("out.toml"),
    );
    let output = characterize(&[&empty, Path::new("--profile"), &profile]);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(
        said.contains("empty room: 498 frames, ")
            && said.contains("; the pattern is its whole background"),
        "{said}"
    );
    let written = fs::read_to_string(&profile).unwrap();
    assert!(
        written.contains("\n# empty room: 498 frames, "),
        "{written}"
    );
    let unasked = offsets(&profile);
    assert!((sd(&unasked) - 0.27).abs() < 0.02, "{}", sd(&unasked));
    let with = |empty_is: &str| {
        let output = characterize(&[
            &empty,
            Path::new("--empty"),
            Path::new(empty_is),
            Path::new("--profile"),
            &profile,
        ]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        (offsets(&profile), text(&output.stderr))
    };
    assert_eq!(with("yes").0, unasked);
    let (alone, said) = with("no");
    assert!((sd(&alone) - 0.235).abs() < 0.015, "{}", sd(&alone));
    assert!(
        said.contains("no empty room: --empty no; the pattern is only what is not smooth"),
        "{said}"
    );
}

#[test]
fn where_nobody_can_tell_whether_the_room_is_empty_it_is_asked() {
    let folder = tempfile::tempdir().unwrap();
    let (short, profile) = (
        empty_rows(folder.path(), 200),
        folder.path().join("out.toml"),
    );
    let output = characterize(&[&short, Path::new("--profile"), &profile]);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(
        said.contains(
            "cannot tell whether the room is empty: half a minute without a gap is needed"
        ),
        "{said}"
    );
    assert!(
        said.contains("hint: say --empty yes if nobody is in view, --empty no if somebody may be"),
        "{said}"
    );
    assert!(!profile.exists());
    assert!(
        text(&output.stdout).contains("somebody in view"),
        "the table is printed"
    );
    // Without a profile nothing depends on it.
    assert_eq!(characterize(&[&short]).status.code(), Some(0));
    for answer in ["yes", "no"] {
        let output = characterize(&[
            &short,
            Path::new("--empty"),
            Path::new(answer),
            Path::new("--profile"),
            &profile,
        ]);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{answer}: {}",
            text(&output.stderr)
        );
        fs::remove_file(&profile).unwrap();
    }
    let output = characterize(&[&short, Path::new("--empty"), Path::new("perhaps")]);
    assert_eq!(output.status.code(), Some(2));
    let said = text(&output.stderr);
    assert!(
        said.contains("expected yes, no or auto, or FROM..TO in seconds"),
        "{said}"
    );
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/experiment-1.toml");
    let output = characterize(&[
        &short,
        Path::new("--empty"),
        Path::new("no"),
        Path::new("--scene"),
        &scene,
    ]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output.stderr).contains("--scene needs an empty room"),
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn a_profile_of_a_recording_with_people_states_what_it_keeps() {
    let folder = tempfile::tempdir().unwrap();
    let profile = folder.path().join("out.toml");
    let output = characterize(&[&session_3(), Path::new("--profile"), &profile]);
    assert_eq!(output.status.code(), Some(0));
    let said = text(&output.stderr);
    assert!(
        said.contains(" °C); the pattern is only what is not smooth in the background"),
        "{said}"
    );
    assert!(
        said.contains(
            "hint: --empty auto takes the whole background from the stretches in which nobody is"
        ),
        "{said}"
    );
    let written = fs::read_to_string(&profile).unwrap();
    assert!(
        written.contains("\n# no empty room: somebody is in view (rows "),
        "{written}"
    );
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/profiles/linaige.toml");
    let pairs = offsets(&profile).into_iter().zip(offsets(&shipped));
    assert!(
        pairs
            .into_iter()
            .all(|(now, before)| (now - before).abs() < 2e-4),
        "as it was kept before"
    );
}

/// A unit whose background slopes by a degree and a half, in a room that somebody leaves.
const SLOPE: &str = "[noise]\nsigma_c = 0.24\n[fixed_pattern]\noffset_c = [";
const WALKED: &str = r#"
[room]
size_mm = [6000, 6000, 2700]
ambient_c = 21
[[sensor]]
name = "ceiling"
preset = "grid-eye"
sampling_hz = 10
step_c = 0.25
position_mm = [2500, 2500, 2700]
elevation_deg = 90
azimuth_deg = -90
"#;
const PERSON: &str = r#"
[[agent]]
name = "person"
size_mm = [300, 450, 1750]
temperature_c = 29
trajectory = "way.csv"
speed_mm_per_s = 600
"#;

fn grideye(folder: &Path, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_grideye"))
        .args(arguments.split(' '))
        .current_dir(folder)
        .output()
        .unwrap()
}

/// Scenes, the recordings of a walk and of the empty room, and the profile of the latter with and without what is smooth.
fn prepare(folder: &Path) {
    let slope: Vec<String> = (0..64)
        .map(|pixel| {
            format!(
                "{:.2}",
                0.2 * f64::from(pixel % 8) - 0.9 + 0.1 * f64::from(pixel * 7 % 5)
            )
        })
        .collect();
    fs::write(
        folder.join("unit.toml"),
        format!("{SLOPE}{}]\n", slope.join(", ")),
    )
    .unwrap();
    fs::write(
        folder.join("way.csv"),
        "x_mm,y_mm,z_mm,dwell_s\n1500,2000,0,0\n3300,3000,0,0\n5700,5700,0,30\n",
    )
    .unwrap();
    let unit = format!("{WALKED}profile = \"unit.toml\"\n");
    fs::write(folder.join("empty.toml"), &unit).unwrap();
    fs::write(folder.join("walked.toml"), format!("{unit}{PERSON}")).unwrap();
    fs::write(folder.join("claim.toml"), format!("{WALKED}{PERSON}")).unwrap();
    fs::write(folder.join("nobody.toml"), WALKED).unwrap();
    for command in [
        "simulate empty.toml --frames 600 --out empty.csv",
        "simulate walked.toml --seed 3 --out walk.csv",
        "characterize empty.csv --profile whole.toml",
        "characterize empty.csv --empty no --profile pattern.toml",
    ] {
        let output = grideye(folder, command);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{command}: {}",
            text(&output.stderr)
        );
    }
}

/// Code, table, JSON and page of a comparison with the walk.
fn compare(
    folder: &Path,
    scene: &str,
    profile: &str,
) -> (Option<i32>, String, serde_json::Value, String) {
    let output = grideye(
        folder,
        &format!(
            "compare --scene {scene} --recording walk.csv --profile {profile} --json out.json --report out.html"
        ),
    );
    let json = fs::read_to_string(folder.join("out.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let page = fs::read_to_string(folder.join("out.html")).unwrap();
    (output.status.code(), text(&output.stdout), json, page)
}

/// With its whole background the right scene agrees; with the pattern alone, as `characterize` wrote it before, it is
/// said that the recording itself knows better.
#[test]
fn a_profile_that_explains_the_background_badly_is_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    prepare(folder);
    let (code, table, json, page) = compare(folder, "claim.toml", "whole.toml");
    assert_eq!(code, Some(0), "{table}");
    assert!(
        !table.contains("warning: ") && !page.contains("Warning:"),
        "{table}"
    );
    assert_eq!(json["warnings"].as_array().unwrap().len(), 0);
    assert!(
        json["background"]["profile_rms_c"].as_f64().unwrap() < 0.1,
        "{}",
        json["background"]
    );
    assert_eq!(
        compare(folder, "nobody.toml", "whole.toml").0,
        Some(1),
        "nobody is refused all the same"
    );

    let (_, table, json, page) = compare(folder, "claim.toml", "pattern.toml");
    let fit = &json["background"];
    let (left, own) = (
        fit["profile_rms_c"].as_f64().unwrap(),
        fit["own_rms_c"].as_f64().unwrap(),
    );
    // The slope of 0.2 °C a column alone: 0.2 times the root of (64 - 1) / 12.
    assert!((left - 0.458).abs() < 0.05 && own < 0.1, "{fit}");
    let warning = format!(
        "the profile leaves {left:.2} °C rms of the background unexplained, the recording's own empty stretches ("
    );
    let figure = format!(") leave {own:.2} °C");
    for place in [
        &table,
        &page,
        &json["warnings"][0].as_str().unwrap().to_owned(),
    ] {
        let place = place.replace("&#39;", "'");
        assert!(
            place.contains(&warning) && place.contains(&figure),
            "{warning}: {place}"
        );
        assert!(place.contains("hint: leave out --profile, "), "{place}");
    }
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
