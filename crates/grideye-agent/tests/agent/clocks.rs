//! A wall clock that is unset, set, and set wrong stamps frames but decides nothing.

use crate::patience::{WAIT_MAX, wait_for};
use crate::support::*;
use amg8833::Address as Target;
use grideye_agent::agent::{Agent, AnyBus, Start};
use grideye_agent::clock::{Clock, SystemClock};
use grideye_agent::config::{BusConfig, Config, SensorConfig, SpoolConfig, SpoolMode};
use grideye_agent::log::Log;
use grideye_recording::{ClockState, Stamp};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// The host's clock with a wall clock that jumps.
struct Jumping(Arc<Host>);

/// Second of each jump, then the wall clock's offset to the boot clock in hours, and its state.
const JUMPS: [(u64, i64, ClockState); 5] = [
    (0, -480_000, ClockState::Unsynced),
    (10, 0, ClockState::Synced),
    (20, 5, ClockState::Synced),
    (30, -7, ClockState::Synced),
    (40, 0, ClockState::Synced),
];

impl Clock for Jumping {
    fn boot(&self) -> Duration {
        self.0.boot()
    }

    fn utc(&self) -> (i64, ClockState) {
        let (utc_ns, _) = self.0.utc();
        let boot_s = self.0.boot().as_secs();
        let (_, hours, state) = *JUMPS
            .iter()
            .rev()
            .find(|(from, ..)| *from <= boot_s)
            .unwrap();
        (utc_ns + hours * 3_600_000_000_000, state)
    }

    fn sleep_until(&self, boot: Duration) {
        self.0.sleep_until(boot);
    }
}

#[test]
fn a_clock_that_is_unset_and_then_stepped_by_hours_both_ways_loses_doubles_and_disorders_nothing() {
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
        assert_eq!(count(ClockState::Stepped), 4);
        assert!(count(ClockState::Unsynced) > 50);
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

/// Runs an agent through all jumps, and waits for its spooled frames.
fn deliver_500(collector: &Collector, mode: SpoolMode, folder: PathBuf) {
    let host = Host::late_by(&[]);
    let bus = Emulated::with_sensor(&host, 400_000, Counter::at_10_hz(), 0);
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
        frames_limit: Some(500),
        ..Start::new(config, "host")
    };
    let bus_config = BusConfig {
        path: "/dev/i2c-1".into(),
        sensors: vec![SensorConfig::at(Target::High)],
    };
    let clock = Arc::new(Jumping(Arc::clone(&host)));
    let buses = vec![(bus_config, AnyBus::new(bus))];
    let agent = Agent::start(start, buses, clock, Log::silent()).unwrap();
    assert!(agent.wait_finished(WAIT_MAX));
    // Spooled frames come back without help.
    wait_for("all frames", || {
        (collector.records(SENSOR).len() >= 500).then_some(())
    });
    let summary = agent.stop(WAIT_MAX);
    assert!(summary.is_complete(), "{mode:?}: {summary}");
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
