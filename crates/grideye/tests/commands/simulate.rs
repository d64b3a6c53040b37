//! `grideye simulate`, `fuse` and `distinguish`: what they write, what they print, and what they refuse.

use std::fs;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../scenes/{name}.toml"))
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

/// Simulates into a file of this name and hands over its bytes and what was said.
fn simulated(scene_name: &str, file: &str, more: &[&str]) -> (Vec<u8>, String) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join(file);
    let scene = scene(scene_name);
    let mut arguments = vec![
        "simulate",
        scene.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
    ];
    arguments.extend(more);
    let output = grideye(&arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    (fs::read(out).unwrap(), text(&output.stderr))
}

fn number(bytes: &[u8], at: usize) -> usize {
    usize::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]))
}

/// The numbers of an array in an archive: after its name, magic, version, length of the header, and header.
fn array<'a>(npz: &'a [u8], name: &str) -> (String, &'a [u8]) {
    let at = npz
        .windows(name.len())
        .position(|window| window == name.as_bytes())
        .unwrap()
        + name.len();
    let npy = &npz[at..];
    assert!(npy.starts_with(b"\x93NUMPY\x01\x00"));
    let length = number(npy, 8);
    assert_eq!((10 + length) % 64, 0);
    (text(&npy[10..10 + length]), &npy[10 + length..])
}

#[test]
fn an_archive_holds_the_frames_that_are_printed() {
    let (npz, said) = simulated("experiment-3", "walk.npz", &[]);
    assert!(said.contains("wrote 51 rows to"), "{said}");
    let (header, numbers) = array(&npz, "frames.npy");
    assert!(
        header.starts_with("{'descr': '<f4', 'fortran_order': False, 'shape': (51, 8, 8), }"),
        "{header}"
    );
    let printed = grideye(&["simulate", scene("experiment-3").to_str().unwrap()]);
    let printed: Vec<f32> = text(&printed.stdout)
        .split_whitespace()
        .map(|word| word.parse().unwrap())
        .collect();
    assert_eq!(printed.len(), 64);
    for (printed, bytes) in printed.iter().zip(numbers.chunks(4)) {
        let stored = f32::from_le_bytes(bytes.try_into().unwrap());
        assert!((stored - printed).abs() <= 0.005_01, "{stored}, {printed}");
    }
    let (header, times) = array(&npz, "time_s.npy");
    assert!(
        header.contains("'<f8'") && header.contains("(51,)"),
        "{header}"
    );
    let second = f64::from_le_bytes(times[8..16].try_into().unwrap());
    assert_eq!(second, 0.1);
    assert!(array(&npz, "metadata.npy").0.contains("'shape': ()"));
    // Eleven arrays, and the same bytes once more.
    let end = &npz[npz.len() - 22..];
    assert_eq!((&end[..4], number(end, 10)), (&b"PK\x05\x06"[..], 11));
    assert_eq!(simulated("experiment-3", "walk.npz", &[]).0, npz);
    assert_ne!(
        simulated("experiment-3", "walk.npz", &["--seed", "2"]).0,
        npz
    );
}

#[test]
fn an_eight_by_eight_sensor_makes_a_recording_and_any_other_a_table() {
    let (recording, _) = simulated("experiment-1", "still.csv", &[]);
    assert_eq!(
        text(&recording).lines().count(),
        1 + 10,
        "the paper's static protocol"
    );
    assert!(text(&recording).starts_with("device,sensor,boot,seq"));
    let (table, said) = simulated("experiment-5", "face.csv", &["--frames", "2"]);
    assert!(
        said.contains("a recording holds 8 x 8 pixels, and camera has 80 x 60"),
        "{said}"
    );
    let table = text(&table);
    let rows: Vec<Vec<&str>> = table
        .lines()
        .map(|line| line.split(',').collect())
        .collect();
    assert_eq!((rows.len(), rows[0].len()), (3, 2 + 80 * 60));
    assert_eq!(rows[0][..4], ["seq", "time_s", "r0c0_c", "r0c1_c"]);
    assert_eq!(rows[0][2 + 80 * 60 - 1], "r59c79_c");
    assert!(
        rows[2]
            .iter()
            .skip(1)
            .all(|cell| cell.parse::<f64>().is_ok())
    );
}

#[test]
fn pictures_are_whole_and_of_the_size_they_say() {
    let (sheet, _) = simulated("experiment-1", "still.png", &[]);
    let mut reader = png::Decoder::new(std::io::Cursor::new(sheet))
        .read_info()
        .unwrap();
    let mut dots = vec![0; reader.output_buffer_size().unwrap()];
    let size = reader.next_frame(&mut dots).unwrap();
    assert!(size.width > 600 && size.height > 160, "{size:?}");

    let (film, _) = simulated("experiment-3", "walk.gif", &[]);
    let mut decoder = gif::DecodeOptions::new()
        .read_info(film.as_slice())
        .unwrap();
    let mut hundredths = 0;
    let mut frames = 0;
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        hundredths += u32::from(frame.delay);
        frames += 1;
    }
    assert_eq!(
        (frames, hundredths),
        (51, 510),
        "5 s and the last frame, at 10 Hz"
    );
}

#[test]
fn the_papers_model_says_nearly_the_same_on_its_grid() {
    let printed = |model: &str| -> Vec<f64> {
        let output = grideye(&[
            "simulate",
            scene("experiment-1").to_str().unwrap(),
            "--model",
            model,
        ]);
        text(&output.stdout)
            .split_whitespace()
            .map(|word| word.parse().unwrap())
            .collect()
    };
    let (grid, area) = (printed("paper-grid"), printed("paper"));
    assert_eq!((grid.len(), area.len()), (64, 64));
    let largest = grid
        .iter()
        .zip(&area)
        .map(|(one, other)| (one - other).abs())
        .fold(0.0, f64::max);
    assert!(largest < 0.1, "{largest}");
    assert_ne!(grid, area, "they are two methods");
}

#[test]
fn the_view_needs_no_sensor_and_unknown_endings_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let view = folder.path().join("room.svg");
    let output = grideye(&[
        "simulate",
        scene("scenario-b-fall").to_str().unwrap(),
        "--view",
        view.to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(output.stdout.is_empty());
    assert!(
        fs::read_to_string(view)
            .unwrap()
            .contains("scenario-b-fall")
    );
    for (key, name) in [
        ("--view", "room.png"),
        ("--out", "walk.mp4"),
        ("--out", "walk"),
    ] {
        let output = grideye(&[
            "simulate",
            scene("experiment-1").to_str().unwrap(),
            key,
            name,
        ]);
        assert_eq!(output.status.code(), Some(2));
        let said = text(&output.stderr);
        assert!(
            said.contains(name) && said.contains("hint: end it with ."),
            "{said}"
        );
    }
}

#[test]
fn scenario_a_is_fused_and_its_errors_printed() {
    let folder = tempfile::tempdir().unwrap();
    let (out, json) = (
        folder.path().join("fused.png"),
        folder.path().join("fused.json"),
    );
    let output = grideye(&[
        "fuse",
        scene("scenario-a-3x3").to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
        "--json",
        json.to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let said = text(&output.stdout);
    assert!(
        said.contains("26 x 26 in view of at least one sensor, 22 x 22 of all"),
        "{said}"
    );
    assert!(
        said.contains("across 96.23 mm (Eq. 7 for a factor of 3: 96.23)"),
        "{said}"
    );
    let json: serde_json::Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    let error = |method: &str, noise: &str| {
        json["methods"][method][noise]["all_cells_c"]
            .as_f64()
            .unwrap()
    };
    for noise in ["rmse_without_noise", "rmse_with_noise"] {
        assert!(error("least_squares", noise) < error("mean", noise));
        assert!(error("mean", noise) < error("one_sensor", noise));
    }
    assert!(
        png::Decoder::new(std::io::Cursor::new(fs::read(out).unwrap()))
            .read_info()
            .is_ok()
    );
    let output = grideye(&["fuse", scene("scenario-b-before").to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output.stderr).contains("sensor `B` differs from `A`"),
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn scenario_b_is_told_apart_by_the_pairs_that_the_table_names() {
    let scenes = ["before", "after", "standing"].map(|name| scene(&format!("scenario-b-{name}")));
    let mut arguments = vec!["distinguish"];
    arguments.extend(scenes.iter().map(|path| path.to_str().unwrap()));
    let output = grideye(&arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let said = text(&output.stdout);
    let whole = said.split("less what all").next().unwrap();
    let row = |sensors: &str| {
        whole
            .lines()
            .find(|line| line.trim_start().starts_with(sensors) && line.contains('.'))
            .unwrap()
            .to_owned()
    };
    assert!(row("A  ").ends_with("not all"), "{said}");
    for pair in ["A + B  ", "A + C  ", "B + C  ", "A + B + C"] {
        assert!(row(pair).ends_with("  all"), "{said}");
    }
    // The same situation twice cannot be told apart.
    let same = scenes[0].to_str().unwrap();
    assert_eq!(grideye(&["distinguish", same, same]).status.code(), Some(1));
    assert_eq!(grideye(&["distinguish", same]).status.code(), Some(2));
}

/// A socket whose other end is closed answers the first write as a pipe without a reader does.
#[test]
fn who_reads_no_further_makes_no_panic_and_no_other_exit_code() {
    for arguments in [
        vec!["simulate", "experiment-5"],
        vec!["distinguish", "scenario-b-before", "scenario-b-fall"],
    ] {
        let command = || {
            let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
            let scenes = arguments[1..].iter().map(|name| scene(name));
            command.arg(arguments[0]).args(scenes);
            command
        };
        let whole = command().output().unwrap();
        assert!(!whole.stdout.is_empty(), "{arguments:?}");
        let (reader, writer) = UnixStream::pair().unwrap();
        drop(reader);
        let cut = command().stdout(OwnedFd::from(writer)).output().unwrap();
        assert_eq!(
            (cut.status.code(), text(&cut.stderr)),
            (whole.status.code(), text(&whole.stderr))
        );
    }
}

/// A person in a corner that the sensor does not see, a radiator in another, and where the file says so.
const UNSEEN: &str = "[room]\nsize_mm = [4000, 6000, 2700]\nambient_c = 20\n\n[[object]]\nname = \"radiator\"\nposition_mm = [200, 5700, 0]\nsize_mm = [300, 300, 900]\ntemperature_c = 45\n\n[[agent]]\nname = \"anna\"\nperson = {}\nposition_mm = [400, 400, 0]\n\n[[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\nstep_c = 0.25\nposition_mm = [2000, 3000, 2700]\nelevation_deg = 90\nazimuth_deg = -90\n";

#[test]
fn what_no_frame_shows_is_said_with_its_place_and_what_is_seen_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (room, recording, json) = (file("room.toml"), file("r.csv"), file("c.json"));
    let out = file("frames");
    let simulate = ["simulate", &room, "--out", &recording, "--frames", "40"];
    let sides = ["--scene", &room, "--recording", &recording];
    let compare = [&["compare"], &sides[..], &["--json", &json]].concat();
    let dataset = ["dataset", &room, "--frames", "4", "--out", &out];
    fs::write(&room, UNSEEN).unwrap();
    for arguments in [&simulate[..], &compare, &dataset] {
        let said = text(&grideye(arguments).stderr);
        let warning = "room.toml:12:8: agent `anna` is never in view of";
        assert!(
            said.contains("warning: ") && said.contains(warning),
            "{arguments:?}: {said}"
        );
        let note = "room.toml:6:8: object `radiator` is not in view of";
        assert!(
            said.contains("note: ") && said.contains(note),
            "{arguments:?}: {said}"
        );
        assert_eq!(
            said.matches("hint: move").count(),
            2,
            "{arguments:?}: {said}"
        );
    }
    let json = fs::read_to_string(&json).unwrap();
    assert!(json.contains("agent `anna` is never in view of"), "{json}");
    // In view, and out of view of the file's own place but not of those that are drawn.
    let out = file("drawn");
    let drawn = ["dataset", &room, "--frames", "300", "--out", &out];
    let drawn = [&drawn[..], &["--vary", "agent.anna.position=floor"]].concat();
    let drawn = text(&grideye(&drawn).stderr);
    assert!(!drawn.contains("anna"), "{drawn}");
    fs::write(&room, UNSEEN.replace("[400, 400, 0]", "[2000, 3000, 0]")).unwrap();
    let said = text(&grideye(&simulate).stderr);
    assert!(!said.contains("warning"), "{said}");
    for name in ["experiment-1", "falls", "counting", "two-people", "bedroom"] {
        let (_, said) = simulated(name, "frames.csv", &["--frames", "1"]);
        assert!(!said.contains("warning"), "{name}: {said}");
    }
}
