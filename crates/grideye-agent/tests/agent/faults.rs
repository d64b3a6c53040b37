//! A bus fault is counted by kind, costs only the frames that passed meanwhile, and is repaired if possible.

use crate::support::*;
use amg8833::{Address as Target, FrameRate};
use amg8833_emulator::{Address, Fault, Options};
use grideye_agent::agent::Summary;
use grideye_agent::config::SensorConfig;
use grideye_agent::sampler::FROZEN_FRAMES;
use grideye_frame::{NoData, Reading};
use grideye_recording::Record;
use std::time::Duration;

const SENSORS: [SensorConfig; 1] = [SensorConfig::at(Target::High)];

/// A sensor at -4.3 % that breaks at 30 s for this long, read until 600 frames.
fn broken(fault: Fault, lasting: Duration) -> (Vec<Record>, Summary) {
    let collector = Collector::storing();
    let host = Host::late_by(&[]);
    let source = Counter::at_10_hz().never_again();
    let start = Duration::from_secs(30);
    let bus = Emulated::with_sensor(&host, 100_000, source, -43_000)
        .at(start, move |bus| {
            assert!(bus.set_fault(Address::High, fault));
        })
        .at(start + lasting, |bus| {
            assert!(bus.clear_fault(Address::High));
        });
    let summary = run(&collector, &host, &bus, &SENSORS, 600);
    (collector.records(SENSOR), summary)
}

/// `seq` has no gaps, no frame appears twice, and the order is the sensor's.
fn assert_in_order(records: &[Record]) {
    for (expected, record) in (0..).zip(records) {
        assert_eq!(record.seq, expected);
    }
    let numbers: Vec<u64> = records
        .iter()
        .filter_map(|record| record.reading.frame())
        .map(number_in_pixels)
        .collect();
    assert!(
        numbers.windows(2).all(|pair| pair[0] < pair[1]),
        "{numbers:?}"
    );
    assert_eq!(numbers.len(), 600);
    let times: Vec<u64> = records
        .iter()
        .map(|record| record.stamp.t_boot_ns)
        .collect();
    assert!(times.is_sorted());
}

/// The missing records of an outage: all within it, as many as frames passed, give or take `slack` if the phase was
/// lost.
fn assert_costs(records: &[Record], expected: usize, slack: usize, reasons: &[NoData]) {
    let missing = missing(records);
    let seqs: Vec<u64> = missing.iter().map(|(seq, _)| *seq).collect();
    assert!(
        seqs.windows(2).all(|pair| pair[0] + 1 == pair[1]),
        "{missing:?}"
    );
    assert!(
        missing.len().abs_diff(expected) <= slack,
        "{} missing, {expected} expected",
        missing.len()
    );
    assert!(
        missing.iter().all(|(_, reason)| reasons.contains(reason)),
        "{missing:?}"
    );
}

fn faults(summary: &Summary, kind: NoData) -> u64 {
    summary.sensors[SENSOR]
        .account
        .errors
        .get(kind.name())
        .copied()
        .unwrap_or(0)
}

#[test]
fn one_lost_acknowledge_costs_no_frame() {
    let (records, summary) = broken(Fault::NackAddress, 5 * MS);
    assert_in_order(&records);
    assert_eq!(missing(&records), []);
    assert_eq!(faults(&summary, NoData::Nack), 1);
    assert!(summary.is_complete());
}

#[test]
fn half_a_second_without_acknowledge_costs_only_its_own_frames() {
    let (records, summary) = broken(Fault::NackAddress, 500 * MS);
    assert_in_order(&records);
    assert_costs(&records, 5, 1, &[NoData::Nack]);
    assert!(faults(&summary, NoData::Nack) > 5);
    // The sensor continued to measure, so the count is exact: each frame has the sensor's own number.
    let offset = number(records[0].reading.frame().unwrap());
    let last = records.last().unwrap();
    assert_eq!(number(last.reading.frame().unwrap()), last.seq + offset);
}

#[test]
fn a_sensor_that_is_gone_for_20_s_is_set_up_again_when_it_is_back() {
    let (records, summary) = broken(Fault::AdapterGone, Duration::from_secs(20));
    assert_in_order(&records);
    // 191 frames by its clock, plus the time for reopening the bus and the set-up.
    assert_costs(
        &records,
        220,
        30,
        &[
            NoData::Unplugged,
            NoData::NotReady,
            NoData::WrongConfiguration,
        ],
    );
    assert!(faults(&summary, NoData::Unplugged) > 1);
    assert_eq!(faults(&summary, NoData::WrongConfiguration), 1);
}

#[test]
fn a_bus_held_low_times_out_and_the_count_goes_on() {
    let (records, summary) = broken(Fault::Hang, Duration::from_secs(5));
    assert_in_order(&records);
    assert_costs(&records, 55, 10, &[NoData::BusTimeout, NoData::NotReady]);
    assert!(faults(&summary, NoData::BusTimeout) >= 4);
}

#[test]
fn a_brown_out_is_found_by_the_settings_and_repaired() {
    let (records, summary) = broken(Fault::BrownOut, MS);
    assert_in_order(&records);
    assert!(missing(&records).len() <= 8, "{:?}", missing(&records));
    assert_eq!(faults(&summary, NoData::WrongConfiguration), 1);
}

#[test]
fn registers_stuck_high_or_all_zero_are_not_frames() {
    for (fault, reason) in [
        (Fault::StuckHigh, NoData::StuckHigh),
        (Fault::AllZero, NoData::AllZero),
        (Fault::BusError, NoData::BusError),
    ] {
        let (records, summary) = broken(fault, Duration::from_secs(1));
        assert_in_order(&records);
        let reasons = [reason, NoData::NotReady, NoData::WrongConfiguration];
        assert_costs(&records, 12, 6, &reasons);
        assert!(faults(&summary, reason) > 0, "{summary:?}");
    }
}

#[test]
fn a_sensor_that_has_stopped_is_told_from_a_still_scene_after_a_hundred_frames() {
    let (records, summary) = broken(Fault::Freeze, Duration::from_secs(30));
    for (expected, record) in (0..).zip(&records) {
        assert_eq!(record.seq, expected);
    }
    // 287 frames passed; the first hundred count as a still scene, and the reset empties the registers.
    let limit = usize::try_from(FROZEN_FRAMES).unwrap();
    assert_costs(
        &records,
        287 - limit,
        8,
        &[NoData::Frozen, NoData::NotReady, NoData::AllZero],
    );
    assert!(
        faults(&summary, NoData::Frozen) == 1 && faults(&summary, NoData::AllZero) > 1,
        "{summary:?}"
    );
    let numbers: Vec<u64> = records
        .iter()
        .filter_map(|record| record.reading.frame())
        .map(number)
        .collect();
    let stood_still = numbers.windows(2).filter(|pair| pair[0] == pair[1]).count();
    assert_eq!(stood_still, limit - 1);
}

/// The emulator's `--constant`: the interrupt flag shows that the sensor measures the same again and again.
#[test]
fn a_scene_of_one_temperature_is_no_sensor_that_has_stopped() {
    for (source, sensors) in [
        (Counter::at_10_hz(), SENSORS),
        (
            Counter::at_1_hz(),
            [SensorConfig {
                rate: FrameRate::One,
                ..SENSORS[0]
            }],
        ),
    ] {
        let collector = Collector::storing();
        let host = Host::late_by(&[]);
        let bus = Emulated::with_sensor(&host, 100_000, source.showing(|_| 5), 0);
        let summary = run(&collector, &host, &bus, &sensors, 400);
        let records = collector.records(SENSOR);
        assert_eq!((records.len(), missing(&records)), (400, vec![]));
        assert_eq!(faults(&summary, NoData::Frozen), 0, "{summary:?}");
    }
}

#[test]
fn a_sensor_that_stops_in_a_scene_of_one_temperature_is_noticed_and_believed_again() {
    let collector = Collector::storing();
    let host = Host::late_by(&[]);
    let source = Counter::at_10_hz().showing(|_| 5);
    let bus = Emulated::with_sensor(&host, 100_000, source, 0)
        .at(Duration::from_secs(30), |bus| {
            assert!(bus.set_fault(Address::High, Fault::Freeze));
        })
        .at(Duration::from_secs(60), |bus| {
            assert!(bus.clear_fault(Address::High));
        });
    run(&collector, &host, &bus, &SENSORS, 600);
    let records = collector.records(SENSOR);
    let frozen: Vec<u64> = records
        .iter()
        .filter(|record| record.reading == Reading::NoData(NoData::Frozen))
        .map(|record| record.stamp.t_boot_ns / 1_000_000_000)
        .collect();
    // A check notices it within ten seconds and has it set up; its registers are empty until it measures again.
    let is_meanwhile = |second: &u64| (31..=45).contains(second);
    assert!(
        frozen.len() > 40 && frozen.iter().all(is_meanwhile),
        "{frozen:?}"
    );
}

#[test]
fn a_sensor_that_does_not_answer_at_the_start_is_waited_for() {
    let collector = Collector::storing();
    let host = Host::late_by(&[]);
    let bus = Emulated::with_sensor(&host, 400_000, Counter::at_10_hz(), 0);
    bus.with(|bus| bus.set_fault(Address::High, Fault::NackAddress));
    let bus = bus.at(Duration::from_secs(60), |bus| {
        assert!(bus.clear_fault(Address::High));
    });
    let summary = run(&collector, &host, &bus, &SENSORS, 100);
    let records = collector.records(SENSOR);
    // The frames of a sensor that has never answered are unknown, so none is listed.
    assert_exact(&records, |n| n);
    assert_eq!((records.len(), missing(&records)), (100, vec![]));
    let nacks = faults(&summary, NoData::Nack);
    assert!((10..40).contains(&nacks), "{nacks}");
}

#[test]
fn a_broken_neighbor_costs_the_other_sensor_nothing() {
    let collector = Collector::storing();
    let host = Host::late_by(&[]);
    let sensors = [Address::Low, Address::High]
        .map(|address| (address, Counter::at_10_hz(), Options::default()));
    let bus = Emulated::new(&host, 400_000, &sensors)
        .at(Duration::from_secs(20), |bus| {
            assert!(bus.set_fault(Address::Low, Fault::NackAddress));
        })
        .at(Duration::from_secs(40), |bus| {
            assert!(bus.clear_fault(Address::Low));
        });
    run(
        &collector,
        &host,
        &bus,
        &[SensorConfig::at(Target::Low), SENSORS[0]],
        600,
    );
    let records = collector.records(SENSOR);
    assert_exact(&records, |n| n);
    assert_eq!((records.len(), missing(&records)), (600, vec![]));
    assert!(missing(&collector.records("i2c-1:0x68")).len() > 190);
}
