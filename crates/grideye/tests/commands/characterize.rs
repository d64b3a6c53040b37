//! `grideye characterize`: the table, the files, and what it says of recordings that tell nothing.

use grideye_frame::word::{pixel_celsius, pixel_word};
use grideye_frame::{Celsius, Reading};
use grideye_recording::csv;
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
    profile.in_its_room_c()
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
            && said.contains("; its background is in the profile"),
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
        said.contains("no empty room: --empty no; the profile has no background, and its pattern"),
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

/// Session 3 has stretches in which nobody was counted; the pattern from its rows is the shipped profile's.
#[test]
fn a_recording_with_people_gives_the_background_of_its_empty_stretches() {
    let folder = tempfile::tempdir().unwrap();
    let profile = folder.path().join("out.toml");
    let with = |arguments: &[&Path]| {
        let session = session_3();
        let given = [
            &[session.as_path(), Path::new("--profile"), &profile],
            arguments,
        ];
        let output = characterize(&given.concat());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{said}");
        let written = fs::read_to_string(&profile).unwrap();
        let read = grideye_scene::profile::Profile::parse(&written, "out.toml").unwrap();
        (said, read)
    };
    let (said, unasked) = with(&[]);
    assert!(said.contains("empty room: "), "{said}");
    let (_, auto) = with(&[Path::new("--empty"), Path::new("auto")]);
    assert_eq!(unasked.background_c, auto.background_c);
    let empty = empty_rows(folder.path(), 498);
    let output = characterize(&[
        &empty,
        Path::new("--profile"),
        &folder.path().join("e.toml"),
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let apart: Vec<f64> = offsets(&folder.path().join("e.toml"))
        .iter()
        .zip(unasked.in_its_room_c())
        .map(|(empty, all)| empty - all)
        .collect();
    // As the search alone is held to in the validator's tests.
    assert!(sd(&apart) < 0.08, "{}", sd(&apart));

    let (said, none) = with(&[Path::new("--empty"), Path::new("no")]);
    assert_eq!(none.background_c, None);
    assert!(said.contains("the profile has no background"), "{said}");
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/profiles/linaige.toml");
    let pairs = none.in_its_room_c().into_iter().zip(offsets(&shipped));
    assert!(
        pairs
            .into_iter()
            .all(|(now, before)| (now - before).abs() < 2e-4),
        "as it was kept before"
    );
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
            .in_its_room_c()
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

/// The shipped session as somebody has it who took degrees Fahrenheit for Celsius: the doubt comes before everything else.
#[test]
fn a_level_that_no_room_has_is_doubted_first() {
    let folder = tempfile::tempdir().unwrap();
    let (celsius, wrong) = (folder.path().join("c.csv"), folder.path().join("f.csv"));
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/experiment-3.toml");
    let grideye = |arguments: &[&str], files: &[&Path]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
        let output = command.args(arguments).args(files).output().unwrap();
        (text(&output.stdout), text(&output.stderr))
    };
    grideye(&["simulate", "--out"], &[&celsius, &scene]);
    let mut writer = csv::Writer::new(fs::File::create(&wrong).unwrap()).unwrap();
    for row in csv::Reader::new(fs::File::open(&celsius).unwrap()).unwrap() {
        let mut row = row.unwrap();
        if let Reading::Frame(frame) = &mut row.record.reading {
            for word in &mut frame.pixels {
                let fahrenheit = 1.8 * pixel_celsius(*word).get() + 32.0;
                *word = pixel_word(Celsius::new(fahrenheit)).unwrap();
            }
        }
        writer.write(&row).unwrap();
    }
    writer.finish().unwrap();
    let said = |recording: &Path| {
        let of = [Path::new("--recording"), recording];
        let sides = [&[Path::new("--scene"), &scene], &of[..]].concat();
        let replay = [&of[..], &[Path::new("--"), Path::new("true")]].concat();
        [
            grideye(&["characterize"], &[recording]).1,
            grideye(&["compare"], &sides).0,
            grideye(&["emulate"], &replay).1,
        ]
    };
    for said in said(&wrong) {
        let first = said.lines().next().unwrap_or_default();
        assert!(first.starts_with("warning: "), "{said}");
        assert!(
            first.ends_with("they are probably degrees Fahrenheit"),
            "{said}"
        );
    }
    for said in said(&celsius) {
        assert!(!said.contains("degrees Celsius"), "{said}");
    }
}
