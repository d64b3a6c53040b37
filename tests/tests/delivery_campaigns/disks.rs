//! Disks: full, failing, read-only, and in use by another agent. Reads that fail and power that is lost in the middle of a
//! write are tried on a model of a disk, in `grideye-agent`'s own tests.

use crate::agents::{Agents, config};
use crate::collector::Collector;
use crate::{OUTAGE, end, spooled};
use grideye_tests::mounted::Mounted;
use grideye_tests::patience::{wait_for, wait_or_explain};
use grideye_tests::programs::{grideye_agent, is_left_out, run, terminate, wait};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

#[test]
fn d_a_full_disk_costs_nothing_while_there_is_memory() {
    if is_left_out("GRIDEYE_WITHOUT_MOUNTS", "a spool on a full disk") {
        return;
    }
    for comes_back in [true, false] {
        let folder = tempfile::tempdir().unwrap();
        let disk = Mounted::tmpfs(folder.path().join("disk"), 1);
        let (mut collector, agents) = write_to(&disk, folder.path());
        disk.fill();
        agents.wait_for_log("the spool cannot be written: ");
        std::thread::sleep(Duration::from_secs(2));
        if comes_back {
            disk.empty();
            agents.wait_for_log("the spool takes frames again");
        }
        collector.run();
        collector.wait_until_caught_up();
        if !comes_back {
            disk.empty();
        }
        let back = if comes_back { "room again" } else { "no room" };
        let what = format!("disk full, {back} before the collector is back");
        end_whole(&what, "spool-disk-full", folder.path(), agents, collector);
    }
}

/// A card at its end: what was written does not reach it, which its sync says, and then the system makes it read-only. It
/// is a real ext4 on a device whose blocks nothing stands behind.
#[test]
fn d_a_disk_whose_syncs_fail_and_that_turns_read_only_costs_nothing_while_there_is_memory() {
    if is_left_out("GRIDEYE_WITHOUT_MOUNTS", "a spool on a disk that fails") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let behind = Mounted::tmpfs(folder.path().join("behind"), 8);
    let disk = Mounted::ext4(&behind, folder.path().join("disk"));
    let (mut collector, agents) = write_to(&disk, folder.path());
    behind.fill();
    agents.wait_for_log("Read-only file system");
    std::thread::sleep(Duration::from_secs(2));
    collector.run();
    let what = "disk whose syncs fail and that turns read-only";
    end_whole(what, "spool-read-only", folder.path(), agents, collector);
}

/// An agent whose collector is away, once something is in its spool on this disk: before, it has nothing to lose there.
fn write_to(disk: &Mounted, folder: &Path) -> (Collector, Agents) {
    let spool = disk.path().join("spool");
    std::fs::create_dir(&spool).unwrap();
    let mut collector = Collector::start(folder);
    collector.kill();
    let agents = Agents::start(folder, &collector.url(), &spool, OUTAGE);
    let has_frames = || (!spooled::records(&spool).is_empty()).then_some(());
    wait_or_explain(has_frames, || {
        format!("a frame in the spool: {}", agents.log())
    });
    (collector, agents)
}

/// Everything arrives, and the fault can be seen at the collector.
fn end_whole(what: &str, kind: &str, folder: &Path, agents: Agents, collector: Collector) {
    let errors = collector.wait_until_caught_up()[0]["errors"].clone();
    assert!(
        errors[kind].as_u64().is_some_and(|count| count > 0),
        "{errors}"
    );
    let books = end(what, folder, agents, collector);
    let whole = books.stored + books.spooled;
    assert_eq!((books.read, books.dropped), (whole, BTreeMap::new()));
    assert_eq!(books.at_ends.len(), 1);
    assert_eq!(books.at_ends[0].0, books.spooled);
}

#[test]
fn d_a_second_agent_on_the_same_spool_is_refused_and_named() {
    if is_left_out("GRIDEYE_WITHOUT_CAMPAIGNS", "a second agent on a spool") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let spool = folder.path().join("spool");
    let text = config("http://127.0.0.1:9", &spool, "");
    let text = text.replace("/dev/i2c-1", "/nonexistent/i2c-1");
    let path = folder.path().join("agent.toml");
    std::fs::write(&path, text).unwrap();
    let mut first = grideye_agent();
    first.args(["run", "--config"]).arg(&path);
    first.stdout(Stdio::null()).stderr(Stdio::null());
    let mut first = first.spawn().unwrap();
    wait_for("the first agent", || {
        spool.join("state").exists().then_some(())
    });
    let second = run(grideye_agent().args(["run", "--config"]).arg(&path));
    assert_eq!(second.code, 1, "{second:?}");
    assert!(
        second
            .stderr
            .contains("another agent uses this spool\nhint: "),
        "{second:?}"
    );
    terminate(&first);
    wait(&mut first);
}
