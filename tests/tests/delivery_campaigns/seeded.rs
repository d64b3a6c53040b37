//! Moments drawn from a seed.

use std::time::Duration;

/// How often each campaign kills.
const KILLS_BY_DEFAULT: u32 = 6;
const KILLS: u32 = 200;

/// How often each campaign kills: the full number with `GRIDEYE_ALL_SEEDS=1`.
pub(crate) fn kills() -> u32 {
    let is_long = std::env::var_os("GRIDEYE_ALL_SEEDS").is_some_and(|value| value == "1");
    if is_long { KILLS } else { KILLS_BY_DEFAULT }
}

/// SplitMix64 (Steele, Lea and Flood 2014).
pub(crate) struct Seeded(pub(crate) u64);

impl Seeded {
    /// The moments of one campaign, which is named by its test; prints how to draw them again.
    pub(crate) fn of(test: &str) -> Self {
        let seed: u64 =
            std::env::var("GRIDEYE_CAMPAIGN_SEED").map_or(1, |seed| seed.parse().unwrap());
        let long = if kills() == KILLS {
            "GRIDEYE_ALL_SEEDS=1 "
        } else {
            ""
        };
        println!(
            "seed {seed}; again: {long}GRIDEYE_CAMPAIGN_SEED={seed} cargo test -p grideye-tests --test delivery_campaigns {test} -- --nocapture"
        );
        let of_test = |sum: u64, byte: u8| sum.wrapping_mul(31).wrapping_add(byte.into());
        Self(test.bytes().fold(seed, of_test))
    }

    /// A number below `limit`.
    pub(crate) fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (mixed ^ (mixed >> 31)) % limit
    }

    /// Waits for at least `from_ms` and less than `to_ms`.
    pub(crate) fn pause(&mut self, from_ms: u64, to_ms: u64) {
        std::thread::sleep(Duration::from_millis(from_ms + self.below(to_ms - from_ms)));
    }
}
