//! The hash by which a line names the collector's authority.

use super::error::NotJoined;
use ring::digest;
use std::fmt;
use std::str::FromStr;

/// The SHA-256 of a certificate, as `sha256-` and 64 hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pin(String);

impl Pin {
    /// The pin as it stands in a line.
    pub(super) fn as_str(&self) -> &str {
        &self.0
    }

    /// That of a certificate in DER.
    #[must_use]
    pub fn of(certificate: &[u8]) -> Self {
        let hash = digest::digest(&digest::SHA256, certificate);
        let digits: String = hash
            .as_ref()
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        Self(format!("sha256-{digits}"))
    }
}

impl FromStr for Pin {
    type Err = NotJoined;

    fn from_str(text: &str) -> Result<Self, NotJoined> {
        let digits = text.strip_prefix("sha256-").unwrap_or_default();
        let is_digit = |byte: u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte);
        if digits.len() == 64 && digits.bytes().all(is_digit) {
            return Ok(Self(text.to_owned()));
        }
        Err(NotJoined(
            "its pin is cut: expected sha256- and 64 hexadecimal digits".to_owned(),
        ))
    }
}

impl fmt::Display for Pin {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pin_is_the_sha_256() {
        // FIPS 180-2, appendix B.1.
        let abc = "sha256-ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(Pin::of(b"abc").to_string(), abc);
    }
}
