//! Data sets that are balanced by the people in view.

use crate::dataset::{done, files, refused};
use std::fs;
use std::process::Command;

#[test]
fn people_in_view_are_balanced_if_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let counting = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
        command.args([
            "dataset", "--preset", "counting", "--frames", "80", "--seed", "3",
        ]);
        command
            .args(["--format", "npz"])
            .args(more)
            .arg("--out")
            .arg(&out);
        (command, out)
    };
    let (mut command, out) = counting("balanced", &["--in-view", "1,2,1"]);
    let printed = done(&mut command);
    let line = printed.lines().last().unwrap();
    let frames = |people: usize| {
        let (_, rest) = line.split_once(&format!("{people} in ")).unwrap();
        rest.split_whitespace()
            .next()
            .unwrap()
            .parse::<u32>()
            .unwrap()
    };
    for (people, wanted) in [(0, 20), (1, 40), (2, 20)] {
        assert!(frames(people).abs_diff(wanted) <= 2, "{line}");
    }
    assert!(!line.contains("3 in "), "{line}");
    let card = fs::read_to_string(out.join("README.md")).unwrap();
    assert!(
        card.contains("1 : 2 : 1") && card.contains("--in-view 1,2,1"),
        "{card}"
    );
    // The same frames in other shards, and another data set without the option.
    let shards = folder.path().join("shards");
    for shard in ["2/2", "1/2"] {
        let more = [
            "--in-view",
            "1,2,1",
            "--frames-per-part",
            "1000",
            "--shard",
            shard,
        ];
        done(counting("shards", &more).0.arg("--threads").arg("3"));
    }
    assert_eq!(
        files(&out)["part-000000.npz"].len(),
        files(&shards)["part-000000.npz"].len()
    );
    let said = refused(&mut counting("balanced", &[]).0);
    assert!(said.contains("in_view was [1.0,2.0,1.0] and is"), "{said}");
    for (weights, more) in [
        ("1,1,1,1,1,1,1,1,1", &[][..]),
        ("0,0", &[]),
        ("1,1", &["--clip", "4"]),
    ] {
        let said = refused(&mut counting("wrong", &[&["--in-view", weights], more].concat()).0);
        assert!(said.contains("hint: give up to"), "{said}");
    }
    let never = ["--in-view", "1,0,0,1", "--vary", "people=0"];
    let said = refused(&mut counting("never", &never).0);
    assert!(
        said.contains("none of 1000 draws has 3 in view\nhint: "),
        "{said}"
    );
}
