//! Every frame of an emulated sensor reaches the collector exactly once, whatever the clocks and the host do.

use crate::support::*;
use crate::table::{self, Case, Tally, Way};
use amg8833::{Address as Target, FrameRate};
use amg8833_emulator::{Address, Drift, Options};
use grideye_agent::config::SensorConfig;
use grideye_frame::NoData;
use std::time::Duration;

const AT_10_HZ: SensorConfig = SensorConfig::at(Target::High);
const AT_1_HZ: SensorConfig = SensorConfig {
    rate: FrameRate::One,
    ..AT_10_HZ
};

/// Delays of a busy host, 0 to 40 ms, without a pattern that a sensor's clock could match.
fn delays() -> Vec<Duration> {
    (0..997_u64)
        .map(|turn| Duration::from_micros(turn * turn * 7_919 % 40_000))
        .collect()
}

fn assert_whole(
    source: Counter,
    config: SensorConfig,
    scl_hz: u32,
    ppm: i32,
    delays: &[Duration],
    frames: u64,
) {
    let collector = Collector::storing();
    let host = Host::late_by(delays);
    let bus = Emulated::with_sensor(&host, scl_hz, source, ppm);
    let summary = run(&collector, &host, &bus, &[config], frames);
    let records = collector.records(SENSOR);
    assert_exact(&records, |n| n);
    assert_eq!(missing(&records), [], "{ppm} ppm, {scl_hz} Hz");
    assert_eq!(records.len(), usize::try_from(frames).unwrap());
    assert!(summary.is_complete(), "{summary}");
    assert_eq!(summary.sensors[SENSOR].acknowledged, frames);
    assert_eq!(
        summary.sensors[SENSOR].account.errors.len(),
        0,
        "{summary:?}"
    );
}

#[test]
fn twenty_minutes_at_10_hz_on_clocks_from_minus_to_plus_six_per_cent() {
    for ppm in [-60_000, -43_000, 0, 60_000] {
        for scl_hz in [100_000, 400_000] {
            assert_whole(Counter::at_10_hz(), AT_10_HZ, scl_hz, ppm, &[], 1_500);
        }
    }
}

#[test]
fn a_host_that_wakes_up_to_40_ms_late_loses_nothing() {
    for ppm in [-60_000, 0, 60_000] {
        assert_whole(
            Counter::at_10_hz(),
            AT_10_HZ,
            100_000,
            ppm,
            &delays(),
            3_000,
        );
    }
}

#[test]
fn one_frame_a_second_is_a_mean_of_ten_and_arrives_once() {
    for (ppm, delays) in [(-60_000, vec![]), (60_000, delays())] {
        assert_whole(Counter::at_1_hz(), AT_1_HZ, 100_000, ppm, &delays, 300);
    }
}

#[test]
fn a_clock_that_drifts_is_followed() {
    let collector = Collector::storing();
    let host = Host::late_by(&[]);
    // From -6 % to +6 % within 20 minutes: 100 ppm per second.
    let options = Options {
        clock_error_ppm: -60_000,
        clock_drift: Drift::PpmPerHour(360_000),
        ..Options::default()
    };
    let sensors = [(Address::High, Counter::at_10_hz(), options)];
    let bus = Emulated::new(&host, 100_000, &sensors);
    run(&collector, &host, &bus, &[AT_10_HZ], 12_000);
    let records = collector.records(SENSOR);
    assert_exact(&records, |n| n);
    assert_eq!((records.len(), missing(&records)), (12_000, vec![]));
}

#[test]
fn equal_frames_of_a_still_scene_are_counted_and_none_is_doubled() {
    let content: fn(u64) -> u64 = |n| if n < 64 { n } else { n / 4 + 48 };
    for delays in [vec![], delays()] {
        let collector = Collector::storing();
        let host = Host::late_by(&delays);
        let source = Counter::at_10_hz().showing(content);
        let bus = Emulated::with_sensor(&host, 100_000, source, -43_000);
        run(&collector, &host, &bus, &[AT_10_HZ], 1_000);
        let records = collector.records(SENSOR);
        assert_exact(&records, content);
        assert_eq!((records.len(), missing(&records)), (1_000, vec![]));
    }
}

#[test]
fn a_host_that_stalls_for_longer_than_a_period_owes_a_row_for_each_frame() {
    let collector = Collector::storing();
    // One sleep in forty lasts 0.15 to 2.1 s longer.
    let stall = |turn: u64| {
        Duration::from_millis(if turn % 40 == 39 {
            150 + turn * 37 % 1_950
        } else {
            0
        })
    };
    let host = Host::late_by(&(0..4_000).map(stall).collect::<Vec<_>>());
    let bus = Emulated::with_sensor(&host, 100_000, Counter::at_10_hz(), -43_000);
    let summary = run(&collector, &host, &bus, &[AT_10_HZ], 1_500);
    let records = collector.records(SENSOR);
    assert_exact_by(&records, |n| n, number_in_pixels);
    let missing = missing(&records);
    assert!(missing.len() > 100, "{}", missing.len());
    assert!(
        missing
            .iter()
            .all(|(_, reason)| *reason == NoData::HostStalled)
    );
    let account = &summary.sensors[SENSOR].account;
    assert_eq!(
        (account.read, account.missing),
        (1_500, u64::try_from(missing.len()).unwrap())
    );
    assert!(!summary.is_complete());
    // The sensor itself counts its frames.
    let made = bus.with(|bus| bus.device(Address::High).unwrap().frames());
    assert_eq!(u64::try_from(records.len()).unwrap(), made);
}

#[test]
fn two_sensors_on_one_slow_bus_do_not_cost_each_other_a_frame() {
    let collector = Collector::storing();
    let host = Host::late_by(&[]);
    let options = |clock_error_ppm| Options {
        clock_error_ppm,
        ..Options::default()
    };
    let sensors = [
        (Address::Low, Counter::at_10_hz(), options(-43_000)),
        (Address::High, Counter::at_10_hz(), options(21_000)),
    ];
    let bus = Emulated::new(&host, 100_000, &sensors);
    let configs = [SensorConfig::at(Target::Low), AT_10_HZ];
    run(&collector, &host, &bus, &configs, 1_500);
    for sensor in ["i2c-1:0x68", SENSOR] {
        let records = collector.records(sensor);
        assert_exact(&records, |n| n);
        assert_eq!(
            (records.len(), missing(&records)),
            (1_500, vec![]),
            "{sensor}"
        );
    }
}

#[test]
fn a_frame_costs_little_more_than_the_136_bytes_it_takes() {
    let collector = Collector::storing();
    let host = Host::late_by(&[]);
    let bus = Emulated::with_sensor(&host, 100_000, Counter::at_10_hz(), -43_000);
    run(&collector, &host, &bus, &[AT_10_HZ], 3_000);
    let bytes = bus.with(|bus| bus.traffic().bytes);
    // Probes of the lower bound, occasional halving, and the settings every 5 s: less than a quarter more.
    assert!(
        bytes < 3_000 * 136 * 5 / 4,
        "{} bytes a frame",
        bytes / 3_000
    );
}

/// The table of `cargo bench -p grideye-agent --bench acquisition`, over minutes instead of a day.
#[test]
fn where_polls_tear_double_and_lose_frames_the_agent_does_neither() {
    for (rate, minutes) in [(FrameRate::Ten, 10), (FrameRate::One, 60)] {
        for scl_hz in [100_000, 400_000] {
            let tallies = |way| {
                let clocks = [(-60_000, 0), (-43_000, 0), (60_000, 0), (-60_000, 120_000)];
                let of = |(error_ppm, drift_ppm_per_hour)| {
                    let case = Case {
                        rate,
                        scl_hz,
                        error_ppm,
                        drift_ppm_per_hour,
                        span: Duration::from_secs(60) * minutes,
                        late_max: 40 * MS,
                    };
                    let tally = table::run(&case, way);
                    println!("{}", table::row(&case, way, std::slice::from_ref(&tally)));
                    tally
                };
                clocks.map(of)
            };
            println!("{}", table::HEADING);
            for tally in tallies(Way::Agent) {
                let all_whole = Tally {
                    made: tally.made,
                    rows: tally.made,
                    whole: tally.made,
                    ..Tally::default()
                };
                assert_eq!(tally, all_whole, "every frame once, nothing else");
                assert!(tally.made > 550 * u64::from(minutes) * u64::from(rate.fps()) / 10);
            }
            let is_torn = |tally: &Tally| tally.torn > 0;
            let is_wrong = |tally: &Tally| tally.doubled + tally.missed_unknown > 0;
            assert!(tallies(Way::Singles).iter().all(is_torn));
            assert!(tallies(Way::Blocks).iter().all(is_torn));
            let burst = tallies(Way::Burst);
            assert!(!burst.iter().any(is_torn), "one transaction is whole");
            assert!(burst.iter().all(is_wrong));
        }
    }
}
