//! What a recording's file is called.

use axum::http::HeaderValue;
use std::fmt::Write as _;

/// The header `content-disposition` of a recording's file, which is called as the recording.
///
/// RFC 6266: a plain name for old programs, the exact one for the others.
#[must_use]
pub fn attachment(name: &str, extension: &str) -> HeaderValue {
    let plain: String = name
        .chars()
        .map(|character| {
            if matches!(character, ' '..='~') && character != '%' {
                character
            } else {
                '_'
            }
        })
        .collect();
    let mut exact = String::new();
    for byte in name.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
            exact.push(char::from(byte));
        } else {
            let _ = write!(exact, "%{byte:02X}");
        }
    }
    let disposition = format!(
        r#"attachment; filename="{plain}.{extension}"; filename*=UTF-8''{exact}.{extension}"#
    );
    HeaderValue::from_str(&disposition).unwrap_or(HeaderValue::from_static("attachment"))
}
