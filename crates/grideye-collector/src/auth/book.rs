//! The list of tokens, as stored in `tokens.json`.

use crate::auth::error::{AccessError, Result};
use crate::auth::limits::{DEVICES_PER_TOKEN_MAX, TOKEN_NAME_CHARS_MAX, TOKENS_MAX};
use crate::auth::token::{Scope, SecretHash, Token, TokenId};
use grideye_recording::check_name;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;

const LAYOUT: u32 = 1;

/// Every token ever created, including revoked ones, in order of creation.
#[derive(Debug, Clone, Default)]
pub struct TokenBook {
    records: Vec<Arc<TokenRecord>>,
    by_id: HashMap<TokenId, usize>,
}

/// The stored part of a token, without its secret.
#[derive(Debug, Clone)]
pub struct TokenRecord {
    /// Its public number.
    pub id: TokenId,
    /// Its name: the device, unless named otherwise.
    pub name: String,
    /// What it allows.
    pub scope: Scope,
    /// When it was created, in seconds since 1970-01-01 UTC.
    pub t_made_s: i64,
    /// When it was revoked; `None` while it is valid.
    pub t_revoked_s: Option<i64>,
    pub(crate) hash: SecretHash,
}

impl TokenBook {
    /// Every token, oldest first.
    #[must_use]
    pub fn records(&self) -> &[Arc<TokenRecord>] {
        &self.records
    }

    /// Whether no token was ever created. Revoked ones count: revoking the last one must not admit anyone.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// The valid token with this number.
    pub(crate) fn get(&self, id: &TokenId) -> Option<&Arc<TokenRecord>> {
        self.find(id).filter(|record| record.t_revoked_s.is_none())
    }

    /// The token with this number, also a revoked one.
    pub(crate) fn find(&self, id: &TokenId) -> Option<&Arc<TokenRecord>> {
        self.records.get(*self.by_id.get(id)?)
    }

    /// Adds a token and returns it: only this once, because the secret is not stored.
    ///
    /// # Errors
    /// [`AccessError`]: too many tokens or devices, a bad name, or no randomness.
    pub fn add(&mut self, name: &str, scope: Scope, t_made_s: i64) -> Result<Token> {
        if self.records.len() >= TOKENS_MAX {
            return Err(AccessError::Failed(format!(
                "the folder already holds the maximum of {TOKENS_MAX} tokens\nhint: `grideye token list` shows them; use a separate folder for another site"
            )));
        }
        check(name, &scope)?;
        let token = Token::random()?;
        self.push(TokenRecord {
            id: token.id().clone(),
            name: name.to_owned(),
            scope,
            t_made_s,
            t_revoked_s: None,
            hash: token.hash(),
        });
        Ok(token)
    }

    /// Revokes the valid tokens with this number or name, and returns them.
    ///
    /// # Errors
    /// [`AccessError::Refused`] if there is none.
    pub fn revoke(&mut self, named: &str, t_revoked_s: i64) -> Result<Vec<Arc<TokenRecord>>> {
        let mut revoked = Vec::new();
        for record in &mut self.records {
            let is_meant = record.id.to_string() == named || record.name == named;
            if is_meant && record.t_revoked_s.is_none() {
                Arc::make_mut(record).t_revoked_s = Some(t_revoked_s);
                revoked.push(Arc::clone(record));
            }
        }
        if revoked.is_empty() {
            return Err(AccessError::Refused(format!(
                "no token {named:?} is in use\nhint: `grideye token list` shows them"
            )));
        }
        Ok(revoked)
    }

    fn push(&mut self, record: TokenRecord) {
        self.by_id.insert(record.id.clone(), self.records.len());
        self.records.push(Arc::new(record));
    }

    pub(super) fn from_json(json: &[u8], path: &Path) -> Result<Self> {
        let file: File =
            serde_json::from_slice(json).map_err(|error| AccessError::malformed(path, error))?;
        if file.layout != LAYOUT {
            let what = format!(
                "unknown layout {}; this program knows only {LAYOUT}",
                file.layout
            );
            return Err(AccessError::malformed(path, what));
        }
        if file.tokens.len() > TOKENS_MAX {
            return Err(AccessError::malformed(path, "too many tokens"));
        }
        let mut book = Self::default();
        for entry in file.tokens {
            let record = entry
                .into_record()
                .map_err(|what| AccessError::malformed(path, what))?;
            if book.by_id.contains_key(&record.id) {
                let what = format!("duplicate token {}", record.id);
                return Err(AccessError::malformed(path, what));
            }
            book.push(record);
        }
        Ok(book)
    }

    pub(super) fn to_json(&self) -> Result<Vec<u8>, serde_json::Error> {
        let tokens = self.records.iter().map(|record| Entry::of(record));
        let file = File {
            layout: LAYOUT,
            tokens: tokens.collect(),
        };
        let mut json = serde_json::to_vec_pretty(&file)?;
        json.push(b'\n');
        Ok(json)
    }
}

fn check(name: &str, scope: &Scope) -> Result<()> {
    let bad = |of, name: &str| {
        let name: String = name.chars().take(TOKEN_NAME_CHARS_MAX).collect();
        AccessError::Refused(format!(
            "{name:?} cannot be the name of a {of}: expected 1 to {TOKEN_NAME_CHARS_MAX} letters, digits, and - _ . :, beginning with a letter or a digit\nhint: for example pi-1"
        ))
    };
    if check_name(name).is_err() || name.chars().count() > TOKEN_NAME_CHARS_MAX {
        return Err(bad("token", name));
    }
    let Scope::Ingest { devices } = scope else {
        return Ok(());
    };
    if !(1..=DEVICES_PER_TOKEN_MAX).contains(&devices.len()) {
        return Err(AccessError::Refused(format!(
            "a token speaks for 1 to {DEVICES_PER_TOKEN_MAX} devices, found {}\nhint: enroll the others with another token",
            devices.len()
        )));
    }
    match devices.iter().find(|device| check_name(device).is_err()) {
        Some(device) => Err(bad("device", device)),
        None => Ok(()),
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    layout: u32,
    tokens: Vec<Entry>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    id: String,
    name: String,
    scope: String,
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    devices: BTreeSet<String>,
    sha256: String,
    t_made_s: i64,
    t_revoked_s: Option<i64>,
}

impl Entry {
    fn of(record: &TokenRecord) -> Self {
        Self {
            id: record.id.to_string(),
            name: record.name.clone(),
            scope: record.scope.name().to_owned(),
            devices: match &record.scope {
                Scope::Ingest { devices } => devices.clone(),
                Scope::Read | Scope::Admin => BTreeSet::new(),
            },
            sha256: record.hash.to_hex(),
            t_made_s: record.t_made_s,
            t_revoked_s: record.t_revoked_s,
        }
    }

    fn into_record(self) -> Result<TokenRecord, String> {
        let scope = match self.scope.as_str() {
            "ingest" => Scope::Ingest {
                devices: self.devices,
            },
            "read" if self.devices.is_empty() => Scope::Read,
            "admin" if self.devices.is_empty() => Scope::Admin,
            _ => return Err(format!("token {:?} has an unknown scope", self.id)),
        };
        check(&self.name, &scope).map_err(|error| error.to_string())?;
        let id = self.id.parse();
        let hash = SecretHash::from_hex(&self.sha256);
        let (Ok(id), Some(hash)) = (id, hash) else {
            return Err(format!("token {:?} has no number or no hash", self.id));
        };
        Ok(TokenRecord {
            id,
            name: self.name,
            scope,
            t_made_s: self.t_made_s,
            t_revoked_s: self.t_revoked_s,
            hash,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ingest(devices: &[&str]) -> Scope {
        let devices = devices.iter().map(|device| (*device).to_owned());
        Scope::Ingest {
            devices: devices.collect(),
        }
    }

    #[test]
    fn the_book_reads_back_and_holds_no_secret() {
        let mut book = TokenBook::default();
        let pi = book.add("pi-1", ingest(&["pi-1", "pi-2"]), 100).unwrap();
        let page = book.add("page", Scope::Read, 101).unwrap();
        book.revoke("page", 102).unwrap();
        let json = book.to_json().unwrap();
        let text = String::from_utf8(json.clone()).unwrap();
        for token in [&pi, &page] {
            let secret = token.reveal().rsplit('-').next().unwrap().to_owned();
            assert!(!text.contains(&secret), "{text}");
        }
        let again = TokenBook::from_json(&json, Path::new("tokens.json")).unwrap();
        assert_eq!(again.to_json().unwrap(), json);
        let record = again.get(pi.id()).unwrap();
        assert!(record.hash.is_of(&pi) && !record.hash.is_of(&page));
        assert_eq!(record.scope, ingest(&["pi-1", "pi-2"]));
        assert!(again.get(page.id()).is_none(), "it was revoked");
        assert_eq!(again.records()[1].t_revoked_s, Some(102));
    }

    #[test]
    fn one_token_too_many_is_refused() {
        let mut book = TokenBook::default();
        let token = book.add("first", Scope::Read, 1).unwrap();
        let record = (**book.get(token.id()).unwrap()).clone();
        for _ in 1..TOKENS_MAX {
            book.push(record.clone());
        }
        let error = book.add("last", Scope::Read, 1).unwrap_err().to_string();
        let full = format!("the folder already holds the maximum of {TOKENS_MAX} tokens");
        assert!(error.starts_with(&full), "{error}");
        let json = book.to_json().unwrap();
        assert!(u64::try_from(json.len()).unwrap() < crate::auth::limits::FILE_BYTES_MAX);
    }
}
