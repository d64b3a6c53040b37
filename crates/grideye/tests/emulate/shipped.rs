//! Every scene of the repository, every sensor of it: simulated, emulated, posted, recorded and compared under its own name.

use crate::support::{Server, emulate, pixels, root, run};
use grideye_recording::wire::{Batch, SensorBatch};
use grideye_recording::{Row, csv};
use grideye_scene::{Scene, Sensor};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What one run of the emulated sensors takes in: two on each bus.
const ADDRESSES: [&str; 2] = ["0x68", "0x69"];

#[test]
fn every_shipped_sensor_is_called_alike_in_scene_recording_wire_and_comparison() {
    let folder = tempfile::tempdir().unwrap();
    let mut sensors_seen = 0;
    for path in scenes(&root().join("scenes")) {
        let text = fs::read_to_string(&path).unwrap();
        let beside = |name: &str| fs::read_to_string(path.with_file_name(name));
        let scene = Scene::parse(&text, &path.display().to_string(), &beside).unwrap();
        let sensors = scene.scene.sensors();
        let mut first_frames = Vec::new();
        for sensor in sensors {
            let out = folder.path().join(format!("{}.csv", sensor.name));
            simulated(&path, sensor, &out);
            if (sensor.columns, sensor.rows) != (8, 8) {
                continue;
            }
            let rows: Vec<Row> = csv::Reader::new(fs::File::open(&out).unwrap())
                .unwrap()
                .collect::<Result<_, _>>()
                .unwrap();
            first_frames.push((sensor, posted(&rows, sensor)));
            compared(&path, sensor, &out);
            sensors_seen += 1;
        }
        emulated(&path, &first_frames);
    }
    assert!(sensors_seen >= 47, "{sensors_seen} sensors");
}

/// Scene files of a folder and those below; profiles are none.
fn scenes(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("profiles") {
            found.extend(scenes(&path));
        } else if path.extension().is_some_and(|end| end == "toml") {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn grideye(arguments: &[&str], scene: &Path, sensor: &Sensor) -> crate::support::Ended {
    let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
    command.args(arguments).arg(scene);
    run(command.args(["--sensor", &sensor.name]))
}

fn simulated(scene: &Path, sensor: &Sensor, out: &Path) {
    let out = out.to_str().unwrap();
    let asked = ["simulate", "--frames", "3", "--seed", "2", "--out", out];
    let ended = grideye(&asked, scene, sensor);
    assert_eq!(
        ended.code,
        0,
        "{} {}: {ended:?}",
        scene.display(),
        sensor.name
    );
}

/// The rows go onto the wire and come off it; the pixels of the first.
fn posted(rows: &[Row], sensor: &Sensor) -> Vec<i32> {
    assert_eq!(rows.len(), 3);
    let stream = &rows[0].stream;
    assert_eq!(stream.sensor, sensor.name);
    let batch = Batch {
        device: stream.device.clone(),
        boot: stream.boot.clone(),
        t_sent_boot_ns: None,
        sensors: vec![SensorBatch {
            sensor: stream.sensor.clone(),
            account: None,
            frames: rows.iter().map(|row| row.record).collect(),
        }],
    };
    let json = batch.to_json().unwrap();
    assert_eq!(Batch::from_json(&json).unwrap(), batch);
    let frame = rows[0].record.reading.frame().unwrap();
    let word = |word: u16| i32::from(word) - if word >= 0x800 { 0x1000 } else { 0 };
    frame.pixels.iter().map(|pixel| word(pixel.0)).collect()
}

/// Against itself: few frames do not say much, but they never disagree.
fn compared(scene: &Path, sensor: &Sensor, recording: &Path) {
    let recording = recording.to_str().unwrap();
    let asked = [
        "compare",
        "--json",
        "-",
        "--seed",
        "2",
        "--recording",
        recording,
        "--scene",
    ];
    let ended = grideye(&asked, scene, sensor);
    assert!(
        [0, 3].contains(&ended.code),
        "{} {}: {ended:?}",
        scene.display(),
        sensor.name
    );
    let report: serde_json::Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(report["context"]["sensor"], sensor.name, "{report}");
}

/// All of a scene at once; each shows about what its simulation begins with.
fn emulated(scene: &Path, sensors: &[(&Sensor, Vec<i32>)]) {
    let place = |index: usize| (1 + index / 2, ADDRESSES[index % 2]);
    let mut arguments = vec!["--scene".to_owned(), scene.to_str().unwrap().to_owned()];
    for (index, (sensor, _)) in sensors.iter().enumerate() {
        let (bus, address) = place(index);
        arguments.push("--sensor".to_owned());
        arguments.push(format!("{}={bus}:{address}", sensor.name));
    }
    if sensors.is_empty() {
        let refused = run(emulate(&["--scene", scene.to_str().unwrap()]).args(["--", "true"]));
        assert_eq!(refused.code, 2, "no AMG8833 is in it: {refused:?}");
        return;
    }
    let server = Server::start(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    for (index, (sensor, first)) in sensors.iter().enumerate() {
        let (bus, address) = place(index);
        let address = if address == "0x68" { 0x68 } else { 0x69 };
        let shown = pixels(&mut server.client(u32::try_from(bus).unwrap()), address);
        let apart: i32 = shown
            .iter()
            .zip(first)
            .map(|(one, other)| (one - other).abs())
            .sum();
        // A degree, on average.
        assert!(
            apart < 4 * 64,
            "{} {}: {shown:?} {first:?}",
            scene.display(),
            sensor.name
        );
    }
}
