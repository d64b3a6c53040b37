//! How agent and collector identify each other: token, pin, certificates, address.

use ring::digest;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::net::Ipv6Addr;
use std::str::FromStr;

/// A text for the collector only; `Debug` hides it.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Secret(String);

/// The credentials that agent and collector show each other.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Credentials {
    /// The token sent with every request.
    pub token: Option<Secret>,
    /// The one trusted authority, in PEM. `https` requires it.
    pub authority: Option<String>,
    /// The agent's own certificate, if the collector requires one.
    pub client: Option<ClientCertificate>,
}

/// A certificate with its chain, and its key, in PEM.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ClientCertificate {
    /// The certificate and its chain.
    pub chain: String,
    /// Its key.
    pub key: Secret,
}

impl Secret {
    /// A token that can appear in a header.
    ///
    /// # Errors
    /// [`NotJoined`] for anything else.
    pub fn new(text: &str) -> Result<Self, NotJoined> {
        let is_plain = text.bytes().all(|byte| byte.is_ascii_graphic());
        if is_plain && (1..=TOKEN_CHARS_MAX).contains(&text.len()) {
            return Ok(Self(text.to_owned()));
        }
        let what = "the token is empty, cut, or contains a character that no token has";
        Err(NotJoined(what.to_owned()))
    }

    /// A key in PEM.
    #[must_use]
    pub fn pem(text: String) -> Self {
        Self(text)
    }

    /// The text itself.
    #[must_use]
    pub fn reveal(&self) -> &str {
        &self.0
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Secret")
    }
}

/// Maximum length of a token in characters.
const TOKEN_CHARS_MAX: usize = 256;

/// Why a line or file is not understood. It does not quote the content, which includes a token.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NotJoined(pub(super) String);

/// The SHA-256 of a certificate, as `sha256-` and 64 hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pin(String);

impl Pin {
    /// The pin of a certificate in DER.
    #[must_use]
    pub fn of(certificate: &[u8]) -> Self {
        let hash = digest::digest(&digest::SHA256, certificate);
        let digits = hash.as_ref().iter().map(|byte| format!("{byte:02x}"));
        Self(format!("sha256-{}", digits.collect::<String>()))
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
        let what = "its pin is cut: expected sha256- and 64 hexadecimal digits";
        Err(NotJoined(what.to_owned()))
    }
}

impl fmt::Display for Pin {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

/// Whether this is HOST:PORT. Reject a wrong one at the start, because a failed delivery would be retried without end.
pub(crate) fn is_host_and_port(authority: &str) -> bool {
    let Some((host, port)) = authority.rsplit_once(':') else {
        return false;
    };
    let is_port =
        port.bytes().all(|b| b.is_ascii_digit()) && port.parse::<u16>().is_ok_and(|port| port != 0);
    let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let inner = host
        .strip_prefix('[')
        .and_then(|rest| rest.strip_suffix(']'));
    let is_host = match inner {
        Some(inner) => inner.parse::<Ipv6Addr>().is_ok(),
        None => !host.is_empty() && host.chars().all(is_name),
    };
    is_port && is_host
}

pub(crate) fn check_url(url: &str) -> Result<(), String> {
    let secure = url.strip_prefix("https://");
    let authority = secure.or_else(|| url.strip_prefix("http://"));
    if authority.is_some_and(is_host_and_port) {
        return Ok(());
    }
    Err("expected the collector as https://HOST:PORT".to_owned())
}
