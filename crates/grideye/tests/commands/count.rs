//! `grideye count` and `convert --count`: what they print of real recordings, and what they refuse.

use crate::Fixture;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

const SESSION: &str = "Session2_2021-07-01_RoomB_v2.csv";

/// A folder with a real session, whose `people_number` says how many people there were.
fn fixture() -> Fixture {
    let fixture = Fixture::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../recordings/linaige");
    let session = fs::read(folder.join(SESSION)).unwrap();
    fixture.put(SESSION, session);
    fixture
}

fn printed(fixture: &Fixture, arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_grideye"))
        .args(arguments)
        .current_dir(fixture.folder.path())
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    String::from_utf8(output.stdout).unwrap()
}

/// The column `people` of the JSON lines.
fn people(lines: &str) -> Vec<Option<u64>> {
    let lines = lines.lines().map(|line| {
        let line: serde_json::Value = serde_json::from_str(line).unwrap();
        line["people"].as_u64()
    });
    lines.collect()
}

#[test]
fn the_last_line_sums_up_for_how_long_how_many_were_there() {
    let fixture = fixture();
    let told = printed(&fixture, &["count", SESSION]);
    let sum = told.lines().next_back().unwrap();
    let seconds = sum.split(", ").map(|part| {
        let (_, seconds) = part.split_once(" for ").unwrap();
        let seconds: f64 = seconds.trim_end_matches(" s").parse().unwrap();
        seconds
    });
    // The session lasts 185 s.
    let all: f64 = seconds.sum();
    assert!((183.0..=187.0).contains(&all), "{sum}");
    assert!(sum.starts_with("nobody for ") && sum.contains("2 people for "));
}

#[test]
fn a_count_is_judged_beside_true_numbers_wherever_they_stand() {
    let fixture = fixture();
    let judged = printed(&fixture, &["count", SESSION, "--truth", SESSION]);
    assert!(
        judged.contains("more than 0.5 s from a change of the truth"),
        "{judged}"
    );
    let named = format!("{SESSION}:people_number");
    assert_eq!(
        printed(&fixture, &["count", SESSION, "--truth", &named]),
        judged
    );
    // The truth as another program's counts is never wrong.
    let perfect = printed(
        &fixture,
        &["count", SESSION, "--truth", SESSION, "--counts", SESSION],
    );
    let of_all: Vec<&str> = perfect
        .lines()
        .find(|line| line.starts_with("all frames"))
        .unwrap()
        .split_whitespace()
        .collect();
    assert_eq!(of_all[2..], ["100.0", "%", "0.0", "%", "0.0", "%"]);
    // By their numbers, in any order, as the labels of a recording: the session's first minute has no label here.
    fixture.put("labels.csv", "number,label,device,sensor,boot,first_seq,last_seq\n2,two people,d,s,b,900,999\n1,nobody,d,s,b,600,899\n");
    let by_number = printed(&fixture, &["count", SESSION, "--truth", "labels.csv"]);
    let rows: Vec<&str> = by_number.lines().rev().take(4).collect();
    let sum = |row: &str| -> u64 {
        row.split_whitespace()
            .skip(1)
            .map(|cell| cell.parse::<u64>().unwrap())
            .sum()
    };
    assert_eq!([3, 1].map(|row| sum(rows[row])), [300, 100], "{by_number}");
}

#[test]
fn json_lines_and_the_column_of_convert_have_the_same_counts() {
    let fixture = fixture();
    let lines = printed(
        &fixture,
        &[
            "count",
            SESSION,
            "--json",
            "-",
            "--line",
            "-0.5,3.5,7.5,3.5",
        ],
    );
    let counts = people(&lines);
    assert_eq!(counts.len(), 1848);
    let last: serde_json::Value = serde_json::from_str(lines.lines().last().unwrap()).unwrap();
    let [entered, left] = ["entered", "left"].map(|key| last[key].as_u64().unwrap());
    let changes = printed(&fixture, &["count", SESSION, "--line", "-0.5,3.5,7.5,3.5"]);
    assert!(
        changes.ends_with(&format!("{entered} entered, {left} left\n")),
        "{changes}"
    );
    assert!(
        fixture
            .run(&["convert", SESSION, "counted.csv", "--count"])
            .code
            == Some(0)
    );
    let table = fs::read_to_string(fixture.path("counted.csv")).unwrap();
    assert!(
        table
            .lines()
            .next()
            .unwrap()
            .ends_with(",people_number,confidence,people")
    );
    let column = table
        .lines()
        .skip(1)
        .map(|row| row.rsplit(',').next().unwrap().parse().ok());
    assert_eq!(column.collect::<Vec<Option<u64>>>(), counts);
    // As live: the first half minute is not known.
    let live = people(&printed(
        &fixture,
        &["count", SESSION, "--live", "--json", "-"],
    ));
    let unknown = live.iter().take_while(|people| people.is_none()).count();
    assert!((250..=330).contains(&unknown), "{unknown}");
    assert!(live[unknown..].iter().all(Option::is_some));
}

#[test]
fn what_cannot_be_counted_or_judged_is_refused_with_its_place() {
    let fixture = fixture();
    fixture.put("short.csv", "people\n1\n2\n");
    fixture.put("words.csv", "seq,people\n0,1\n1,many\n");
    fixture.put("other.csv", "seq,temperature\n0,1\n");
    fixture.put("weights.gec", "GEC1 no weights");
    for (arguments, said) in [
        (
            vec!["--truth", "short.csv"],
            "short.csv has 2 rows, and the recording 1848 frames",
        ),
        (
            vec!["--truth", "words.csv"],
            "words.csv:3: \"many\" is not 0, 1, 2 or more people",
        ),
        (
            vec!["--truth", "other.csv"],
            "name one as FILE:COLUMN; there are seq, temperature",
        ),
        (vec!["--truth", "nowhere.csv"], "cannot open nowhere.csv"),
        (
            vec!["--weights", "weights.gec"],
            "weights.gec: the layers have 1 to 64 channels",
        ),
        (vec!["--weights", "other.csv"], "does not begin with GEC1"),
        (
            vec!["--profile", "profile.toml"],
            "profile.toml has no [background]",
        ),
        (vec!["--sensor", "nobody"], "holds no frame to count in"),
        (vec!["--line", "1,2,3"], "X1,Y1,X2,Y2 in pixels"),
    ] {
        let ended = fixture.run(&[&["count", SESSION], &arguments[..]].concat());
        assert_eq!(ended.code, Some(2), "{arguments:?}: {ended:?}");
        assert!(
            ended.stderr.contains(said),
            "{arguments:?}: {}",
            ended.stderr
        );
    }
}
