//! Packs a frame's 64 words into the bits by which they differ: 4 to 6 per pixel for a room, instead of 16.
//!
//! ```text
//! lowest word (2 bytes) · width (1 byte, 0 to 16) · per pixel, in order, word − lowest in that many bits
//! ```
//!
//! Little-endian, lowest bit first. The width is as small as possible, so that equal frames are equal bytes.

use grideye_frame::{PIXELS, PixelWord};

/// Maximum packed size of a frame's words in bytes.
pub const BYTES_MAX: usize = 3 + 2 * PIXELS;

/// This many pixels fill whole bytes at any width.
const GROUP: usize = 8;
/// Up to this width, a group fits in 64 bits.
const NARROW_MAX: usize = 8;
const WIDTH_MAX: usize = 16;

/// Calls the function's instance for one width, so that every shift is a constant.
macro_rules! made_for_width {
    ($width:expr, $function:ident($($argument:expr),*)) => {
        match $width {
            0 => $function::<0>($($argument),*),
            1 => $function::<1>($($argument),*),
            2 => $function::<2>($($argument),*),
            3 => $function::<3>($($argument),*),
            4 => $function::<4>($($argument),*),
            5 => $function::<5>($($argument),*),
            6 => $function::<6>($($argument),*),
            7 => $function::<7>($($argument),*),
            8 => $function::<8>($($argument),*),
            9 => $function::<9>($($argument),*),
            10 => $function::<10>($($argument),*),
            11 => $function::<11>($($argument),*),
            12 => $function::<12>($($argument),*),
            13 => $function::<13>($($argument),*),
            14 => $function::<14>($($argument),*),
            15 => $function::<15>($($argument),*),
            _ => $function::<16>($($argument),*),
        }
    };
}

pub(super) fn put(bytes: &mut Vec<u8>, pixels: &[PixelWord; PIXELS]) {
    let words = pixels.map(|word| word.0);
    let (lowest, highest) = ends(&words);
    let width = width_of(highest - lowest);
    let above = words.map(|word| word - lowest);
    bytes.extend_from_slice(&lowest.to_le_bytes());
    bytes.push(u8::try_from(width).unwrap_or(u8::MAX));
    made_for_width!(width, put_above(bytes, &above));
}

/// Reads the words at the start of `bytes`, and their packed size; `None` for anything that [`put`] does not write.
pub(super) fn take(bytes: &[u8]) -> Option<([PixelWord; PIXELS], usize)> {
    let (head, rest) = bytes.split_first_chunk::<3>()?;
    let lowest = u16::from_le_bytes([head[0], head[1]]);
    let width = usize::from(head[2]);
    if width > WIDTH_MAX {
        return None;
    }
    let packed = rest.get(..GROUP * width)?;
    let above = made_for_width!(width, take_above(packed));
    let (least, most) = ends(&above);
    let is_as_written = least == 0 && width_of(most) == width;
    lowest.checked_add(most).filter(|_fits| is_as_written)?;
    let pixels = above.map(|above| PixelWord(lowest.wrapping_add(above)));
    Some((pixels, head.len() + packed.len()))
}

fn ends(words: &[u16; PIXELS]) -> (u16, u16) {
    let lowest = words
        .iter()
        .fold(u16::MAX, |lowest, word| lowest.min(*word));
    let highest = words
        .iter()
        .fold(0, |highest: u16, word| highest.max(*word));
    (lowest, highest)
}

fn width_of(word: u16) -> usize {
    WIDTH_MAX - usize::try_from(word.leading_zeros()).unwrap_or(0)
}

fn put_above<const WIDTH: usize>(bytes: &mut Vec<u8>, above: &[u16; PIXELS]) {
    let mut packed = [0; 2 * PIXELS];
    for (words, group) in above.chunks_exact(GROUP).zip(0..) {
        let from = group * WIDTH;
        if WIDTH <= NARROW_MAX {
            let bits = words.iter().zip(0..).fold(0, |bits, (word, place)| {
                bits | u64::from(*word) << (place * WIDTH)
            });
            // The upper bytes are 0; the next group overwrites them.
            packed[from..from + 8].copy_from_slice(&bits.to_le_bytes());
        } else {
            let bits = words.iter().zip(0..).fold(0, |bits, (word, place)| {
                bits | u128::from(*word) << (place * WIDTH)
            });
            packed[from..from + WIDTH].copy_from_slice(&bits.to_le_bytes()[..WIDTH]);
        }
    }
    bytes.extend_from_slice(&packed[..GROUP * WIDTH]);
}

/// `packed` has 8 bytes per bit of width.
fn take_above<const WIDTH: usize>(packed: &[u8]) -> [u16; PIXELS] {
    let mut above = [0; PIXELS];
    if WIDTH == 0 {
        return above;
    }
    let mask = u16::MAX >> (WIDTH_MAX - WIDTH);
    let groups = above
        .chunks_exact_mut(GROUP)
        .zip(packed.chunks_exact(WIDTH));
    for (words, bytes) in groups {
        if WIDTH <= NARROW_MAX {
            let mut bits = u64::from_le_bytes(padded(bytes));
            for word in words {
                let [low, high, ..] = bits.to_le_bytes();
                *word = u16::from_le_bytes([low, high]) & mask;
                bits >>= WIDTH;
            }
        } else {
            let mut bits = u128::from_le_bytes(padded(bytes));
            for word in words {
                let [low, high, ..] = bits.to_le_bytes();
                *word = u16::from_le_bytes([low, high]) & mask;
                bits >>= WIDTH;
            }
        }
    }
    above
}

fn padded<const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut padded = [0; N];
    padded[..bytes.len()].copy_from_slice(bytes);
    padded
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Packs bit by bit, as this module's documentation describes.
    fn by_hand(pixels: &[PixelWord; PIXELS]) -> Vec<u8> {
        let lowest = pixels.iter().map(|word| word.0).min().unwrap();
        let highest = pixels.iter().map(|word| word.0).max().unwrap();
        let width = (0..=16_u8)
            .find(|width| u32::from(highest - lowest) < 1 << width)
            .unwrap();
        let mut bytes = lowest.to_le_bytes().to_vec();
        bytes.push(width);
        let bits = pixels.iter().flat_map(|word| {
            let above = word.0 - lowest;
            (0..width).map(move |bit| above >> bit & 1)
        });
        let bits: Vec<u16> = bits.collect();
        for eight in bits.chunks(8) {
            let byte = eight.iter().rev().fold(0, |byte, bit| byte << 1 | bit);
            bytes.push(u8::try_from(byte).unwrap());
        }
        bytes
    }

    /// Words within this many bits above `lowest`, with both extremes among them.
    fn words(lowest: u16, width: u32) -> [PixelWord; PIXELS] {
        let above = (1_u64 << width) - 1;
        std::array::from_fn(|pixel| {
            let word = u64::try_from(pixel).unwrap() * 40_503 * 7919;
            let within = if pixel == 17 { above } else { word & above };
            let within = if pixel == 40 { 0 } else { within };
            PixelWord(lowest + u16::try_from(within).unwrap())
        })
    }

    #[test]
    fn words_of_every_width_round_trip_bit_by_bit() {
        for width in 0..=16 {
            for lowest in [0, 80, 0xFFFF - u16::try_from((1_u32 << width) - 1).unwrap()] {
                let pixels = words(if width == 16 { 0 } else { lowest }, width);
                let mut bytes = b"before".to_vec();
                put(&mut bytes, &pixels);
                assert_eq!(bytes[6..], by_hand(&pixels));
                let length = bytes.len() - 6;
                assert_eq!(length, 3 + 8 * usize::try_from(width).unwrap());
                assert!(length <= BYTES_MAX);
                bytes.extend(b"behind");
                assert_eq!(take(&bytes[6..]), Some((pixels, length)));
                for cut in 0..length {
                    assert_eq!(take(&bytes[6..6 + cut]), None);
                }
            }
        }
    }

    #[test]
    fn bytes_that_put_does_not_write_are_rejected() {
        let mut good = Vec::new();
        put(&mut good, &words(80, 5));
        let mut wider = vec![80, 0, 6];
        wider.extend(by_hand(&words(80, 6)).split_off(3));
        assert!(take(&wider).is_some());
        // All differences below 32: five bits would do.
        for byte in &mut wider[3..] {
            *byte = 0x41;
        }
        assert_eq!(take(&wider), None, "too wide");
        let mut lower = good.clone();
        lower[3..].fill(0xFF);
        assert_eq!(take(&lower), None, "no word equals the lowest");
        let mut beyond = good.clone();
        beyond[..2].fill(0xFF);
        assert_eq!(take(&beyond), None, "words above 65535");
        let mut width = good;
        width[2] = 17;
        width.extend([0; 200]);
        assert_eq!(take(&width), None);
    }
}
