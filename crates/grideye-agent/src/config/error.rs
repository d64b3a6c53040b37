//! Why a configuration was refused, where, and what to do.

/// Length of the configuration file at most, in bytes.
pub const CONFIG_BYTES_MAX: usize = 64 * 1024;

/// Why a configuration was refused, where, and what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// Not TOML, or a key that is unknown, missing, of the wrong type or out of range.
    #[error("{origin}:{line}:{column}: {message}\nhint: {hint}")]
    Refused {
        /// The file's name, as the caller gave it.
        origin: String,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// What was found and what was expected.
        message: String,
        /// What to do about it.
        hint: String,
    },
    /// The configuration names a collector, and the agent joined another.
    #[error(
        "the configuration names the collector {named}, and this agent joined {joined}\nhint: take the line `collector` out of the configuration, or remove the file collector.toml"
    )]
    TwoCollectors {
        /// The one that the configuration names.
        named: String,
        /// The one that it joined.
        joined: String,
    },
    /// The file is longer than [`CONFIG_BYTES_MAX`].
    #[error(
        "{origin}: expected at most {CONFIG_BYTES_MAX} bytes, found {found}\nhint: is this really agent.toml?"
    )]
    TooLong {
        /// The file's name.
        origin: String,
        /// Its length in bytes.
        found: usize,
    },
}
