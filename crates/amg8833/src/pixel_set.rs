//! Sets of pixels, as the interrupt table reports them.

use grideye_frame::{PIXELS, PixelIndex};

/// The set of pixels with their interrupt bit set (AMG88 spec §4-11-10).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct PixelSet(u64);

impl PixelSet {
    /// No pixel.
    pub const EMPTY: Self = Self(0);

    /// The set of these bits: bit `n` is the pixel of index `n`, so bit 0 is pixel 1.
    #[must_use]
    pub const fn from_bits(bits: u64) -> Self {
        Self(bits)
    }

    /// The set as bits: bit `n` is the pixel of index `n`, so bit 0 is pixel 1.
    #[must_use]
    pub const fn bits(self) -> u64 {
        self.0
    }

    /// Whether the pixel is in the set.
    #[must_use]
    pub fn contains(self, pixel: PixelIndex) -> bool {
        self.0 & bit(pixel) != 0
    }

    /// The number of pixels in the set, 0 to 64.
    #[must_use]
    pub fn len(self) -> usize {
        self.iter().count()
    }

    /// Whether no pixel is in the set.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The pixels of the set in ascending order.
    pub fn iter(self) -> impl Iterator<Item = PixelIndex> {
        PixelIndex::all().filter(move |pixel| self.contains(*pixel))
    }

    /// INT0 to INT7: bit `b` of byte `n` is pixel `8 n + b + 1` (AMG88 spec §4-11-10).
    pub(crate) const fn from_table(bytes: [u8; PIXELS / 8]) -> Self {
        Self(u64::from_le_bytes(bytes))
    }
}

impl FromIterator<PixelIndex> for PixelSet {
    fn from_iter<I: IntoIterator<Item = PixelIndex>>(pixels: I) -> Self {
        Self(pixels.into_iter().fold(0, |bits, pixel| bits | bit(pixel)))
    }
}

fn bit(pixel: PixelIndex) -> u64 {
    1 << pixel.as_usize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn every_bit_of_the_table_is_the_pixel_that_the_datasheet_names() {
        for byte in 0..8 {
            for bit in 0..8 {
                let mut table = [0; 8];
                table[byte] = 1 << bit;
                let pixel = PixelIndex::from_number(8 * byte + bit + 1).unwrap();
                let set = PixelSet::from_table(table);
                assert!(set.contains(pixel));
                assert!(set.iter().eq([pixel]));
            }
        }
    }

    #[test]
    fn the_empty_and_the_full_set() {
        let full: PixelSet = PixelIndex::all().collect();
        assert_eq!(full, PixelSet::from_bits(u64::MAX));
        assert_eq!((full.len(), full.is_empty()), (64, false));
        assert!(PixelSet::EMPTY.is_empty());
    }

    proptest! {
        #[test]
        fn a_set_is_what_it_was_made_of(bits: u64) {
            let set = PixelSet::from_bits(bits);
            prop_assert_eq!(set.iter().collect::<PixelSet>(), set);
            prop_assert_eq!(u32::try_from(set.len()), Ok(bits.count_ones()));
            prop_assert_eq!(set.bits(), bits);
        }
    }
}
