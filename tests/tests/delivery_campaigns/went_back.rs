//! A collector whose store is replaced by an older one: what it had acknowledged comes again, or is named as lost.

use crate::agents::{config, identifiable};
use crate::collector::Collector;
use crate::{ALWAYS, OUTAGE};
use grideye_tests::emulated::recording;
use grideye_tests::patience::{wait_for, wait_or_explain};
use grideye_tests::programs::{grideye, grideye_agent, run, wait};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Frames that the sensor shows before it stands still.
const SOURCE_FRAMES: usize = 3000;

/// One boot of an agent on an emulated sensor.
struct Boot {
    emulator: Child,
    folder: PathBuf,
}

impl Boot {
    fn start(folder: &Path) -> Self {
        let _ = std::fs::remove_file(folder.join("pid"));
        let emulator = grideye()
            .args(["emulate", "--quiet", "--replay", "frames", "--recording"])
            .arg(folder.join("source.csv"))
            .args(["--", "bash", "-c"])
            .arg(r#"echo $$ >"$1/pid"; exec "$2" run --config "$1/agent.toml" 2>>"$1/log""#)
            .arg("boot")
            .arg(folder)
            .arg(grideye_agent().get_program())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        Self {
            emulator,
            folder: folder.to_owned(),
        }
    }

    fn signal(&self, name: &str) {
        let pid = || {
            let pid = std::fs::read_to_string(self.folder.join("pid")).ok()?;
            pid.ends_with('\n').then(|| pid.trim().to_owned())
        };
        let pid = wait_for("the agent", pid);
        let sent = Command::new("kill").args([name, &pid]).status().unwrap();
        assert!(sent.success());
    }

    fn stop(mut self) {
        self.signal("-TERM");
        wait(&mut self.emulator);
    }
}

impl Drop for Boot {
    fn drop(&mut self) {
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
    }
}

/// What the audit says of one boot.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Row {
    boot: String,
    read: u64,
    stored: u64,
    spooled: u64,
    by_collector: u64,
    otherwise: u64,
    is_balanced: bool,
}

fn rows(collector: &Collector) -> Vec<Row> {
    let of = |row: Value| {
        let number = |name: &str| row[name].as_u64().unwrap_or(0);
        let dropped = row["dropped"].as_object().into_iter().flatten();
        let all: u64 = dropped.filter_map(|(_, count)| count.as_u64()).sum();
        let by_collector = row["dropped"]["lost-by-collector"].as_u64().unwrap_or(0);
        Row {
            boot: row["boot"].as_str().unwrap().to_owned(),
            read: number("read"),
            stored: number("stored"),
            spooled: number("spooled"),
            by_collector,
            otherwise: all - by_collector,
            is_balanced: row["balanced"] == true,
        }
    };
    collector.audit().into_iter().map(of).collect()
}

/// Waits until the boots satisfy this.
fn wait_until(collector: &Collector, folder: &Path, is_met: impl Fn(&[Row]) -> bool) -> Vec<Row> {
    let met = || Some(rows(collector)).filter(|rows| is_met(rows));
    let log = || std::fs::read_to_string(folder.join("log")).unwrap_or_default();
    wait_or_explain(met, || format!("{:#?}\n{}", rows(collector), log()))
}

/// Waits until a boot other than these has so many frames stored; returns it.
fn wait_for_boot(collector: &Collector, folder: &Path, but: &[&str], stored: u64) -> String {
    let is_it = |row: &Row| row.stored >= stored && !but.contains(&row.boot.as_str());
    let rows = wait_until(collector, folder, |rows| rows.iter().any(is_it));
    rows.into_iter().find(is_it).unwrap().boot
}

fn of<'r>(rows: &'r [Row], boot: &str) -> &'r Row {
    rows.iter().find(|row| row.boot == boot).unwrap()
}

/// Puts an older store in place of the collector's: a plain copy, or `grideye restore`.
fn go_back(collector: &mut Collector, old: &Path, is_by_copy: bool) {
    collector.kill();
    if is_by_copy {
        std::fs::copy(old, &collector.store).unwrap();
    } else {
        let mut restore = grideye();
        restore.arg("restore").arg(old).arg("--store");
        let restored = run(restore.arg(&collector.store));
        assert_eq!(restored.code, 0, "{restored:?}");
    }
    collector.run();
}

fn set_up(mode: &str) -> (tempfile::TempDir, Collector) {
    let folder = tempfile::tempdir().unwrap();
    let _ = recording(
        folder.path(),
        "source.csv",
        (0..SOURCE_FRAMES).map(identifiable),
    );
    let collector = Collector::start(folder.path());
    let spool = folder.path().join("spool");
    let config = config(&collector.url(), &spool, mode);
    std::fs::write(folder.path().join("agent.toml"), config).unwrap();
    (folder, collector)
}

fn back_up(collector: &Collector, out: &Path) {
    let mut backup = grideye();
    backup.args(["backup", "--store"]).arg(&collector.store);
    let made = run(backup.arg(out));
    assert_eq!(made.code, 0, "{made:?}");
}

/// An agent with a log on its disk sends again what is still there, also after a second restore. Of the boot before, the
/// audit names what is gone.
#[test]
fn d_frames_that_a_restored_collector_lost_come_again_from_the_disk_or_are_named() {
    let (folder, mut collector) = set_up(ALWAYS);
    let (folder, old) = (folder.path(), folder.path().join("old.sqlite"));
    let boot = Boot::start(folder);
    let first = wait_for_boot(&collector, folder, &[], 10);
    back_up(&collector, &old);
    wait_for_boot(&collector, folder, &[], 40);
    boot.stop();
    let ended = of(&rows(&collector), &first).clone();
    assert_eq!(ended.stored, ended.read, "{ended:?}");
    let boot = Boot::start(folder);
    let second = wait_for_boot(&collector, folder, &[&first], 20);
    for is_by_copy in [true, false] {
        let before = of(&rows(&collector), &second).clone();
        go_back(&mut collector, &old, is_by_copy);
        let stored = of(&rows(&collector), &first).stored;
        assert!(stored < ended.read, "the tail is gone");
        let is_mended = |rows: &[Row]| {
            let live = rows.iter().find(|row| row.boot == second);
            let of_first = of(rows, &first);
            live.is_some_and(|live| live.is_balanced && live.stored > 20)
                && of_first.by_collector == ended.read - stored
        };
        let rows = wait_until(&collector, folder, is_mended);
        let (of_first, live) = (of(&rows, &first), of(&rows, &second));
        let sum = of_first.stored + of_first.by_collector;
        assert_eq!((of_first.read, sum), (ended.read, ended.read), "{rows:#?}");
        assert_eq!((of_first.otherwise, of_first.is_balanced), (0, true));
        // Only frames that were delivered before they were written are not on the disk.
        let lost = live.by_collector - before.by_collector;
        assert!(lost < before.stored, "{before:?}: {rows:#?}");
        assert_eq!(live.otherwise, 0, "{rows:#?}");
    }
    boot.stop();
    let live = of(&rows(&collector), &second).clone();
    let sum = live.stored + live.by_collector;
    assert_eq!((sum, live.spooled), (live.read, 0), "{live:?}");
}

/// An agent that has nothing on its disk while all goes well counts what the collector lost.
#[test]
fn e_frames_that_a_restored_collector_lost_and_no_agent_has_are_named() {
    for mode in [OUTAGE, "mode = \"ram\""] {
        let (folder, mut collector) = set_up(mode);
        let (folder, old) = (folder.path(), folder.path().join("old.sqlite"));
        let boot = Boot::start(folder);
        let name = wait_for_boot(&collector, folder, &[], 10);
        back_up(&collector, &old);
        wait_for_boot(&collector, folder, &[], 40);
        go_back(&mut collector, &old, true);
        let rows = wait_until(&collector, folder, |rows| of(rows, &name).by_collector > 0);
        assert!(of(&rows, &name).is_balanced, "{mode}: {rows:#?}");
        boot.stop();
        let row = of(&self::rows(&collector), &name).clone();
        let sum = row.stored + row.by_collector + row.otherwise;
        assert_eq!((row.read, row.spooled), (sum, 0), "{mode}: {row:?}");
        assert_eq!(row.otherwise, 0, "{mode}: {row:?}");
        let log = std::fs::read_to_string(folder.join("log")).unwrap();
        assert_eq!(log.matches("no longer has ").count(), 1, "{log}");
    }
}
