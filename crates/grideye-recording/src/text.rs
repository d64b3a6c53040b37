//! Makes untrusted text safe for an error message.

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
