//! The texts of `grideye-agent check`.

use crate::support::*;
use amg8833::{Address as Target, FrameRate};
use amg8833_emulator::{Address, Fault};
use grideye_agent::bus::LinuxBus;
use grideye_agent::check::{Report, check};
use grideye_agent::clock::Clock;
use grideye_agent::config::SensorConfig;
use std::sync::Arc;

const CONFIG: SensorConfig = SensorConfig::at(Target::High);

fn report(fault: Option<Fault>, config: &SensorConfig, source: Counter) -> Report {
    let host = Host::late_by(&[]);
    let bus = Emulated::with_sensor(&host, 400_000, source, -43_000);
    if let Some(fault) = fault {
        bus.with(|bus| bus.set_fault(Address::High, fault));
    }
    let clock: Arc<dyn Clock> = host;
    check(bus.clone(), Some(bus), SENSOR, config, &clock)
}

#[test]
fn a_sensor_that_works_shows_a_frame_and_its_own_rate() {
    let report = report(None, &CONFIG, Counter::at_10_hz());
    assert!(report.ok);
    insta(&report.to_string(), include_str!("check-ok.txt"));
    // 4.3 % slow: 9.57 Hz.
    let measured = report.measured.clone().unwrap();
    assert!(
        (measured.rate_hz - 9.57).abs() <= measured.rate_error_hz && measured.rate_error_hz < 0.05,
        "{measured:?}"
    );
    assert_eq!(measured.pixels_c[0], 20.0 + 19.0 * 0.25);
}

#[test]
fn a_sensor_at_1_hz_is_checked_in_a_few_seconds() {
    let config = SensorConfig {
        rate: FrameRate::One,
        ..CONFIG
    };
    let measured = report(None, &config, Counter::at_1_hz()).measured.unwrap();
    assert_eq!((measured.frames, measured.nominal_hz), (4, 1));
    assert!(
        (measured.rate_hz - 0.957).abs() <= measured.rate_error_hz,
        "{measured:?}"
    );
}

#[test]
fn each_fault_says_what_to_do_about_it() {
    let cases: [(Fault, &str, &[&str]); 6] = [
        (
            Fault::NackAddress,
            "i2c-1:0x69: failed\nerror: the sensor at 0x69 does not answer: nack (NoAcknowledge",
            &[
                "hint: nobody answers at this address: most boards are 0x69, with AD_SELECT at GND 0x68",
                "or are SDA and SCL exchanged?",
            ],
        ),
        (
            Fault::Hang,
            "i2c-1:0x69: failed\nerror: the sensor at 0x69 does not answer: bus-timeout (Timeout)",
            &[
                "hint: SDA or SCL is held low",
                "SDA and SCL exchanged",
                "The pull-ups go to 3.3 V, never to 5 V",
            ],
        ),
        (
            Fault::BusError,
            "i2c-1:0x69: failed\nerror: the sensor at 0x69 does not answer: bus-error (Bus)",
            &[
                "hint: the transfer broke down",
                "pull-ups (2.2 to 10 kOhm, to 3.3 V and never to 5 V: power the board from pin 1",
            ],
        ),
        (
            Fault::AdapterGone,
            "i2c-1:0x69: failed\nerror: the sensor at 0x69 does not answer: unplugged (Gone)",
            &["hint: the bus adapter is gone: plug it in again, or enable I2C"],
        ),
        (
            Fault::AllZero,
            "i2c-1:0x69: failed\n",
            &["error: no frame came: all-zero\nhint: every pixel reads zero: the sensor sleeps"],
        ),
        (
            Fault::StuckHigh,
            "i2c-1:0x69: failed\n",
            &["hint: every byte reads 0xff: SDA is not connected, or the sensor has no supply"],
        ),
    ];
    for (fault, begin, hints) in cases {
        let report = report(Some(fault), &CONFIG, Counter::at_10_hz());
        let text = report.to_string();
        assert!(!report.ok && text.starts_with(begin), "{fault:?}: {text}");
        for hint in hints {
            assert!(text.contains(hint), "{fault:?}, {hint}: {text}");
        }
    }
}

#[test]
fn a_sensor_at_the_other_address_is_found_and_another_chip_is_not_taken_for_one() {
    let config = SensorConfig::at(Target::Low);
    let found = report(None, &config, Counter::at_10_hz());
    assert!(!found.ok);
    let text = found.to_string();
    assert!(
        text.contains("; one does at 0x69\nhint: say `address = 0x69`"),
        "{text}"
    );
    // All bits set: a bus without a device, or another chip.
    let other = report(Some(Fault::StuckHigh), &config, Counter::at_10_hz());
    assert!(
        other.to_string().contains("hint: nobody answers"),
        "{other}"
    );
}

#[test]
fn a_bus_that_is_not_there_says_how_to_enable_it() {
    let clock: Arc<dyn Clock> = Host::late_by(&[]);
    let report = check(
        LinuxBus::new("/nonexistent/i2c-1", [0x69]),
        None,
        SENSOR,
        &CONFIG,
        &clock,
    );
    insta(&report.to_string(), include_str!("check-no-bus.txt"));
}

/// Compares with a file next to this one; the message shows the new text, to store there if it is right.
fn insta(found: &str, expected: &str) {
    assert_eq!(found, expected, "found:\n{found}");
}
