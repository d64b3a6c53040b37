//! How long to wait after a failure.

use super::limits::{BACK_OFF_MAX, BACK_OFF_MIN};
use std::time::Duration;

/// The pause after this many failures in a row: anywhere between the shortest and a bound that doubles ("full
/// jitter"), so that a fleet does not come back all at once.
pub(super) fn back_off(failures: u32, entropy: u64) -> Duration {
    let doublings = failures.min(16);
    let bound = BACK_OFF_MIN
        .saturating_mul(1 << doublings)
        .min(BACK_OFF_MAX);
    let span_ms = u64::try_from((bound - BACK_OFF_MIN).as_millis()).unwrap_or(0) + 1;
    BACK_OFF_MIN + Duration::from_millis(entropy % span_ms)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_pause_lies_between_half_a_second_and_a_minute(failures in 0..u32::MAX, entropy: u64) {
            let pause = back_off(failures, entropy);
            prop_assert!((BACK_OFF_MIN..=BACK_OFF_MAX).contains(&pause));
            prop_assert!(failures > 3 || pause <= BACK_OFF_MIN * 8);
        }
    }

    #[test]
    fn the_bound_of_the_pause_doubles_and_is_used_in_full() {
        let longest = |failures| {
            (0..100_000)
                .map(|entropy| back_off(failures, entropy))
                .max()
        };
        assert_eq!(longest(1), Some(Duration::from_secs(1)));
        assert_eq!(longest(3), Some(Duration::from_secs(4)));
        assert_eq!(longest(40), Some(BACK_OFF_MAX));
    }
}
