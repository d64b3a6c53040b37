//! Takes the pixels out of a JSON body before parsing: they are most of it, and arrays of numbers need no parser.

use core::cell::Cell;
use grideye_frame::{PIXELS, PixelWord};
use memchr::memmem::Finder;

type Pixels = [PixelWord; PIXELS];

const KEY: &[u8] = b"\"pixels_raw\"";
/// Replaces each array taken out. A body that contains this itself asks for more arrays than were taken, and fails.
const TAKEN: &[u8] = b"0";

/// A body without its pixel arrays, and these arrays in order.
///
/// JSON escapes quotes inside a string, so text that looks like the key is the key, or the end of another key that is
/// rejected by name.
pub(super) struct Lifted {
    pub(super) rest: Vec<u8>,
    pixels: Vec<Pixels>,
    next: Cell<usize>,
}

impl Lifted {
    /// Leaves anything but an array of 64 words in place, for the parser to name.
    pub(super) fn of(json: &[u8]) -> Self {
        let key = Finder::new(KEY);
        let (mut rest, mut pixels) = (Vec::new(), Vec::new());
        let mut left = json;
        while let Some(at) = key.find(left) {
            let (before, text) = left.split_at(at + KEY.len());
            rest.extend_from_slice(before);
            left = text;
            if let Some((found, text)) = after(text, b':').and_then(pixels_of) {
                rest.push(b':');
                rest.extend_from_slice(TAKEN);
                pixels.push(found);
                left = text;
            }
        }
        rest.extend_from_slice(left);
        let next = Cell::new(0);
        Self { rest, pixels, next }
    }

    pub(super) fn next(&self) -> Option<Pixels> {
        let pixels = self.pixels.get(self.next.replace(self.next.get() + 1));
        pixels.copied()
    }
}

/// The words of an array of 64, and the text after it.
fn pixels_of(text: &[u8]) -> Option<(Pixels, &[u8])> {
    let mut words = [PixelWord(0); PIXELS];
    let mut text = after(text, b'[')?;
    for (index, slot) in words.iter_mut().enumerate() {
        if index > 0 {
            text = after(text, b',')?;
        }
        let (word, behind) = word_of(without_blanks(text))?;
        (*slot, text) = (PixelWord(word), behind);
    }
    Some((words, after(text, b']')?))
}

/// A number as JSON writes it, without leading zeros.
fn word_of(text: &[u8]) -> Option<(u16, &[u8])> {
    const DIGITS_MAX: usize = 5;
    let (mut word, mut digits) = (0, 0);
    while let Some(digit @ b'0'..=b'9') = text.get(digits) {
        word = 10 * word + u32::from(digit - b'0');
        digits += 1;
        if digits > DIGITS_MAX {
            return None;
        }
    }
    let is_number = digits == 1 || digits > 1 && text[0] != b'0';
    let word = u16::try_from(word).ok().filter(|_| is_number)?;
    Some((word, &text[digits..]))
}

/// The text after this mark, which may follow blanks.
fn after(text: &[u8], mark: u8) -> Option<&[u8]> {
    match without_blanks(text).split_first() {
        Some((&first, behind)) if first == mark => Some(behind),
        _ => None,
    }
}

fn without_blanks(mut text: &[u8]) -> &[u8] {
    while let Some((b' ' | b'\n' | b'\r' | b'\t', behind)) = text.split_first() {
        text = behind;
    }
    text
}
