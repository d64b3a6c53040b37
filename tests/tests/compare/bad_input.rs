//! What `grideye compare` does with recordings and scenes that nothing can be told from: a clear error (exit code 2), or
//! the verdict "cannot tell" with its reason (3); never a score of nothing.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::comparing::{compare, simulate};
use grideye_tests::programs::{Ended, root};
use std::path::PathBuf;
use tempfile::TempDir;

const STILL: &str = "scenes/experiment-1.toml";
const WALK: &str = "scenes/experiment-3.toml";
const TWO_SENSORS: &str = "scenes/scenario-b-standing.toml";

struct Bench {
    folder: TempDir,
}

impl Bench {
    fn new() -> Self {
        Self {
            folder: tempfile::tempdir().unwrap(),
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A recording that the scene's own sensor would make.
    fn simulated(&self, scene: &str, frames: u32) -> Vec<String> {
        let path = self.path("simulated.csv");
        simulate(scene, 7, frames, &path);
        let text = std::fs::read_to_string(path).unwrap();
        text.lines().map(str::to_owned).collect()
    }

    fn file(&self, name: &str, lines: &[String]) -> PathBuf {
        let path = self.path(name);
        let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
        std::fs::write(&path, text).unwrap();
        path
    }
}

/// Nothing on standard output, so that no score can be taken for one.
#[track_caller]
fn refused(ended: &Ended, words: &[&str]) {
    assert_eq!(ended.code, 2, "{ended:?}");
    assert_eq!(ended.stdout, "", "{ended:?}");
    for word in words {
        assert!(ended.stderr.contains(word), "`{word}` is not in {ended:?}");
    }
}

#[track_caller]
fn cannot_tell(ended: &Ended, words: &[&str]) {
    assert_eq!(ended.code, 3, "{ended:?}");
    assert!(ended.stdout.starts_with("Cannot tell: "), "{ended:?}");
    for word in words {
        assert!(ended.stdout.contains(word), "`{word}` is not in {ended:?}");
    }
}

/// The cells of a row with one of them replaced.
fn with_cell(row: &str, column: usize, cell: &str) -> String {
    let mut cells: Vec<&str> = row.split(',').collect();
    cells[column] = cell;
    cells.join(",")
}

/// A row that says that the frame is missing.
fn missing(row: &str) -> String {
    let cells: Vec<&str> = row.split(',').take(8).collect();
    format!("{},nack{}", cells.join(","), ",".repeat(65))
}

#[test]
fn a_recording_with_gaps_is_compared_and_the_gaps_are_counted() {
    let bench = Bench::new();
    let mut rows = bench.simulated(STILL, 60);
    for row in [5, 6, 7, 30, 44] {
        rows[row] = missing(&rows[row]);
    }
    let recording = bench.file("gaps.csv", &rows);
    let ended = compare(STILL, &recording, &["--json", "-"]);
    assert_eq!(ended.code, 0, "{ended:?}");
    assert!(ended.stdout.contains("Left out 5 of 60 rows"), "{ended:?}");

    for row in &mut rows[1..] {
        *row = missing(row);
    }
    let nothing = bench.file("nothing.csv", &rows);
    refused(
        &compare(STILL, &nothing, &[]),
        &["nothing.csv", "no frame", "hint:"],
    );
    let header = bench.file("header.csv", &rows[..1]);
    refused(
        &compare(STILL, &header, &[]),
        &["header.csv", "no frame", "hint:"],
    );
}

#[test]
fn a_number_that_is_none_is_refused_with_its_place() {
    let bench = Bench::new();
    let mut rows = bench.simulated(STILL, 12);
    for wrong in ["NaN", "inf", "", "warm"] {
        rows[4] = with_cell(&rows[4], 12, wrong);
        let recording = bench.file("nan.csv", &rows);
        refused(
            &compare(STILL, &recording, &[]),
            &["nan.csv", "line 5", "pixel3"],
        );
    }
}

#[test]
fn a_recording_of_another_resolution_is_refused_with_both() {
    let bench = Bench::new();
    for (pixels, words) in [
        (768, "32 x 24"),
        (4_800, "80 x 60"),
        (16, "4 x 4"),
        (100, "another"),
    ] {
        let names: String = (1..=pixels).map(|pixel| format!(",pixel{pixel}")).collect();
        let header = format!(
            "device,sensor,boot,seq,t_boot_ns,t_utc_ns,clock,t_arrival_ns,missing,thermistor{names}"
        );
        let recording = bench.file("other.csv", &[header]);
        let pixels = format!("{pixels} pixels a frame");
        refused(
            &compare(STILL, &recording, &[]),
            &["other.csv", &pixels, "8 x 8", words],
        );
    }
    let scene = std::fs::read_to_string(root().join(STILL)).unwrap();
    let scene = scene.replace("[[sensor]]", "[[sensor]]\nresolution = [80, 60]");
    let large = bench.file("large.toml", &[scene]);
    let rows = bench.simulated(STILL, 12);
    let recording = bench.file("eight.csv", &rows);
    let ended = compare(large.to_str().unwrap(), &recording, &[]);
    refused(&ended, &["ceiling", "80 x 60", "8 x 8", "hint:"]);
}

#[test]
fn a_start_that_leaves_nothing_of_the_scene_is_refused() {
    let bench = Bench::new();
    let rows = bench.simulated(WALK, 40);
    let recording = bench.file("walk.csv", &rows);
    refused(
        &compare(WALK, &recording, &["--start", "3600"]),
        &["3600", "ends after", "hint:"],
    );
    refused(
        &compare(WALK, &recording, &["--start", "-3600"]),
        &["ends before", "hint:"],
    );
    refused(
        &compare(WALK, &recording, &["--start", "noon"]),
        &["--start", "seconds"],
    );
    let early = compare(WALK, &recording, &["--start", "-1"]);
    assert_eq!(early.code, 1, "{early:?}");
    assert!(
        early.stdout.contains("Compare with `--start 0.0"),
        "{early:?}"
    );
}

#[test]
fn fewer_than_two_frames_cannot_tell() {
    let bench = Bench::new();
    let rows = bench.simulated(STILL, 12);
    for scene in [STILL, WALK] {
        let one = bench.file("one.csv", &rows[..2]);
        cannot_tell(&compare(scene, &one, &[]), &["1 frame", "at least 2"]);
    }
}

#[test]
fn an_empty_room_refutes_a_person_and_tells_nothing_of_an_empty_scene() {
    let bench = Bench::new();
    let scene = std::fs::read_to_string(root().join(STILL)).unwrap();
    let (before, after) = scene.split_once("[[object]]").unwrap();
    let sensor = after.split_once("[[sensor]]").unwrap().1;
    let empty = bench.file("empty.toml", &[format!("{before}[[sensor]]{sensor}")]);
    let rows = bench.simulated(empty.to_str().unwrap(), 60);
    let recording = bench.file("empty.csv", &rows);
    let claimed = compare(STILL, &recording, &[]);
    assert_eq!(claimed.code, 1, "{claimed:?}");
    let why = "shows nobody, only the room and noise";
    assert!(claimed.stdout.contains(why), "{claimed:?}");
    cannot_tell(
        &compare(empty.to_str().unwrap(), &recording, &[]),
        &["shows only the room and noise"],
    );
}

#[test]
fn a_scene_without_that_sensor_is_refused_with_those_it_has() {
    let bench = Bench::new();
    let rows = bench.simulated(STILL, 12);
    let recording = bench.file("some.csv", &rows);
    refused(
        &compare(STILL, &recording, &["--sensor", "window"]),
        &["window", "ceiling"],
    );
    let scene = std::fs::read_to_string(root().join(STILL)).unwrap();
    let none = scene.split_once("[[sensor]]").unwrap().0.to_owned();
    let none = bench.file("none.toml", &[none]);
    refused(
        &compare(none.to_str().unwrap(), &recording, &[]),
        &["sensor"],
    );
    refused(
        &compare(TWO_SENSORS, &recording, &["--sensor", "cellar"]),
        &["cellar"],
    );
}

#[test]
fn a_file_of_another_kind_is_refused() {
    let bench = Bench::new();
    let picture: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR";
    for (name, bytes, what) in [
        ("picture.png", picture, "this is an image (PNG)"),
        ("words.csv", b"a,b\n1,2\n", "expected rows of 64 numbers"),
        ("empty", b"", "this is an empty file"),
        (
            "binary.csv",
            &[0xFF, 0xFE, 0x00, 0x80],
            "expected rows of 64 numbers",
        ),
    ] {
        let path = bench.path(name);
        std::fs::write(&path, bytes).unwrap();
        refused(&compare(STILL, &path, &[]), &[name, what, "hint:"]);
    }
    refused(&compare(STILL, bench.folder.path(), &[]), &["hint:"]);
    refused(
        &compare(STILL, &bench.path("missing.csv"), &[]),
        &["missing.csv", "hint:"],
    );
    let rows = bench.simulated(STILL, 12);
    let recording = bench.file("some.csv", &rows);
    refused(
        &compare(recording.to_str().unwrap(), &recording, &[]),
        &["some.csv", "hint:"],
    );
}

/// The scene says which experiment it stands for; what its file is called does not matter.
#[test]
fn the_papers_figures_stand_beside_ours_where_the_scene_says_so() {
    let bench = Bench::new();
    let rows = bench.simulated(STILL, 40);
    let recording = bench.file("some.csv", &rows);
    let scene = std::fs::read_to_string(root().join(STILL)).unwrap();
    let named = bench.file("kitchen.toml", std::slice::from_ref(&scene));
    let ended = compare(named.to_str().unwrap(), &recording, &[]);
    for words in [
        "the paper's, table 1",
        "0.79",
        "3.50",
        "5.20",
        "5.90",
        "2.80",
        "95.0 %",
    ] {
        assert!(
            ended.stdout.contains(words),
            "`{words}` is not in {ended:?}"
        );
    }
    let unnamed = scene.replace("paper_experiment = 1", "");
    let unnamed = bench.file("experiment-1.toml", &[unnamed]);
    let ended = compare(unnamed.to_str().unwrap(), &recording, &[]);
    assert!(!ended.stdout.contains("the paper's, table"), "{ended:?}");
}
