//! `grideye orient`: a simulated person at the left and at the top of a sensor that is mounted in each of the eight ways,
//! from a recording and live, through the registers of the emulated sensor, the agent and the collector.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::programs::{Ended, RunningCollector, folder, grideye, run, terminate, wait_for};
use serde_json::Value;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Straight below the ceiling, as on a map: left is the room's left, and top its back (the table of scenes/README.md).
const SCENE: &str = r#"
[room]
size_mm = [6000, 6000, 2700]
ambient_c = 22
[[agent]]
name = "person"
size_mm = [300, 300, 1700]
temperature_c = 30
trajectory = "hands.csv"
[[sensor]]
name = "ceiling"
preset = "grid-eye"
position_mm = [3000, 3000, 2700]
elevation_deg = 90
azimuth_deg = 90
"#;
/// Out of sight, at the left, out of sight and round the view, at the back: so long at each that a machine which stalls
/// for seconds sees enough of it.
const WAY: &str = "t_s,x_mm,y_mm,z_mm
0,500,3000,0
4,500,3000,0
5,2400,3000,0
11,2400,3000,0
12,500,3000,0
13,500,5500,0
14,3000,5500,0
15,3000,3600,0
21,3000,3600,0
22,3000,5500,0
";

/// What a sensor records that is rolled so.
fn recording(at: &Path, roll_deg: u16) -> PathBuf {
    std::fs::write(at.join("hands.csv"), WAY).unwrap();
    let scene = at.join(format!("roll-{roll_deg}.toml"));
    std::fs::write(&scene, format!("{SCENE}roll_deg = {roll_deg}\n")).unwrap();
    let path = scene.with_extension("csv");
    let made = run(grideye()
        .arg("simulate")
        .arg(&scene)
        .arg("--out")
        .arg(&path));
    assert_eq!(made.code, 0, "{made:?}");
    path
}

/// The same with left and right exchanged, by its columns.
fn mirrored(recording: &Path) -> PathBuf {
    let text = std::fs::read_to_string(recording).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let first = header.iter().position(|name| *name == "pixel1").unwrap();
    let mut out = header.join(",") + "\n";
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let exchanged = (0..cells.len()).map(|index| {
            let Some(pixel) = index.checked_sub(first).filter(|pixel| *pixel < 64) else {
                return cells[index];
            };
            cells[first + pixel / 8 * 8 + 7 - pixel % 8]
        });
        out += &(exchanged.collect::<Vec<_>>().join(",") + "\n");
    }
    let path = recording.with_extension("mirrored.csv");
    std::fs::write(&path, out).unwrap();
    path
}

fn orient(recording: &Path, more: &[&str]) -> Ended {
    run(grideye()
        .args(["orient", "--recording"])
        .arg(recording)
        .args(more))
}

fn json(ended: &Ended) -> Value {
    serde_json::from_str(&ended.stdout).unwrap_or_else(|error| unreachable!("{error}: {ended:?}"))
}

/// Where the page draws the side of the picture (column, row from the middle) that a hand was at: what
/// `assets/orientation.js` does, the mirror first and then the quarters clockwise.
fn drawn(answer: &Value, hand: &str) -> (f64, f64) {
    let page = &answer["page"];
    let off = |axis: &str| answer[hand][axis].as_f64().unwrap() - 4.5;
    let (mut x, mut y) = (off("column"), off("row"));
    if page["mirrored"] == true {
        x = -x;
    }
    for _ in 0..page["quarters"].as_u64().unwrap() {
        (x, y) = (-y, x);
    }
    (x, y)
}

fn check_drawn_upright(answer: &Value) {
    let (x, y) = drawn(answer, "left");
    assert!(x < -1.0 && y.abs() < 1.0, "{answer}");
    let (x, y) = drawn(answer, "top");
    assert!(y < -1.0 && x.abs() < 1.0, "{answer}");
}

#[test]
fn each_of_the_eight_ways_is_told_from_a_recording() {
    let at = tempfile::tempdir().unwrap();
    for roll_deg in [0, 90, 180, 270] {
        let straight = recording(at.path(), roll_deg);
        let ended = orient(&straight, &["--json"]);
        assert_eq!(ended.code, 0, "{ended:?}");
        let answer = json(&ended);
        assert_eq!(answer["roll_deg"], roll_deg, "{answer}");
        assert_eq!(answer["mirrored"], false, "{answer}");
        assert!(answer["confidence"].as_f64().unwrap() > 0.9, "{answer}");
        check_drawn_upright(&answer);

        let ended = orient(&mirrored(&straight), &["--json"]);
        assert_eq!(ended.code, 0, "{ended:?}");
        let answer = json(&ended);
        assert_eq!(answer["roll_deg"], Value::Null, "{answer}");
        assert_eq!(answer["mirrored"], true, "{answer}");
        check_drawn_upright(&answer);
    }
}

#[test]
fn a_person_is_told_what_to_write_and_what_to_press() {
    let at = tempfile::tempdir().unwrap();
    let ended = orient(&recording(at.path(), 90), &[]);
    for words in [
        "simulator/ceiling: mounted turned a quarter clockwise, as seen from behind it",
        "hand at the left  seen at the bottom,",
        "scene     roll_deg = 90\n",
        "page      keys t  (t turns, m mirrors)\n",
    ] {
        assert!(ended.stdout.contains(words), "{words}: {ended:?}");
    }
}

#[test]
fn what_cannot_be_told_ends_with_3_and_a_hint() {
    let at = tempfile::tempdir().unwrap();
    let whole = recording(at.path(), 0);
    let text = std::fs::read_to_string(&whole).unwrap();
    let cut = |name: &str, rows: usize| {
        let path = at.path().join(name);
        let kept: Vec<&str> = text.lines().take(rows + 1).collect();
        std::fs::write(&path, kept.join("\n") + "\n").unwrap();
        path
    };
    for (rows, words) in [
        (10, "the view was never still"),
        (40, "no hand was seen at one side"),
        (75, "the first hand never left the view"),
        (140, "no second hand was seen"),
    ] {
        let ended = orient(&cut(&format!("{rows}.csv"), rows), &[]);
        assert_eq!(ended.code, 3, "{rows}: {ended:?}");
        assert!(ended.stdout.contains(words), "{rows}: {ended:?}");
        let ended = orient(&cut(&format!("{rows}.csv"), rows), &["--json"]);
        assert_eq!(
            (ended.code, &json(&ended)["told"]),
            (3, &Value::Bool(false)),
            "{ended:?}"
        );
    }
    let ended = orient(&whole, &["--sensor", "other"]);
    assert_eq!(ended.code, 2, "{ended:?}");
    let ended = run(grideye().args(["orient", "--collector", "http://127.0.0.1:9"]));
    assert_eq!(ended.code, 1, "{ended:?}");
    assert!(
        ended
            .stderr
            .contains("hint: start one with `grideye collect`"),
        "{ended:?}"
    );
}

/// `grideye orient` at a collector, which asks before anything is shown.
struct Asking {
    child: Child,
    said: BufReader<std::process::ChildStderr>,
}

impl Asking {
    fn start(collector: &RunningCollector, sensor: &str) -> Self {
        let mut child = grideye()
            .args([
                "orient",
                "--json",
                "--sensor",
                sensor,
                "--seconds",
                "300",
                "--collector",
                collector.url(),
            ])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let said = BufReader::new(child.stderr.take().unwrap());
        Self { child, said }
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.said.read_line(&mut line).unwrap();
        line
    }

    /// What it asked for from here on, and its answer.
    fn end(mut self) -> (Vec<String>, Ended) {
        let mut asked = Vec::new();
        loop {
            let line = self.line();
            if line.is_empty() {
                break;
            }
            asked.push(line);
        }
        let output = self.child.wait_with_output().unwrap();
        let ended = Ended {
            code: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: asked.concat(),
        };
        (asked, ended)
    }
}

/// The agent on the emulated sensor that replays this recording, until it has read so many frames.
fn agent_on(at: &Path, device: &str, recording: &Path, collector: &RunningCollector) -> Emulating {
    let config = at.join(format!("{device}.toml"));
    let text = format!(
        "device = \"{device}\"\ncollector = \"{}\"\n[spool]\nmode = \"ram\"\n[[bus]]\npath = \"/dev/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n",
        collector.url()
    );
    std::fs::write(&config, text).unwrap();
    let mut command: Command = grideye();
    command
        .args(["emulate", "--quiet", "--recording"])
        .arg(recording);
    command.args(["--"]).arg(folder().join("grideye-agent"));
    command
        .args(["run", "--frames", "240", "--config"])
        .arg(config);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    Emulating(command.spawn().unwrap())
}

/// Asked to end with its test, so that it ends the agent too.
struct Emulating(Child);

impl Drop for Emulating {
    fn drop(&mut self) {
        terminate(&self.0);
        // Whatever it ends with.
        let _ = self.0.wait();
    }
}

#[test]
fn live_frames_of_the_emulated_sensor_are_asked_for_and_told() {
    let at = tempfile::tempdir().unwrap();
    let collector = RunningCollector::start(at.path());
    let turned = recording(at.path(), 270);
    let mirrored = mirrored(&recording(at.path(), 180));
    let mut runs = Vec::new();
    for (device, recording) in [("turned", &turned), ("mirrored", &mirrored)] {
        let mut asking = Asking::start(&collector, &format!("{device}/i2c-1:0x69"));
        // It follows the collector before the first frame is there.
        assert!(asking.line().contains("keep out of the sensor's view"));
        runs.push((asking, agent_on(at.path(), device, recording, &collector)));
    }
    let mut answers = Vec::new();
    for (asking, _agent) in runs {
        let (asked, ended) = asking.end();
        assert_eq!(ended.code, 0, "{ended:?}");
        let order = ["LEFT of its view", "take it out", "TOP of its view"];
        let asks: Vec<&String> = asked
            .iter()
            .filter(|line| order.iter().any(|words| line.contains(words)))
            .collect();
        assert_eq!(asks.len(), 3, "{asked:?}");
        answers.push(json(&ended));
    }
    assert_eq!(answers[0]["sensor"], "turned/i2c-1:0x69", "{answers:?}");
    assert_eq!(answers[0]["roll_deg"], 270, "{answers:?}");
    assert_eq!(answers[1]["mirrored"], true, "{answers:?}");
    for answer in &answers {
        check_drawn_upright(answer);
    }
    let several = wait_for("both sensors", || {
        let ended = run(grideye().args(["orient", "--collector", collector.url()]));
        (ended.code == 2).then_some(ended)
    });
    assert!(
        several.stderr.contains("name one with --sensor"),
        "{several:?}"
    );
}
