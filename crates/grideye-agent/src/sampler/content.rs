//! What a frame's words reveal on their own, and reads that are still undecided.

use super::phase::Ns;
use grideye_frame::word;
use grideye_frame::{COLUMNS, Celsius, NoData, PIXELS, PixelWord, RawFrame, ThermistorWord};

/// Values seen in pixels that failed for a moment: 0x000, and 0xFFF, one step below.
const GLITCHES: [Celsius; 2] = [Celsius::new(0.0), Celsius::new(-0.25)];
/// A glitch differs from all its neighbors by more than this. No real object does: a pixel's viewing angle is wider
/// than the grid spacing, so an object never fills one pixel alone.
const GLITCH_MIN_C: f32 = 5.0;

/// The pixels' temperatures, for comparing frames: a change in meaningless bits does not make a frame new.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Content([Celsius; PIXELS]);

impl Content {
    pub(super) fn of(frame: &RawFrame) -> Self {
        Self(frame.pixels.map(word::pixel_celsius))
    }

    pub(super) fn is_zero(&self) -> bool {
        self.0.iter().all(|pixel| pixel.get() == 0.0)
    }

    /// Whether a pixel reads a failure value, far from all its neighbors.
    pub(super) fn has_glitch(&self) -> bool {
        (0..PIXELS).any(|index| {
            let found = |pixel: &&Celsius| GLITCHES.contains(pixel);
            let pixel = self.0.get(index).filter(found);
            pixel.is_some_and(|pixel| self.is_alone(index, *pixel))
        })
    }

    fn is_alone(&self, index: usize, pixel: Celsius) -> bool {
        let (row, column) = (index / COLUMNS, index % COLUMNS);
        let around = |place: usize| place.saturating_sub(1)..=(place + 1).min(COLUMNS - 1);
        around(row)
            .flat_map(|row| around(column).map(move |column| row * COLUMNS + column))
            .filter(|neighbor| *neighbor != index)
            .filter_map(|neighbor| self.0.get(neighbor))
            .all(|neighbor| (neighbor.get() - pixel.get()).abs() > GLITCH_MIN_C)
    }
}

/// The mark of a dead or stuck link in a frame. The thermistor is read after the pixels: if it alone is suddenly all
/// zeros or all ones, the link died in between. If it stays so, the thermistor failed and the pixels are good.
pub(super) fn implausible(frame: &RawFrame, before: Option<ThermistorWord>) -> Option<NoData> {
    const ZEROS: u16 = 0;
    const ONES: u16 = u16::MAX;
    let all_pixels = |bits| frame.pixels.iter().all(|word| *word == PixelWord(bits));
    let thermistor_died =
        |bits| frame.thermistor == ThermistorWord(bits) && before.is_some_and(is_far_from_zero);
    if all_pixels(ZEROS) || thermistor_died(ZEROS) {
        Some(NoData::AllZero)
    } else if all_pixels(ONES) || thermistor_died(ONES) {
        Some(NoData::StuckHigh)
    } else {
        None
    }
}

/// Whether a thermistor that measured this cannot reach 0 °C within one frame.
fn is_far_from_zero(thermistor: ThermistorWord) -> bool {
    word::thermistor_celsius(thermistor).get().abs() > 1.0 && thermistor != ThermistorWord(u16::MAX)
}
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    pub(super) before: Ns,
    pub(super) content: Content,
    pub(super) seq: Option<u64>,
}

impl Seen {
    pub(super) fn by(read: &Read, seq: Option<u64>) -> Self {
        Self {
            seq,
            before: read.before,
            content: read.content,
        }
    }
}

/// One read: the sensor copied its registers after `before` and no later than `latched_until`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Read {
    pub(super) before: Ns,
    pub(super) latched_until: Ns,
    pub(super) after: Ns,
    pub(super) frame: RawFrame,
    pub(super) content: Content,
}

/// A new frame with a number from `low` to `high`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pending {
    pub(super) read: Read,
    pub(super) seen_before: Ns,
    pub(super) low: u64,
    pub(super) high: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uniform(bits: u16) -> RawFrame {
        RawFrame {
            thermistor: ThermistorWord(400),
            pixels: [PixelWord(bits); PIXELS],
        }
    }

    #[test]
    fn meaningless_bits_do_not_make_a_frame_new() {
        let mut garbled = uniform(100);
        for (nibble, pixel) in (0..).zip(&mut garbled.pixels) {
            pixel.0 |= (nibble % 16) << 12;
        }
        assert_ne!(garbled, uniform(100));
        assert_eq!(Content::of(&garbled), Content::of(&uniform(100)));
        assert_ne!(Content::of(&uniform(101)), Content::of(&uniform(100)));
    }

    /// Recordings contain pixels of exactly 0.0 °C among others of 25 °C, and one of 0xFFF.
    #[test]
    fn a_failed_pixel_is_found_anywhere() {
        for glitch in [0x000, 0xFFF] {
            for index in 0..PIXELS {
                let mut frame = uniform(100);
                frame.pixels[index] = PixelWord(glitch);
                assert!(Content::of(&frame).has_glitch(), "{index}");
            }
        }
    }

    #[test]
    fn ice_a_hot_spot_and_a_frame_near_zero_are_not_glitches() {
        let mut ice = uniform(100);
        (ice.pixels[27], ice.pixels[28]) = (PixelWord(0), PixelWord(12));
        let mut hot = uniform(100);
        hot.pixels[36] = PixelWord(320);
        let mut edge = uniform(0);
        edge.pixels[0] = PixelWord(20);
        for frame in [ice, hot, edge, uniform(0), uniform(0xFFF)] {
            assert!(!Content::of(&frame).has_glitch());
        }
    }
}
