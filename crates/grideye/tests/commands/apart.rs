//! No command writes over a file that it reads.

use crate::Fixture;
use std::fs;
use std::path::Path;

/// A command with one file that it reads, IN, and one that it would write.
struct Row {
    /// The file that IN is a copy of; the copy has the name of OUT.
    is: &'static str,
    /// The name that the command writes to: the argument OUT, or one that it makes up itself.
    out: &'static str,
    arguments: &'static str,
}

const fn row(is: &'static str, out: &'static str, arguments: &'static str) -> Row {
    Row { is, out, arguments }
}

const ROWS: &[Row] = &[
    row("recording.csv", "x.csv", "convert IN OUT"),
    row("room.toml", "x.csv", "simulate IN --out OUT"),
    row("room.toml", "x.svg", "simulate IN --view OUT"),
    row("way.csv", "x.csv", "simulate named.toml --out OUT"),
    row("room.toml", "x.png", "fuse IN --out OUT"),
    row("room.toml", "x.json", "fuse IN --json OUT"),
    row("way.csv", "x.csv", "fuse named.toml --json OUT"),
    row("room.toml", "x.svg", "coverage IN --out OUT"),
    row(
        "room.toml",
        "x.toml",
        "coverage IN --candidates all --write OUT",
    ),
    row("way.csv", "x.csv", "coverage named.toml --out OUT"),
    row(
        "room.toml",
        "x",
        "compare --scene IN --recording recording.csv --report OUT",
    ),
    row(
        "room.toml",
        "x",
        "compare --scene IN --recording recording.csv --junit OUT",
    ),
    row(
        "room.toml",
        "x",
        "compare --scene IN --recording recording.csv --json OUT",
    ),
    row(
        "recording.csv",
        "x",
        "compare --scene room.toml --recording IN --json OUT",
    ),
    row(
        "way.csv",
        "x.csv",
        "compare --scene named.toml --recording recording.csv --json OUT",
    ),
    row(
        "profile.toml",
        "x",
        "compare --scene room.toml --recording recording.csv --profile IN --json OUT",
    ),
    row(
        "thresholds.toml",
        "x",
        "compare --scene room.toml --recording recording.csv --thresholds IN --json OUT",
    ),
    row(
        "room.toml",
        "x",
        "calibrate --scene IN --recording recording.csv --out OUT",
    ),
    row(
        "room.toml",
        "x",
        "calibrate --scene IN --recording recording.csv --json OUT",
    ),
    row(
        "room.toml",
        "x",
        "calibrate --scene IN --recording recording.csv --write-profile OUT",
    ),
    row(
        "recording.csv",
        "x",
        "calibrate --scene room.toml --recording IN --out OUT",
    ),
    row(
        "way.csv",
        "x.csv",
        "calibrate --scene named.toml --recording recording.csv --out OUT",
    ),
    row(
        "profile.toml",
        "x",
        "calibrate --scene room.toml --recording recording.csv --profile IN --write-profile OUT",
    ),
    row("recording.csv", "x", "characterize IN --profile OUT"),
    row("recording.csv", "x", "characterize IN --report OUT"),
    row("recording.csv", "x", "characterize IN --json OUT"),
    row(
        "room.toml",
        "x",
        "characterize recording.csv --empty auto --scene IN --profile OUT",
    ),
    row("token", "x", "record evening --token-file IN --out OUT"),
    row(
        "authority.pem",
        "x",
        "record evening --authority IN --out OUT",
    ),
    row(
        "room.toml",
        "x.csv",
        "emulate --scene IN --trace OUT -- true",
    ),
    row(
        "recording.csv",
        "x.csv",
        "emulate --recording IN --trace OUT -- true",
    ),
    row(
        "profile.toml",
        "x.csv",
        "emulate --constant 20 --profile IN --trace OUT -- true",
    ),
    row(
        "faults.toml",
        "x.csv",
        "emulate --constant 20 --faults IN --trace OUT -- true",
    ),
    row(
        "room.toml",
        "out/recording.csv",
        "demo --once --out out --scene IN",
    ),
    row(
        "room.toml",
        "out/report.html",
        "demo --once --out out --scene IN",
    ),
    row(
        "room.toml",
        "out/report.json",
        "demo --once --out out --scene IN",
    ),
    row(
        "room.toml",
        "out/store.sqlite",
        "demo --once --out out --scene IN",
    ),
    row(
        "recording.csv",
        "out/recording.csv",
        "demo --once --out ./out --replay IN",
    ),
];

/// How the file that is read has the name that is written too.
#[derive(Debug, Clone, Copy)]
enum Twin {
    Same,
    Relative,
    SymbolicLink,
    HardLink,
}

#[test]
fn no_command_writes_over_a_file_that_it_reads_by_whatever_name() {
    for row in ROWS {
        for twin in [
            Twin::Same,
            Twin::Relative,
            Twin::SymbolicLink,
            Twin::HardLink,
        ] {
            refused(row, twin);
        }
    }
}

/// Puts a copy of the input under the name that is written; how the command calls the one and the other.
fn placed(fixture: &Fixture, row: &Row, twin: Twin) -> (String, String) {
    let (is, out) = (fixture.path(row.is), fixture.path(row.out));
    match twin {
        Twin::Same | Twin::Relative => {
            fs::copy(is, out).unwrap();
        }
        Twin::SymbolicLink => std::os::unix::fs::symlink(is, out).unwrap(),
        Twin::HardLink => fs::hard_link(is, out).unwrap(),
    }
    match twin {
        Twin::Same => (row.out.to_owned(), row.out.to_owned()),
        Twin::Relative => (row.out.to_owned(), format!("out/.././{}", row.out)),
        Twin::SymbolicLink | Twin::HardLink => (row.is.to_owned(), row.out.to_owned()),
    }
}

fn refused(row: &Row, twin: Twin) {
    let fixture = Fixture::new();
    fs::create_dir(fixture.path("out")).unwrap();
    fixture.put("out/way.csv", crate::WAY);
    let (input, out) = placed(&fixture, row, twin);
    fixture.put("named.toml", crate::ROOM.replace("way.csv", &input));
    let before = fixture.files();
    let arguments: Vec<&str> = row
        .arguments
        .split(' ')
        .map(|word| match word {
            "IN" => input.as_str(),
            "OUT" => out.as_str(),
            other => other,
        })
        .collect();
    let ended = fixture.run(&arguments);
    let context = format!("{arguments:?} {twin:?}: {ended:?}");
    assert_eq!(ended.code, Some(2), "{context}");
    let is_named = row.arguments.contains("OUT");
    let told = format!(
        "error: the output {} is the input {input}, and would be written over it\n\
         hint: name another output; nothing was changed\n",
        if is_named { &out } else { row.out },
    );
    // The folder of what a demonstration writes is part of its outputs' names.
    assert_eq!(ended.stderr.replace("./out/", "out/"), told, "{context}");
    assert_eq!(fixture.files(), before, "{context}");
}

#[test]
fn two_results_of_one_command_have_two_names() {
    let fixture = Fixture::new();
    fixture.put("a.csv", "old");
    std::os::unix::fs::symlink("a.csv", fixture.path("v.svg")).unwrap();
    for arguments in [
        "compare --scene room.toml --recording recording.csv --report x --json ./x",
        "compare --scene room.toml --recording recording.csv --junit x --report x",
        "calibrate --scene room.toml --recording recording.csv --out x --write-profile x",
        "characterize recording.csv --profile x --report x",
        "coverage room.toml --out x.svg --out ./x.svg",
        "coverage room.toml --candidates all --out x.svg --write x.svg",
        "fuse room.toml --out x.png --json x.png",
        "simulate room.toml --out a.csv --view v.svg",
    ] {
        let before = fixture.files();
        let ended = fixture.run(&arguments.split(' ').collect::<Vec<_>>());
        assert_eq!(ended.code, Some(2), "{arguments}: {ended:?}");
        assert!(
            ended.stderr.starts_with("error: the outputs ")
                && ended
                    .stderr
                    .contains(" are one file\nhint: give each a name of its own"),
            "{arguments}: {ended:?}"
        );
        assert_eq!(fixture.files(), before, "{arguments}");
    }
    let twice = "compare --scene room.toml --recording recording.csv --report /dev/null --junit /dev/null --json -";
    let ended = fixture.run(&twice.split(' ').collect::<Vec<_>>());
    assert_ne!(ended.code, Some(2), "a device is no file: {ended:?}");
    assert!(!Path::new("/dev/null").is_file());
}

/// A dataset's folder takes nothing that another program wrote, whatever its name.
#[test]
fn a_dataset_leaves_a_scene_in_its_folder_as_it_is() {
    let fixture = Fixture::new();
    for name in ["dataset.json", "part-000000.npz"] {
        let folder = format!("of-{name}");
        fs::create_dir(fixture.path(&folder)).unwrap();
        let scene = format!("{folder}/{name}");
        fixture.put(
            &scene,
            crate::ROOM.replace(
                "trajectory = \"way.csv\"\nspeed_mm_per_s = 500",
                "position_mm = [1000, 1000, 0]",
            ),
        );
        let before = fs::read(fixture.path(&scene)).unwrap();
        let arguments = [
            "dataset", &scene, "--out", &folder, "--frames", "1", "--format", "npz",
        ];
        let ended = fixture.run(&arguments);
        assert_eq!(ended.code, Some(2), "{name}: {ended:?}");
        assert!(ended.stderr.contains("it is left as it is"), "{ended:?}");
        assert_eq!(fs::read(fixture.path(&scene)).unwrap(), before);
    }
}
