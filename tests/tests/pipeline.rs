//! The whole pipeline with the release programs: registers to verdict, and every common mistake of a user.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails in a helper fails the test"
)]

#[path = "pipeline/mistakes.rs"]
mod mistakes;

use grideye_tests::live_page::{batch, frame};
use grideye_tests::programs::{
    self, Ended, RunningCollector, grideye, grideye_agent, root, run, wait_for,
};
use mistakes::file;
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

const SESSION: &str = "recordings/linaige/Session2_2021-07-01_RoomB_v2.csv";

fn demo(out: &Path, arguments: &[&str]) -> Ended {
    run(grideye()
        .args(["demo", "--once", "--out"])
        .arg(out)
        .args(arguments))
}

fn line<'a>(ended: &'a Ended, beginning: &str) -> &'a str {
    let found = ended
        .stdout
        .lines()
        .find(|line| line.starts_with(beginning));
    found.unwrap_or_else(|| panic!("no line {beginning:?} in {ended:?}"))
}

/// Holds a command's output to the block of the document that shows it, word by word and digit by digit.
fn assert_as_in(document: &str, command: &str, ended: &Ended) {
    let readme = std::fs::read_to_string(root().join(document)).unwrap();
    let (_, behind) = readme.split_once(&format!("$ {command}\n")).unwrap();
    let (shown, _) = behind.split_once("```").unwrap();
    let said = ended.stdout.lines().chain(ended.stderr.lines());
    let said: Vec<String> = said.map(words).collect();
    assert!(shown.lines().count() >= 5, "{shown}");
    for line in shown.lines() {
        assert!(
            said.contains(&words(line)),
            "{document} shows {line:?} of {command}; {said:#?}"
        );
    }
}

/// A line without what differs from run to run: ports, and the folders of paths. The demonstration has a clock of its own and
/// seeds, so that its figures do not.
fn words(line: &str) -> String {
    const HOST: &str = "http://127.0.0.1:";
    let words = line.split_whitespace().map(|word| {
        if let Some(port) = word.strip_prefix(HOST) {
            let path = port.trim_start_matches(|letter: char| letter.is_ascii_digit());
            return format!("{HOST}#{path}");
        }
        let name = word.rsplit('/').next().filter(|name| !name.is_empty());
        name.unwrap_or(word).to_owned()
    });
    words.collect::<Vec<_>>().join(" ")
}

#[test]
fn the_demonstration_ends_with_delivery_scores_and_report() {
    let out = tempfile::tempdir().unwrap();
    let ended = demo(out.path(), &["--speed", "10"]);
    assert_eq!(ended.code, 0, "{ended:?}");
    assert_eq!(ended.stdout.lines().count(), 4, "{ended:?}");
    let command = "cargo run --release -- demo --once --out out";
    assert_as_in("README.md", command, &ended);
    assert!(
        line(&ended, "delivery")
            .contains("read 100 = stored 100 + dropped 0 + spooled 0, missing 0")
    );
    let verdict = line(&ended, "verdict");
    assert!(
        verdict.contains("Agrees: `person` is where and when the scene says. ")
            && verdict.ends_with("of 100 frames."),
        "{verdict}"
    );
    let scores = line(&ended, "scores");
    assert!(
        scores.contains("blank frame") && scores.contains("shuffled"),
        "{scores}"
    );
    assert!(line(&ended, "page").contains("report.html"));

    let report = std::fs::read_to_string(out.path().join("report.html")).unwrap();
    assert!(report.contains("</span> Agrees</h1>"));
    assert!(
        report.contains("emulated sensor"),
        "the report must say that the sensor was emulated"
    );
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(out.path().join("report.json")).unwrap())
            .unwrap();
    assert!(json.to_string().contains("sha256:"));
}

/// The rows of a CSV file as text, header first; nothing of this project reads it.
fn cells(path: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines()
        .map(|line| line.split(',').map(str::to_owned).collect())
        .collect()
}

/// `thermistor, pixel 1 … pixel 64` of every row, compared as numbers.
fn temperatures(rows: &[Vec<String>], first: &str, count: usize) -> Vec<Vec<f64>> {
    let start = rows[0].iter().position(|name| name == first).unwrap();
    rows[1..]
        .iter()
        .map(|row| {
            row[start..start + count]
                .iter()
                .map(|cell| cell.parse().unwrap())
                .collect()
        })
        .collect()
}

#[test]
fn a_real_recording_comes_out_as_it_went_in_through_registers_bus_http_and_store() {
    let out = tempfile::tempdir().unwrap();
    let ended = demo(out.path(), &["--replay", SESSION, "--speed", "40"]);
    assert_eq!(ended.code, 0, "{ended:?}");
    let command = format!("cargo run --release -- demo --replay {SESSION} --once --speed 20");
    assert_as_in("recordings/README.md", &command, &ended);
    assert!(
        line(&ended, "replay").contains("1848 frames in, 1848 out, 0 missing"),
        "{ended:?}"
    );

    let source = temperatures(&cells(&root().join(SESSION)), "thermistor", 65);
    let written = cells(&out.path().join("recording.csv"));
    assert_eq!(temperatures(&written, "thermistor", 65), source);
    let seq = written[0].iter().position(|name| name == "seq").unwrap();
    let numbers: Vec<usize> = written[1..]
        .iter()
        .map(|row| row[seq].parse().unwrap())
        .collect();
    assert_eq!(
        numbers,
        (0..1848).collect::<Vec<_>>(),
        "in order, none missing, none twice"
    );
}

#[test]
fn another_scene_is_not_taken_for_the_recorded_one() {
    let out = tempfile::tempdir().unwrap();
    let shown = ["--speed", "10", "--scene", "scenes/experiment-1.toml"];
    assert_eq!(demo(out.path(), &shown).code, 0);
    let compare = |scene: &str| {
        let recording = out.path().join("recording.csv");
        run(grideye()
            .args(["compare", "--scene", scene, "--recording"])
            .arg(recording))
    };
    assert_eq!(compare("scenes/experiment-1.toml").code, 0);
    let wrong = compare("scenes/experiment-2.toml");
    assert_eq!(wrong.code, 1, "{wrong:?}");
    assert!(wrong.stdout.starts_with("Disagrees: "));
    let empty = out.path().join("empty.toml");
    let scene = std::fs::read_to_string(root().join("scenes/experiment-1.toml")).unwrap();
    let (before, after) = scene.split_once("[[object]]").unwrap();
    let sensor = after.split_once("[[sensor]]").unwrap().1;
    std::fs::write(&empty, format!("{before}[[sensor]]{sensor}")).unwrap();
    let nobody = compare(empty.to_str().unwrap());
    assert!(
        [1, 3].contains(&nobody.code),
        "a scene without anybody cannot agree: {nobody:?}"
    );
}

/// A configuration of the agent for this collector; its path.
fn agent_config(folder: &Path, collector: &RunningCollector) -> String {
    let text = format!(
        "device = \"pi-1\"\ncollector = \"{}\"\n[[bus]]\npath = \"/dev/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n",
        collector.url()
    );
    file(folder, "agent.toml", &text)
}

/// The agent runs in real time here: on a host that stalls for longer than a frame it misses some, and must say so.
#[test]
fn the_agent_delivers_from_a_device_file_to_a_collector() {
    let folder = tempfile::tempdir().unwrap();
    let collector = RunningCollector::start(folder.path());
    let config = agent_config(folder.path(), &collector);
    let mut agent = emulated(&["--scene", "scenes/experiment-1.toml"]);
    agent
        .arg(grideye_agent().get_program())
        .args(["run", "--frames", "30", "--config", &config]);
    let ended = run(&mut agent);

    let audit = collector.json("/v1/audit");
    let stream = &audit["streams"][0];
    assert_eq!(
        (stream["device"].as_str(), stream["sensor"].as_str()),
        (Some("pi-1"), Some("i2c-1:0x69"))
    );
    assert_eq!(
        (stream["read"].as_u64(), stream["stored"].as_u64()),
        (Some(30), Some(30)),
        "{audit}"
    );
    let missing = stream["missing"].as_u64().unwrap();
    let code = if missing == 0 { 0 } else { 3 };
    assert_eq!(ended.code, code, "{ended:?}");
    let audited = run(grideye().args(["audit", "--collector", collector.url()]));
    assert_eq!(audited.code, code, "{audited:?}");
    let equation = format!("read 30 = stored 30 + dropped 0 + spooled 0, missing {missing}");
    assert!(audited.stdout.contains(&equation), "{audited:?}");
    let stopped = collector.stop();
    assert_eq!(stopped.code, 0, "{stopped:?}");
}

#[test]
fn an_audit_that_ends_with_3_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let collector = RunningCollector::start(folder.path());
    let missing = || json!({ "missing": "nack" });
    let frames = [frame(&[80; 64], 402), missing(), missing()];
    let mut turn = 0;
    let mut audited = |account: Value| {
        let mut body = batch("s1", turn, &frames);
        turn += 3;
        body["sensors"][0]["account"] = account;
        let url = format!("{}/v1/frames", collector.url());
        ureq::post(url).send_json(body).unwrap();
        let audited = run(grideye().args(["audit", "--collector", collector.url()]));
        assert_eq!(audited.code, 3, "{audited:?}");
        audited.stderr
    };
    let account = |read: u64, dropped: Value| json!({ "read": read, "missing": 2, "dropped": dropped, "spooled": 1, "errors": {} });
    for (account, said) in [
        (
            account(1, json!({})),
            "missing 2 (never read from the sensor), dropped 0 (after reading)\n",
        ),
        (
            account(5, json!({ "ring-full": 3 })),
            "missing 4 (never read from the sensor), dropped 3 (after reading)\n",
        ),
        (
            account(8, json!({ "ring-full": 3 })),
            "missing 6 (never read from the sensor), dropped 3 (after reading), others unaccounted for (≠)\n",
        ),
    ] {
        let stderr = audited(account);
        assert!(
            stderr.ends_with(&format!("exit code 3: {said}")),
            "{stderr}"
        );
    }
}

#[test]
fn the_agent_stays_small() {
    let folder = tempfile::tempdir().unwrap();
    let collector = RunningCollector::start(folder.path());
    let config = agent_config(folder.path(), &collector);
    let mut agent = emulated(&["--recording", SESSION]);
    // The shell looks at the agent while it runs: its VmHWM is gone with the process.
    let look = r#""$0" run --config "$1" & agent=$!; sleep 4; grep VmHWM /proc/$agent/status; kill $agent; wait $agent"#;
    agent
        .args(["sh", "-c", look])
        .arg(grideye_agent().get_program())
        .arg(&config);
    let ended = run(&mut agent);
    let peak = ended
        .stdout
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"));
    let peak = peak.unwrap_or_else(|| panic!("{ended:?}"));
    let peak_kib: u64 = peak.trim().trim_end_matches(" kB").parse().unwrap();
    println!(
        "peak resident memory: agent {peak_kib} KiB, collector {} KiB",
        collector.peak_kib()
    );
    assert!(
        peak_kib < 12 * 1024,
        "the agent had {peak_kib} KiB resident"
    );
    let stored = collector.json("/v1/audit")["streams"][0]["stored"].as_u64();
    assert!(
        stored.is_some_and(|frames| frames > 10),
        "it was measured while it delivered: {stored:?}"
    );
}

fn emulated(what: &[&str]) -> Command {
    let mut command = grideye();
    command.arg("emulate").args(what).arg("--");
    command
}

#[test]
fn a_person_sees_the_sensor_with_one_command() {
    let mut check = emulated(&["--scene", "scenes/experiment-1.toml"]);
    check.arg(grideye_agent().get_program()).args([
        "check",
        "--bus",
        "/dev/i2c-1",
        "--address",
        "0x69",
    ]);
    // The check runs in real time: a host that stalls is told apart from a sensor at fault, and asked again.
    let ended = (0..3)
        .map(|_| run(&mut check))
        .find(|ended| !format!("{ended:?}").contains("too busy to read in time"))
        .unwrap();
    assert_eq!(ended.code, 0, "{ended:?}");
    assert!(ended.stdout.contains("thermistor"), "{ended:?}");

    let mut wrong = emulated(&["--address", "0x68", "--scene", "scenes/experiment-1.toml"]);
    wrong.arg(grideye_agent().get_program()).args([
        "check",
        "--bus",
        "/dev/i2c-1",
        "--address",
        "0x69",
    ]);
    let ended = run(&mut wrong);
    assert_eq!(ended.code, 1, "{ended:?}");
    let said = format!("{}{}", ended.stdout, ended.stderr);
    assert!(
        said.contains("hint:") && said.contains("0x68"),
        "a wrong address must be named with the other one: {said}"
    );
}

/// A long recording is read with a bar and the time that is left, where a person looks; `script` is such a terminal.
#[test]
fn long_work_says_on_a_terminal_how_long_it_takes() {
    let folder = tempfile::tempdir().unwrap();
    let one = folder.path().join("one.csv");
    let converted = run(grideye().arg("convert").arg(root().join(SESSION)).arg(&one));
    assert_eq!(converted.code, 0, "{converted:?}");
    let text = std::fs::read_to_string(&one).unwrap();
    let (head, rows) = text.split_once('\n').unwrap();
    let long =
        (0..20).map(|run| rows.replace("Session2_2021-07-01_RoomB_v2", &format!("run{run}")));
    std::fs::write(
        folder.path().join("long.csv"),
        format!("{head}\n{}", long.collect::<String>()),
    )
    .unwrap();
    let shown = run(Command::new("script")
        .args(["--quiet", "--return", "--command"])
        .arg(format!(
            "{} convert long.csv out.parquet",
            programs::folder().join("grideye").display()
        ))
        .arg("/dev/null")
        .current_dir(folder.path()));
    assert_eq!(shown.code, 0, "{shown:?}");
    assert!(
        shown.stdout.contains("reading") && shown.stdout.contains(" left"),
        "{shown:?}"
    );
    assert!(shown.stdout.contains("wrote 36960 rows"), "{shown:?}");
}

#[test]
fn a_session_of_linaige_becomes_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("session2.csv");
    let ended = run(grideye().args(["convert", SESSION]).arg(&out));
    assert_eq!(ended.code, 0, "{ended:?}");
    let source = temperatures(&cells(&root().join(SESSION)), "thermistor", 65);
    assert_eq!(temperatures(&cells(&out), "thermistor", 65), source);
}

#[test]
fn what_arrives_is_recorded_under_a_name_and_fetched() {
    let folder = tempfile::tempdir().unwrap();
    let collector = RunningCollector::start(folder.path());
    let out = folder.path().join("evening.csv");
    let record = grideye()
        .args([
            "record",
            "evening",
            "--seconds",
            "3",
            "--collector",
            collector.url(),
            "--out",
        ])
        .arg(&out)
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    wait_for("the recording's start", || {
        let first = collector.json("/v1/recordings")["recordings"][0].clone();
        first["running"].as_bool().filter(|running| *running)
    });
    let frame = serde_json::json!({
        "seq": 7, "t_boot_ns": 1_000_000_000, "t_utc_ns": 0, "clock": "unsynced",
        "thermistor_raw": 402, "pixels_raw": vec![4095; 64]
    });
    let missing = serde_json::json!({ "seq": 8, "t_boot_ns": 1_100_000_000, "t_utc_ns": 0, "clock": "unsynced", "missing": "nack" });
    let batch = serde_json::json!({ "device": "pi-1", "boot": "b", "sensors": [{ "sensor": "s", "frames": [frame, missing] }] });
    let mut answer = ureq::post(format!("{}/v1/frames", collector.url()))
        .send_json(&batch)
        .unwrap();
    let answer: serde_json::Value = answer.body_mut().read_json().unwrap();
    assert_eq!(answer["durable_through"]["s"].as_u64(), Some(8), "{answer}");
    let ended = record.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(0));
    let said = String::from_utf8(ended.stdout).unwrap();
    assert_eq!(said, "recorded 1 frames as \"evening\"; 1 missing\n");
    let rows = cells(&out);
    assert_eq!(rows.len(), 3);
    // 402 sixteenths of a degree, and 0xFFF in two's complement (AMG88 spec §4-11-11).
    let degrees = temperatures(&rows[..2], "thermistor", 65);
    assert_eq!(
        (degrees[0][0], degrees[0][1], degrees[0][64]),
        (25.125, -0.25, -0.25)
    );
}

/// The report must name every file that the scene is made of, and what was done to the scene.
#[test]
fn a_report_names_the_walk_and_the_warnings_of_its_scene() {
    let folder = tempfile::tempdir().unwrap();
    let scene = std::fs::read_to_string(root().join("scenes/experiment-3.toml")).unwrap();
    let moved = scene.replace(
        "position_mm = [2000, 3000, 0]",
        "position_mm = [9000, 3000, 0]",
    );
    assert_ne!(moved, scene);
    let scene = file(folder.path(), "walk.toml", &moved);
    std::fs::create_dir(folder.path().join("trajectories")).unwrap();
    let walk = "trajectories/straight-across.csv";
    std::fs::copy(root().join("scenes").join(walk), folder.path().join(walk)).unwrap();
    let recording = folder.path().join("walk.csv");
    let recording = recording.to_str().unwrap();
    assert_eq!(
        run(grideye().args(["simulate", &scene, "--out", recording])).code,
        0
    );

    let ended = run(grideye().args([
        "compare",
        "--scene",
        &scene,
        "--recording",
        recording,
        "--json",
        "-",
    ]));
    assert_eq!(ended.code, 0, "{ended:?}");
    let report: serde_json::Value = serde_json::from_str(&ended.stdout).unwrap();
    let said = report.to_string();
    let sum = Command::new("sha256sum")
        .arg(folder.path().join(walk))
        .output()
        .unwrap();
    let sum = String::from_utf8(sum.stdout).unwrap();
    let sum = sum.split_whitespace().next().unwrap();
    assert!(
        said.contains(walk) && said.contains(&format!("sha256:{sum}")),
        "{said}"
    );
    assert!(
        said.contains("table") && ended.stderr.contains("warning:"),
        "{said}{}",
        ended.stderr
    );
}

#[test]
fn an_object_outside_its_room_is_removed_with_a_warning_that_names_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("outside.toml");
    let scene = std::fs::read_to_string(root().join("scenes/experiment-1.toml")).unwrap();
    std::fs::write(
        &path,
        scene.replace(
            "position_mm = [2000, 3000, 0]",
            "position_mm = [9000, 3000, 0]",
        ),
    )
    .unwrap();
    let ended = run(grideye().arg("simulate").arg(&path));
    assert_eq!(ended.code, 0, "{ended:?}");
    assert!(
        ended.stderr.contains("warning:") && ended.stderr.contains("table"),
        "{ended:?}"
    );
    assert_eq!(ended.stdout.lines().count(), 8);
}
