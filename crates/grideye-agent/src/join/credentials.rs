//! By what the agent knows its collector and is known by it.

use super::error::NotJoined;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A text that is shown to the collector and to nobody else: debugging does not show it.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Secret(String);

/// By what the agent knows its collector and is known by it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Credentials {
    /// The token, which goes with every request.
    pub token: Option<Secret>,
    /// The one authority whose certificates are believed, in PEM. `https` does not go without.
    pub authority: Option<String>,
    /// The agent's own certificate, where the collector asks for one.
    pub client: Option<ClientCertificate>,
}

/// A certificate with its chain, and its key, in PEM.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ClientCertificate {
    /// The certificate, and those that it leads to.
    pub chain: String,
    /// Its key.
    pub key: Secret,
}

impl Secret {
    /// A text that can stand in a header.
    ///
    /// # Errors
    /// [`NotJoined`] for anything else.
    pub fn new(text: &str) -> Result<Self, NotJoined> {
        let is_plain = text.bytes().all(|byte| byte.is_ascii_graphic());
        if is_plain && (1..=TOKEN_CHARS_MAX).contains(&text.len()) {
            return Ok(Self(text.to_owned()));
        }
        Err(NotJoined(
            "the token is empty, cut, or holds what no token holds".to_owned(),
        ))
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

/// Length of a token at most, in characters.
const TOKEN_CHARS_MAX: usize = 256;
