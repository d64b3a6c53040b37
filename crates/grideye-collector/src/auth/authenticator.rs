//! Identifies the caller of each request, with a list of tokens that is reread from disk.

use crate::auth::book::{TokenBook, TokenRecord};
use crate::auth::error::{AccessError, Result};
use crate::auth::folder::{AccessFolder, FileState};
use crate::auth::session::Sessions;
use crate::auth::token::Token;
use crate::lock::lock;
use std::sync::{Arc, Mutex};
use std::time::Duration;

#[derive(Debug, Clone)]
pub(crate) enum Caller {
    /// No token was ever created here, so anyone may call.
    Anyone,
    /// The holder of a valid token, sent with the request or through the page's cookie.
    Holder {
        record: Arc<TokenRecord>,
        by_cookie: bool,
    },
}

impl Caller {
    /// The caller's token, unless none was asked for.
    pub(crate) fn record(&self) -> Option<&Arc<TokenRecord>> {
        match self {
            Self::Anyone => None,
            Self::Holder { record, .. } => Some(record),
        }
    }
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Presented<'a> {
    Nothing,
    Token(&'a str),
    Cookie(&'a str),
}

#[derive(Debug, Clone)]
pub(crate) enum Unknown {
    /// No token was sent, and tokens are required.
    NoToken,
    /// The text sent is not a token that was made here.
    BadToken,
    /// This token was revoked.
    Revoked(Arc<TokenRecord>),
    /// The cookie is not ours or expired, or its token was revoked.
    BadCookie,
}

pub(crate) struct Authenticator {
    folder: Option<AccessFolder>,
    reread_every: Duration,
    known: Mutex<Known>,
}

struct Known {
    book: Arc<TokenBook>,
    sessions: Option<Arc<Sessions>>,
    state: Option<FileState>,
    looked_at: Duration,
    /// Why the last read of the list failed. The list before it stays in force.
    fault: Option<String>,
}

impl Authenticator {
    pub(crate) fn open() -> Self {
        Self {
            folder: None,
            reread_every: Duration::MAX,
            known: Mutex::new(Known {
                book: Arc::default(),
                sessions: None,
                state: None,
                looked_at: Duration::ZERO,
                fault: None,
            }),
        }
    }

    /// Admits the holders of the folder's tokens, or anyone while there are none.
    pub(crate) fn of(folder: AccessFolder, reread_every: Duration) -> Result<Self> {
        let authenticator = Self {
            folder: Some(folder),
            reread_every,
            ..Self::open()
        };
        authenticator.reread(&mut lock(&authenticator.known))?;
        Ok(authenticator)
    }

    pub(crate) fn asks_for_tokens(&self, now: Duration) -> bool {
        !self.look(now).1
    }

    /// The same, and rereads the list now.
    pub(crate) fn asks_for_tokens_now(&self, now: Duration) -> bool {
        self.look_again(now);
        self.asks_for_tokens(now)
    }

    pub(crate) fn fault(&self) -> Option<String> {
        lock(&self.known).fault.clone()
    }

    /// Identifies the caller. `now` is on the monotonic clock; `t_now_s` (since 1970-01-01 UTC) is called only for a
    /// cookie.
    pub(crate) fn authenticate(
        &self,
        presented: Presented<'_>,
        now: Duration,
        t_now_s: impl FnOnce() -> i64,
    ) -> Result<Caller, Unknown> {
        let (book, is_open) = self.look(now);
        if is_open {
            return Ok(Caller::Anyone);
        }
        match presented {
            Presented::Nothing => Err(Unknown::NoToken),
            Presented::Token(text) => {
                by_token(&book, text).or_else(|_unknown| by_token(&self.look_again(now), text))
            }
            Presented::Cookie(cookie) => self
                .by_cookie(&book, cookie, t_now_s())
                .ok_or(Unknown::BadCookie),
        }
    }

    pub(crate) fn still_knows(&self, caller: &Caller, now: Duration) -> bool {
        let (book, is_open) = self.look(now);
        match caller {
            Caller::Anyone => is_open,
            Caller::Holder { record, .. } => book.get(&record.id).is_some(),
        }
    }

    /// A cookie for the holder of this token, valid until `t_end_s`.
    pub(crate) fn cookie(&self, record: &TokenRecord, t_end_s: i64) -> Result<String> {
        Ok(self
            .sessions()?
            .map_or_else(String::new, |sessions| sessions.cookie(record, t_end_s)))
    }

    fn by_cookie(&self, book: &TokenBook, cookie: &str, t_now_s: i64) -> Option<Caller> {
        let record = book.get(&Sessions::claimed(cookie)?)?;
        let sessions = self.sessions().ok()??;
        sessions
            .is_good(cookie, record, t_now_s)
            .then(|| Caller::Holder {
                record: Arc::clone(record),
                by_cookie: true,
            })
    }

    /// The key is created at the first sign-in.
    fn sessions(&self) -> Result<Option<Arc<Sessions>>> {
        let Some(folder) = &self.folder else {
            return Ok(None);
        };
        let mut known = lock(&self.known);
        if let Some(sessions) = &known.sessions {
            return Ok(Some(Arc::clone(sessions)));
        }
        let sessions = Arc::new(Sessions::new(&folder.session_key()?));
        known.sessions = Some(Arc::clone(&sessions));
        Ok(Some(sessions))
    }

    /// The list, reread if due, and whether anyone is admitted. An unreadable list may hold tokens, so it admits nobody
    /// new.
    fn look(&self, now: Duration) -> (Arc<TokenBook>, bool) {
        let mut known = lock(&self.known);
        if self.folder.is_some() && now.saturating_sub(known.looked_at) >= self.reread_every {
            self.refresh(&mut known, now);
        }
        let is_open = known.book.is_empty() && known.fault.is_none();
        (Arc::clone(&known.book), is_open)
    }

    /// Rereads the list now: a token may have just been created, and its holder must not be rejected.
    fn look_again(&self, now: Duration) -> Arc<TokenBook> {
        let mut known = lock(&self.known);
        self.refresh(&mut known, now);
        Arc::clone(&known.book)
    }

    fn refresh(&self, known: &mut Known, now: Duration) {
        known.looked_at = now;
        known.fault = self.reread(known).err().map(|error| error.to_string());
    }

    fn reread(&self, known: &mut Known) -> Result<()> {
        let Some(folder) = &self.folder else {
            return Ok(());
        };
        let state = folder.tokens_state()?;
        if state == known.state {
            return Ok(());
        }
        // A deleted list must not admit what it excluded.
        if state.is_none() && !known.book.is_empty() {
            let path = folder.path().join("tokens.json");
            return Err(AccessError::malformed(&path, "the list of tokens is gone"));
        }
        known.book = Arc::new(folder.book()?);
        known.state = state;
        Ok(())
    }
}

fn by_token(book: &TokenBook, text: &str) -> Result<Caller, Unknown> {
    let token: Token = text.parse().map_err(|_no_token| Unknown::BadToken)?;
    let record = book
        .find(token.id())
        .filter(|record| record.hash.is_of(&token));
    let record = Arc::clone(record.ok_or(Unknown::BadToken)?);
    match record.t_revoked_s {
        Some(_) => Err(Unknown::Revoked(record)),
        None => Ok(Caller::Holder {
            record,
            by_cookie: false,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::auth::token::Scope;

    const EVERY: Duration = Duration::from_secs(1);

    fn at(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    /// A folder with tokens of these names, its authenticator, and the text of each token.
    fn site(names: &[&str]) -> (tempfile::TempDir, AccessFolder, Authenticator, Vec<String>) {
        let around = tempfile::tempdir().unwrap();
        let folder = AccessFolder::new(around.path());
        let tokens = names.iter().map(|name| make(&folder, name)).collect();
        let authenticator = Authenticator::of(folder.clone(), EVERY).unwrap();
        (around, folder, authenticator, tokens)
    }

    fn make(folder: &AccessFolder, name: &str) -> String {
        let made = folder.change(|book| book.add(name, Scope::Read, 1));
        made.unwrap().reveal()
    }

    fn revoke(folder: &AccessFolder) {
        folder.change(|book| book.revoke("page", 2)).unwrap();
    }

    fn shown(authenticator: &Authenticator, token: &str, seconds: u64) -> Result<Caller, Unknown> {
        authenticator.authenticate(Presented::Token(token), at(seconds), || 0)
    }

    fn nothing(authenticator: &Authenticator, seconds: u64) -> Result<Caller, Unknown> {
        authenticator.authenticate(Presented::Nothing, at(seconds), || 0)
    }

    fn is_holder(found: &Result<Caller, Unknown>, with_cookie: bool) -> bool {
        matches!(found, Ok(Caller::Holder { by_cookie, .. }) if *by_cookie == with_cookie)
    }

    #[test]
    fn without_tokens_anyone_is_let_in_and_the_first_token_ends_that() {
        let (_around, folder, authenticator, _) = site(&[]);
        assert!(matches!(nothing(&authenticator, 0), Ok(Caller::Anyone)));
        let token = make(&folder, "page");
        let not_looked_at_yet = nothing(&authenticator, 0);
        assert!(matches!(not_looked_at_yet, Ok(Caller::Anyone)));
        assert!(matches!(nothing(&authenticator, 1), Err(Unknown::NoToken)));
        assert!(is_holder(&shown(&authenticator, &token, 1), false));
        revoke(&folder);
        let found = shown(&authenticator, &token, 2);
        assert!(matches!(found, Err(Unknown::Revoked(record)) if record.name == "page"));
        let still_closed = nothing(&authenticator, 3);
        assert!(matches!(still_closed, Err(Unknown::NoToken)));
    }

    #[test]
    fn a_token_that_was_made_just_now_is_known_at_once() {
        let (_around, folder, authenticator, _) = site(&["first"]);
        // Within the second in which the list is not reread by itself.
        for name in ["second", "third"] {
            let token = make(&folder, name);
            assert!(shown(&authenticator, &token, 10).is_ok(), "{name}");
        }
    }

    #[test]
    fn a_deleted_or_broken_list_stays_in_force_and_is_reported() {
        let (around, _folder, authenticator, tokens) = site(&["page"]);
        let file = around.path().join("tokens.json");
        let whole = std::fs::read(&file).unwrap();
        let still = |seconds, said: &str| {
            assert!(shown(&authenticator, &tokens[0], seconds).is_ok());
            assert!(nothing(&authenticator, seconds).is_err());
            let fault = authenticator.fault().unwrap_or_default();
            let is_said = fault.contains(said) && fault.is_empty() == said.is_empty();
            assert!(is_said, "{fault}");
        };
        std::fs::remove_file(&file).unwrap();
        still(1, "gone");
        std::fs::write(&file, b"{").unwrap();
        still(2, "tokens.json: ");
        std::fs::write(&file, whole).unwrap();
        still(3, "");
    }

    #[test]
    fn the_number_alone_or_the_secret_of_another_is_not_enough() {
        let (_around, _folder, authenticator, tokens) = site(&["one", "two"]);
        let (one, two) = (&tokens[0], &tokens[1]);
        let (head, secret) = (&one[..one.len() - 64], &two[two.len() - 64..]);
        for bad in [head, &format!("{head}{secret}"), ""] {
            let found = shown(&authenticator, bad, 0);
            assert!(matches!(found, Err(Unknown::BadToken)), "{bad}");
        }
    }

    #[test]
    fn a_cookie_is_valid_at_every_collector_of_the_folder_until_its_token_is_revoked() {
        let (_around, folder, authenticator, _) = site(&["page"]);
        let other = Authenticator::of(folder.clone(), EVERY).unwrap();
        let record = Arc::clone(&folder.book().unwrap().records()[0]);
        let cookie = authenticator.cookie(&record, 1000).unwrap();
        let by_cookie = |authenticator: &Authenticator, seconds, t_now_s| {
            authenticator.authenticate(Presented::Cookie(&cookie), at(seconds), || t_now_s)
        };
        assert!(is_holder(&by_cookie(&other, 0, 999), true));
        let late = by_cookie(&authenticator, 0, 1000);
        assert!(matches!(late, Err(Unknown::BadCookie)));
        // A cookie is not a token, nor a token a cookie.
        assert!(shown(&authenticator, &cookie, 0).is_err());
        revoke(&folder);
        let revoked = by_cookie(&authenticator, 1, 0);
        assert!(matches!(revoked, Err(Unknown::BadCookie)));
    }
}
