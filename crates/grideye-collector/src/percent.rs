//! Bytes as they stand in a URL (RFC 3986).

use std::fmt::Write as _;

/// Letters, digits and the bytes in `plain` as they are, and `%2F` for any other.
pub(crate) fn percent_encoded(bytes: &[u8], plain: &[u8]) -> String {
    let mut encoded = String::new();
    for byte in bytes {
        if byte.is_ascii_alphanumeric() || plain.contains(byte) {
            encoded.push(char::from(*byte));
        } else {
            // Writing into a string does not fail.
            let _ = write!(encoded, "%{byte:02X}");
        }
    }
    encoded
}
