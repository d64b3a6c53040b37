//! Percent encoding for URLs (RFC 3986).

use std::fmt::Write as _;

/// Keeps letters, digits and the bytes in `plain`; writes any other as `%2F`.
pub(crate) fn percent_encoded(bytes: &[u8], plain: &[u8]) -> String {
    let mut encoded = String::new();
    for byte in bytes {
        if byte.is_ascii_alphanumeric() || plain.contains(byte) {
            encoded.push(char::from(*byte));
        } else {
            // Writing to a string cannot fail.
            let _ = write!(encoded, "%{byte:02X}");
        }
    }
    encoded
}
