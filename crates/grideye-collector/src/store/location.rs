//! Where a store is: a file, memory, or a database by its URL.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use tokio_postgres::config::{Config, Host, SslMode};

/// Which store. Parsed from text: `postgres://…` or `postgresql://…` is a database, anything else is a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StoreLocation {
    /// An SQLite file, created if missing. Its folder must exist.
    File(PathBuf),
    /// In memory and lost when the collector ends: for tests and trials.
    Memory,
    /// A PostgreSQL database, or one that speaks its protocol. The database must exist; the tables are created.
    Postgres(PostgresUrl),
}

impl fmt::Display for StoreLocation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => write!(formatter, "{}", path.display()),
            Self::Memory => formatter.write_str("memory"),
            Self::Postgres(url) => url.fmt(formatter),
        }
    }
}

impl FromStr for StoreLocation {
    type Err = UrlError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let is_url = ["postgres://", "postgresql://"]
            .iter()
            .any(|scheme| text.starts_with(scheme));
        if is_url {
            return text.parse().map(Self::Postgres);
        }
        if let Some((scheme, _)) = text.split_once("://") {
            return Err(UrlError::Scheme(scheme.to_owned()));
        }
        Ok(Self::File(text.into()))
    }
}

/// `postgres://USER[:PASSWORD]@HOST[:PORT]/DATABASE`; in a HOST that is a socket folder, `/` is `%2F`. Never shows the
/// password.
#[derive(Clone, PartialEq, Eq)]
pub struct PostgresUrl {
    pub(super) config: Box<Config>,
}

/// Why a store's URL is invalid. Never repeats the URL, which may hold a password.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UrlError {
    /// Another kind of database.
    #[error(
        "a store cannot be at {0}://\nhint: name a file, or postgres://USER@HOST:PORT/DATABASE"
    )]
    Scheme(String),
    /// Not a URL of the expected form.
    #[error(
        "the URL of the store is not understood: {0}\nhint: expected postgres://USER[:PASSWORD]@HOST[:PORT]/DATABASE; for a socket's folder as HOST, write / as %2F"
    )]
    NotUnderstood(String),
    /// A required part is missing.
    #[error(
        "the URL of the store has no {0}\nhint: expected postgres://USER[:PASSWORD]@HOST[:PORT]/DATABASE"
    )]
    Lacks(&'static str),
    /// The URL asks for TLS.
    #[error(
        "the URL of the store asks for TLS (sslmode=require), which this program does not speak to a database\nhint: reach the database on this machine, in a private network, or through a tunnel such as `ssh -L 5432:localhost:5432 HOST`"
    )]
    Tls,
    /// A line of the password file is invalid.
    #[error(
        "line {0} of the password file does not have 5 fields\nhint: expected HOST:PORT:DATABASE:USER:PASSWORD, `*` for any"
    )]
    PasswordFile(usize),
}

impl FromStr for PostgresUrl {
    type Err = UrlError;

    fn from_str(url: &str) -> Result<Self, Self::Err> {
        let config: Config = url.parse().map_err(|error: tokio_postgres::Error| {
            UrlError::NotUnderstood(
                std::error::Error::source(&error)
                    .map_or_else(|| error.to_string(), ToString::to_string),
            )
        })?;
        let lacks = |part| Err(UrlError::Lacks(part));
        if config.get_hosts().is_empty() {
            return lacks("host");
        }
        if config.get_user().is_none_or(str::is_empty) {
            return lacks("user");
        }
        if config.get_dbname().is_none_or(str::is_empty) {
            return lacks("database");
        }
        if config.get_ssl_mode() == SslMode::Require {
            return Err(UrlError::Tls);
        }
        Ok(Self {
            config: Box::new(config),
        })
    }
}

impl PostgresUrl {
    /// Takes the password from the first matching line of a password file (`PGPASSFILE`), unless the URL has one.
    ///
    /// # Errors
    /// [`UrlError::PasswordFile`] for an invalid line before the matching one.
    pub fn with_password_file(mut self, text: &str) -> Result<Self, UrlError> {
        if self.config.get_password().is_some() {
            return Ok(self);
        }
        for (index, line) in text.lines().enumerate() {
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let fields = fields(line);
            let [host, port, database, user, password] = fields.as_slice() else {
                return Err(UrlError::PasswordFile(index + 1));
            };
            if self.fits(host, port, database, user) {
                self.config.password(password);
                break;
            }
        }
        Ok(self)
    }

    fn fits(&self, host: &str, port: &str, database: &str, user: &str) -> bool {
        let is = |field: &str, value: &str| field == "*" || field == value;
        let host_fits = match self.config.get_hosts().first() {
            Some(Host::Tcp(name)) => is(host, name),
            Some(Host::Unix(folder)) => {
                is(host, "localhost") || is(host, &folder.to_string_lossy())
            }
            None => false,
        };
        host_fits
            && is(port, &self.port().to_string())
            && is(database, self.config.get_dbname().unwrap_or_default())
            && is(user, self.config.get_user().unwrap_or_default())
    }

    fn port(&self) -> u16 {
        self.config.get_ports().first().copied().unwrap_or(5432)
    }
}

/// The fields of a line of a password file, separated by `:`; `\:` and `\\` escape.
fn fields(line: &str) -> Vec<String> {
    let (mut fields, mut field) = (Vec::new(), String::new());
    let mut characters = line.chars();
    while let Some(character) = characters.next() {
        match character {
            '\\' => field.extend(characters.next()),
            ':' => fields.push(std::mem::take(&mut field)),
            other => field.push(other),
        }
    }
    fields.push(field);
    fields
}

impl fmt::Display for PostgresUrl {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let user = self.config.get_user().unwrap_or_default();
        write!(formatter, "postgres://{user}@")?;
        match self.config.get_hosts().first() {
            Some(Host::Tcp(name)) => formatter.write_str(name)?,
            Some(Host::Unix(folder)) => write!(formatter, "{}", folder.display())?,
            None => {}
        }
        let database = self.config.get_dbname().unwrap_or_default();
        write!(formatter, ":{}/{database}", self.port())
    }
}

impl fmt::Debug for PostgresUrl {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, formatter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn url(text: &str) -> PostgresUrl {
        text.parse().unwrap()
    }

    fn password(url: &PostgresUrl) -> Option<&[u8]> {
        url.config.get_password()
    }

    #[test]
    fn a_password_is_never_shown() {
        let secret = url("postgres://grideye:pa%24s@db.local:5433/frames");
        assert_eq!(password(&secret), Some(&b"pa$s"[..]));
        let shown = "postgres://grideye@db.local:5433/frames";
        assert_eq!(secret.to_string(), shown);
        let location = StoreLocation::Postgres(secret);
        assert!(!format!("{location:?} {location}").contains("pa"));
        let socket = url("postgres://grideye@%2Frun%2Fpostgresql/frames");
        let shown = "postgres://grideye@/run/postgresql:5432/frames";
        assert_eq!(socket.to_string(), shown);
    }

    #[test]
    fn the_first_line_of_a_password_file_that_fits_counts() {
        let text = "# one\n\nother:*:*:*:no\ndb:5432:frames:me:y\\:e\\\\s\n*:*:*:*:any\n";
        let asked = |text: &str, address: &str| {
            let found = url(address).with_password_file(text).unwrap();
            password(&found).map(|found| String::from_utf8_lossy(found).into_owned())
        };
        let local = "localhost:*:*:*:by-socket";
        for (text, address, expected) in [
            (text, "postgres://me@db/frames", Some("y:e\\s")),
            (text, "postgres://me@db:1/frames", Some("any")),
            (text, "postgres://you@db/frames", Some("any")),
            (text, "postgres://me:own@db/frames", Some("own")),
            (local, "postgres://me@%2Ftmp/frames", Some("by-socket")),
            (local, "postgres://me@db/frames", None),
        ] {
            assert_eq!(asked(text, address).as_deref(), expected, "{address}");
        }
        let wrong = url("postgres://me@db/frames").with_password_file("a:b:c");
        assert_eq!(wrong, Err(UrlError::PasswordFile(1)));
    }
}
