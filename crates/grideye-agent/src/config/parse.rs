//! Reads `agent.toml`: every key is known and within its bounds, or the text is refused.

use super::bus::{RawBus, check_bus};
use super::error::{CONFIG_BYTES_MAX, ConfigError};
use super::place::Place;
use super::spool::{RawSpool, check_spool};
use super::types::{Body, BusConfig, Config, RING_FRAMES_DEFAULT, SpoolMode};
use crate::address::is_host_and_port;
use crate::join::Credentials;
use crate::limits::RING_FRAMES_MAX;
use serde::Deserialize;
use std::net::SocketAddr;
use std::path::PathBuf;

/// Buses of one agent at most: each has a thread.
pub const BUSES_MAX: usize = 16;

const KEYS_HINT: &str = "the keys are device, collector, joined, body, post_every_ms, ring_frames, request_timeout_ms, \
    [spool], [health] listen, [[bus]] path and [[bus.sensor]] address, rate_hz, moving_average; see firmware-config/agent.toml";

impl Config {
    /// Reads and checks a configuration. `origin` is the name to print in errors, usually the file's path.
    ///
    /// # Errors
    /// [`ConfigError`], with line and column, for anything that is not exactly understood.
    pub fn parse(text: &str, origin: &str) -> Result<Self, ConfigError> {
        if text.len() > CONFIG_BYTES_MAX {
            return Err(ConfigError::TooLong {
                origin: origin.to_owned(),
                found: text.len(),
            });
        }
        let place = Place { text, origin };
        let raw: RawConfig = toml::from_str(text).map_err(|error| {
            let offset = error.span().map_or(0, |span| span.start);
            // What the TOML crate calls u64 is no word of a person who writes a configuration.
            let message =
                one_line(error.message()).replace("expected u64", "expected a whole number");
            place.refuse(offset, message, KEYS_HINT)
        })?;
        check(raw, &place)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawConfig {
    device: Option<toml::Spanned<String>>,
    collector: Option<toml::Spanned<String>>,
    joined: Option<PathBuf>,
    body: Option<toml::Spanned<String>>,
    post_every_ms: Option<toml::Spanned<u64>>,
    ring_frames: Option<toml::Spanned<u64>>,
    request_timeout_ms: Option<toml::Spanned<u64>>,
    spool: Option<toml::Spanned<RawSpool>>,
    health: Option<RawHealth>,
    bus: Vec<toml::Spanned<RawBus>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawHealth {
    listen: toml::Spanned<String>,
}

fn check(raw: RawConfig, place: &Place<'_>) -> Result<Config, ConfigError> {
    let ring_frames_max = u64::try_from(RING_FRAMES_MAX).unwrap_or(u64::MAX);
    let ring_frames_default = u64::try_from(RING_FRAMES_DEFAULT).unwrap_or(u64::MAX);
    let ring_frames = place.within(
        "ring_frames",
        raw.ring_frames,
        ring_frames_default,
        (100, ring_frames_max),
    )?;
    if raw.bus.is_empty() || raw.bus.len() > BUSES_MAX {
        let message = format!("expected 1 to {BUSES_MAX} [[bus]], found {}", raw.bus.len());
        return Err(place.refuse(
            0,
            message,
            "name the bus that the sensor is wired to: [[bus]] path = \"/dev/i2c-1\"",
        ));
    }
    let mut buses: Vec<BusConfig> = Vec::new();
    for bus in raw.bus {
        let at = bus.span().start;
        let bus = check_bus(bus.into_inner(), at, place)?;
        if buses
            .iter()
            .any(|other| other.path.file_name() == bus.path.file_name())
        {
            let message = format!("the bus {} is named twice", bus.path.display());
            return Err(place.refuse(at, message, "put all sensors of a bus below one [[bus]]"));
        }
        buses.push(bus);
    }
    let spool_at = raw.spool.as_ref().map_or(0, |spool| spool.span().start);
    let spool = check_spool(raw.spool.map(toml::Spanned::into_inner), place)?;
    let config = Config {
        device: raw
            .device
            .map(|device| check_device(&device, place))
            .transpose()?,
        collector: raw
            .collector
            .map(|collector| check_collector(&collector, place))
            .transpose()?,
        joined: raw.joined,
        credentials: Credentials::default(),
        body: check_body(raw.body.as_ref(), place)?,
        post_every: place.milliseconds("post_every_ms", raw.post_every_ms, 500, (50, 60_000))?,
        ring_frames: usize::try_from(ring_frames).unwrap_or(RING_FRAMES_MAX),
        request_timeout: place.milliseconds(
            "request_timeout_ms",
            raw.request_timeout_ms,
            10_000,
            (100, 120_000),
        )?,
        spool,
        health: raw
            .health
            .map(|health| check_health(&health.listen, place))
            .transpose()?,
        buses,
    };
    check_ring_for_spool(&config, spool_at, place)?;
    Ok(config)
}

/// What waits for the disk must find room in memory.
fn check_ring_for_spool(
    config: &Config,
    spool_at: usize,
    place: &Place<'_>,
) -> Result<(), ConfigError> {
    let SpoolMode::Outage { after } = config.spool.mode else {
        return Ok(());
    };
    let seconds = after.as_secs() + 10;
    let needed = u64::from(config.rate_hz()) * seconds;
    if u64::try_from(config.ring_frames).is_ok_and(|frames| frames >= needed) {
        return Ok(());
    }
    Err(place.refuse(
        spool_at,
        format!(
            "ring_frames: expected at least {needed}, which are {seconds} s of these sensors, found {}",
            config.ring_frames
        ),
        format!("write ring_frames = {needed}, or lower spool.after_ms"),
    ))
}

fn check_device(device: &toml::Spanned<String>, place: &Place<'_>) -> Result<String, ConfigError> {
    let name = device.get_ref();
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    if (1..=64).contains(&name.len()) && name.chars().all(plain) {
        return Ok(name.clone());
    }
    Err(place.refuse(
        device.span().start,
        format!(
            "device: expected 1 to 64 letters, digits, dots, hyphens or underscores, found {name:?}"
        ),
        "leave device out to use the host's name",
    ))
}

fn check_collector(
    collector: &toml::Spanned<String>,
    place: &Place<'_>,
) -> Result<String, ConfigError> {
    let url = collector.get_ref().trim_end_matches('/');
    if url.strip_prefix("http://").is_some_and(is_host_and_port) {
        return Ok(url.to_owned());
    }
    let hint = if url.starts_with("https://") {
        "https goes with a token and a pin: paste the line that `grideye enroll DEVICE` prints on the collector's machine, instead of this key"
    } else {
        "give the collector's address and port alone, for example http://192.168.1.20:8833"
    };
    Err(place.refuse(
        collector.span().start,
        format!(
            "collector: expected http://HOST:PORT, found {:?}",
            collector.get_ref()
        ),
        hint,
    ))
}

fn check_body(
    body: Option<&toml::Spanned<String>>,
    place: &Place<'_>,
) -> Result<Body, ConfigError> {
    let Some(body) = body else {
        return Ok(Body::default());
    };
    match body.get_ref().as_str() {
        "json" => Ok(Body::Json),
        "binary" => Ok(Body::Binary),
        found => Err(place.refuse(
            body.span().start,
            format!("body: expected \"json\" or \"binary\", found {found:?}"),
            "\"binary\" is for fleets and slow lines; a collector that does not know it gets JSON",
        )),
    }
}

fn check_health(
    listen: &toml::Spanned<String>,
    place: &Place<'_>,
) -> Result<SocketAddr, ConfigError> {
    let found = listen.get_ref();
    match found.parse::<SocketAddr>() {
        Ok(address) if address.ip().is_loopback() => Ok(address),
        _ => Err(place.refuse(
            listen.span().start,
            format!("listen: expected an address and port of this machine, found {found:?}"),
            "listen = \"127.0.0.1:8834\"; what other machines want to know, the collector tells them: GET /v1/devices, /metrics",
        )),
    }
}

fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}
