//! Whatever a program asks, and whatever its memory holds.

use proptest::prelude::*;

use super::bench::*;
use crate::adapter::Fault;
use crate::ioctl::request::*;
use crate::ioctl::{AdapterMode, PointerWidth};

/// Pointers that lead somewhere more often than not.
fn pointer() -> impl Strategy<Value = u64> {
    prop_oneof![8 => BASE..BASE + 0x1_0000, 1 => any::<u64>(), 1 => Just(0), 1 => BASE + 0xFF00..BASE + 0x1_0100]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Whatever a program asks, and whatever its memory holds: an answer of the documented kind, and no panic.
    #[test]
    fn no_request_can_break_the_layer(
        mode in prop::sample::select(AdapterMode::ALL.to_vec()),
        width in prop::sample::select(vec![PointerWidth::Bits32, PointerWidth::Bits64]),
        faults in prop::collection::vec(prop::sample::select(vec![Fault::NackAddress, Fault::ArbitrationLost, Fault::Timeout]), 0..4),
        calls in prop::collection::vec((prop_oneof![8 => 0x0700..0x0722u32, 1 => any::<u32>()], pointer(), any::<u8>()), 1..12),
        smbus in (0..3u8, any::<u8>(), 0..10u32, pointer()),
        messages in prop::collection::vec((any::<u16>(), any::<u16>(), any::<u16>(), pointer()), 0..5),
        filling in prop::collection::vec(any::<u8>(), 64),
    ) {
        let mut bench = Bench::with_width(mode, width);
        bench.fail_with(&faults);
        bench.memory.put(DATA, &filling);
        let mut outcomes = Vec::new();
        for (request, argument, value) in calls {
            let argument = if value & 1 == 0 { argument } else { u64::from(value) };
            outcomes.push(bench.call(request, argument));
        }
        let argument = bench.memory.put_smbus(BASE + 0x40, smbus.0, smbus.1, smbus.2, smbus.3);
        outcomes.push(bench.call(I2C_SMBUS, argument));
        outcomes.push(bench.rdwr(&messages));
        for outcome in outcomes {
            match outcome {
                Ok(count) => prop_assert!((0..=42).contains(&count)),
                Err(errno) => prop_assert!(
                    [5, 6, 11, 14, 16, 19, 22, 25, 71, 74, 95, 110, 121].contains(&errno.raw()),
                    "errno {errno:?}"
                ),
            }
        }
    }
}
