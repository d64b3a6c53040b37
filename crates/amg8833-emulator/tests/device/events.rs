//! The INT pin as an event: its next possible change, its past changes, and waiting for them.

use crate::support::*;
use amg8833_emulator::{
    Address, Bus, Clock, Device, EDGES_MAX, Edge, InterruptOutput, InterruptPin, ManualClock,
    Options, PinEdge, SharedBus, ZeroLevels,
};
use core::time::Duration;
use embedded_hal::digital::InputPin;
use embedded_hal::i2c::I2c;
use grideye_frame::Frame;
use std::cell::RefCell;

/// Trips at 30.25 degrees and above, pin enabled, no hysteresis.
const ALARM: [[u8; 2]; 3] = [[0x08, 0x78], [0x0A, 0x00], [0x03, 0x03]];

/// A warm person is present from second 2 to 3, and from 5 on.
fn visits(t: Duration) -> Frame {
    let second = t.as_secs();
    uniform(if second == 2 || second >= 5 {
        31.0
    } else {
        20.0
    })
}

fn alarmed() -> Rig {
    let mut rig = Rig::new(visits);
    for pair in ALARM {
        rig.write(&pair);
    }
    rig
}

fn edges(device: &mut Device<Source>) -> Vec<(u128, Edge)> {
    std::iter::from_fn(|| device.take_edge())
        .map(|PinEdge { at, edge }| (at.as_millis(), edge))
        .collect()
}

#[test]
fn no_change_is_missed_however_late_somebody_looks() {
    let mut rig = alarmed();
    rig.set(10_000);
    rig.frames();
    let expected = [
        (2_000, Edge::Falling),
        (3_000, Edge::Rising),
        (5_000, Edge::Falling),
    ];
    assert_eq!(edges(rig.device()), expected);
    assert_eq!(rig.device().edge_counts(), (2, 1));
    assert_eq!(rig.device().take_edge(), None);
}

#[test]
fn a_write_moves_the_pin_at_its_own_time() {
    let mut rig = Rig::new(constant(31.0));
    rig.write(&[0x08, 0x78, 0x00]);
    rig.set(150);
    rig.write(&[0x03, 0x03]);
    assert_eq!(rig.device().edge_counts(), (0, 0), "the next frame trips");
    rig.set(210);
    rig.write(&[0x03, 0x02]);
    rig.set(220);
    rig.write(&[0x03, 0x03]);
    rig.set(230);
    rig.write(&[0x05, 0x02]);
    rig.set(310);
    rig.write(&SLEEP);
    rig.set(320);
    rig.write(&NORMAL);
    rig.set(330);
    rig.write(&INITIAL_RESET);
    rig.set(530);
    rig.device().power_cycle(ms(530));
    use Edge::{Falling, Rising};
    let expected = [
        (200, Falling),
        (210, Rising),
        (220, Falling),
        (230, Rising),
        (300, Falling),
        (310, Rising),
        (320, Falling),
        (330, Rising),
        (500, Falling),
        (530, Rising),
    ];
    assert_eq!(edges(rig.device()), expected);
}

#[test]
fn a_change_that_falls_due_in_a_transaction_comes_with_its_stop() {
    let mut rig = alarmed();
    rig.set(1_950);
    rig.frames();
    let device = rig.device();
    device.start_write(ms(1_990));
    device.write(0x80, ms(1_991));
    device.start_read(ms(2_010));
    assert_eq!(device.interrupt_pin(), InterruptPin::HighZ);
    assert_eq!(device.next_frame_at(), Some(ms(2_000)));
    device.stop(ms(2_020));
    assert_eq!(edges(device), [(2_020, Edge::Falling)]);
}

#[test]
fn only_the_newest_changes_are_stored() {
    let blinking = |t: Duration| uniform(if t.as_millis() % 200 == 0 { 31.0 } else { 20.0 });
    let mut rig = Rig::new(blinking);
    for pair in ALARM {
        rig.write(&pair);
    }
    rig.set(5_050);
    rig.frames();
    let kept = edges(rig.device());
    assert_eq!(kept.len(), EDGES_MAX);
    assert_eq!(kept[EDGES_MAX - 1], (5_000, Edge::Falling));
    assert_eq!(rig.device().edges_lost(), 49 - 16);
    assert_eq!(rig.device().edge_counts(), (25, 24));
}

#[test]
fn the_next_frame_is_known_in_every_mode() {
    let mut rig = Rig::with(
        counting,
        Options {
            clock_error_ppm: -500_000,
            ..Options::default()
        },
    );
    rig.set(50);
    assert_eq!(rig.device().next_frame_at(), Some(ms(200)));
    rig.write(&ONE_FPS);
    assert_eq!(rig.device().next_tick_at(), Some(ms(200)));
    assert_eq!(rig.device().next_frame_at(), Some(ms(2_000)));
    rig.set(1_900);
    rig.frames();
    assert_eq!(rig.device().next_frame_at(), Some(ms(2_000)));
    rig.set(2_000);
    assert_eq!(rig.frames(), 1);
    assert_eq!(rig.device().next_frame_at(), Some(ms(4_000)));
    rig.write(&[0x00, 0x21]);
    assert_eq!(rig.device().next_frame_at(), Some(ms(22_000)));
    rig.write(&SLEEP);
    assert_eq!(rig.device().next_frame_at(), None);
}

type Visits = fn(Duration) -> Frame;

fn shared(clock: &ManualClock) -> RefCell<Bus<&ManualClock, Visits>> {
    let source: Visits = visits;
    let bus = Bus::with_sensor(clock, Address::High, source);
    let mut bus = bus.with_instant_transactions();
    for pair in ALARM {
        bus.write(HIGH, &pair).unwrap();
    }
    RefCell::new(bus)
}

#[test]
fn future_changes_are_found_by_advancing_the_clock() {
    let clock = ManualClock::new();
    let bus = shared(&clock);
    let pin = SharedBus::new(&bus).int_pin(Address::High);
    assert_eq!(pin.next_frame_at(), Ok(Some(ms(100))));
    let mut edges = pin.edges(ms(8_000));
    let first = edges.next().unwrap();
    assert_eq!((first.at, first.edge), (ms(2_000), Edge::Falling));
    assert_eq!(clock.now(), ms(2_000), "no further than to the change");
    assert_eq!(edges.next().unwrap().at, ms(3_000));
    assert_eq!(edges.next().unwrap().at, ms(5_000));
    assert_eq!(edges.next(), None);
    assert_eq!(clock.now(), ms(8_000));
    assert_eq!(edges.next(), None);

    let nobody = SharedBus::new(&bus).int_pin(Address::Low);
    assert_eq!(nobody.next_frame_at(), Ok(None));
    assert_eq!(nobody.edges(ms(9_000)).next(), None);
    let held = bus.borrow_mut();
    assert!(pin.next_frame_at().is_err());
    assert_eq!(pin.edges(ms(9_000)).next(), None);
    drop(held);
}

/// A clock that cannot be moved, like a real one.
struct Standing(Duration);

impl Clock for Standing {
    fn now(&self) -> Duration {
        self.0
    }
}

#[test]
fn on_a_real_clock_the_changes_end_at_the_present() {
    let bus = RefCell::new(Bus::with_sensor(
        Standing(ms(500)),
        Address::High,
        constant(20.0),
    ));
    let pin = SharedBus::new(&bus).int_pin(Address::High);
    assert_eq!(pin.edges(ms(10_000)).next(), None);
}

/// AMG88 spec §4-7: "VDD" when idle, Hi-Z when not enabled; the reference circuits have a pull-up instead.
#[test]
fn the_idle_pin_is_driven_by_option() {
    let options = Options {
        interrupt_output: InterruptOutput::PushPull,
        ..Options::default()
    };
    let mut rig = Rig::with(visits, options);
    let pin = |rig: &mut Rig| rig.bus.interrupt_pin(ADDRESS).unwrap();
    assert_eq!(pin(&mut rig), InterruptPin::HighZ, "not enabled");
    for pair in ALARM {
        rig.write(&pair);
    }
    assert_eq!(pin(&mut rig), InterruptPin::High);
    rig.set(2_000);
    assert_eq!(pin(&mut rig), InterruptPin::Low);
    rig.set(3_000);
    assert_eq!(pin(&mut rig), InterruptPin::High);
    rig.write(&SLEEP);
    assert_eq!(pin(&mut rig), InterruptPin::HighZ);
    assert_eq!(
        rig.device().edge_counts(),
        (1, 1),
        "High and HighZ are one level"
    );
}

/// Section 2.4: INT as "data ready" with levels of zero in difference mode: due to noise, or by option without it.
#[test]
fn int_as_data_ready() {
    // A quarter degree back and forth in one pixel is the smallest possible noise.
    let noisy = |t: Duration| {
        let odd = t.as_millis() / 100 % 2 == 1;
        with_pixel(20.0, 11, if odd { 20.25 } else { 20.0 })
    };
    let still = constant(20.0);
    let always = Options {
        zero_levels: ZeroLevels::AlwaysTrip,
        ..Options::default()
    };
    let rigs = [
        (Rig::new(noisy), 9),
        (Rig::new(constant(20.0)), 0),
        (Rig::with(still, always), 10),
    ];
    for (mut rig, ready) in rigs {
        rig.write(&[0x03, 0x01]);
        let mut found = 0;
        for frame in 1..=10 {
            rig.set(100 * frame + 3);
            if rig.bus.interrupt_pin(ADDRESS) == Some(InterruptPin::Low) {
                found += 1;
                rig.read(0x80, 128);
                let status = rig.register(0x04);
                rig.write(&[0x05, status]);
                assert_eq!(rig.bus.interrupt_pin(ADDRESS), Some(InterruptPin::HighZ));
            }
        }
        assert_eq!(found, ready);
    }
}

#[test]
fn levels_that_are_not_all_zero_are_compared_whatever_the_option() {
    let options = Options {
        zero_levels: ZeroLevels::AlwaysTrip,
        ..Options::default()
    };
    let mut rig = Rig::with(constant(20.0), options);
    rig.write(&[0x0C, 0x04]);
    rig.set(200);
    assert_eq!(rig.register(0x04), 0x00);
}

#[test]
fn pins_are_input_pins_and_handles() {
    let clock = ManualClock::new();
    let bus = shared(&clock);
    let mut pin = SharedBus::new(&bus).int_pin(Address::High);
    let mut copy = pin;
    clock.set(ms(2_500));
    assert!(pin.is_low().unwrap() && copy.is_low().unwrap());
}
