//! The files of the folder: read whole, written whole, accessible only to their owner.

use crate::auth::authority::Authority;
use crate::auth::book::TokenBook;
use crate::auth::error::{AccessError, Result};
use crate::auth::limits::FILE_BYTES_MAX;
use crate::auth::token::{hex, random_bytes, unhex};
use grideye_recording::whole::replace_private;
use rustix::fs::{FlockOperation, flock};
use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Read as _};
use std::os::unix::fs::{
    DirBuilderExt as _, MetadataExt as _, OpenOptionsExt as _, PermissionsExt as _,
};
use std::path::{Path, PathBuf};

const TOKENS: &str = "tokens.json";
const SESSION_KEY: &str = "session.key";
const AUTHORITY_CERTIFICATE: &str = "authority.pem";
/// The certificate until its key is on the disk.
const AUTHORITY_DRAFT: &str = "authority.pem.new";
const AUTHORITY_KEY: &str = "authority.key";
const ADDRESS: &str = "address";
const LOCK: &str = "lock";
/// Length of the session key in bytes: that of the hash it signs with.
pub(super) const SESSION_KEY_BYTES: usize = 32;

/// The folder of tokens and keys. It is created at the first write.
#[derive(Debug, Clone)]
pub struct AccessFolder {
    path: PathBuf,
}

/// The collector's address, for agents.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    /// `https://HOST:PORT` or `http://HOST:PORT`.
    pub url: String,
    /// `sha256-…` of the authority that signs its certificate; `None` without TLS.
    pub pin: Option<String>,
}

/// Distinguishes states of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FileState {
    inode: u64,
    length: u64,
    modified: (i64, i64),
}

impl AccessFolder {
    /// The folder at this path, which need not exist.
    #[must_use]
    pub fn new(path: impl Into<PathBuf>) -> Self {
        let path = path.into();
        let absolute = std::path::absolute(&path);
        Self {
            path: absolute.unwrap_or(path),
        }
    }

    /// The files that hold secrets and that other users may read.
    pub(crate) fn exposed(&self) -> Vec<PathBuf> {
        let files = [TOKENS, SESSION_KEY, AUTHORITY_KEY].map(|name| self.file(name));
        let is_exposed = |path: &PathBuf| {
            fs::metadata(path).is_ok_and(|found| found.permissions().mode() & 0o077 != 0)
        };
        files.into_iter().filter(is_exposed).collect()
    }

    /// The folder itself, as an absolute path.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The current tokens; none if there is no folder.
    ///
    /// # Errors
    /// [`AccessError::Failed`].
    pub fn book(&self) -> Result<TokenBook> {
        let path = self.file(TOKENS);
        match read(&path)? {
            Some(json) => TokenBook::from_json(&json, &path),
            None => Ok(TokenBook::default()),
        }
    }

    /// Changes the tokens under a lock; a reader sees either the old list or the new one.
    ///
    /// # Errors
    /// Those of `change`, and [`AccessError::Failed`].
    pub fn change<T>(&self, change: impl FnOnce(&mut TokenBook) -> Result<T>) -> Result<T> {
        let _lock = self.lock()?;
        let mut book = self.book()?;
        let answer = change(&mut book)?;
        let path = self.file(TOKENS);
        let json = book
            .to_json()
            .map_err(|error| AccessError::malformed(&path, error))?;
        self.write(TOKENS, &json)?;
        Ok(answer)
    }

    /// The authority that signs the collector's certificates, created if missing.
    ///
    /// # Errors
    /// [`AccessError::Failed`].
    pub fn authority(&self) -> Result<Authority> {
        let _lock = self.lock()?;
        let (certificate, key) = (self.file(AUTHORITY_CERTIFICATE), self.file(AUTHORITY_KEY));
        let draft = self.file(AUTHORITY_DRAFT);
        match (read(&certificate)?, read(&key)?) {
            (Some(certificate_pem), Some(key_pem)) => {
                Authority::from_pem(&certificate_pem, &key_pem)
                    .map_err(|what| AccessError::malformed(&certificate, what))
            }
            (None, None) => {
                let made = Authority::new()?;
                self.write(AUTHORITY_DRAFT, made.certificate_pem().as_bytes())?;
                self.write(AUTHORITY_KEY, made.key_pem().as_bytes())?;
                fs::rename(&draft, &certificate).map_err(AccessError::file(&certificate))?;
                Ok(made)
            }
            (Some(_), None) => Err(AccessError::malformed(&key, "the authority's key is gone")),
            // A power cut came before the certificate got its name.
            (None, Some(_)) if draft.exists() => {
                fs::rename(&draft, &certificate).map_err(AccessError::file(&certificate))?;
                drop(_lock);
                self.authority()
            }
            (None, Some(_)) => {
                let what = "the authority's certificate is gone, and agents trust no other one";
                Err(AccessError::malformed(&certificate, what))
            }
        }
    }

    /// The address stored when the collector last started, as an agent would use it.
    ///
    /// # Errors
    /// [`AccessError::Failed`].
    pub fn address(&self) -> Result<Option<Address>> {
        let path = self.file(ADDRESS);
        let Some(bytes) = read(&path)? else {
            return Ok(None);
        };
        let text =
            String::from_utf8(bytes).map_err(|error| AccessError::malformed(&path, error))?;
        let mut lines = text.lines().map(str::to_owned);
        let url = lines
            .next()
            .ok_or_else(|| AccessError::malformed(&path, "the file is empty"))?;
        Ok(Some(Address {
            url,
            pin: lines.next(),
        }))
    }

    /// Stores the collector's address.
    ///
    /// # Errors
    /// [`AccessError::Failed`].
    pub fn set_address(&self, address: &Address) -> Result<()> {
        let mut text = format!("{}\n", address.url);
        if let Some(pin) = &address.pin {
            text.push_str(pin);
            text.push('\n');
        }
        self.write(ADDRESS, text.as_bytes())
    }

    /// The key that signs the page's cookies, created if missing.
    pub(super) fn session_key(&self) -> Result<[u8; SESSION_KEY_BYTES]> {
        let _lock = self.lock()?;
        let path = self.file(SESSION_KEY);
        if let Some(text) = read(&path)? {
            let key = std::str::from_utf8(&text)
                .ok()
                .map(str::trim)
                .and_then(unhex);
            return key.ok_or_else(|| AccessError::malformed(&path, "this is not a key"));
        }
        let key = random_bytes()?;
        self.write(SESSION_KEY, hex(&key).as_bytes())?;
        Ok(key)
    }

    pub(super) fn tokens_state(&self) -> Result<Option<FileState>> {
        let path = self.file(TOKENS);
        match fs::metadata(&path) {
            Ok(found) => Ok(Some(FileState {
                inode: found.ino(),
                length: found.len(),
                modified: (found.mtime(), found.mtime_nsec()),
            })),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(AccessError::file(&path)(error)),
        }
    }

    fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Creates the folder and locks it until the file is dropped.
    fn lock(&self) -> Result<File> {
        self.make()?;
        let path = self.file(LOCK);
        let opened = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(&path);
        let file = opened.map_err(AccessError::file(&path))?;
        flock(&file, FlockOperation::LockExclusive)
            .map_err(|error| AccessError::file(&path)(error.into()))?;
        Ok(file)
    }

    fn make(&self) -> Result<()> {
        match DirBuilder::new().mode(0o700).create(&self.path) {
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
                Err(AccessError::file(&self.path)(error))
            }
            _ => Ok(()),
        }
    }

    fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        self.make()?;
        let path = self.file(name);
        replace_private(&path, bytes).map_err(AccessError::file(&path))
    }
}

fn read(path: &Path) -> Result<Option<Vec<u8>>> {
    let file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(AccessError::file(path)(error)),
    };
    let mut bytes = Vec::new();
    file.take(FILE_BYTES_MAX + 1)
        .read_to_end(&mut bytes)
        .map_err(AccessError::file(path))?;
    let length = u64::try_from(bytes.len()).unwrap_or(u64::MAX);
    if length > FILE_BYTES_MAX {
        let what = format!("longer than {FILE_BYTES_MAX} bytes");
        return Err(AccessError::malformed(path, what));
    }
    Ok(Some(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::auth::token::Scope;

    fn folder() -> (tempfile::TempDir, AccessFolder) {
        let around = tempfile::tempdir().unwrap();
        let folder = AccessFolder::new(around.path().join("access"));
        (around, folder)
    }

    #[test]
    fn reading_creates_no_files_and_created_files_are_private() {
        let (_around, folder) = folder();
        assert!(folder.book().unwrap().is_empty());
        assert_eq!(folder.address().unwrap(), None);
        assert_eq!(folder.tokens_state().unwrap(), None);
        assert!(!folder.path().exists());
        let added = folder.change(|book| book.add("page", Scope::Read, 1));
        added.unwrap();
        folder.authority().unwrap();
        folder.session_key().unwrap();
        let address = Address {
            url: "https://192.168.1.20:8833".to_owned(),
            pin: Some("sha256-00".to_owned()),
        };
        folder.set_address(&address).unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(folder.path()), 0o700);
        let mut files = 0;
        for entry in fs::read_dir(folder.path()).unwrap() {
            let path = entry.unwrap().path();
            assert_eq!(mode(&path), 0o600, "{}", path.display());
            assert!(!path.display().to_string().ends_with(".partial"));
            files += 1;
        }
        // Tokens, two for the authority, session key, address, lock.
        assert_eq!(files, 6);
        assert_eq!(folder.book().unwrap().records()[0].name, "page");
        assert_eq!(folder.address().unwrap(), Some(address));
    }

    #[test]
    fn keys_are_made_once() {
        let (_around, folder) = folder();
        assert_eq!(folder.session_key().unwrap(), folder.session_key().unwrap());
        let first = folder.authority().unwrap();
        assert_eq!(folder.authority().unwrap().pin(), first.pin());
        // A power cut may come before the certificate gets its name, or before there is a key.
        let (certificate, draft) = (
            folder.file(AUTHORITY_CERTIFICATE),
            folder.file(AUTHORITY_DRAFT),
        );
        fs::rename(&certificate, &draft).unwrap();
        assert_eq!(folder.authority().unwrap().pin(), first.pin());
        let lost = |file: &Path, said: &str| {
            let kept = fs::read(file).unwrap();
            fs::remove_file(file).unwrap();
            let error = folder.authority().err().unwrap().to_string();
            assert!(error.contains(said), "{error}");
            fs::write(file, kept).unwrap();
        };
        lost(
            &certificate,
            "authority.pem: the authority's certificate is gone",
        );
        lost(
            &folder.file(AUTHORITY_KEY),
            "authority.key: the authority's key is gone",
        );
        assert_eq!(folder.authority().unwrap().pin(), first.pin());
        // The last two writes left files that others may read.
        assert_eq!(folder.exposed(), [folder.file(AUTHORITY_KEY)]);
    }
}
