//! Texts are bounded and in UTF-8, whatever a command takes them for.

use crate::Fixture;

/// Commands that read IN, and what it is taken for.
const COMMANDS: &[(&str, &str)] = &[
    ("simulate IN", "the scene"),
    ("dataset IN --out out --frames 1", "the scene"),
    ("distinguish room.toml IN", "the scene"),
    ("compare --scene IN --recording recording.csv", "the scene"),
    (
        "compare --scene room.toml --recording recording.csv --thresholds IN",
        "the thresholds",
    ),
    (
        "compare --scene room.toml --recording recording.csv --profile IN",
        "the profile",
    ),
    (
        "calibrate --scene IN --recording recording.csv",
        "the scene",
    ),
    (
        "calibrate --scene room.toml --recording recording.csv --profile IN",
        "the profile",
    ),
    ("emulate --scene IN -- true", "the scene"),
    ("emulate --constant 20 --profile IN -- true", "the profile"),
    (
        "emulate --constant 20 --faults IN -- true",
        "the script of faults",
    ),
    ("demo --once --out out --scene IN", "the scene"),
];

/// Commands that read IN as a recording, which has no end that they wait for.
const OF_RECORDINGS: &[&str] = &[
    "convert IN x.csv",
    "compare --scene room.toml --recording IN",
    "calibrate --scene room.toml --recording IN",
    "characterize IN",
    "emulate --recording IN -- true",
    "orient --recording IN",
];

/// Whoever reads on is ended, and not the machine.
const LITTLE_MEMORY: &str = "ulimit -v 4000000";

fn named<'a>(command: &'a str, input: &'a str) -> Vec<&'a str> {
    let words = command.split(' ');
    words
        .map(|word| if word == "IN" { input } else { word })
        .collect()
}

#[test]
fn a_file_that_is_too_long_is_refused_after_16_mib() {
    let fixture = Fixture::new();
    let long = std::fs::File::create(fixture.path("long")).unwrap();
    long.set_len(1 << 33).unwrap();
    for (command, what) in COMMANDS {
        let ended = fixture.run_limited(LITTLE_MEMORY, &named(command, "long"));
        assert_eq!(ended.code, Some(2), "{command}: {ended:?}");
        let told = format!("error: cannot read {what} long: it has more than 16 MiB\nhint: ");
        assert!(ended.stderr.starts_with(&told), "{command}: {ended:?}");
    }
    for command in OF_RECORDINGS {
        let ended = fixture.run_limited(LITTLE_MEMORY, &named(command, "long"));
        assert_eq!(ended.code, Some(2), "{command}: {ended:?}");
        let told = "error: long: line 1: more than 262144 bytes without a newline\nhint: ";
        assert!(ended.stderr.starts_with(told), "{command}: {ended:?}");
    }
    fixture.put("of-long.toml", crate::ROOM.replace("way.csv", "long"));
    let ended = fixture.run_limited(LITTLE_MEMORY, &["simulate", "of-long.toml"]);
    assert_eq!(ended.code, Some(2), "{ended:?}");
    let told = "error: of-long.toml:8:14: cannot read the trajectory `long`: it has more than 16 MiB\nhint: ";
    assert!(ended.stderr.starts_with(told), "{ended:?}");
}

#[test]
fn what_is_no_file_is_refused_at_once() {
    let fixture = Fixture::new();
    let made = fixture.run_limited(
        "mkfifo pipe; ln -s /dev/zero zero; ln -s pipe link",
        &["man"; 0],
    );
    assert!(fixture.path("pipe").exists(), "{made:?}");
    // Nobody writes into the pipe.
    let soon = "set -- timeout 20 \"$@\"; ulimit -v 4000000";
    let no_file = "it is a pipe, a socket or a device, and only files are read: save into a file what comes from it\nhint: ";
    for input in ["pipe", "zero", "link"] {
        for (command, what) in COMMANDS {
            let ended = fixture.run_limited(soon, &named(command, input));
            assert_eq!(ended.code, Some(2), "{command}: {ended:?}");
            let told = format!("error: cannot read {what} {input}: {no_file}");
            assert!(ended.stderr.starts_with(&told), "{command}: {ended:?}");
        }
        for command in OF_RECORDINGS {
            let ended = fixture.run_limited(soon, &named(command, input));
            assert_eq!(ended.code, Some(2), "{command}: {ended:?}");
            let told = format!("error: cannot open {input}: {no_file}");
            assert!(ended.stderr.starts_with(&told), "{command}: {ended:?}");
        }
        fixture.put("of.toml", crate::ROOM.replace("way.csv", input));
        let ended = fixture.run_limited(soon, &["simulate", "of.toml"]);
        assert_eq!(ended.code, Some(2), "{ended:?}");
        let told =
            format!("error: of.toml:8:14: cannot read the trajectory `{input}`: it is a pipe");
        assert!(ended.stderr.starts_with(&told), "{ended:?}");
    }
}

#[test]
fn what_others_named_controls_no_terminal() {
    let fixture = Fixture::new();
    let evil = "\u{1b}]0;owned\u{7}\u{1b}[2J\rx\ny\u{202e}\u{9b}31m";
    let frames: String = (0..4)
        .map(|row| format!("{row},a,{}\n", ["20.5"; 64].join(",")))
        .collect();
    let pixels: Vec<String> = (0..64).map(|pixel| format!("p{pixel}")).collect();
    let named = evil.replace('\n', " ");
    fixture.put(&format!("{evil}.toml"), "[room]\n");
    fixture.put(&format!("{evil}.csv"), &frames);
    fixture.put(
        "columns.csv",
        format!("t_s,{named},{}\n{frames}", pixels.join(",")),
    );
    let keys: Vec<String> = pixels
        .iter()
        .map(|name| format!("\"{name}\":20.5"))
        .collect();
    let key = serde_json::json!(evil);
    let row = format!("{{\"t_s\":1,{key}:\"a\",{}}}", keys.join(","));
    fixture.put("keys.json", format!("[{row},{row},{row}]"));
    let scene = crate::ROOM.replace("\"ana\"", &key.to_string());
    fixture.put(
        "room.toml",
        scene.replace("\\r", "\\u000d").replace("\\f", ""),
    );
    let in_files: &[&[&str]] = &[
        &["simulate", &format!("{evil}.toml")],
        &["simulate", &format!("{evil}.none")],
        &["simulate", "room.toml"],
        &["convert", &format!("{evil}.csv"), "x.csv"],
        &["convert", "columns.csv", "x.csv"],
        &["convert", "keys.json", "x.csv"],
    ];
    let in_arguments: &[&[&str]] = &[
        &[
            "convert",
            "columns.csv",
            "x.csv",
            "--columns",
            &format!("time={evil}"),
        ],
        &["convert", "recording.csv", &format!("{evil}/x.csv")],
        &["simulate", "room.toml", evil],
        &["simulate", "room.toml", &format!("--{evil}")],
        &[evil],
    ];
    for command in in_files.iter().chain(in_arguments) {
        let ended = fixture.run(command);
        let told = ended.stderr.replace('\n', "");
        let is_evil = |letter: &char| letter.is_control() || *letter == '\u{202e}';
        assert_eq!(told.chars().find(is_evil), None, "{command:?}: {ended:?}");
        let is_torn = in_files.contains(command) && ended.stderr.contains("\ny");
        assert!(!is_torn, "{command:?}: {ended:?}");
    }
    let ended = fixture.run(&["convert", "keys.json", "x.csv"]);
    assert!(ended.stderr.contains("\\u{1b}]0;owned\\u{7}"), "{ended:?}");
}

#[test]
fn a_byte_that_is_no_text_is_told_with_its_line_and_column() {
    let fixture = Fixture::new();
    fixture.put("latin-1.toml", b"# a room\n# K\xc3\xbcche, K\xfcche\n");
    for (command, what) in COMMANDS {
        let ended = fixture.run(&named(command, "latin-1.toml"));
        assert_eq!(ended.code, Some(2), "{command}: {ended:?}");
        let told = format!(
            "error: latin-1.toml:2:11: the byte 0xfc is not UTF-8\nhint: save {what} as UTF-8\n"
        );
        assert_eq!(ended.stderr, told, "{command}");
    }
    fixture.put("way.csv", b"# K\xfcche\nx_mm,y_mm,z_mm\n");
    let ended = fixture.run(&["simulate", "room.toml"]);
    let told = "error: room.toml:8:14: cannot read the trajectory `way.csv`: line 1, column 4: the byte 0xfc is not UTF-8\nhint: ";
    assert!(ended.stderr.starts_with(told), "{ended:?}");
}

#[test]
fn a_bad_row_is_blamed_on_the_input_and_not_on_the_output() {
    let fixture = Fixture::new();
    let row = ["20"; 64].join(",");
    let header = grideye_recording::csv::header();
    fixture.put(
        "rows.csv",
        format!("{header}\n,s,b,0,0,0,unsynced,,,,{row}\n"),
    );
    let ended = fixture.run(&["convert", "rows.csv", "x.csv"]);
    assert_eq!(ended.code, Some(2), "{ended:?}");
    let told = "error: cannot read rows.csv: line 2, column device: expected a name";
    assert!(ended.stderr.starts_with(told), "{ended:?}");
    assert!(!ended.stderr.contains("x.csv"), "{ended:?}");
    assert!(!fixture.path("x.csv").exists());
}

/// Commands with a number below 0, their exit codes, and how an error names it.
const BELOW_ZERO: &[(&str, i32, &str)] = &[
    (
        "coverage room.toml --candidates walls --wall-headings-deg -30,0",
        0,
        "",
    ),
    (
        "emulate --constant -20 --clock-error -43000 --seconds 0.1 --socket s",
        0,
        "",
    ),
    ("convert rows.txt x.csv --rate -1", 2, "'-1' for '--rate"),
    (
        "compare --scene room.toml --recording recording.csv --start -0.5",
        0,
        "",
    ),
    ("simulate room.toml --frames -1", 2, "'-1' for '--frames"),
];

#[test]
fn a_number_below_zero_is_a_value_and_not_an_option() {
    let fixture = Fixture::new();
    fixture.put("rows.txt", ["20"; 64].join(",") + "\n");
    for (command, code, told) in BELOW_ZERO {
        let ended = fixture.run(&command.split(' ').collect::<Vec<_>>());
        assert_eq!(ended.code, Some(*code), "{command}: {ended:?}");
        assert!(ended.stderr.contains(told), "{command}: {ended:?}");
    }
}
