//! For any script and any text: two runs agree, and nothing stays behind.

use super::support::*;
use amg8833_emulator::script::{Lasting, Rule, Script, When};
use amg8833_emulator::{Address, BusError, Chance, Clock, Fault, FaultCounts, FaultKind, Options};
use core::time::Duration;
use embedded_hal::i2c::I2c;
use grideye_frame::PixelIndex;
use proptest::prelude::*;

fn any_fault() -> impl Strategy<Value = Fault> {
    let pixel = (0_usize..=64).prop_map(PixelIndex::from_number);
    prop_oneof![
        prop::sample::select(vec![
            Fault::NackAddress,
            Fault::BusError,
            Fault::ArbitrationLoss,
            Fault::Timeout,
            Fault::Hang,
            Fault::StuckHigh,
            Fault::AllZero,
            Fault::BrownOut,
            Fault::FastWake,
            Fault::Freeze,
            Fault::Unplugged,
            Fault::AdapterGone,
        ]),
        any::<u16>().prop_map(Fault::NackByte),
        (any::<u16>(), any::<u8>()).prop_map(|(byte, bit)| Fault::ShortClock { byte, bit }),
        any::<(Option<u8>, Option<u16>, Option<u8>)>().prop_map(|(register, byte, bit)| {
            Fault::BitFlip {
                register,
                byte,
                bit,
            }
        }),
        pixel.clone().prop_map(|pixel| Fault::Torn { pixel }),
        (pixel, any::<u16>()).prop_map(|(pixel, word)| Fault::PixelGlitch { pixel, word }),
        any::<u16>().prop_map(|word| Fault::ThermistorFailure { word }),
        any::<i32>().prop_map(|ppm| Fault::ClockError { ppm }),
        (1..=u32::MAX).prop_map(|hz| Fault::SclSpeed {
            hz: hz.try_into().unwrap()
        }),
    ]
}

/// Script times, mostly within the first 20 s, occasionally anything.
fn any_time() -> impl Strategy<Value = Duration> {
    prop_oneof![
        20 => (0_u64..20_000).prop_map(ms),
        1 => any::<u64>().prop_map(Duration::from_nanos),
        1 => Just(Duration::MAX),
    ]
}

fn any_when() -> impl Strategy<Value = When> {
    prop_oneof![
        Just(When::Always),
        any_time().prop_map(When::At),
        (any_time(), prop::option::of(any_time()))
            .prop_map(|(from, until)| When::Between { from, until }),
        (any_time(), any_time(), prop::option::of(any_time())).prop_map(|(period, from, until)| {
            When::Every {
                period,
                from,
                until,
            }
        }),
        (0_u64..200).prop_map(When::Frame),
    ]
}

fn any_lasting() -> impl Strategy<Value = Lasting> {
    prop_oneof![
        Just(Lasting::ToTheEnd),
        any_time().prop_map(Lasting::For),
        (0_u32..30).prop_map(Lasting::Frames),
        (0_u32..30).prop_map(Lasting::Times),
    ]
}

prop_compose! {
    fn any_rule()(
        fault in any_fault(),
        when in any_when(),
        lasting in any_lasting(),
        chance in 0.0..=1.0_f64,
        address in prop::option::of(prop::sample::select(Address::ALL.to_vec())),
    ) -> Rule {
        Rule { fault, when, lasting, chance: Chance::new(chance).unwrap(), address, bus: None }
    }
}

#[derive(Debug, Clone)]
enum Act {
    Wait(Duration),
    Read(u8, u8, usize),
    Write(u8, Vec<u8>),
    Replug(Address),
    Call(Address, Fault),
}

fn any_act() -> impl Strategy<Value = Act> {
    let to = prop::sample::select(vec![0x69_u8, 0x69, 0x68, 0x42]);
    let place = prop::sample::select(Address::ALL.to_vec());
    prop_oneof![
        6 => (0_u64..2_000).prop_map(|wait| Act::Wait(ms(wait))),
        6 => (to.clone(), any::<u8>(), 0_usize..140).prop_map(|(to, from, count)| Act::Read(to, from, count)),
        3 => (to, prop::collection::vec(any::<u8>(), 0..5)).prop_map(|(to, bytes)| Act::Write(to, bytes)),
        1 => place.clone().prop_map(Act::Replug),
        1 => (place, any_fault()).prop_map(|(place, fault)| Act::Call(place, fault)),
    ]
}

/// A read's result and bytes.
type Seen = (Result<(), BusError>, Vec<u8>);

fn play(rules: &[Rule], acts: &[Act], seed: u64) -> (TestBus, Vec<Seen>, FaultCounts) {
    let mut bus = bus().with_scl_hz(400_000.try_into().unwrap());
    bus.plug(Address::Low, COUNTING, Options::default());
    if let Ok(script) = Script::new(seed, rules.to_vec()) {
        bus.set_script(script);
    }
    let mut seen = Vec::new();
    for act in acts {
        let mut bytes = Vec::new();
        let answer = match act {
            Act::Wait(time) => {
                bus.clock().advance(*time);
                Ok(())
            }
            Act::Read(to, from, count) => {
                bytes = vec![0xA5; *count];
                bus.write_read(*to, &[*from], &mut bytes)
            }
            Act::Write(to, bytes) => bus.write(*to, bytes),
            Act::Replug(address) => {
                bus.unplug(*address);
                bus.plug(*address, COUNTING, Options::default());
                Ok(())
            }
            Act::Call(address, fault) => {
                bus.set_fault(*address, *fault);
                Ok(())
            }
        };
        seen.push((answer, bytes));
    }
    let counts = bus.fault_counts();
    (bus, seen, counts)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn scripts_are_deterministic_and_leave_nothing_behind(
        rules in prop::collection::vec(any_rule(), 0..8),
        acts in prop::collection::vec(any_act(), 0..40),
        seed in any::<u64>(),
    ) {
        let (mut bus, seen, counts) = play(&rules, &acts, seed);
        let (_, again, counts_again) = play(&rules, &acts, seed);
        prop_assert_eq!(seen, again);
        prop_assert_eq!(counts, counts_again);

        bus.clear_script();
        for address in Address::ALL {
            prop_assert!(bus.clear_fault(address));
        }
        for address in Address::ALL {
            prop_assert!(bus.faults(address).is_empty());
            prop_assert!(bus.set_fault(address, Fault::BrownOut));
        }
        let now = bus.clock().now();
        let mut image = [0xA5; 256];
        for address in Address::ALL {
            bus.write_read(address.bits(), &[0x00], &mut image).unwrap();
            prop_assert_eq!(image, [0; 256]);
        }
        let before = bus.device(Address::High).unwrap().frames();
        bus.clock().set(now + ms(2_050));
        bus.advance();
        prop_assert_eq!(bus.device(Address::High).unwrap().frames() - before, 20);
    }

    /// Whatever a file holds, the result is a script or an error with its place.
    #[test]
    fn any_text_is_a_script_or_an_error(text in ".{0,200}") {
        if let Err(error) = Script::from_toml(&text, "f.toml") {
            prop_assert!(error.to_string().starts_with("f.toml:"));
        }
    }

    /// Almost valid scripts: known keys with unlikely values.
    #[test]
    fn any_fields_are_a_script_or_an_error(
        fields in prop::collection::vec((field(), value()), 0..6),
        kind in prop::sample::select(FaultKind::ALL.to_vec()),
    ) {
        let mut text = format!("[[fault]]\nkind = \"{kind}\"\n");
        for (field, value) in &fields {
            text.push_str(&format!("{field} = {value}\n"));
        }
        match Script::from_toml(&text, "f.toml") {
            Err(error) => prop_assert!(error.to_string().starts_with("f.toml:")),
            Ok(script) => {
                let rules: Vec<Rule> = script.rules().copied().collect();
                prop_assert_eq!(rules.len(), 1);
                play(&rules, &[Act::Wait(ms(3_000)), Act::Read(HIGH, 0x80, 128)], 1);
            }
        }
    }
}

fn field() -> impl Strategy<Value = &'static str> {
    prop::sample::select(vec![
        "at",
        "from",
        "until",
        "every",
        "frame",
        "duration",
        "frames",
        "count",
        "probability",
        "address",
        "bus",
        "byte",
        "bit",
        "register",
        "pixel",
        "word",
        "ppm",
        "hz",
        "seed",
    ])
}

fn value() -> impl Strategy<Value = String> {
    let times = vec![
        "\"1 s\"",
        "\"2.5 ms\"",
        "\"0 s\"",
        "\"99999999999 h\"",
        "\"7 ns\"",
        "\"x\"",
    ];
    prop_oneof![
        3 => prop::sample::select(times).prop_map(String::from),
        3 => prop::sample::select(vec!["0x68", "0x69", "0", "1", "64", "0xFFF", "0.5"]).prop_map(String::from),
        1 => any::<i64>().prop_map(|number| number.to_string()),
        1 => any::<f64>().prop_map(|number| format!("{number:e}")),
        1 => Just("nan".to_owned()),
        1 => Just("[]".to_owned()),
    ]
}
