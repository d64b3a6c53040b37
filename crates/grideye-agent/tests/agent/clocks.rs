//! A wall clock that is unset, set, and set wrong stamps frames but decides nothing.

use crate::patience::{WAIT_MAX, wait_for};
use crate::support::*;
use amg8833::Address as Target;
use grideye_agent::agent::{Agent, AnyBus, Start, Summary};
use grideye_agent::clock::{Clock, SystemClock};
use grideye_agent::config::{BusConfig, Config, SensorConfig, SpoolConfig, SpoolMode};
use grideye_agent::log::Log;
use grideye_recording::{ClockState, Stamp};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

const HOUR_NS: i64 = 3_600_000_000_000;

/// The host's clock with a wall clock that jumps.
struct Jumping(Arc<Host>);

/// Second of each jump, then the wall clock's offset to the boot clock in hours, and its state. An hour is what a clock moves
/// that keeps local time, when summer begins and ends.
const JUMPS: [(u64, i64, ClockState); 9] = [
    (0, -480_000, ClockState::Unsynced),
    (10, 0, ClockState::Synced),
    (15, 1, ClockState::Synced),
    (20, 0, ClockState::Synced),
    (25, 5, ClockState::Synced),
    (30, -7, ClockState::Synced),
    (35, 24 * 40, ClockState::Synced),
    (40, -24 * 40, ClockState::Synced),
    (45, 0, ClockState::Synced),
];

fn jump_at(boot_s: u64) -> (u64, i64, ClockState) {
    let mut jumps = JUMPS.iter().rev();
    *jumps.find(|(from, ..)| *from <= boot_s).unwrap()
}

impl Clock for Jumping {
    fn boot(&self) -> Duration {
        self.0.boot()
    }

    fn utc(&self) -> (i64, ClockState) {
        let (utc_ns, _) = self.0.utc();
        let (_, hours, state) = jump_at(self.0.boot().as_secs());
        (utc_ns + hours * HOUR_NS, state)
    }

    fn sleep_until(&self, boot: Duration) {
        self.0.sleep_until(boot);
    }
}

#[test]
fn a_clock_that_is_unset_and_then_stepped_by_hours_and_days_both_ways_loses_doubles_and_disorders_nothing()
 {
    for mode in [
        SpoolMode::Outage {
            after: Duration::from_millis(200),
        },
        SpoolMode::Always {
            sync_every: Duration::from_millis(50),
        },
    ] {
        let folder = tempfile::tempdir().unwrap();
        let script = [
            vec![Conduct::Status(503); 3],
            vec![Conduct::StoreAndHangUp, Conduct::Store],
        ]
        .concat();
        let collector = Collector::start(script);
        deliver_500(&collector, mode, folder.path().join("spool"));
        let records = collector.records(SENSOR);
        assert_eq!(records.len(), 500, "{mode:?}");
        assert_exact(&records, |n| n);
        let count = |state| {
            let of_state = records.iter().filter(|record| record.stamp.clock == state);
            of_state.count()
        };
        println!(
            "{mode:?}: 500 of 500 frames, in order, none twice; {} stamped as stepped, {} as unsynced",
            count(ClockState::Stepped),
            count(ClockState::Unsynced)
        );
        assert_eq!(count(ClockState::Stepped), JUMPS.len() - 1);
        assert!(count(ClockState::Unsynced) > 50);
        // Each stamp is the wall clock's own at that time, but for the record on either side of a jump.
        for Stamp {
            t_boot_ns,
            t_utc_ns,
            ..
        } in records.iter().map(|record| record.stamp)
        {
            let is_close = |jump: &(u64, i64, ClockState)| {
                t_boot_ns.abs_diff(jump.0 * 1_000_000_000) < 200_000_000
            };
            let (_, hours, _) = jump_at(t_boot_ns / 1_000_000_000);
            let true_ns = UTC_AT_BOOT_NS + i64::try_from(t_boot_ns).unwrap() + hours * HOUR_NS;
            assert!(
                t_utc_ns == true_ns || JUMPS.iter().any(is_close),
                "{t_boot_ns}"
            );
        }
        let pairs = || {
            records
                .windows(2)
                .map(|pair| (pair[0].stamp, pair[1].stamp))
        };
        assert!(pairs().all(|(before, after)| before.t_boot_ns < after.t_boot_ns));
        let went_back = |(before, after): (Stamp, Stamp)| before.t_utc_ns > after.t_utc_ns;
        assert!(pairs().any(went_back));
    }
}

/// The host's own clock, which this suspends once: it sleeps, and so does nothing else, until so much later.
struct Suspended {
    host: Arc<Host>,
    at: Duration,
    lasts: Duration,
    is_over: AtomicBool,
}

impl Clock for Suspended {
    fn boot(&self) -> Duration {
        self.host.boot()
    }

    fn utc(&self) -> (i64, ClockState) {
        self.host.utc()
    }

    fn sleep_until(&self, boot: Duration) {
        self.host.sleep_until(boot);
        if self.host.boot() >= self.at && !self.is_over.swap(true, Ordering::SeqCst) {
            self.host.sleep_until(self.host.boot() + self.lasts);
        }
    }
}

#[test]
fn a_suspended_host_goes_on_where_the_sensor_is_and_counts_what_passed_meanwhile() {
    for lasts in [Duration::from_secs(30), Duration::from_secs(4 * 3600)] {
        let folder = tempfile::tempdir().unwrap();
        let collector = Collector::start(vec![Conduct::Store]);
        let host = Host::late_by(&[]);
        let clock = Arc::new(Suspended {
            host: Arc::clone(&host),
            at: Duration::from_secs(20),
            lasts,
            is_over: AtomicBool::new(false),
        });
        let mode = SpoolMode::Always {
            sync_every: Duration::from_millis(50),
        };
        deliver(
            &collector,
            (mode, folder.path().join("spool")),
            (&host, clock),
            400,
        );
        let records = collector.records(SENSOR);
        let pairs = || records.windows(2).map(|pair| (&pair[0], &pair[1]));
        assert!(pairs().all(|(before, after)| before.seq < after.seq));
        assert!(pairs().all(|(before, after)| before.stamp.t_boot_ns <= after.stamp.t_boot_ns));
        assert!(
            records
                .iter()
                .all(|record| record.stamp.clock == ClockState::Synced)
        );
        let utc = |stamp: Stamp| UTC_AT_BOOT_NS + i64::try_from(stamp.t_boot_ns).unwrap();
        assert!(
            records
                .iter()
                .all(|record| record.stamp.t_utc_ns == utc(record.stamp))
        );
        let frames: Vec<_> = records
            .iter()
            .filter_map(|record| Some((record.seq, number(record.reading.frame()?))))
            .collect();
        assert_eq!(frames.len(), 400);
        assert!(
            frames.is_sorted_by(|(_, before), (_, after)| before < after),
            "none twice"
        );
        let passed = frames[399].1 - frames[0].1;
        let counted = frames[399].0 - frames[0].0;
        println!(
            "{lasts:?}: {passed} frames passed, {counted} were counted, {} rows",
            records.len()
        );
        assert!(passed >= 399 + 10 * lasts.as_secs(), "{passed}");
        // The sensor's clock is known to a thousandth by then.
        assert!(
            passed.abs_diff(counted) <= 1 + passed / 1_000,
            "{passed} {counted}"
        );
    }
}

/// Runs an agent through all jumps, and waits for its spooled frames.
fn deliver_500(collector: &Collector, mode: SpoolMode, folder: PathBuf) {
    let host = Host::late_by(&[]);
    let clock = Arc::new(Jumping(Arc::clone(&host)));
    let summary = deliver(collector, (mode, folder), (&host, clock), 500);
    assert!(summary.is_complete(), "{mode:?}: {summary}");
}

fn deliver(
    collector: &Collector,
    (mode, folder): (SpoolMode, PathBuf),
    (host, clock): (&Arc<Host>, Arc<dyn Clock>),
    frames: u64,
) -> Summary {
    let bus = Emulated::with_sensor(host, 400_000, Counter::at_10_hz(), 0);
    let config = Config {
        spool: SpoolConfig {
            mode,
            folder: Some(folder),
            bytes_max: 1 << 30,
            free_bytes_min: 0,
            backlog_per_s: 100_000,
        },
        ..config(&collector.url)
    };
    let start = Start {
        frames_limit: Some(frames),
        ..Start::new(config, "host")
    };
    let bus_config = BusConfig {
        path: "/dev/i2c-1".into(),
        sensors: vec![SensorConfig::at(Target::High)],
    };
    let buses = vec![(bus_config, AnyBus::new(bus))];
    let agent = Agent::start(start, buses, clock, Log::silent()).unwrap();
    assert!(agent.wait_finished(WAIT_MAX));
    // Spooled frames come back without help.
    wait_for("all frames", || {
        let records = collector.records(SENSOR);
        let arrived = records
            .iter()
            .filter(|record| record.reading.frame().is_some());
        (arrived.count() >= usize::try_from(frames).unwrap()).then_some(())
    });
    agent.stop(WAIT_MAX)
}

#[test]
fn a_clock_that_the_time_service_has_not_set_yet_is_unsynced_and_without_one_a_plausible_year_must_do()
 {
    let run = tempfile::tempdir().unwrap();
    let state = || SystemClock::beside(run.path().join("timesync")).utc().1;
    assert_eq!(state(), ClockState::Synced);
    std::fs::create_dir(run.path().join("timesync")).unwrap();
    assert_eq!(state(), ClockState::Unsynced);
    std::fs::write(run.path().join("timesync/synchronized"), "").unwrap();
    assert_eq!(state(), ClockState::Synced);
}

#[test]
fn the_system_clock_runs_forward_and_sleeps_until_the_moment_named() {
    let clock = SystemClock::default();
    let until = clock.boot() + Duration::from_millis(3);
    clock.sleep_until(until);
    assert!(clock.boot() >= until);
    clock.sleep_until(Duration::ZERO);
    assert!(clock.utc().0 > 0);
}
