//! Whatever is sent, nothing panics, time stays ordered, and a power cycle leaves nothing behind.

use crate::any_options::{any_options, power_on_image};
use crate::support::*;
use amg8833_emulator::{Address, Clock, Fault, Options, PastTheEnd};
use core::time::Duration;
use embedded_hal::i2c::{I2c, Operation};
use proptest::prelude::*;

#[derive(Debug, Clone)]
enum Part {
    Write(Vec<u8>),
    Read(usize),
}

#[derive(Debug, Clone)]
enum Action {
    Transfer(u8, Vec<Part>),
    Wait(u64),
    Break(Fault),
    Mend,
    Drift(i32),
    Raw(u8, u8),
}

/// Meaningful bytes, more often than by chance.
fn byte() -> impl Strategy<Value = u8> {
    let commands = vec![
        0x00, 0x01, 0x02, 0x03, 0x05, 0x07, 0x08, 0x10, 0x1F, 0x20, 0x21, 0x30, 0x3F, 0x45, 0x50,
        0x57, 0x80, 0xFF,
    ];
    prop_oneof![3 => prop::sample::select(commands), 1 => any::<u8>()]
}

fn part() -> impl Strategy<Value = Part> {
    prop_oneof![
        prop::collection::vec(byte(), 0..6).prop_map(Part::Write),
        (0_usize..300).prop_map(Part::Read),
    ]
}

fn fault() -> impl Strategy<Value = Fault> {
    prop::sample::select(vec![
        Fault::NackAddress,
        Fault::NackByte(1),
        Fault::BusError,
        Fault::ArbitrationLoss,
        Fault::Hang,
        Fault::StuckHigh,
        Fault::AllZero,
        Fault::Freeze,
        Fault::BrownOut,
        Fault::Unplugged,
        Fault::AdapterGone,
        Fault::Timeout,
        Fault::FastWake,
        Fault::Torn { pixel: None },
        Fault::ClockError { ppm: 77_000 },
        Fault::ThermistorFailure { word: 0xFFF },
        Fault::ShortClock { byte: 2, bit: 3 },
    ])
}

fn action() -> impl Strategy<Value = Action> {
    let address = prop_oneof![8 => Just(HIGH), 1 => any::<u8>()];
    prop_oneof![
        12 => (address, prop::collection::vec(part(), 0..5)).prop_map(|(to, parts)| Action::Transfer(to, parts)),
        4 => (0_u64..3_000).prop_map(Action::Wait),
        1 => fault().prop_map(Action::Break),
        2 => Just(Action::Mend),
        1 => any::<i32>().prop_map(Action::Drift),
        3 => (0_u8..5, byte()).prop_map(|(call, byte)| Action::Raw(call, byte)),
    ]
}

fn options() -> impl Strategy<Value = Options> {
    (any::<u64>(), any::<i32>()).prop_map(|(bits, ppm)| any_options(bits, ppm))
}

/// Pixels across the range and beyond, different every tick.
fn wild(t: Duration) -> grideye_frame::Frame {
    let step = u16::try_from(t.as_millis() / 100 % 4_801).unwrap();
    uniform(f32::from(step) / 4.0 - 600.0)
}

fn perform(rig: &mut Rig, action: &Action) {
    let now = rig.bus.clock().now();
    match action {
        Action::Transfer(address, parts) => {
            let mut buffers: Vec<Vec<u8>> = parts
                .iter()
                .map(|part| match part {
                    Part::Write(bytes) => bytes.clone(),
                    Part::Read(count) => vec![0; *count],
                })
                .collect();
            let mut operations: Vec<Operation<'_>> = parts
                .iter()
                .zip(&mut buffers)
                .map(|(part, buffer)| match part {
                    Part::Write(_) => Operation::Write(buffer),
                    Part::Read(_) => Operation::Read(buffer),
                })
                .collect();
            let _ = rig.bus.transaction(*address, &mut operations);
        }
        Action::Wait(milliseconds) => rig.pass(*milliseconds),
        Action::Break(fault) => assert!(rig.bus.set_fault(Address::High, *fault)),
        Action::Mend => assert!(rig.bus.clear_fault(Address::High)),
        Action::Drift(ppm) => rig.device().set_clock_error_ppm(*ppm, now),
        Action::Raw(call, byte) => {
            let device = rig.device();
            match call {
                0 => drop(device.start_write(now)),
                1 => drop(device.start_read(now)),
                2 => drop(device.write(*byte, now)),
                3 => drop(device.read(now)),
                _ => device.stop(now),
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn nothing_panics_and_a_power_cycle_leaves_nothing(
        options in options(),
        actions in prop::collection::vec(action(), 1..60),
    ) {
        let mut rig = Rig::with(wild, options).at_scl(400_000);
        let mut frames = 0;
        for action in &actions {
            perform(&mut rig, action);
            let now = rig.device().frames();
            prop_assert!(now >= frames);
            frames = now;
        }
        prop_assert!(rig.bus.clear_fault(Address::High));
        let now = rig.bus.clock().now();
        rig.device().power_cycle(now);
        let frames = rig.device().frames();
        rig.bus.clock().set(now + Duration::from_millis(50));
        let mut pointer = [0xA5];
        rig.bus.read(HIGH, &mut pointer).unwrap();
        prop_assert_eq!(pointer, [0x00]);
        if options.past_the_end == PastTheEnd::Wraps {
            prop_assert_eq!(rig.image(), power_on_image(&options));
        }

        // From here on it must behave like a new one.
        let error = rig.device().options().clock_error_ppm;
        let mut fresh = Rig::with(move |t| wild(t + now), Options { clock_error_ppm: error, ..options });
        fresh.set(2_050);
        rig.bus.clock().set(now + Duration::from_millis(2_050));
        prop_assert_eq!(rig.frames() - frames, fresh.frames());
    }

    /// Section 1.3: unspecified bits read 0 for any measurement.
    #[test]
    fn upper_nibbles_read_zero(degrees in prop::num::f32::ANY) {
        let mut rig = Rig::new(constant(degrees));
        rig.set(100);
        for word in rig.pixels() {
            prop_assert!(word <= 0x0FFF);
        }
        prop_assert!(rig.register(0x0F) <= 0x0F);
    }
}
