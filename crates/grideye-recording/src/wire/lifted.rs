//! Pixels out of the text of a JSON body, before it is parsed: they are most of it, and an array of numbers needs no parser.

use core::cell::Cell;
use grideye_frame::{PIXELS, PixelWord};
use memchr::memmem::Finder;

type Pixels = [PixelWord; PIXELS];

const KEY: &[u8] = b"\"pixels_raw\"";
/// Stands where an array was. A body that has it there of itself asks for more arrays than were taken.
const TAKEN: &[u8] = b"0";

/// A body without the arrays of its pixels, and these in order.
///
/// Quotes inside of a text are escaped, so what looks like the key is the key, or the end of another that is refused by name.
pub(super) struct Lifted {
    pub(super) rest: Vec<u8>,
    pixels: Vec<Pixels>,
    next: Cell<usize>,
}

impl Lifted {
    /// Whatever is no array of 64 words stays where it is, for the parser to name.
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

    /// The pixels of the next array that was taken.
    pub(super) fn next(&self) -> Option<Pixels> {
        let pixels = self.pixels.get(self.next.replace(self.next.get() + 1));
        pixels.copied()
    }
}

/// The words of an array of 64, and the text behind it.
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

/// A number as JSON writes it, without needless zeros.
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

/// The text behind this mark, which blanks may precede.
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
