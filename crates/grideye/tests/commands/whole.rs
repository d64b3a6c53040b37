//! A result is whole under its name, or not there.

use crate::Fixture;
use std::fs;

/// Commands whose OUT has more bytes than a file may have here.
const COMMANDS: &[(&str, &str)] = &[
    ("x.csv", "simulate room.toml --out OUT"),
    ("x.npz", "simulate room.toml --out OUT"),
    ("x.png", "simulate room.toml --out OUT"),
    ("x.gif", "simulate room.toml --out OUT"),
    ("x.svg", "simulate room.toml --view OUT"),
    ("x.csv", "convert recording.csv OUT"),
    ("x.npz", "convert recording.csv OUT"),
    ("x.parquet", "convert recording.csv OUT"),
    ("x.mcap", "convert recording.csv OUT"),
    ("x.png", "convert recording.csv OUT"),
    ("x.gif", "convert recording.csv OUT"),
    ("x.json", "fuse room.toml --json OUT"),
    (
        "x.svg",
        "coverage room.toml --turns 1 --cell-mm 500 --out OUT",
    ),
    (
        "x.csv",
        "coverage room.toml --turns 1 --cell-mm 500 --out OUT",
    ),
    (
        "x.json",
        "compare --scene room.toml --recording recording.csv --json OUT",
    ),
    (
        "x.html",
        "compare --scene room.toml --recording recording.csv --report OUT",
    ),
    (
        "x.xml",
        "compare --scene room.toml --recording recording.csv --junit OUT",
    ),
    ("x.html", "characterize recording.csv --report OUT"),
    ("x.json", "characterize recording.csv --json OUT"),
    ("out/grideye.1", "man out"),
];

/// 512 bytes a file, and an error instead of a signal: as on a disk that fills up while it is written.
const NO_ROOM: &str = "trap '' XFSZ; ulimit -f 1";

#[test]
fn a_write_that_fails_midway_leaves_the_old_file_and_no_other() {
    let fixture = Fixture::new();
    fs::create_dir(fixture.path("out")).unwrap();
    for (out, command) in COMMANDS {
        let arguments: Vec<&str> = command
            .split(' ')
            .map(|word| if word == "OUT" { out } else { word })
            .collect();
        fixture.put(out, "old");
        let before = fixture.files();
        let ended = fixture.run_limited(NO_ROOM, &arguments);
        let context = format!("{arguments:?}: {ended:?}");
        assert_eq!(ended.code, Some(1), "{context}");
        let begin = format!("error: cannot write {out}: ");
        assert!(
            ended.stderr.starts_with(&begin) && ended.stderr.contains("File too large"),
            "{context}"
        );
        assert_eq!(fixture.files(), before, "{context}");
        fs::remove_file(fixture.path(out)).unwrap();
    }
}

#[test]
fn a_token_that_is_not_made_leaves_no_file() {
    let fixture = Fixture::new();
    let ended = fixture.run(&["token", "make", "a b", "--scope", "read", "--out", "x"]);
    assert_eq!(ended.code, Some(2), "{ended:?}");
    assert!(!fixture.path("x").exists());
}
