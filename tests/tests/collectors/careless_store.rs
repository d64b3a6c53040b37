//! Mishandles the file of a running collector: moved, hidden by another disk, on a disk that turns read-only, and
//! backed up while frames come in.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::mounted::Mounted;
use grideye_tests::patience::WAIT_MAX;
use grideye_tests::programs::{Ended, RunningCollector, grideye, is_left_out, run, wait, wait_for};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Posts `count` frames from `first` on; returns status and answer.
fn post(url: &str, first: u64, count: u64) -> (u16, Value) {
    let frame = |seq| {
        let pixels: Vec<u64> = (0..64).map(|pixel| (seq * 7 + pixel) % 4096).collect();
        json!({
            "seq": seq, "t_boot_ns": 1_000_000_000 + seq * 100_000_000, "t_utc_ns": 1_700_000_000_000_000_000_u64 + seq,
            "clock": "synced", "thermistor_raw": seq % 2048, "pixels_raw": pixels,
        })
    };
    let body = json!({
        "device": "pi-1", "boot": "b",
        "sensors": [{"sensor": "s", "frames": (first..first + count).map(frame).collect::<Vec<_>>()}],
    });
    ask(|http| http.post(format!("{url}/v1/frames")).send_json(&body))
}

fn get(url: &str, path: &str) -> (u16, Value) {
    ask(|http| http.get(format!("{url}{path}")).call())
}

fn ask(
    request: impl Fn(&ureq::Agent) -> Result<ureq::http::Response<ureq::Body>, ureq::Error>,
) -> (u16, Value) {
    let http: ureq::Agent = ureq::Agent::config_builder()
        .timeout_global(Some(WAIT_MAX))
        .http_status_as_error(false)
        .build()
        .into();
    let mut answer = request(&http).unwrap();
    let status = answer.status().as_u16();
    (status, answer.body_mut().read_json().unwrap())
}

/// Posts frames and checks that the collector acknowledges them.
fn acknowledge(collector: &RunningCollector, first: u64, count: u64) {
    let (status, answer) = post(collector.url(), first, count);
    let last = json!({ "s": first + count - 1 });
    assert_eq!(
        (status, &answer["durable_through"]),
        (200, &last),
        "{answer}"
    );
}

/// The number of frames that the collector counts, after checking that a recording returns as many.
fn readable(collector: &RunningCollector, recording: u64) -> u64 {
    let stored = collector.json("/v1/audit")["streams"][0]["stored"].as_u64();
    let csv = collector.recording_csv(recording);
    let rows = u64::try_from(csv.lines().count() - 1).unwrap();
    assert_eq!(stored, Some(rows));
    rows
}

#[test]
fn a_collector_with_its_file_moved_away_exits_with_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let collector = RunningCollector::start(folder.path());
    let recording = collector.start_recording("all");
    acknowledge(&collector, 0, 10);
    let moved = folder.path().join("moved.sqlite");
    fs::rename(folder.path().join("store.sqlite"), &moved).unwrap();
    for _ in 0..3 {
        let (status, answer) = post(collector.url(), 10, 10);
        assert_eq!(
            (status, &answer["error"]["code"]),
            (503, &json!("store_gone"))
        );
    }
    let Ended { code, stderr, .. } = collector.stop();
    assert_eq!(code, 1, "{stderr}");
    assert!(
        !stderr.contains("every acknowledged frame is on disk"),
        "{stderr}"
    );
    assert!(
        stderr.contains("closing the store failed: the store's file was moved away"),
        "{stderr}"
    );
    assert_eq!(stderr.matches("error: store_gone").count(), 1, "{stderr}");
    assert!(stderr.contains("put it back to "), "{stderr}");
    let again = RunningCollector::start_on(&moved);
    acknowledge(&again, 10, 10);
    assert_eq!(readable(&again, recording), 20);
    let Ended { code, stderr, .. } = again.stop();
    assert_eq!(code, 0, "{stderr}");
    assert!(
        stderr.contains("every acknowledged frame is on disk"),
        "{stderr}"
    );
}

#[test]
fn a_folder_hidden_by_another_disk_takes_no_batch_until_it_is_back() {
    if is_left_out("GRIDEYE_WITHOUT_MOUNTS", "a store below a mount") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let disk = Mounted::tmpfs(folder.path().join("disk"), 8);
    let store = disk.path().join("store");
    fs::create_dir(&store).unwrap();
    let collector = RunningCollector::start(&store);
    let recording = collector.start_recording("all");
    acknowledge(&collector, 0, 10);
    // The system refuses to remount a disk read-only while it is being written, so this disk fails under the batches.
    let remounted = Command::new("mount")
        .args(["-o", "remount,ro"])
        .arg(disk.path())
        .stderr(Stdio::null())
        .status();
    assert!(!remounted.unwrap().success());
    acknowledge(&collector, 10, 10);
    let cover = Mounted::tmpfs(store, 1);
    assert_eq!(get(collector.url(), "/healthz").0, 503);
    assert_eq!(post(collector.url(), 20, 10).0, 503);
    assert_eq!(get(collector.url(), "/v1/health").0, 503);
    drop(cover);
    assert_eq!(get(collector.url(), "/healthz").0, 200);
    acknowledge(&collector, 20, 10);
    assert_eq!(readable(&collector, recording), 30);
    assert_eq!(collector.stop().code, 0);
}

#[test]
fn a_disk_that_turns_read_only_takes_no_batch_until_it_is_repaired() {
    if is_left_out("GRIDEYE_WITHOUT_MOUNTS", "a store on a disk that fails") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let behind = Mounted::tmpfs(folder.path().join("behind"), 8);
    let path = folder.path().join("disk");
    let disk = Mounted::ext4(&behind, path.clone());
    let mut collector = RunningCollector::start(disk.path());
    let recording = collector.start_recording("all");
    for first in (0..500).step_by(10) {
        acknowledge(&collector, first, 10);
    }
    behind.fill();
    let mut acknowledged = 500;
    while post(collector.url(), acknowledged, 10).0 == 200 {
        acknowledged += 10;
        assert!(acknowledged < 100_000, "the disk never fails");
    }
    wait_for("the disk to be read-only", || {
        fs::write(path.join("probe"), "x").is_err().then_some(())
    });
    for _ in 0..3 {
        let (status, answer) = post(collector.url(), acknowledged, 10);
        assert!(status >= 500, "{answer}");
        assert_eq!(get(collector.url(), "/healthz").0, 503);
    }
    collector.kill();
    drop((collector, disk));
    behind.empty();
    let disk = Mounted::ext4_again(&behind, path);
    let collector = RunningCollector::start(disk.path());
    let found = collector.json("/v1/audit")["streams"][0]["stored"].as_u64();
    assert!(found >= Some(acknowledged), "{found:?} of {acknowledged}");
    acknowledge(&collector, acknowledged, 10);
    assert_eq!(readable(&collector, recording), acknowledged + 10);
    println!(
        "{acknowledged} frames acknowledged before the disk failed, all of them there after its repair"
    );
    assert_eq!(collector.stop().code, 0);
}

/// `grideye backup` of the store in this folder.
fn backup(folder: &Path, out: &Path) -> Command {
    let mut command = grideye();
    command
        .args(["backup", "--json", "--store"])
        .arg(folder.join("store.sqlite"))
        .arg(out);
    command
}

/// Posts 10 frames every 50 ms, counts those acknowledged, and runs `then` meanwhile.
fn while_frames_come<T>(collector: &RunningCollector, then: impl FnOnce(&AtomicU64) -> T) -> T {
    let (acknowledged, is_over) = (AtomicU64::new(0), AtomicBool::new(false));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut next = Instant::now();
            while !is_over.load(Ordering::SeqCst) {
                let first = acknowledged.load(Ordering::SeqCst);
                acknowledge(collector, first, 10);
                acknowledged.fetch_add(10, Ordering::SeqCst);
                next += Duration::from_millis(50);
                std::thread::sleep(next.saturating_duration_since(Instant::now()));
            }
        });
        let done = then(&acknowledged);
        is_over.store(true, Ordering::SeqCst);
        done
    })
}

#[test]
fn a_backup_has_every_frame_that_was_acknowledged_before_it_and_is_restored_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let collector = RunningCollector::start(folder.path());
    let recording = collector.start_recording("all");
    let out = folder.path().join("monday.sqlite");
    let (before, ended, after) = while_frames_come(&collector, |acknowledged| {
        let count = || acknowledged.load(Ordering::SeqCst);
        wait_for("frames", || (count() >= 200).then_some(()));
        let before = count();
        let ended = run(&mut backup(folder.path(), &out));
        (before, ended, count())
    });
    assert_eq!(ended.code, 0, "{ended:?}");
    let counts: Value = serde_json::from_str(&ended.stdout).unwrap();
    let frames = counts["frames"].as_u64().unwrap();
    println!("{before} frames acknowledged before, {frames} in the backup, {after} after");
    // One batch may be in transit.
    assert!((before..=after + 10).contains(&frames), "{counts}");
    assert_eq!(counts["streams"][0]["stored"], frames);
    let again = run(&mut backup(folder.path(), &out));
    assert_eq!(again.code, 2, "{again:?}");
    assert!(again.stderr.contains("exists already"), "{again:?}");
    assert_eq!(collector.stop().code, 0);
    let restored = RunningCollector::start_on(&out);
    assert_eq!(readable(&restored, recording), frames);
    acknowledge(&restored, 0, frames + 10);
    assert_eq!(
        restored.json("/v1/audit")["streams"][0]["stored"],
        frames + 10
    );
    assert_eq!(restored.stop().code, 0);
}

#[test]
fn a_backup_that_is_killed_leaves_nothing_under_its_name_and_the_next_one_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let collector = RunningCollector::start(folder.path());
    for first in (0..20_000).step_by(1000) {
        acknowledge(&collector, first, 1000);
    }
    let mut tries = 0..20;
    let partial = loop {
        let number = tries.next().expect("each was whole before it was killed");
        let out = folder.path().join(format!("{number}.sqlite"));
        let partial = PathBuf::from(format!("{}.partial", out.display()));
        let mut child = backup(folder.path(), &out)
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let began = Instant::now();
        while !partial.exists() && began.elapsed() < Duration::from_secs(5) {
            std::hint::spin_loop();
        }
        child.kill().unwrap();
        wait(&mut child);
        if partial.exists() {
            assert!(!out.exists());
            break partial;
        }
        assert!(out.exists(), "neither the backup nor a part of it");
    };
    let out = partial.with_extension("");
    let ended = run(&mut backup(folder.path(), &out));
    assert_eq!(ended.code, 0, "{ended:?}");
    assert!(!partial.exists());
    let counts: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(counts["frames"], 20_000);
    assert_eq!(collector.stop().code, 0);
}

#[test]
fn a_backup_without_room_leaves_nothing() {
    if is_left_out("GRIDEYE_WITHOUT_MOUNTS", "a backup to a full disk") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let collector = RunningCollector::start(folder.path());
    for first in (0..20_000).step_by(1000) {
        acknowledge(&collector, first, 1000);
    }
    let disk = Mounted::tmpfs(folder.path().join("disk"), 1);
    let ended = run(&mut backup(folder.path(), &disk.path().join("out")));
    assert_eq!(ended.code, 1, "{ended:?}");
    assert!(ended.stderr.contains("no room for "), "{ended:?}");
    assert_eq!(fs::read_dir(disk.path()).unwrap().count(), 0);
    let database = run(grideye().args(["backup", "--store", "postgres://me@db/frames", "out"]));
    assert_eq!(database.code, 2, "{database:?}");
    let hint =
        "hint: pg_dump --format=custom --schema=grideye --file=out postgres://me@db:5432/frames";
    assert!(database.stderr.contains(hint), "{database:?}");
}
