//! `grideye dataset --preset` and `--preview`.

use crate::dataset::{done, files, refused};
use std::fs;
use std::path::Path;
use std::process::Command;

/// How many rows of images a sheet has: bands that are not white, in a column of the first image.
fn rows(sheet: &Path) -> usize {
    let file = std::io::BufReader::new(fs::File::open(sheet).unwrap());
    let mut decoder = png::Decoder::new(file);
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let line = info.line_size;
    let channels = line / usize::try_from(info.width).unwrap();
    let is_image = |line: &[u8]| {
        line[30 * channels..31 * channels]
            .iter()
            .any(|byte| *byte != 255)
    };
    let lines: Vec<bool> = bytes.chunks(line).map(is_image).collect();
    let bands = lines.chunk_by(|one, other| one == other);
    bands.filter(|band| band[0] && band.len() > 50).count()
}

/// As many rows as the dataset has classes, or clips; nothing else is written.
#[test]
fn a_preset_is_looked_at_and_made() {
    let folder = tempfile::tempdir().unwrap();
    let preset = |words: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
        command.args(["dataset", "--preset"]).args(words);
        done(command.current_dir(folder.path()))
    };
    preset(&["counting", "--frames", "300", "--preview", "people.png"]);
    preset(&[
        "falls",
        "--frames",
        "200",
        "--clip",
        "50",
        "--preview",
        "clips.png",
    ]);
    let names: Vec<String> = files(folder.path()).into_keys().collect();
    assert_eq!(names, ["clips.png", "people.png"]);
    assert_eq!(rows(&folder.path().join("clips.png")), 4);

    let said = preset(&["counting", "--frames", "300", "--out", "set"]);
    let (_, classes) = said.split_once("people in view: ").unwrap();
    let classes = classes.split(", ").count();
    assert!(classes >= 3, "{said}");
    assert_eq!(rows(&folder.path().join("people.png")), classes);
    let card = fs::read_to_string(folder.path().join("set/README.md")).unwrap();
    assert!(
        card.contains("grideye dataset --preset counting "),
        "{card}"
    );
    assert!(card.contains("\n- `people=0..3, weights "), "{card}");
}

/// A preset as it is printed, and with the noise of other sensors.
#[test]
fn a_preset_is_printed_and_changed() {
    let folder = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let preset = |words: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
        command
            .args(["dataset", "--preset", "counting"])
            .args(words);
        command
    };
    let printed = done(&mut preset(&["--print"]));
    let scene = fs::read_to_string(root.join("scenes/counting.toml")).unwrap();
    assert_eq!(printed, scene);

    let recording = root.join("recordings/linaige/Session3_2021-07-06_RoomA_v2.csv");
    let datasheet = root.join("scenes/profiles/datasheet.toml");
    for (name, path) in [("like", &recording), ("profile", &datasheet)] {
        let path = path.to_str().unwrap();
        let (option, out) = (format!("--{name}"), folder.path().join(name));
        let mut command = preset(&[&option, path, "--frames", "20", "--format", "npy"]);
        done(command.arg("--out").arg(&out));
        let card = fs::read_to_string(out.join("README.md")).unwrap();
        assert!(card.contains(&format!(" {option} {path} ")), "{card}");
        assert!(card.contains("`sensor.ceiling.profile="), "{card}");
        // The median of the session's empty room is 26.25 °C.
        assert_eq!(
            card.contains("`room.ambient_c=25.21..27.21`"),
            name == "like",
            "{card}"
        );
    }
    let mut command = preset(&["--profile", "none.toml", "--frames", "20", "--out", "none"]);
    let told = refused(command.current_dir(folder.path()));
    assert!(told.contains("none.toml"), "{told}");
}

#[test]
fn splits_have_files_of_their_own_that_shards_make_alike() {
    let folder = tempfile::tempdir().unwrap();
    let made = |out: &str, words: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
        command.args([
            "dataset", "--preset", "falls", "--frames", "100", "--clip", "10",
        ]);
        command.args([
            "--frames-per-part",
            "30",
            "--format",
            "npz",
            "--split",
            "train=0.7,test=0.3",
        ]);
        done(
            command
                .args(words)
                .arg("--out")
                .arg(folder.path().join(out)),
        );
    };
    made("whole", &[]);
    made("shards", &["--shard", "2/2"]);
    made("shards", &["--shard", "1/2"]);
    let whole = files(&folder.path().join("whole"));
    assert!(whole == files(&folder.path().join("shards")));
    let parts = whole.keys().filter(|name| name.ends_with(".npz"));
    // 70 frames in parts of 30, and then 30.
    let expected = [
        "test-000003.npz",
        "train-000000.npz",
        "train-000001.npz",
        "train-000002.npz",
    ];
    assert!(parts.eq(expected.iter()), "{:?}", whole.keys());

    let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
    command.args([
        "dataset", "--preset", "falls", "--frames", "20", "--clip", "10",
    ]);
    let told = refused(command.args(["--split", "train=9,test=1", "--out", "none"]));
    assert!(
        told.contains("the split `test` gets none of 2 clips"),
        "{told}"
    );
}
