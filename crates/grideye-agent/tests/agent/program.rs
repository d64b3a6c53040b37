//! The program itself: exit codes, messages, signals and memory.

use crate::patience::wait_for;
use crate::spool::record;
use crate::support::*;
use grideye_recording::wire;
use rustix::fs::{FlockOperation, flock};
use rustix::process::{Pid, Signal, kill_process};
use std::io::BufRead as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

fn agent(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_grideye-agent"))
        .args(arguments)
        .output()
        .unwrap()
}

fn assert_ends(arguments: &[&str], code: i32, said: &str) {
    let output = agent(arguments);
    let text = [output.stdout, output.stderr].concat();
    let text = String::from_utf8(text).unwrap();
    assert_eq!(output.status.code(), Some(code), "{text}");
    assert!(text.contains(said), "{text}");
}

fn configuration(text: &str) -> tempfile::NamedTempFile {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), text).unwrap();
    file
}

const NO_BUS: &str = "collector = \"http://127.0.0.1:9\"\n[[bus]]\npath = \"/nonexistent/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n";

#[test]
fn bad_usage_and_bad_configuration_end_with_2_and_say_where() {
    assert_ends(
        &["run", "--config", "/nonexistent/agent.toml"],
        2,
        "hint: copy firmware-config/agent.toml there",
    );
    // For a folder, the message does not suggest copying a file there.
    assert_ends(
        &["run", "--config", "/"],
        2,
        "hint: name the agent's configuration, a text file",
    );
    assert_ends(
        &["check", "--address", "0xd2"],
        2,
        "expected 0x68 or 0x69, found 0xd2",
    );
    assert_ends(
        &["check", "--address", "sixty"],
        2,
        "expected 0x68 or 0x69, found \"sixty\"",
    );
    assert_ends(&["run"], 2, "--config <FILE>");
    let misspelt = configuration(&NO_BUS.replace("collector", "colector"));
    let path = misspelt.path().to_str().unwrap();
    assert_ends(
        &["run", "--config", path],
        2,
        &format!("error: {path}:1:1: unknown field `colector`"),
    );
}

/// The writing end of a pipe that nobody reads any more.
fn unread() -> Stdio {
    let mut reader = Command::new("true").stdin(Stdio::piped()).spawn().unwrap();
    let pipe = reader.stdin.take().unwrap();
    reader.wait().unwrap();
    pipe.into()
}

type Stream = fn() -> Stdio;

fn full() -> Stdio {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
    full.unwrap().into()
}

#[test]
fn the_program_ends_the_same_when_nobody_reads_on_and_only_a_lost_result_is_an_error() {
    let config = configuration(NO_BUS);
    let path = config.path().to_str().unwrap();
    let ways: [(Stream, Stream, bool); 4] = [
        (unread, unread, false),
        (Stdio::null, full, false),
        (Stdio::null, unread, false),
        (full, Stdio::null, true),
    ];
    for (arguments, code, prints) in [
        (&["--help"][..], 0, true),
        (&["run"], 2, false),
        (&["run", "--config", "/"], 2, false),
        (&["run", "--frames", "0", "--config", path], 0, true),
        (&["check", "--config", path], 1, true),
        (&["join", "nothing", "--out", "/nonexistent/x"], 2, false),
    ] {
        for (stdout, stderr, loses_results) in ways {
            let ended = Command::new(env!("CARGO_BIN_EXE_grideye-agent"))
                .args(arguments)
                .stdout(stdout())
                .stderr(stderr())
                .status()
                .unwrap();
            let expected = if loses_results && prints { 1 } else { code };
            assert_eq!(ended.code(), Some(expected), "{arguments:?}");
        }
    }
}

#[test]
fn a_collector_that_is_not_there_is_named_and_a_second_signal_does_not_wait_for_it() {
    let config = configuration(NO_BUS);
    let mut child = Command::new(env!("CARGO_BIN_EXE_grideye-agent"))
        .args(["run", "--config", config.path().to_str().unwrap()])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut log = std::io::BufReader::new(child.stderr.take().unwrap());
    let mut wait_for = |wanted: &str| {
        let mut said = String::new();
        while !said.contains(wanted) {
            assert!(log.read_line(&mut said).unwrap() > 0, "{said}");
        }
    };
    wait_for("delivery to http://127.0.0.1:9 failed, ");
    wait_for("hint: is `grideye collect` running there");
    let first = Instant::now();
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    wait_for("info: stopping; ");
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(3));
    // The first signal alone gives it ten seconds to deliver.
    assert!(first.elapsed() < Duration::from_secs(10));
}

#[test]
fn a_failed_check_ends_with_1_and_is_one_line_of_json_for_programs() {
    assert_ends(
        &["check", "--bus", "/nonexistent/i2c-1"],
        1,
        "error: /nonexistent/i2c-1: no such bus\nhint: enable I2C",
    );
    let output = agent(&["check", "--bus", "/nonexistent/i2c-1", "--json"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.lines().count(), 1);
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(report["sensor"], "i2c-1:0x69");
    assert_eq!(report["ok"], false);
    assert_eq!(report["error"], "/nonexistent/i2c-1: no such bus");
    assert!(report["hint"].as_str().unwrap().starts_with("enable I2C"));
    let config = configuration(NO_BUS);
    let path = config.path().to_str().unwrap();
    assert_ends(&["check", "--config", path], 1, "i2c-1:0x69: failed");
    // Nothing listens there.
    let said = "collector: failed\nerror: http://127.0.0.1:9: ";
    assert_ends(&["check", "--config", path], 1, said);
    let said = "hint: is `grideye collect` running there, on this port?";
    assert_ends(&["check", "--config", path], 1, said);
    let spooling = NO_BUS.replacen("[[bus]]", "[spool]\n[[bus]]", 1);
    let config = configuration(&spooling);
    let path = config.path().to_str().unwrap();
    let said = "spool: mode outage: a power cut or a killed agent costs at most 109 frames";
    assert_ends(&["check", "--config", path], 1, said);
    let output = agent(&["check", "--json", "--config", path]);
    let text = String::from_utf8(output.stdout).unwrap();
    let spool: serde_json::Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    assert_eq!(spool["spool"]["frames_at_risk"], 109);
    // A spool without a folder is bad configuration, unless systemd provides one.
    assert_ends(
        &["run", "--config", path],
        2,
        "spool.folder: expected a folder, found none\nhint: ",
    );
}

#[test]
fn a_running_agent_is_small_and_ends_on_a_signal_with_its_account() {
    let collector = Collector::storing();
    let config = configuration(&NO_BUS.replace("http://127.0.0.1:9", &collector.url));
    for signal in [Signal::TERM, Signal::INT] {
        let child = Command::new(env!("CARGO_BIN_EXE_grideye-agent"))
            .args(["run", "--config", config.path().to_str().unwrap()])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let posts = collector.store.lock().unwrap().bodies;
        wait_for("a post", || {
            (collector.store.lock().unwrap().bodies > posts).then_some(())
        });
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
        let resident_kb: u64 = status
            .lines()
            .find_map(|line| line.strip_prefix("VmHWM:"))
            .and_then(|rest| rest.trim().trim_end_matches(" kB").parse().ok())
            .unwrap();
        assert!(resident_kb < 12 * 1024, "{resident_kb} kB");
        kill_process(Pid::from_child(&child), signal).unwrap();
        let output = child.wait_with_output().unwrap();
        let log = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{log}");
        assert_eq!(
            String::from_utf8(output.stdout).unwrap(),
            "i2c-1:0x69: 0 read = 0 stored + 0 dropped + 0 lost; 0 missing\n"
        );
        assert!(
            log.contains("error: /nonexistent/i2c-1: no such bus\nhint: enable I2C"),
            "{log}"
        );
    }
    let store = collector.store.lock().unwrap();
    let account = store.batches.last().unwrap().sensors[0]
        .account
        .clone()
        .unwrap();
    assert!(account.errors["unplugged"] >= 1, "{account:?}");
    // Two boots have two names, so that their sequence numbers are not confused.
    assert_ne!(
        store.batches.first().unwrap().boot,
        store.batches.last().unwrap().boot
    );
}

/// A record in a batch of its own, as quarantine has it.
fn line(seq: u64) -> String {
    let part = wire::SensorBatch {
        sensor: "s".to_owned(),
        account: None,
        frames: vec![record(seq)],
    };
    let batch = wire::Batch {
        device: "pi".to_owned(),
        boot: "b1".to_owned(),
        t_sent_boot_ns: None,
        sensors: vec![part],
    };
    String::from_utf8(batch.to_json().unwrap()).unwrap()
}

fn assert_resend_ends(spool: &Path, collector: &str, code: i32, said: &str) {
    let config = configuration(&NO_BUS.replace(
        "http://127.0.0.1:9\"",
        &format!(
            "{collector}\"\n[spool]\nmode = \"outage\"\nfolder = \"{}\"",
            spool.display()
        ),
    ));
    assert_ends(
        &["resend", "--config", config.path().to_str().unwrap()],
        code,
        said,
    );
}

#[test]
fn rejected_records_are_sent_again_and_those_that_are_rejected_again_stay() {
    let folder = tempfile::tempdir().unwrap();
    let quarantine = folder.path().join("quarantine");
    std::fs::create_dir(&quarantine).unwrap();
    let file = quarantine.join("refused-b1.jsonl");
    // The last line was cut short by a power cut.
    let cut = &line(8)[..40];
    std::fs::write(
        &file,
        [&line(5), &line(6), &line(7), cut]
            .map(|line| format!("{line}\n"))
            .concat(),
    )
    .unwrap();
    std::fs::write(quarantine.join("segment-0000000000000001"), b"damaged").unwrap();
    let sent_to = |collector: &str, code: i32, said: &str| {
        assert_resend_ends(folder.path(), collector, code, said);
    };
    let refusing = Collector::start(vec![Conduct::RefuseSeq(6)]);
    sent_to(
        &refusing.url,
        1,
        "2 records sent again and taken, 2 left in ",
    );
    let stored: Vec<u64> = refusing
        .records("s")
        .iter()
        .map(|record| record.seq)
        .collect();
    assert_eq!(stored, [5, 7]);
    assert_eq!(
        std::fs::read_to_string(&file).unwrap(),
        format!("{}\n{cut}\n", line(6))
    );
    // Nobody there: everything stays.
    sent_to("http://127.0.0.1:9", 1, "error: ");
    // A proxy: everything stays too.
    sent_to(
        &Collector::start(vec![Conduct::Babble]).url,
        1,
        "0 records sent again and taken, 2 left",
    );
    assert_eq!(
        std::fs::read_to_string(&file).unwrap(),
        format!("{}\n{cut}\n", line(6))
    );
    // Another one is at it.
    let other = std::fs::File::open(&quarantine).unwrap();
    flock(&other, FlockOperation::LockExclusive).unwrap();
    let told = "error: another grideye-agent resend is at work in ";
    sent_to(&Collector::storing().url, 1, told);
    assert_eq!(
        std::fs::read_to_string(&file).unwrap(),
        format!("{}\n{cut}\n", line(6))
    );
    drop(other);
    // Of a run that was killed, beside what a running agent set aside since.
    std::fs::write(quarantine.join("refused-b1.jsonl.sending"), line(9)).unwrap();
    std::fs::write(&file, line(6)).unwrap();
    sent_to(
        &Collector::storing().url,
        0,
        "2 records sent again and taken, 0 left in ",
    );
    let left = std::fs::read_dir(&quarantine)
        .unwrap()
        .map(|entry| entry.unwrap().file_name());
    assert_eq!(left.collect::<Vec<_>>(), ["segment-0000000000000001"]);
}
