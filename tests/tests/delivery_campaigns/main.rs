//! Every frame arrives once: real programs that are killed, cut off and starved of disk, again and again.
//!
//! Each campaign draws its moments from a seed and prints it with its counts and the command that draws them again. By
//! default each kills a few times; `GRIDEYE_ALL_SEEDS=1` is the long run of 200. `grideye audit` is the judge, and beside
//! it stand the trace of the sensor's bus and the rows of the store by SQL.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails in a helper fails the test"
)]

mod agents;
mod books;
mod clocks;
mod collector;
mod delays;
mod disks;
mod proxy;
mod seeded;
mod spooled;
mod went_back;

use agents::Agents;
use books::{Books, Ends, settle};
use collector::Collector;
use grideye_tests::programs::is_left_out;
use proxy::Proxy;
use seeded::{Seeded, kills};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::Ordering;

const ALWAYS: &str = "mode = \"always\"\nsync_every_ms = 100";
const OUTAGE: &str = "mode = \"outage\"\nafter_ms = 500";

#[test]
fn a_an_agent_that_is_killed_at_any_moment_loses_no_more_than_it_says() {
    if is_left_out("GRIDEYE_WITHOUT_CAMPAIGNS", "agents that are killed") {
        return;
    }
    std::thread::scope(|scope| {
        for mode in [ALWAYS, OUTAGE] {
            scope.spawn(move || kill_agents(mode));
        }
    });
}

fn kill_agents(mode: &str) {
    let mut seeded = Seeded::of("a_an_agent");
    let folder = tempfile::tempdir().unwrap();
    let mut collector = Collector::start(folder.path());
    let spool = folder.path().join("spool");
    let mut agents = Agents::start(folder.path(), &collector.url(), &spool, mode);
    for kill in 0..kills() {
        // Every other time the collector is away, so that nothing but the spool saves a frame.
        let is_away = kill % 2 == 1;
        if is_away {
            collector.kill();
        }
        seeded.pause(300, 3000);
        agents.kill();
        if is_away {
            collector.run();
        }
    }
    seeded.pause(2000, 3000);
    let what = format!("agent killed {} times, {mode:?}", agents.killed);
    let books = end(&what, folder.path(), agents, collector);
    assert!(books.stored > u64::from(kills()), "{books}");
}

/// Lets all arrive, ends the programs, and holds the books to the guarantee.
fn end(what: &str, folder: &Path, mut agents: Agents, collector: Collector) -> Books {
    collector.wait_until_caught_up();
    let left = agents.stop();
    let audit = collector.wait_until_all_is_here_but(left);
    let csv = collector.csv();
    let store = collector.stop();
    let trace = Agents::trace(folder);
    let mut books = settle(&csv, &store, &trace, &audit, &agents.on_disk);
    if left > 0 {
        let kept = agents.spooled();
        books.lost_from_disk.retain(|record| !kept.contains(record));
    }
    // The last run ended by itself: what was read behind its last stored frame is on its disk.
    let (last, killed) = books.at_ends.split_last().unwrap();
    let ends = Ends::of(killed, agents.guarantee(), |seconds| {
        agents.delay_s(seconds)
    });
    println!("{what}: {books}; {ends}");
    assert_eq!(books.lost_from_disk, [], "{}", agents.log());
    assert_eq!((books.twice, books.lost_between), (0, 0));
    assert_eq!(last.0, left, "{books}");
    assert_eq!(ends.beyond, [], "more was in memory than stated: {ends}");
    books
}

#[test]
fn b_a_collector_that_is_killed_at_any_moment_costs_nothing() {
    if is_left_out("GRIDEYE_WITHOUT_CAMPAIGNS", "a collector that is killed") {
        return;
    }
    let mut seeded = Seeded::of("b_a_collector");
    let folder = tempfile::tempdir().unwrap();
    let mut collector = Collector::start(folder.path());
    let spool = folder.path().join("spool");
    let agents = Agents::start(folder.path(), &collector.url(), &spool, OUTAGE);
    for _ in 0..kills() {
        seeded.pause(100, 2000);
        collector.kill();
        seeded.pause(10, 1500);
        collector.run();
    }
    seeded.pause(2000, 3000);
    let what = format!("collector killed {} times", kills());
    let books = end(&what, folder.path(), agents, collector);
    let nothing = BTreeMap::new();
    assert_eq!((books.runs, &books.dropped), (1, &nothing));
    assert_eq!(books.read, books.stored + books.spooled);
    assert_eq!(books.at_ends[0].0, books.spooled);
}

#[test]
fn c_both_killed_behind_a_network_that_goes_wrong_lose_no_more_than_the_agent_says() {
    if is_left_out(
        "GRIDEYE_WITHOUT_CAMPAIGNS",
        "both killed behind a network that goes wrong",
    ) {
        return;
    }
    let mut seeded = Seeded::of("c_both");
    let folder = tempfile::tempdir().unwrap();
    let mut collector = Collector::start(folder.path());
    let proxy = Proxy::start(collector.address, seeded.below(u64::MAX));
    let spool = folder.path().join("spool");
    let mut agents = Agents::start(folder.path(), &proxy.url, &spool, ALWAYS);
    let mut collectors_killed = 0;
    for _ in 0..kills() {
        seeded.pause(500, 3000);
        let (kills_agent, kills_collector) =
            [(true, false), (false, true), (true, true)][usize::try_from(seeded.below(3)).unwrap()];
        if kills_collector {
            collector.kill();
            collectors_killed += 1;
        }
        if kills_agent {
            agents.kill();
        }
        if kills_collector {
            seeded.pause(10, 1000);
            collector.run();
        }
    }
    proxy.is_kind.store(true, Ordering::SeqCst);
    let what = format!(
        "agent killed {}, collector {collectors_killed} times, behind {}",
        agents.killed,
        proxy.said()
    );
    end(&what, folder.path(), agents, collector);
}
