//! The configuration, with what joining left beside it.

use super::exit::BadUsage;
use grideye_agent::config::{CONFIG_BYTES_MAX, Config};
use grideye_agent::join::Joined;
use grideye_agent::limits::JOINED_BYTES_MAX;
use std::fs;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

pub(super) fn read_config(path: &Path) -> anyhow::Result<Config> {
    let origin = path.display().to_string();
    let text = read_text(path, CONFIG_BYTES_MAX).map_err(|error| {
        let hint = match error.kind() {
            io::ErrorKind::NotFound => "copy firmware-config/agent.toml there and edit it",
            io::ErrorKind::PermissionDenied => {
                "make the file readable for the user that runs the agent"
            }
            _ => "name the agent's configuration, a text file such as firmware-config/agent.toml",
        };
        BadUsage(format!("{origin}: {error}\nhint: {hint}"))
    })?;
    Ok(Config::parse(&text, &origin).map_err(|error| BadUsage(error.to_string()))?)
}

/// A text file, and one byte more than allowed of one that is too long.
pub(super) fn read_text(path: &Path, bytes_max: usize) -> io::Result<String> {
    let mut text = String::new();
    let limit = u64::try_from(bytes_max).unwrap_or(u64::MAX) + 1;
    fs::File::open(path)?
        .take(limit)
        .read_to_string(&mut text)?;
    Ok(text)
}

/// The host's name where it can name a device; otherwise a name that can.
pub(super) fn host_name() -> String {
    let system = rustix::system::uname();
    let name = system.nodename().to_string_lossy();
    let plain: String = name
        .chars()
        .filter(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.'))
        .take(64)
        .collect();
    if plain.is_empty() {
        "grideye-agent".to_owned()
    } else {
        plain
    }
}

const FILE: &str = "collector.toml";
/// The same file as systemd hands it to the unit (`LoadCredential=grideye:/etc/grideye`).
const CREDENTIAL: &str = "grideye_collector.toml";

/// The configuration with what joining left.
pub(super) fn with_joined(mut config: Config, path: &Path) -> anyhow::Result<Config> {
    let Some(found) = joined_file(&config, path) else {
        return Ok(config);
    };
    let origin = found.display().to_string();
    let text = read_text(&found, JOINED_BYTES_MAX).map_err(|error| {
        let hint =
            "`grideye-agent join` writes it; it must be readable for the user that runs the agent";
        BadUsage(format!("{origin}: {error}\nhint: {hint}"))
    })?;
    let joined = Joined::parse(&text, &origin).map_err(|error| BadUsage(error.to_string()))?;
    config
        .join(joined)
        .map_err(|error| BadUsage(error.to_string()))?;
    Ok(config)
}

/// Why this user may not read what joining left, which is for root alone.
pub(super) fn unreadable(config: &Config, path: &Path) -> Option<String> {
    let found = joined_file(config, path)?;
    let error = fs::File::open(&found).err()?;
    (error.kind() == io::ErrorKind::PermissionDenied).then(|| {
        format!(
            "{}: {error}\nhint: it holds the token, and is for root alone: with `sudo` this asks the collector too",
            found.display()
        )
    })
}

/// What joining left: in the file that the configuration names, the one that systemd hands over, or the one beside the
/// configuration.
fn joined_file(config: &Config, path: &Path) -> Option<PathBuf> {
    let handed = std::env::var_os("CREDENTIALS_DIRECTORY")
        .map(|folder| PathBuf::from(folder).join(CREDENTIAL));
    let beside = path.with_file_name(FILE);
    config.joined.clone().or_else(|| {
        handed
            .into_iter()
            .chain([beside])
            .find(|path| path.exists())
    })
}
