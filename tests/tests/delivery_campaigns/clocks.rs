//! The collector's wall clock: unset, set, and stepped by hours both ways. The agent's, which asks the kernel where no
//! preloaded library can answer, is moved in its own tests.

use crate::agents::Agents;
use crate::collector::Collector;
use crate::seeded::Seeded;
use crate::{OUTAGE, end};
use grideye_tests::programs::is_left_out;
use rusqlite::{Connection, OpenFlags};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Offsets to the true time, as libfaketime reads them: before 1980, right, ahead, behind, right.
const OFFSETS: [&str; 5] = ["-20000d", "+0", "+5h", "-7h", "+0"];

#[test]
fn f_a_collector_whose_clock_is_unset_and_stepped_by_hours_both_ways_loses_and_disorders_nothing() {
    if is_left_out(
        "GRIDEYE_WITHOUT_FAKETIME",
        "a collector whose wall clock steps",
    ) {
        return;
    }
    let mut seeded = Seeded::of("f_a_collector");
    let folder = tempfile::tempdir().unwrap();
    let offset = folder.path().join("offset");
    set(&offset, OFFSETS[0]);
    let environment = vec![
        ("LD_PRELOAD", libfaketime()),
        ("FAKETIME_TIMESTAMP_FILE", offset.clone()),
        ("FAKETIME_NO_CACHE", "1".into()),
        ("FAKETIME_DONT_FAKE_MONOTONIC", "1".into()),
    ];
    let mut collector = Collector::start_in(folder.path(), environment);
    let spool = folder.path().join("spool");
    let agents = Agents::start(folder.path(), &collector.url(), &spool, OUTAGE);
    for (step, to) in OFFSETS.iter().enumerate() {
        set(&offset, to);
        seeded.pause(1000, 2500);
        // And once it comes back in another time than it went.
        if step == 2 {
            collector.kill();
            set(&offset, "-7h");
            collector.run();
        }
    }
    collector.wait_until_caught_up();
    let store = collector.store.clone();
    let books = end(
        &format!("the collector's clock at {OFFSETS:?}"),
        folder.path(),
        agents,
        collector,
    );
    assert_eq!((books.read, books.dropped), (books.stored, BTreeMap::new()));
    let (steps_back, hours) = arrivals(&store);
    println!("the times of arrival step back {steps_back} times, and span {hours:.0} h");
    assert!(steps_back >= 1 && hours > 24.0 * 19_000.0);
}

fn set(offset: &Path, to: &str) {
    let new = offset.with_extension("new");
    std::fs::write(&new, format!("{to}\n")).unwrap();
    std::fs::rename(new, offset).unwrap();
}

fn libfaketime() -> PathBuf {
    let folders = std::fs::read_dir("/usr/lib").unwrap().flatten();
    folders
        .map(|folder| folder.path().join("faketime/libfaketime.so.1"))
        .find(|library| library.exists())
        .unwrap_or_else(|| panic!("no libfaketime: install it, or set GRIDEYE_WITHOUT_FAKETIME"))
}

/// How often a later chunk arrived at an earlier time, and the hours from the earliest to the latest.
fn arrivals(store: &Path) -> (usize, f64) {
    let open = Connection::open_with_flags(store, OpenFlags::SQLITE_OPEN_READ_ONLY);
    let connection = open.unwrap();
    let mut statement = connection
        .prepare("SELECT rows FROM chunks WHERE NOT is_sealed ORDER BY stream_id, first_seq")
        .unwrap();
    let chunks = statement.query_map([], |row| row.get::<_, Vec<u8>>(0));
    // A plain chunk begins with the time of arrival of its first row.
    let first = |rows: Vec<u8>| i64::from_le_bytes(*rows.first_chunk().unwrap());
    let times = chunks.unwrap().map(|rows| hours(first(rows.unwrap())));
    let times: Vec<f64> = times.collect();
    let back = times.windows(2).filter(|pair| pair[1] < pair[0]).count();
    let latest = times.iter().copied().fold(f64::MIN, f64::max);
    let earliest = times.iter().copied().fold(f64::MAX, f64::min);
    (back, latest - earliest)
}

#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "hours of some decades"
)]
fn hours(ns: i64) -> f64 {
    ns as f64 / 3.6e12
}
