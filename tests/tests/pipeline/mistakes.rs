//! Every common mistake of a user, and the error that names the place and the fix.

use super::*;

/// Runs `grideye` with these arguments: it must end with this code and one error that has all of these words.
pub(crate) fn refused(arguments: &[&str], code: i32, words: &[&str]) {
    let ended = run(grideye().args(arguments));
    assert_eq!(ended.code, code, "{arguments:?}: {ended:?}");
    for word in words {
        assert!(
            ended.stderr.contains(word),
            "{arguments:?} does not say {word:?}: {}",
            ended.stderr
        );
    }
    assert!(
        !ended.stderr.contains("panicked"),
        "{arguments:?}: {}",
        ended.stderr
    );
}

/// A file of a test.
pub(crate) fn file(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn mistakes_in_a_scene_are_named_with_their_place() {
    let folder = tempfile::tempdir().unwrap();
    let experiment = std::fs::read_to_string(root().join("scenes/experiment-1.toml")).unwrap();
    let unknown_key = file(
        folder.path(),
        "unknown.toml",
        &experiment.replace("ambient_c", "ambeint_c"),
    );
    let walk = std::fs::read_to_string(root().join("scenes/experiment-3.toml")).unwrap();
    let walk = file(
        folder.path(),
        "walk.toml",
        &walk.replace("trajectories/straight-across.csv", "bad.csv"),
    );
    file(
        folder.path(),
        "bad.csv",
        "x_mm,y_mm,z_mm\n300,1340,0\nhere,1340,0\n",
    );
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    refused(
        &[
            "demo",
            "--once",
            "--scene",
            "scenes/nowhere.toml",
            "--out",
            out,
        ],
        2,
        &["scenes/nowhere.toml"],
    );
    refused(
        &["simulate", &unknown_key],
        2,
        &["unknown.toml:", "ambeint_c"],
    );
    refused(&["simulate", &walk], 2, &["bad.csv", "3", "here"]);
    refused(
        &["simulate", "scenes/experiment-1.toml", "--sensor", "window"],
        2,
        &["window", "ceiling"],
    );
    refused(
        &["simulate", "scenes/experiment-1.toml", "--sensor", "window"],
        2,
        &["window", "ceiling"],
    );
}

#[test]
fn mistakes_in_a_recording_are_named_with_their_place_and_leave_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let session = std::fs::read_to_string(root().join(SESSION)).unwrap();
    let out = folder.path().join("never.csv");
    let written = out.to_str().unwrap();
    for (name, text, words) in [
        ("notes.csv", "a,b\n1,2\n".to_owned(), &["hint:"][..]),
        ("undated.csv", session.clone(), &["undated.csv", "hint:"]),
    ] {
        let path = file(folder.path(), name, &text);
        refused(&["convert", &path, written], 2, &[&[name], words].concat());
        assert!(
            !out.exists(),
            "{name}: a refused conversion left a file under its final name"
        );
    }
    let left: Vec<_> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    assert_eq!(left.len(), 2, "nothing but the inputs is left: {left:?}");
    // A damaged row is a missing frame, and its place is said.
    for found in [",26.5,", ",600,25.5,", ",NaN,25.5,"] {
        let damaged = session.replacen(",26.5,25.5,", found, 1);
        let path = file(folder.path(), "damaged_2021-07-01.csv", &damaged);
        let ended = run(grideye().args(["convert", &path, written]));
        assert_eq!(ended.code, 3, "{found}: {ended:?}");
        let said = "1 damaged rows are missing frames";
        assert!(ended.stderr.contains(said), "{found}: {ended:?}");
        assert!(
            ended.stderr.contains("the first at 2\n"),
            "{found}: {ended:?}"
        );
    }
    // A session that breaks off is read up to there, and its last frame is missing.
    let whole = session[..20_000].matches('\n').count();
    let path = file(folder.path(), "cut_2021-07-01.csv", &session[..20_000]);
    let ended = run(grideye().args(["convert", &path, written]));
    assert_eq!(ended.code, 3, "{ended:?}");
    let place = format!("the first at {}\n", whole + 1);
    assert!(ended.stderr.contains(&place), "{ended:?}");
    let text = std::fs::read_to_string(&out).unwrap();
    assert_eq!(
        text.lines().count(),
        whole + 1,
        "the header, the whole rows, the missing one"
    );
}

#[test]
fn a_recording_of_several_sensors_is_not_taken_for_one() {
    let two = "recordings/golden/two-sensors.csv";
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    refused(
        &[
            "compare",
            "--scene",
            "scenes/experiment-1.toml",
            "--recording",
            two,
        ],
        2,
        &[two, "2 streams", "hint:"],
    );
    refused(
        &["demo", "--once", "--replay", two, "--out", out],
        2,
        &[two, "2 streams", "hint:"],
    );
}

#[test]
fn mistakes_with_addresses_and_folders_name_the_fix() {
    let folder = tempfile::tempdir().unwrap();
    let below_a_file = format!("{}/out", file(folder.path(), "blocked", ""));
    let fresh = folder.path().join("fresh");
    let fresh = fresh.to_str().unwrap();
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = listener.local_addr().unwrap().to_string();
    let scene = "scenes/experiment-1.toml";
    refused(
        &["demo", "--once", "--out", &below_a_file],
        2,
        &["blocked", "hint:"],
    );
    refused(
        &["collect", "--listen", "0.0.0.0:0", "--store", fresh],
        2,
        &["0.0.0.0", "grideye enroll DEVICE", "hint:"],
    );
    refused(
        &["audit", "--collector", "http://127.0.0.1:9"],
        1,
        &["127.0.0.1:9", "hint:"],
    );
    refused(&["emulate", "--scene", scene], 2, &["PROGRAM"]);
    refused(
        &[
            "emulate",
            "--scene",
            scene,
            "--address",
            "0x70",
            "--",
            "true",
        ],
        2,
        &["0x68 or 0x69"],
    );
    refused(&["demo", "--speed", "0"], 2, &["above 0"]);
    refused(
        &["demo", "--once", "--listen", &taken, "--out", fresh],
        1,
        &[&taken, "in use", "hint:"],
    );
    drop(listener);
}
