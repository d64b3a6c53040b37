//! Makes untrusted text safe for an error message and a terminal.

const SHOWN_CHARS_MAX: usize = 48;

/// Untrusted text in quotation marks: control characters escaped, long text cut.
pub(crate) fn quoted(text: &str) -> String {
    format!("\"{}\"", shortened(text))
}

/// Untrusted text without quotation marks: control characters escaped, long text cut.
pub(crate) fn shortened(text: &str) -> String {
    let mut shown = String::new();
    for (index, character) in text.chars().enumerate() {
        if index == SHOWN_CHARS_MAX {
            shown.push('…');
            break;
        }
        if character.is_control() || !(character == ' ' || character.is_ascii_graphic()) {
            shown.extend(character.escape_default());
        } else {
            shown.push(character);
        }
    }
    shown
}

/// Text of others in one line of a message: control characters, and the marks that turn or hide what stands beside them, are
/// escaped.
///
/// ```
/// use grideye_recording::printable;
/// assert_eq!(printable("Küche 1"), "Küche 1");
/// assert_eq!(printable("a\u{1b}[2J\nb\u{202e}c"), "a\\u{1b}[2J\\nb\\u202ec");
/// ```
#[must_use]
pub fn printable(text: &str) -> String {
    escaped(text, &[])
}

/// A message of several lines, in which everything but tabs and the ends of its lines is [`printable`].
#[must_use]
pub fn printable_lines(text: &str) -> String {
    escaped(text, &['\n', '\t'])
}

fn escaped(text: &str, kept: &[char]) -> String {
    let mut shown = String::with_capacity(text.len());
    for character in text.chars() {
        match !is_hidden(character) || kept.contains(&character) {
            true => shown.push(character),
            false if character < ' ' => shown.extend(character.escape_default()),
            // As JSON has it, which may contain such a character as it is.
            false => shown.push_str(&format!("\\u{:04x}", u32::from(character))),
        }
    }
    shown
}

/// Whether a character changes how others look or a terminal behaves: control characters, ends of lines, and those that turn
/// the direction of writing (Unicode's `Bidi_Control`; Unicode 15.1, annex 9, table 1).
#[must_use]
pub fn is_hidden(character: char) -> bool {
    character.is_control()
        || matches!(character, '\u{61C}' | '\u{200E}' | '\u{200F}' | '\u{2028}'..='\u{202E}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn untrusted_text_can_neither_flood_nor_control_a_terminal() {
        assert_eq!(quoted("pi-1"), "\"pi-1\"");
        assert_eq!(shortened("a\u{1b}[2Jb\r\n"), "a\\u{1b}[2Jb\\r\\n");
        assert_eq!(shortened("\u{202e}"), "\\u{202e}");
        let cut = shortened(&"x".repeat(1_000_000));
        assert_eq!(cut, format!("{}…", "x".repeat(48)));
    }
}
