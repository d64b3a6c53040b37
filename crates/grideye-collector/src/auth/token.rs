//! A token as its holder has it, and its scope.

use crate::auth::error::{AccessError, Result};
use ring::digest;
use ring::rand::{SecureRandom, SystemRandom};
use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;
use subtle::ConstantTimeEq;

/// Length of a secret in bytes: 256 bits cannot be guessed.
pub(crate) const SECRET_BYTES: usize = 32;
const ID_BYTES: usize = 6;
const PREFIX: &str = "grideye";

/// A token: `grideye-`, its number and its secret in hexadecimal. The collector stores only a hash of the secret.
#[derive(Clone, PartialEq, Eq)]
pub struct Token {
    id: TokenId,
    secret: [u8; SECRET_BYTES],
}

/// The public part of a token: 12 hexadecimal digits by which it is listed, logged and revoked.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TokenId(String);

/// What a token allows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Scope {
    /// Posting frames of these devices, and nothing else.
    Ingest {
        /// The devices' names, 1 to [`DEVICES_PER_TOKEN_MAX`](super::DEVICES_PER_TOKEN_MAX).
        devices: BTreeSet<String>,
    },
    /// Reading everything: the page, recordings, audit, metrics.
    Read,
    /// Reading, and changing recordings.
    Admin,
}

impl Token {
    /// A new token from the system's random numbers.
    ///
    /// # Errors
    /// [`AccessError::Failed`] if the system gives none.
    pub fn random() -> Result<Self> {
        let id = random_bytes::<ID_BYTES>()?;
        Ok(Self {
            id: TokenId(hex(&id)),
            secret: random_bytes()?,
        })
    }

    /// Its public number.
    #[must_use]
    pub fn id(&self) -> &TokenId {
        &self.id
    }

    /// The whole token, for its holder only.
    #[must_use]
    pub fn reveal(&self) -> String {
        format!("{PREFIX}-{}-{}", self.id.0, hex(&self.secret))
    }

    /// The stored hash. A secret of 256 random bits needs no salt and no slow hash.
    pub(crate) fn hash(&self) -> SecretHash {
        SecretHash(sha256(&self.secret))
    }
}

impl FromStr for Token {
    type Err = NotAToken;

    fn from_str(text: &str) -> Result<Self, NotAToken> {
        let mut parts = text.split('-');
        let (prefix, id, secret) = (parts.next(), parts.next(), parts.next());
        match (prefix, id, secret, parts.next()) {
            (Some(PREFIX), Some(id), Some(secret), None) => Ok(Self {
                id: id.parse()?,
                secret: unhex(secret).ok_or(NotAToken)?,
            }),
            _ => Err(NotAToken),
        }
    }
}

/// Shows only the number: an error must not carry a secret into a log.
impl fmt::Debug for Token {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Token({})", self.id)
    }
}

/// The text is not a token. The error does not repeat it: it may contain one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "this is not a token: expected `grideye-`, 12 hexadecimal digits, `-`, 64 hexadecimal digits"
)]
pub struct NotAToken;

impl FromStr for TokenId {
    type Err = NotAToken;

    fn from_str(text: &str) -> Result<Self, NotAToken> {
        unhex::<ID_BYTES>(text).ok_or(NotAToken)?;
        Ok(Self(text.to_owned()))
    }
}

impl fmt::Display for TokenId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

impl Scope {
    /// `ingest`, `read` or `admin`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Ingest { .. } => "ingest",
            Self::Read => "read",
            Self::Admin => "admin",
        }
    }
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct SecretHash([u8; SECRET_BYTES]);

impl SecretHash {
    /// Whether this is the hash of the token's secret, compared in constant time.
    pub(crate) fn is_of(&self, token: &Token) -> bool {
        self.0.ct_eq(&token.hash().0).into()
    }

    pub(crate) fn to_hex(self) -> String {
        hex(&self.0)
    }

    pub(crate) fn from_hex(text: &str) -> Option<Self> {
        unhex(text).map(Self)
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &self.0
    }
}

pub(crate) fn sha256(bytes: &[u8]) -> [u8; 32] {
    let mut hash = [0; 32];
    hash.copy_from_slice(digest::digest(&digest::SHA256, bytes).as_ref());
    hash
}

pub(crate) fn random_bytes<const N: usize>() -> Result<[u8; N]> {
    let mut bytes = [0; N];
    SystemRandom::new()
        .fill(&mut bytes)
        .map_err(|error| AccessError::no_key(&error))?;
    Ok(bytes)
}

pub(crate) fn hex(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 16] = b"0123456789abcdef";
    let digit = |nibble: u8| char::from(DIGITS[usize::from(nibble)]);
    bytes
        .iter()
        .flat_map(|byte| [digit(byte >> 4), digit(byte & 15)])
        .collect()
}

/// Decodes exactly `2 * N` lower-case hexadecimal digits.
pub(crate) fn unhex<const N: usize>(text: &str) -> Option<[u8; N]> {
    if text.len() != 2 * N {
        return None;
    }
    let nibble = |digit: u8| match digit {
        b'0'..=b'9' => Some(digit - b'0'),
        b'a'..=b'f' => Some(digit - b'a' + 10),
        _ => None,
    };
    let mut bytes = [0; N];
    for (byte, pair) in bytes.iter_mut().zip(text.as_bytes().chunks_exact(2)) {
        *byte = nibble(pair[0])? << 4 | nibble(pair[1])?;
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_reads_back_has_256_random_bits_and_shows_them_to_no_debugger() {
        let token = Token::random().unwrap();
        let text = token.reveal();
        assert_eq!(text.len(), "grideye-".len() + 12 + 1 + 64);
        assert_eq!(text.parse::<Token>().unwrap(), token);
        let other = Token::random().unwrap();
        assert!(other != token && other.id() != token.id());
        let set_bits: u32 = token.secret.iter().map(|byte| byte.count_ones()).sum();
        // 256 fair coins: fewer than 64 or more than 192 heads has a probability below 1e-14.
        assert!((64..=192).contains(&set_bits), "{set_bits}");
        let shown = format!("{token:?}");
        assert!(shown.contains(&token.id().to_string()));
        assert!(!text.contains(&shown) && !shown.contains(&hex(&token.secret)));
    }

    #[test]
    fn the_hash_is_sha_256_and_knows_its_token_and_no_other() {
        // FIPS 180-2, appendix B.1.
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(hex(&sha256(b"abc")), expected);
        let token = Token::random().unwrap();
        assert_eq!(token.hash().to_hex(), hex(&sha256(&token.secret)));
        let hash = SecretHash::from_hex(&token.hash().to_hex()).unwrap();
        assert!(hash.is_of(&token));
        for byte in 0..SECRET_BYTES {
            let mut other = token.clone();
            other.secret[byte] ^= 1;
            assert!(!hash.is_of(&other), "byte {byte}");
        }
    }

    #[test]
    fn hexadecimal_digits_are_taken_in_one_spelling_and_length() {
        assert_eq!(unhex::<2>("00ff"), Some([0, 255]));
        assert_eq!(hex(&[0, 255, 0x1a]), "00ff1a");
        for bad in ["00f", "00fff", "00FF", "00fg", "é0f"] {
            assert_eq!(unhex::<2>(bad), None, "{bad}");
        }
    }
}
