//! The file that joining leaves: `collector.toml`.

use super::credentials::{ClientCertificate, Credentials, Secret};
use super::error::NotJoined;
use crate::address::check_url;
use serde::{Deserialize, Serialize};

/// What joining leaves in a file: `collector.toml`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Joined {
    /// `https://HOST:PORT` or `http://HOST:PORT`.
    pub collector: String,
    /// The device's name, if the token speaks for one alone.
    pub device: Option<String>,
    /// The rest.
    pub credentials: Credentials,
}

impl Joined {
    /// Reads the file. `origin` is its name, for errors.
    ///
    /// # Errors
    /// [`NotJoined`] for anything that [`Self::to_toml`] did not write.
    pub fn parse(text: &str, origin: &str) -> Result<Self, NotJoined> {
        let refuse = |what: String| {
            NotJoined(format!(
                "{origin}: {what}\nhint: join again: paste the line that `grideye enroll DEVICE` prints on the collector's machine"
            ))
        };
        let file: File = toml::from_str(text).map_err(|error| {
            let line = error.span().map_or(1, |span| {
                text[..span.start.min(text.len())].matches('\n').count() + 1
            });
            // The parser's message may quote the line; the place is enough.
            refuse(format!("line {line} is not understood"))
        })?;
        check_url(&file.collector).map_err(refuse)?;
        if file.collector.starts_with("https://") != file.authority.is_some() {
            return Err(refuse(
                "https goes with an authority, and http without".to_owned(),
            ));
        }
        let token = file.token.map(|token| Secret::new(&token)).transpose();
        let client = match (file.client_certificate, file.client_key) {
            (None, None) => None,
            (Some(chain), Some(key)) => Some(ClientCertificate { chain, key }),
            _ => return Err(refuse("a certificate goes with its key".to_owned())),
        };
        Ok(Self {
            collector: file.collector,
            device: file.device,
            credentials: Credentials {
                token: token.map_err(|error| refuse(error.0))?,
                authority: file.authority,
                client,
            },
        })
    }

    /// The file, token included: it is for its owner alone.
    ///
    /// # Errors
    /// [`NotJoined`] if it cannot be written as TOML, which no value here brings about.
    pub fn to_toml(&self) -> Result<String, NotJoined> {
        let client = self.credentials.client.as_ref();
        let file = File {
            collector: self.collector.clone(),
            device: self.device.clone(),
            token: self
                .credentials
                .token
                .as_ref()
                .map(|token| token.reveal().to_owned()),
            authority: self.credentials.authority.clone(),
            client_certificate: client.map(|client| client.chain.clone()),
            client_key: client.map(|client| client.key.clone()),
        };
        toml::to_string_pretty(&file).map_err(|error| NotJoined(error.to_string()))
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    collector: String,
    device: Option<String>,
    token: Option<String>,
    authority: Option<String>,
    client_certificate: Option<String>,
    client_key: Option<Secret>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_reads_back_and_hides_its_token() {
        let joined = Joined {
            collector: "https://pc:8833".to_owned(),
            device: Some("pi-1".to_owned()),
            credentials: Credentials {
                token: Some(Secret::new("grideye-12-34").unwrap()),
                authority: Some(
                    "-----BEGIN CERTIFICATE-----\nAA==\n-----END CERTIFICATE-----\n".to_owned(),
                ),
                client: Some(ClientCertificate {
                    chain: "chain".to_owned(),
                    key: Secret::new("key").unwrap(),
                }),
            },
        };
        let text = joined.to_toml().unwrap();
        assert_eq!(Joined::parse(&text, "collector.toml").unwrap(), joined);
        let shown = format!("{joined:?}");
        assert!(
            !shown.contains("12-34") && !shown.contains("\"key\""),
            "{shown}"
        );
    }

    #[test]
    fn a_file_that_was_changed_is_refused_with_its_place_and_without_its_token() {
        let good = "collector = \"http://pc:8833\"\ntoken = \"grideye-12-34\"\n";
        assert!(Joined::parse(good, "collector.toml").is_ok());
        for (found, with) in [
            ("token", "tokn"),
            ("http:", "https:"),
            (":8833", ""),
            ("grideye-12-34\"", "grideye-12-34"),
            ("token", "client_key = \"k\"\ntoken"),
            ("collector", "authority = \"a\"\ncollector"),
        ] {
            let error =
                Joined::parse(&good.replacen(found, with, 1), "collector.toml").unwrap_err();
            let error = error.to_string();
            assert!(error.starts_with("collector.toml: ") && error.contains("\nhint: join again"));
            assert!(!error.contains("12-34"), "{error}");
        }
    }
}
