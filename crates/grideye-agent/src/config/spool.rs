//! The section `[spool]`.

use super::error::ConfigError;
use super::place::Place;
use super::types::{BACKLOG_PER_S_DEFAULT, SPOOL_AFTER_DEFAULT, SpoolConfig, SpoolMode};
use serde::Deserialize;
use std::path::PathBuf;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSpool {
    mode: Option<toml::Spanned<String>>,
    folder: Option<toml::Spanned<PathBuf>>,
    after_ms: Option<toml::Spanned<u64>>,
    sync_every_ms: Option<toml::Spanned<u64>>,
    mib_max: Option<toml::Spanned<u64>>,
    free_mib_min: Option<toml::Spanned<u64>>,
    backlog_frames_per_s: Option<toml::Spanned<u64>>,
}

/// Without a section there is no spool: an agent that is started by hand leaves nothing on the disk.
pub(super) fn check_spool(
    raw: Option<RawSpool>,
    place: &Place<'_>,
) -> Result<SpoolConfig, ConfigError> {
    const MIB: u64 = 1 << 20;
    let Some(raw) = raw else {
        return Ok(SpoolConfig {
            mode: SpoolMode::Ram,
            folder: None,
            bytes_max: MIB,
            free_bytes_min: 0,
            backlog_per_s: BACKLOG_PER_S_DEFAULT,
        });
    };
    let folder = raw
        .folder
        .map(|folder| check_folder(&folder, place))
        .transpose()?;
    let after_default = u64::try_from(SPOOL_AFTER_DEFAULT.as_millis()).unwrap_or(u64::MAX);
    let after = place.milliseconds("after_ms", raw.after_ms, after_default, (100, 600_000))?;
    let sync_every = place.milliseconds("sync_every_ms", raw.sync_every_ms, 1000, (50, 60_000))?;
    let mode = match &raw.mode {
        None => SpoolMode::Outage { after },
        Some(mode) => match mode.get_ref().as_str() {
            "ram" => SpoolMode::Ram,
            "outage" => SpoolMode::Outage { after },
            "always" => SpoolMode::Always { sync_every },
            found => {
                return Err(place.refuse(
                    mode.span().start,
                    format!("mode: expected \"ram\", \"outage\" or \"always\", found {found:?}"),
                    "\"outage\" spares the card: it is written only while the collector is away",
                ));
            }
        },
    };
    let backlog = place.within(
        "backlog_frames_per_s",
        raw.backlog_frames_per_s,
        BACKLOG_PER_S_DEFAULT.into(),
        (10, 100_000),
    )?;
    Ok(SpoolConfig {
        mode,
        folder,
        bytes_max: MIB * place.within("mib_max", raw.mib_max, 1024, (1, 1 << 20))?,
        free_bytes_min: MIB * place.within("free_mib_min", raw.free_mib_min, 256, (0, 1 << 20))?,
        backlog_per_s: u32::try_from(backlog).unwrap_or(BACKLOG_PER_S_DEFAULT),
    })
}

fn check_folder(
    folder: &toml::Spanned<PathBuf>,
    place: &Place<'_>,
) -> Result<PathBuf, ConfigError> {
    if folder.get_ref().is_absolute() {
        return Ok(folder.get_ref().clone());
    }
    let message = format!(
        "folder: expected an absolute path, found {:?}",
        folder.get_ref()
    );
    Err(place.refuse(
        folder.span().start,
        message,
        "leave folder out under systemd, which gives one (StateDirectory=); else /var/lib/grideye-agent/spool",
    ))
}
