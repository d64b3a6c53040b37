//! Frames as a hexadecimal dump of the sensor's registers.

use grideye_frame::PIXELS;

/// A line that ends in a frame of hexadecimal bytes (low byte first, as the registers lie) or words, with decimals in their
/// place; `None` for any other.
pub(super) fn decimal(text: &str) -> Option<String> {
    let between = |letter: char| letter.is_whitespace() || ",;[](){}|\"'".contains(letter);
    let tokens: Vec<&str> = text
        .split(between)
        .filter(|token| !token.is_empty())
        .collect();
    let digits = |token: &str| {
        let bare = token
            .strip_prefix("0x")
            .or_else(|| token.strip_prefix("0X"));
        let is_hex = bare
            .unwrap_or(token)
            .bytes()
            .all(|byte| byte.is_ascii_hexdigit());
        (is_hex && (bare.is_some() || [2, 4].contains(&token.len())))
            .then(|| bare.unwrap_or(token).to_owned())
    };
    let mut bytes: Vec<String> = tokens
        .iter()
        .rev()
        .map_while(|token| digits(token))
        .collect();
    bytes.reverse();
    let lead = tokens.len() - bytes.len();
    if let (true, Some(dump)) = (
        bytes.is_empty(),
        tokens.last().filter(|token| token.len() == 4 * PIXELS),
    ) {
        // All bytes in one word.
        let pairs = (0..2 * PIXELS).map(|at| dump.get(2 * at..2 * at + 2).map(str::to_owned));
        bytes = pairs.collect::<Option<_>>()?;
        return joined(&tokens[..tokens.len() - 1], &words(&bytes)?);
    }
    let is_byte = |token: &String| token.len() <= 2;
    let values = match bytes.len() {
        count if count >= 2 * PIXELS && bytes.iter().all(is_byte) => {
            words(&bytes[count - 2 * PIXELS..])?
        }
        count
            if count >= 8
                && (tokens[lead..].iter().all(|token| token.starts_with("0x"))
                    || are_words(&bytes)) =>
        {
            let values = bytes
                .iter()
                .map(|token| u32::from_str_radix(token, 16).ok());
            values.collect::<Option<Vec<u32>>>()?
        }
        _ => return None,
    };
    joined(&tokens[..lead], &values)
}

/// Words of four digits, all of them small or negative, and one with a letter.
fn are_words(tokens: &[String]) -> bool {
    let has_letter = tokens
        .iter()
        .any(|token| token.bytes().any(|byte| byte.is_ascii_alphabetic()));
    has_letter
        && tokens
            .iter()
            .all(|token| token.len() == 4 && token.starts_with(['0', 'F', 'f']))
}

fn joined(lead: &[&str], words: &[u32]) -> Option<String> {
    let words: Vec<String> = words.iter().map(u32::to_string).collect();
    let lead = lead.iter().map(|token| format!("{token} "));
    Some(lead.collect::<String>() + &words.join(","))
}

/// Words of 12 bits from pairs of bytes, of which the high ones are small.
fn words(bytes: &[String]) -> Option<Vec<u32>> {
    let bytes: Option<Vec<u32>> = bytes
        .iter()
        .map(|byte| u32::from_str_radix(byte, 16).ok())
        .collect();
    let bytes = bytes?;
    let is_small = |offset: usize| bytes.iter().skip(offset).step_by(2).all(|byte| *byte < 16);
    let high = match (is_small(1), is_small(0)) {
        (true, false) => 1,
        (false, true) => 0,
        _ => return None,
    };
    Some(
        bytes
            .chunks(2)
            .map(|pair| pair[high] * 256 + pair[1 - high])
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_and_words_become_decimals() {
        let bytes = "4F 00 50 00 ".repeat(32);
        let expected = "79,80,".repeat(32);
        assert_eq!(
            decimal(&bytes).as_deref(),
            Some(expected.trim_end_matches(','))
        );
        assert_eq!(
            decimal(&format!("12:00:01 {}", "0x00,0x4f,".repeat(64))).unwrap()[..17],
            *"12:00:01 79,79,79"
        );
        assert_eq!(
            decimal(&"4f00".repeat(64)).as_deref(),
            Some("79,".repeat(64).trim_end_matches(','))
        );
        assert_eq!(
            decimal("0x4F 0x50 0xFFC 0x4F 0x4F 0x4F 0x4F 0x4F").as_deref(),
            Some("79,80,4092,79,79,79,79,79")
        );
        assert_eq!(decimal("19 20 21"), None);
        assert_eq!(
            decimal(&"19 ".repeat(128)),
            None,
            "which is the high byte is not told"
        );
    }
}
