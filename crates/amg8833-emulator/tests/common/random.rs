//! Random numbers, identical on every machine: SplitMix64 (Steele, Lea, Flood, OOPSLA 2014).

/// A stream of numbers from a seed.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let value = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let value = (value ^ (value >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        value ^ (value >> 31)
    }

    /// A number below `end`, which is at least 1. The bias is below 2^-32 for small ends.
    pub(crate) fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }
}
