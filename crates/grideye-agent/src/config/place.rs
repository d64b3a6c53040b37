//! Where in the text of a configuration something stands, for the message that refuses it.

use super::error::ConfigError;
use std::time::Duration;

/// The text that is being read, to turn an offset into line and column.
pub(super) struct Place<'a> {
    pub(super) text: &'a str,
    pub(super) origin: &'a str,
}

impl Place<'_> {
    pub(super) fn refuse(
        &self,
        offset: usize,
        message: String,
        hint: impl Into<String>,
    ) -> ConfigError {
        let before = self.text.get(..offset).unwrap_or(self.text);
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        ConfigError::Refused {
            origin: self.origin.to_owned(),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
            message,
            hint: hint.into(),
        }
    }

    pub(super) fn milliseconds(
        &self,
        name: &str,
        given: Option<toml::Spanned<u64>>,
        default: u64,
        (min, max): (u64, u64),
    ) -> Result<Duration, ConfigError> {
        self.within(name, given, default, (min, max))
            .map(Duration::from_millis)
    }

    pub(super) fn within(
        &self,
        name: &str,
        given: Option<toml::Spanned<u64>>,
        default: u64,
        (min, max): (u64, u64),
    ) -> Result<u64, ConfigError> {
        let Some(given) = given else {
            return Ok(default);
        };
        let found = *given.get_ref();
        if (min..=max).contains(&found) {
            return Ok(found);
        }
        Err(self.refuse(
            given.span().start,
            format!("{name}: expected {min} to {max}, found {found}"),
            format!("leave {name} out for the default of {default}"),
        ))
    }
}
