//! Shared by the subcommands: exit codes, reading the configuration, and requests to the collector.

use anyhow::bail;
use grideye_agent::advice;
use grideye_agent::agent::StartError;
use grideye_agent::config::{CONFIG_BYTES_MAX, Config, SpoolMode};
use grideye_agent::deliver::{client, signed};
use grideye_agent::join::{Credentials, Joined, read_text};
use grideye_recording::wire::{Batch, JSON_TYPE};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;
use std::{fs, io};

pub(super) const FAILED: u8 = 1;
const BAD_USAGE: u8 = 2;
pub(super) const DATA_LOST: u8 = 3;

/// A mistake of the caller: exit code 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(super) struct BadUsage(pub(super) String);

/// Everything was done, but its success is unknown: exit code 3.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(super) struct Unanswered(pub(super) String);

pub(crate) fn code_of(error: &anyhow::Error) -> ExitCode {
    let code = |cause: &(dyn std::error::Error + 'static)| {
        let unanswered = cause.is::<Unanswered>().then_some(DATA_LOST);
        cause.is::<BadUsage>().then_some(BAD_USAGE).or(unanswered)
    };
    ExitCode::from(error.chain().find_map(code).unwrap_or(FAILED))
}

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

/// The host's name without the characters that a device's name may not have.
pub(super) fn host_name() -> String {
    let system = rustix::system::uname();
    let name = system.nodename().to_string_lossy();
    let is_plain = |c: &char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let plain: String = name.chars().filter(is_plain).take(64).collect();
    if plain.is_empty() {
        return "grideye-agent".to_owned();
    }
    plain
}

const FILE: &str = "collector.toml";
/// The same file as systemd passes it to the unit (`LoadCredential=grideye:/etc/grideye`).
const CREDENTIAL: &str = "grideye_collector.toml";
pub(super) fn with_joined(mut config: Config, path: &Path) -> anyhow::Result<Config> {
    let Some(found) = joined_file(&config, path) else {
        return Ok(config);
    };
    let joined = Joined::read(&found).map_err(|error| BadUsage(error.to_string()))?;
    let taken = config.join(joined);
    taken.map_err(|error| BadUsage(error.to_string()))?;
    config.joined = Some(found);
    Ok(config)
}

/// Uses systemd's folder for the service if the configuration names none.
pub(super) fn with_spool_folder(mut config: Config, path: &Path) -> Result<Config, BadUsage> {
    let given = std::env::var_os("STATE_DIRECTORY");
    let first = given.and_then(|given| std::env::split_paths(&given).next());
    let given = first.map(|folder| folder.join("spool"));
    config.spool.folder = config.spool.folder.or(given);
    if config.spool.mode != SpoolMode::Ram && config.spool.folder.is_none() {
        let (path, error) = (path.display(), StartError::NoSpoolFolder);
        return Err(BadUsage(format!("{path}: {error}")));
    }
    Ok(config)
}

/// Why this user may not read the file that joining wrote; only root may.
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

/// The file that joining wrote: the one in the configuration, or from systemd, or next to the configuration.
fn joined_file(config: &Config, path: &Path) -> Option<PathBuf> {
    let handed = std::env::var_os("CREDENTIALS_DIRECTORY");
    let handed = handed.map(|folder| PathBuf::from(folder).join(CREDENTIAL));
    let mut files = handed.into_iter().chain([path.with_file_name(FILE)]);
    let found = || files.find(|path| path.exists());
    config.joined.clone().or_else(found)
}

/// How long the collector may take to answer during a join.
pub(super) const TIMEOUT: Duration = Duration::from_secs(10);

/// The boot of the batch that tests a token; no frame ever has it.
const BOOT: &str = "join";
pub(super) fn get(
    collector: &str,
    credentials: &Credentials,
    path: &str,
) -> anyhow::Result<(u16, Value)> {
    let client = client(credentials, TIMEOUT).map_err(BadUsage)?;
    let request = client.get(format!("{collector}{path}"));
    let request = signed(request, credentials.token.as_ref());
    answer(collector, request.call())
}
pub(super) fn post(
    collector: &str,
    credentials: &Credentials,
    batch: &Batch,
) -> anyhow::Result<(u16, Value)> {
    let client = client(credentials, TIMEOUT).map_err(BadUsage)?;
    let request = client.post(format!("{collector}/v1/frames"));
    let request = signed(request, credentials.token.as_ref()).header("content-type", JSON_TYPE);
    answer(collector, request.send(batch.to_json()?))
}

fn answer(
    collector: &str,
    answered: Result<ureq::http::Response<ureq::Body>, ureq::Error>,
) -> anyhow::Result<(u16, Value)> {
    let mut response = answered
        .map_err(|error| anyhow::anyhow!("{collector}: {error}{}", advice::network_hint(&error)))?;
    let status = response.status().as_u16();
    let text = response.body_mut().read_to_string().unwrap_or_default();
    Ok((status, serde_json::from_str(&text).unwrap_or_default()))
}

/// Tests whether the collector takes this device's frames, by posting a batch without any.
pub(super) fn prove(
    collector: &str,
    credentials: &Credentials,
    device: &str,
) -> anyhow::Result<&'static str> {
    let empty = Batch {
        device: device.to_owned(),
        boot: BOOT.to_owned(),
        t_sent_boot_ns: None,
        sensors: Vec::new(),
    };
    let (status, answer) = post(collector, credentials, &empty)?;
    let error = &answer["error"];
    match (status, error["code"].as_str()) {
        (200, _) if answer["durable_through"].is_object() => Ok(match credentials.token {
            Some(_) => "its frames are taken",
            None => "anybody's frames are taken there",
        }),
        (401, _) => bail!(
            "{collector}: the token is not, or no longer, known there\nhint: print a new line with `grideye enroll {device}`"
        ),
        (403, Some("foreign_device")) => bail!(
            "{collector}: this token is for another device, and this one is called {device}\nhint: print a line with `grideye enroll {device}`, or set `device` in agent.toml to the name that the token is for"
        ),
        (403, Some("wrong_scope")) => bail!(
            "{collector}: this token is not for frames\nhint: print a line with `grideye enroll {device}`"
        ),
        (_, Some(_)) => bail!(
            "{collector}: answered {status}: {}\nhint: {}",
            error["message"].as_str().unwrap_or_default(),
            error["hint"]
                .as_str()
                .unwrap_or("see the collector's log, and paste the line again")
        ),
        (_, None) => bail!(
            "{collector}: answered {status}, which no collector does\nhint: is this the address of `grideye collect`?"
        ),
    }
}
