//! Several collectors on one PostgreSQL, with the real programs: agents that move between them, one that is killed,
//! recordings and the live page across them, and migration from SQLite.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::patience::WAIT_MAX;
use grideye_tests::postgres::{self, sql};
use grideye_tests::programs::{RunningCollector, grideye, run, wait_for};
use serde_json::{Value, json};
use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

const FRAMES_A_BATCH: u64 = 5;

/// A frame with words that depend on device and number, so that a mix-up would show.
fn frame(device: u64, seq: u64) -> Value {
    let pixels: Vec<u64> = (0..64)
        .map(|pixel| (device * 131 + seq * 7 + pixel) % 4096)
        .collect();
    json!({
        "seq": seq, "t_boot_ns": 1_000_000_000 + seq * 100_000_000, "t_utc_ns": 1_700_000_000_000_000_000_u64 + seq,
        "clock": "synced", "thermistor_raw": seq % 2048, "pixels_raw": pixels,
    })
}

fn body(device: u64, first: u64, count: u64) -> Value {
    let last = first + count;
    let frames: Vec<Value> = (first..last).map(|seq| frame(device, seq)).collect();
    json!({
        "device": format!("pi-{device}"), "boot": "b", "t_sent_boot_ns": 1_000_000_000 + last * 100_000_000,
        "sensors": [{"sensor": "s", "frames": frames, "account": {
            "read": last, "missing": 0, "dropped": {}, "spooled": count, "errors": {}
        }}],
    })
}

/// Posts a batch; returns the highest durable number, or `None` if no valid answer came.
fn post(http: &ureq::Agent, url: &str, body: &Value) -> Option<u64> {
    let mut answer = http.post(format!("{url}/v1/frames")).send_json(body).ok()?;
    let answer: Value = answer.body_mut().read_json().ok()?;
    answer["durable_through"]["s"].as_u64()
}

fn http() -> ureq::Agent {
    ureq::Agent::config_builder()
        .timeout_global(Some(WAIT_MAX))
        .build()
        .new_agent()
}

/// Pseudo-random numbers, the same in every run (splitmix64).
struct Dice(u64);

impl Dice {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        usize::try_from((mixed ^ (mixed >> 31)) % u64::try_from(bound).unwrap()).unwrap()
    }
}

#[test]
fn agents_that_move_between_three_collectors_lose_nothing_when_one_is_killed() {
    const AGENTS: u64 = 16;
    const BATCHES: u64 = 60;
    let Some(cluster) = postgres::shared("several collectors on one PostgreSQL") else {
        return;
    };
    let database = cluster.database();
    let mut collectors: Vec<_> = (0..3)
        .map(|_| RunningCollector::start_on(&database))
        .collect();
    let urls: Vec<String> = collectors.iter().map(|c| c.url().to_owned()).collect();
    let (acknowledged, sent_again) = (AtomicU64::new(0), AtomicU64::new(0));
    std::thread::scope(|scope| {
        for device in 0..AGENTS {
            let (urls, acknowledged, sent_again) = (&urls, &acknowledged, &sent_again);
            scope.spawn(move || {
                let (http, mut dice) = (http(), Dice(device));
                for batch in 0..BATCHES {
                    let first = batch * FRAMES_A_BATCH;
                    let body = body(device, first, FRAMES_A_BATCH);
                    while post(&http, &urls[dice.below(3)], &body).is_none() {
                        sent_again.fetch_add(1, Ordering::Relaxed);
                        std::thread::sleep(Duration::from_millis(20));
                    }
                    // Sometimes treat the answer as lost and send the same batch to another collector.
                    if dice.below(8) == 0 {
                        post(&http, &urls[dice.below(3)], &body);
                    }
                    acknowledged.fetch_add(FRAMES_A_BATCH, Ordering::Relaxed);
                }
            });
        }
        let half = AGENTS * BATCHES * FRAMES_A_BATCH / 2;
        wait_for("half of the frames", || {
            (acknowledged.load(Ordering::Relaxed) >= half).then_some(())
        });
        collectors[0].kill();
    });
    println!(
        "{} frames acknowledged, {} posts sent again",
        acknowledged.load(Ordering::Relaxed),
        sent_again.load(Ordering::Relaxed)
    );
    assert!(
        sent_again.load(Ordering::Relaxed) > 0,
        "no batch was sent again, so no agent noticed the kill"
    );
    for collector in &collectors[1..] {
        let audit = collector.json("/v1/audit");
        let streams = audit["streams"].as_array().unwrap();
        assert_eq!(streams.len(), usize::try_from(AGENTS).unwrap());
        for stream in streams {
            assert_eq!(stream["stored"], BATCHES * FRAMES_A_BATCH, "{stream}");
            assert_eq!(stream["never_came"], 0, "{stream}");
            assert_eq!(stream["balanced"], true, "{stream}");
        }
    }
    let rows = sql(
        &database,
        "SELECT count(*), count(DISTINCT (device, stream, seq)), sum(get_byte(pixels, 0) + 256 * get_byte(pixels, 1)) FROM grideye.frames",
    );
    let all = AGENTS * BATCHES * FRAMES_A_BATCH;
    let first_pixels: u64 = (0..AGENTS)
        .flat_map(|device| {
            (0..BATCHES * FRAMES_A_BATCH).map(move |seq| (device * 131 + seq * 7) % 4096)
        })
        .sum();
    assert_eq!(rows, format!("{all}|{all}|{first_pixels}"));
}

/// The server-sent events of a collector, as (name, data).
fn follow(url: &str) -> mpsc::Receiver<(String, Value)> {
    let (tell, heard) = mpsc::channel();
    let body = ureq::get(format!("{url}/v1/live"))
        .call()
        .unwrap()
        .into_body();
    std::thread::spawn(move || {
        let mut name = String::new();
        for line in BufReader::new(body.into_reader())
            .lines()
            .map_while(Result::ok)
        {
            if let Some(event) = line.strip_prefix("event: ") {
                name = event.to_owned();
            }
            if let Some(data) = line.strip_prefix("data: ") {
                let data = serde_json::from_str(data).unwrap();
                if tell.send((name.clone(), data)).is_err() {
                    return;
                }
            }
        }
    });
    heard
}

#[test]
fn the_live_page_shows_what_came_in_through_the_other_collector() {
    let Some(cluster) = postgres::shared("the live page across collectors") else {
        return;
    };
    let database = cluster.database();
    let (one, other) = (
        RunningCollector::start_on(&database),
        RunningCollector::start_on(&database),
    );
    let events = follow(other.url());
    let http = http();
    let mut shown = Vec::new();
    let mut slowest = Duration::ZERO;
    for batch in 0..10 {
        let sent = Instant::now();
        assert!(
            post(
                &http,
                one.url(),
                &body(1, batch * FRAMES_A_BATCH, FRAMES_A_BATCH)
            )
            .is_some()
        );
        let last = (batch + 1) * FRAMES_A_BATCH;
        while !shown.contains(&(last - 1)) {
            let (name, data) = events.recv_timeout(WAIT_MAX).unwrap();
            if name == "frames" {
                let sensor = &data["sensors"][0];
                assert_eq!(sensor["device"], "pi-1");
                for frame in sensor["frames"].as_array().unwrap() {
                    shown.push(frame["seq"].as_u64().unwrap());
                    assert_eq!(frame["age_basis"], "boot-clock");
                }
            }
        }
        slowest = slowest.max(sent.elapsed());
    }
    assert_eq!(
        shown,
        (0..10 * FRAMES_A_BATCH).collect::<Vec<_>>(),
        "each once, in order"
    );
    println!("shown on the other page within {slowest:?}");
    let sensors = other.json("/v1/sensors");
    assert_eq!(sensors["sensors"][0]["stored"], 10 * FRAMES_A_BATCH);
    let _recording = one.start_recording("kitchen");
    wait_for("the other page to hear of the recording", || {
        let (name, _) = events.recv_timeout(WAIT_MAX).unwrap();
        (name == "recordings").then_some(())
    });
}

#[test]
fn a_recording_holds_exactly_what_was_acknowledged_between_its_start_and_stop_wherever_it_came_in()
{
    const AGENTS: u64 = 6;
    let Some(cluster) = postgres::shared("a recording across collectors") else {
        return;
    };
    let database = cluster.database();
    let collectors = [
        RunningCollector::start_on(&database),
        RunningCollector::start_on(&database),
    ];
    for round in 0..5 {
        // Frames acknowledged before the start are out, frames sent after the answer to it are in; likewise for the
        // stop.
        let progress: Vec<AtomicU64> = (0..AGENTS).map(|_| AtomicU64::new(0)).collect();
        let is_over = std::sync::atomic::AtomicBool::new(false);
        let base = round * 1_000_000;
        let acknowledged =
            || -> Vec<u64> { progress.iter().map(|p| p.load(Ordering::SeqCst)).collect() };
        let (before_start, after_start, before_stop, after_stop, csv) =
            std::thread::scope(|scope| {
                for device in 0..AGENTS {
                    let (collectors, progress, is_over) = (&collectors, &progress, &is_over);
                    scope.spawn(move || {
                        let (http, mut dice) = (http(), Dice(device + round));
                        for seq in 0.. {
                            if is_over.load(Ordering::SeqCst) {
                                return;
                            }
                            let url = collectors[dice.below(2)].url();
                            assert!(post(&http, url, &body(device, base + seq, 1)).is_some());
                            progress[usize::try_from(device).unwrap()]
                                .store(seq + 1, Ordering::SeqCst);
                        }
                    });
                }
                std::thread::sleep(Duration::from_millis(150));
                let before_start = acknowledged();
                let id = collectors[0].start_recording(&format!("round {round}"));
                let after_start = acknowledged();
                std::thread::sleep(Duration::from_millis(150));
                // A busy machine may need longer for a frame of each that surely came after the start.
                let has_more = |now: &[u64]| {
                    now.iter()
                        .zip(&after_start)
                        .all(|(now, then)| *now > then + 1)
                };
                wait_for("a frame of each agent", || {
                    has_more(&acknowledged()).then_some(())
                });
                let before_stop = acknowledged();
                // Started through one collector, stopped and read through the other.
                let csv = collectors[1].recording_csv(id);
                let after_stop = acknowledged();
                is_over.store(true, Ordering::SeqCst);
                (before_start, after_start, before_stop, after_stop, csv)
            });
        let mut kept: Vec<Vec<u64>> = vec![Vec::new(); usize::try_from(AGENTS).unwrap()];
        for line in csv.lines().skip(1) {
            let cells: Vec<&str> = line.split(',').collect();
            let device: usize = cells[0].strip_prefix("pi-").unwrap().parse().unwrap();
            kept[device].push(cells[3].parse::<u64>().unwrap() - base);
        }
        for (device, kept) in kept.iter().enumerate() {
            let (first, last) = (kept[0], kept[kept.len() - 1]);
            assert_eq!(*kept, (first..=last).collect::<Vec<_>>(), "whole, in order");
            // One frame of each agent may be in transit at either end.
            assert!(
                (before_start[device]..=after_start[device] + 1).contains(&first),
                "{device}"
            );
            assert!(
                (before_stop[device]..=after_stop[device] + 1).contains(&(last + 1)),
                "{device}"
            );
        }
    }
}

/// Kills a migration after it has copied part of `all` frames; returns how many.
fn kill_on_the_way(migration: &mut Command, database: &str, all: u64) -> u64 {
    let mut child = migration
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let copied = "SELECT coalesce(max(copied), 0) FROM grideye.migration";
    let send = |signal: &str| {
        let sent = Command::new("kill")
            .args([signal, &child.id().to_string()])
            .status();
        assert!(sent.unwrap().success(), "{signal}");
    };
    wait_for("a part to be copied", || {
        // It goes on only between the questions, each of which may take a busy host longer than all of the migration.
        send("-CONT");
        std::thread::sleep(Duration::from_millis(20));
        send("-STOP");
        let is_there = sql(
            database,
            "SELECT to_regclass('grideye.migration') IS NOT NULL",
        );
        (is_there == "t" && sql(database, copied) != "0").then_some(())
    });
    child.kill().unwrap();
    child.wait().unwrap();
    let part: u64 = sql(database, copied).parse().unwrap();
    assert!(
        part < all,
        "killed too late to test anything: {part} of {all}"
    );
    part
}

/// The books, but for how long ago each stream was added to.
fn books_of(collector: &RunningCollector) -> Value {
    let mut books = collector.json("/v1/audit");
    for stream in books["streams"].as_array_mut().unwrap() {
        assert!(stream["last_report_s"].take().is_u64());
    }
    books
}

/// A recording of any length, as text.
fn long_recording(collector: &RunningCollector, id: u64) -> String {
    ureq::get(format!("{}/v1/recordings/{id}.csv", collector.url()))
        .call()
        .unwrap()
        .into_body()
        .with_config()
        .limit(100_000_000)
        .read_to_string()
        .unwrap()
}

#[test]
fn a_migration_that_is_killed_goes_on_where_it_was_and_ends_with_the_same_books_and_frames() {
    const STREAMS: u64 = 40;
    const BATCHES: u64 = 20;
    let Some(cluster) = postgres::shared("a migration from SQLite to PostgreSQL") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let (file, database) = (folder.path().join("store.sqlite"), cluster.database());
    let old = RunningCollector::start(folder.path());
    let http = http();
    let mut recordings = Vec::new();
    for batch in 0..BATCHES {
        if batch % 5 == 1 {
            recordings.push(old.start_recording(&format!("r{batch}")));
        }
        for device in 0..STREAMS {
            assert!(post(&http, old.url(), &body(device, batch * 50, 50)).is_some());
        }
    }
    ureq::post(format!(
        "{}/v1/recordings/{}/note",
        old.url(),
        recordings[1]
    ))
    .send_json(json!({ "note": "two people" }))
    .unwrap();
    let labels = format!("/v1/recordings/{}/labels", recordings[1]);
    let span =
        json!({ "device": "pi-0", "sensor": "s", "boot": "b", "first_seq": 300, "last_seq": 310 });
    let label = json!({ "name": "a person, walking", "spans": [span] });
    ureq::post(format!("{}{labels}", old.url()))
        .send_json(label)
        .unwrap();
    let labeled = old.json(&labels);
    let csvs: Vec<String> = recordings.iter().map(|id| old.recording_csv(*id)).collect();
    let books = books_of(&old);
    let list = old.json("/v1/recordings");
    assert_eq!(old.stop().code, 0);

    let migrate = || {
        let mut command = grideye();
        command
            .arg("migrate")
            .arg(&file)
            .arg(&database)
            .arg("--json");
        command
    };
    let all = STREAMS * BATCHES * 50;
    let part = kill_on_the_way(&mut migrate(), &database, all);
    // No collector opens a database with only part of the frames.
    let refused = run(grideye().args(["collect", "--listen", "127.0.0.1:0", "--store", &database]));
    assert_eq!(refused.code, 1, "{refused:?}");
    assert!(
        refused.stderr.contains("not finished\nhint: "),
        "{refused:?}"
    );

    let ended = run(&mut migrate());
    assert_eq!(ended.code, 0, "{ended:?}");
    let counts: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(counts["frames"], all);
    assert_eq!(counts["resumed_after"], part);
    assert_eq!(counts["difference"], Value::Null);
    let new = RunningCollector::start_on(&database);
    assert_eq!(books_of(&new), books);
    assert_eq!(new.json("/v1/recordings"), list);
    assert_eq!(new.json(&labels), labeled);
    for (id, csv) in recordings.iter().zip(&csvs) {
        let copy = long_recording(&new, *id);
        assert!(copy == *csv, "recording {id} differs");
    }
    // The same frames again change nothing; a second migration into it reports that it is done.
    assert!(post(&http, new.url(), &body(3, 0, 50)).is_some());
    assert_eq!(new.json("/v1/audit")["streams"][3]["stored"], BATCHES * 50);
}

/// The two commands in the documentation: dump the database of a running collector, restore it into a new one.
#[test]
fn a_database_that_is_dumped_and_restored_is_the_same_store() {
    let Some(cluster) = postgres::shared("a dump of a store in PostgreSQL") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let (database, restored) = (cluster.database(), cluster.database());
    let old = RunningCollector::start_on(&database);
    let http = http();
    let recording = old.start_recording("all");
    for device in 0..4 {
        assert!(post(&http, old.url(), &body(device, 0, 50)).is_some());
    }
    let out = folder.path().join("frames.dump");
    let dumped = Command::new("pg_dump")
        .args(["--format=custom", "--schema=grideye"])
        .arg(format!("--file={}", out.display()))
        .arg(&database)
        .status();
    assert!(dumped.unwrap().success());
    let books = books_of(&old);
    let csv = old.recording_csv(recording);
    let list = old.json("/v1/recordings");
    let done = Command::new("pg_restore")
        .arg("--no-owner")
        .arg(format!("--dbname={restored}"))
        .arg(&out)
        .status();
    assert!(done.unwrap().success());
    let new = RunningCollector::start_on(&restored);
    assert_eq!(books_of(&new), books);
    assert_eq!(new.recording_csv(recording), csv);
    let name = |list: &Value| {
        (
            list["recordings"][0]["name"].clone(),
            list["recordings"][0]["frames"].clone(),
        )
    };
    assert_eq!(name(&new.json("/v1/recordings")), name(&list));
    // The same frames again change nothing, and new ones are stored.
    assert!(post(&http, new.url(), &body(3, 0, 50)).is_some());
    assert_eq!(post(&http, new.url(), &body(3, 50, 50)), Some(99));
    assert_eq!(new.json("/v1/audit")["streams"][3]["stored"], 100);
}
