//! The page's cookie: the token that signed in, the expiry, and a signature. The server stores nothing; revoking the
//! token ends the cookie.

use crate::auth::book::TokenRecord;
use crate::auth::folder::SESSION_KEY_BYTES;
use crate::auth::token::{TokenId, hex, unhex};
use ring::hmac;

pub(crate) struct Sessions {
    key: hmac::Key,
}

impl Sessions {
    pub(super) fn new(key: &[u8; SESSION_KEY_BYTES]) -> Self {
        Self {
            key: hmac::Key::new(hmac::HMAC_SHA256, key),
        }
    }

    /// `NUMBER.SECONDS.SIGNATURE`: valid until `t_end_s`, in seconds since 1970-01-01 UTC.
    pub(super) fn cookie(&self, record: &TokenRecord, t_end_s: i64) -> String {
        let signature = hmac::sign(&self.key, &signed(record, t_end_s));
        format!("{}.{t_end_s}.{}", record.id, hex(signature.as_ref()))
    }

    pub(super) fn claimed(cookie: &str) -> Option<TokenId> {
        cookie.split('.').next()?.parse().ok()
    }

    /// Whether the cookie belongs to this token and has not expired; compares in constant time.
    pub(super) fn is_good(&self, cookie: &str, record: &TokenRecord, t_now_s: i64) -> bool {
        let mut parts = cookie.split('.').skip(1);
        let (Some(end), Some(signature), None) = (parts.next(), parts.next(), parts.next()) else {
            return false;
        };
        let (Ok(t_end_s), Some(signature)) = (end.parse(), unhex::<32>(signature)) else {
            return false;
        };
        let is_ours = hmac::verify(&self.key, &signed(record, t_end_s), &signature).is_ok();
        is_ours && t_now_s < t_end_s
    }
}

/// Includes the token's hash, so that a cookie is useless for a later token with the same number.
fn signed(record: &TokenRecord, t_end_s: i64) -> Vec<u8> {
    let mut text = format!("grideye session 1\n{}\n{t_end_s}\n", record.id).into_bytes();
    text.extend_from_slice(record.hash.bytes());
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::auth::book::TokenBook;
    use crate::auth::token::Scope;
    use std::sync::Arc;

    fn records() -> Vec<Arc<TokenRecord>> {
        let mut book = TokenBook::default();
        book.add("one", Scope::Read, 1).unwrap();
        book.add("two", Scope::Read, 1).unwrap();
        book.records().to_vec()
    }

    #[test]
    fn a_cookie_is_good_for_its_token_until_its_end() {
        let records = records();
        let sessions = Sessions::new(&[7; SESSION_KEY_BYTES]);
        let cookie = sessions.cookie(&records[0], 1000);
        assert_eq!(Sessions::claimed(&cookie).as_ref(), Some(&records[0].id));
        assert!(sessions.is_good(&cookie, &records[0], 999));
        assert!(!sessions.is_good(&cookie, &records[0], 1000));
        assert!(!sessions.is_good(&cookie, &records[1], 999));
        let others = Sessions::new(&[8; SESSION_KEY_BYTES]);
        assert!(!others.is_good(&cookie, &records[0], 999));
    }

    #[test]
    fn a_cookie_changed_anywhere_is_invalid() {
        let records = records();
        let sessions = Sessions::new(&[7; SESSION_KEY_BYTES]);
        let cookie = sessions.cookie(&records[0], 1000);
        for place in records[0].id.to_string().len()..cookie.len() {
            let mut changed = cookie.clone().into_bytes();
            changed[place] = if changed[place] == b'1' { b'2' } else { b'1' };
            let changed = String::from_utf8(changed).unwrap();
            assert!(!sessions.is_good(&changed, &records[0], 1), "{changed}");
        }
        let (head, _) = cookie.rsplit_once('.').unwrap();
        for bad in [head, "", ".", "..", &format!("{cookie}.")] {
            assert!(!sessions.is_good(bad, &records[0], 1), "{bad}");
        }
    }
}
