//! Spools of every released layout, and of a later one.

use super::*;
use grideye_agent::spool::segment::{HEADER_BYTES, crc32c};
use grideye_agent::spool::{Disk as _, Folder};
use std::path::{Path, PathBuf};

/// Written by [`leave_a_spool`] with the program of layout 1. It stays unchanged when a later layout comes.
const LAYOUT_1: &str = "tests/spool-layout-1";

fn golden() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(LAYOUT_1)
}

/// Leaves a killed boot of which the collector has some frames, and one with saved counts.
fn leave_a_spool(disk: &ModelDisk) {
    let mut spool = reopen(disk, "b1");
    spool_group(&mut spool, "b1", 0, 0..9);
    spool_group(&mut spool, "b1", 1, 0..4);
    let first = next_batch(&mut spool, 3).unwrap().unwrap();
    spool.release(first.items, None);
    spool.checkpoint(&[]).unwrap();
    drop(spool);
    let mut spool = reopen(disk, "b2");
    spool_group(&mut spool, "b2", 0, 5..10);
    let accounts = [(stream("b2", 0), account(frames(0..10), frames(5..10)))];
    spool.checkpoint(&accounts).unwrap();
}

fn of_layout_1() -> ModelDisk {
    let disk = ModelDisk::default();
    for entry in std::fs::read_dir(golden()).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        disk.put(name, &std::fs::read(&path).unwrap());
    }
    disk
}

#[test]
fn a_spool_of_layout_1_is_delivered_record_by_record_and_continued() {
    let disk = of_layout_1();
    let mut spool = reopen(&disk, "b3");
    assert_eq!(spool.take_messages(), Vec::<String>::new());
    let ended = |spool: &Spool, boot, sensor: usize| {
        let account = &spool.ended_accounts(boot).unwrap()[SENSORS[sensor]];
        (account.read, account.spooled)
    };
    assert_eq!(ended(&spool, "b1", 0), (frames(0..9), frames(3..9)));
    assert_eq!(ended(&spool, "b1", 1), (frames(0..4), frames(0..4)));
    assert_eq!(ended(&spool, "b2", 0), (frames(0..10), frames(5..10)));
    spool_group(&mut spool, "b3", 1, 0..20);
    let delivered = drain(&mut spool, 7);
    for (boot, sensor, seqs) in [
        ("b1", 0, 3..9),
        ("b1", 1, 0..4),
        ("b2", 0, 5..10),
        ("b3", 1, 0..20),
    ] {
        assert_eq!(of(&delivered, boot, sensor), Vec::from_iter(seqs), "{boot}");
    }
    assert_eq!(delivered.len(), 6 + 4 + 5 + 20);
    assert_eq!(disk.names(), ["state"]);
}

/// If this fails, the layout changed: give it the next number, keep a spool of it next to this one, and upgrade a copy
/// of this one.
#[test]
fn what_is_written_today_is_layout_1() {
    let (today, kept) = (ModelDisk::default(), of_layout_1());
    leave_a_spool(&today);
    assert_eq!(today.names(), kept.names());
    for name in today.names() {
        assert_eq!(today.bytes(&name), kept.bytes(&name), "{name}");
    }
}

/// The same file as a later version might write it.
fn later(name: &str, bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    if name == "state" {
        let text = String::from_utf8(bytes).unwrap();
        return text.replacen("state 1 ", "state 2 ", 1).into_bytes();
    }
    bytes[8] = 2;
    let crc = crc32c(&[&bytes[..HEADER_BYTES - 4]]).to_le_bytes();
    bytes[HEADER_BYTES - 4..HEADER_BYTES].copy_from_slice(&crc);
    bytes
}

#[test]
fn a_spool_of_a_later_layout_is_refused_by_name_and_left_as_it_is() {
    for name in of_layout_1().names() {
        let disk = of_layout_1();
        disk.put(&name, &later(&name, &disk.bytes(&name)));
        let before: Vec<_> = disk.names().iter().map(|name| disk.bytes(name)).collect();
        let sensors = SENSORS.map(String::from);
        let error =
            Spool::open(Box::new(disk.clone()), limits(), "pi", "b3", &sensors).unwrap_err();
        let expected =
            format!("{name} has layout 2, but this program knows layouts up to 1\nhint: ");
        assert!(error.to_string().starts_with(&expected), "{error}");
        assert_eq!(disk.names(), of_layout_1().names());
        let after: Vec<_> = disk.names().iter().map(|name| disk.bytes(name)).collect();
        assert_eq!(before, after);
    }
}

/// As `grideye-agent run` finds it in its folder.
#[test]
fn an_agent_does_not_start_on_a_spool_of_a_later_layout() {
    let folder = tempfile::tempdir().unwrap();
    let spool = folder.path().join("spool");
    let mut disk = Folder::open(&spool).unwrap();
    let state = later("state", &of_layout_1().bytes("state"));
    disk.write("state", &state).unwrap();
    drop(disk);
    let config = folder.path().join("agent.toml");
    let text = format!(
        "device = \"pi\"\ncollector = \"http://127.0.0.1:9\"\n[spool]\nfolder = {:?}\n[[bus]]\npath = \"/nonexistent/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n",
        spool.display().to_string()
    );
    std::fs::write(&config, text).unwrap();
    let ended = std::process::Command::new(env!("CARGO_BIN_EXE_grideye-agent"))
        .args(["run", "--config", config.to_str().unwrap()])
        .output()
        .unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(1), "{said}");
    assert!(
        said.contains("/state has layout 2, but this program knows"),
        "{said}"
    );
    assert_eq!(std::fs::read(spool.join("state")).unwrap(), state);
}
