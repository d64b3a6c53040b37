//! Data sets that are balanced by the people in view, and draws whose values conflict.

use crate::dataset::{assert_same, done, files, refused, scene};
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

/// A wide person may stand in the middle, and a narrow one at the wall.
#[test]
fn a_draw_whose_values_conflict_is_left_out_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let place = "agent.person.position_mm=[2000..3700, 2000, 0]";
    let made = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
        command.arg("dataset").arg(scene("experiment-1"));
        command.args(["--frames", "60", "--frames-per-part", "10", "--vary", place]);
        let size = "agent.person.size_mm=[300..1500, 500, 1750]";
        command.args(["--vary", size]).args(more);
        (done(command.arg("--out").arg(&out)), out)
    };
    let (told, whole) = made("whole", &[]);
    let left_out = told
        .lines()
        .find_map(|line| line.strip_prefix("draws left out because their values conflict: "));
    let left_out: u32 = left_out.unwrap().parse().unwrap();
    assert!((1..60).contains(&left_out), "{told}");
    let card = fs::read_to_string(whole.join("README.md")).unwrap();
    let line = format!("- {left_out} draws were left out: their values conflict\n");
    assert!(card.contains(&line), "{card}");
    let (_, shards) = made("shards", &["--shard", "2/2"]);
    made("shards", &["--shard", "1/2"]);
    assert_same(&whole, &shards);
    // Where all conflict, the first says how.
    let mut never = Command::new(env!("CARGO_BIN_EXE_grideye"));
    never.arg("dataset").arg(scene("experiment-1"));
    never.args([
        "--frames",
        "60",
        "--vary",
        place.replace("2000..", "").as_str(),
    ]);
    never.args(["--vary", "agent.person.size_mm=[700, 500, 1750]", "--out"]);
    let told = refused(never.arg(folder.path().join("never")));
    assert!(
        told.contains("frame 0 (") && told.contains("leaves the room"),
        "{told}"
    );
}
