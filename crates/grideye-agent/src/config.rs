//! What the agent is told to do: `agent.toml`.
//!
//! A key that is unknown, misspelt or out of range stops the program: an agent that runs with a silent default loses
//! an afternoon of somebody's recording.

use crate::join::{Credentials, Joined};
use crate::keeper::{LOOK_EVERY, SYNC_MAX};
use amg8833::{Address, FrameRate};
use serde::Deserialize;
use std::net::{Ipv6Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Frames that the ring may be told to hold at most: about 35 MB, 5.5 hours of one sensor at 10 Hz.
pub const RING_FRAMES_MAX: usize = 200_000;
/// Frames that the ring holds unless told otherwise: 17 minutes of one sensor at 10 Hz, in about 2 MB.
pub const RING_FRAMES_DEFAULT: usize = 10_000;
/// Length of the configuration file at most, in bytes.
pub const CONFIG_BYTES_MAX: usize = 64 * 1024;
/// Buses of one agent at most: each has a thread.
pub const BUSES_MAX: usize = 16;
/// How long a record waits in memory before it goes to the disk, unless told otherwise.
pub const SPOOL_AFTER_DEFAULT: Duration = Duration::from_secs(10);
/// Frames of the backlog that go to the collector in a second, unless told otherwise.
pub const BACKLOG_PER_S_DEFAULT: u32 = 1000;

/// The agent's configuration, checked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Config {
    /// The name under which this agent's frames are kept. `None`: the caller takes the host's name.
    pub device: Option<String>,
    /// Where to deliver, without a trailing slash: `http://192.168.1.20:8833`. `None`: as joining said.
    pub collector: Option<String>,
    /// The file that `grideye-agent join` wrote, if it is named. The caller reads it.
    pub joined: Option<PathBuf>,
    /// Token and certificates. The file does not hold them; the caller adds what joining left ([`Self::join`]).
    pub credentials: Credentials,
    /// The form of a post's body.
    pub body: Body,
    /// Pause between two posts while there is no backlog.
    pub post_every: Duration,
    /// Frames held in memory until the collector has them on disk; beyond, the oldest is dropped and counted.
    pub ring_frames: usize,
    /// How long one post may take from connecting to the end of the answer.
    pub request_timeout: Duration,
    /// What is kept on a disk.
    pub spool: SpoolConfig,
    /// Where the agent says how it does, on this machine alone. `None`: nowhere.
    pub health: Option<SocketAddr>,
    /// The buses, each read by a thread of its own.
    pub buses: Vec<BusConfig>,
}

/// The form of a post's body: the same meaning, the same checks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Body {
    /// JSON, which a person can read.
    #[default]
    Json,
    /// Bytes, a quarter as long and cheaper on both sides. A collector that does not know them gets JSON.
    Binary,
}

/// What is kept on a disk while the collector is away.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SpoolConfig {
    /// When frames go to the disk.
    pub mode: SpoolMode,
    /// Where to. `None`: the caller takes the folder that systemd gives.
    pub folder: Option<PathBuf>,
    /// Bytes that the spool takes at most; beyond, the oldest backlog is dropped and counted.
    pub bytes_max: u64,
    /// Bytes of the disk that the spool leaves free.
    pub free_bytes_min: u64,
    /// Records of the backlog that go to the collector in a second at most.
    pub backlog_per_s: u32,
}

/// When frames go to the disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpoolMode {
    /// Never.
    Ram,
    /// When one has not been acknowledged for so long; then all that are in memory.
    Outage {
        /// The time.
        after: Duration,
    },
    /// At once, and synced so often.
    Always {
        /// From one sync to the next.
        sync_every: Duration,
    },
}

/// What a loss of power, or of the process, can cost on a disk that takes at most [`SYNC_MAX`] to sync. A slower one costs
/// what was read while it was at it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guarantee {
    /// Frames of all sensors together that may be lost at most.
    pub frames: u64,
    /// The time in which they were read, and not acknowledged, before the loss.
    pub seconds: f64,
    /// Whether it is the disk that keeps them.
    pub needs_disk: bool,
}

/// The fastest clock of a sensor against its nominal rate.
const FASTEST_CLOCK: f64 = 1.06;

impl Config {
    /// Frames a second of all sensors together, nominally.
    #[must_use]
    pub fn rate_hz(&self) -> u32 {
        let sensors = self.buses.iter().flat_map(|bus| &bus.sensors);
        sensors.map(|sensor| u32::from(sensor.rate.fps())).sum()
    }

    /// What a loss of power can cost while the disk works, and syncs within [`SYNC_MAX`]. Without it, and in mode `ram`, it is the whole ring.
    #[must_use]
    pub fn guarantee(&self) -> Guarantee {
        let rate_hz = f64::from(self.rate_hz()) * FASTEST_CLOCK;
        let ring_frames = u32::try_from(self.ring_frames).unwrap_or(u32::MAX);
        let seconds = match self.spool.mode {
            SpoolMode::Ram => f64::from(ring_frames) / rate_hz.max(1.0),
            SpoolMode::Outage { after } => (after + LOOK_EVERY + SYNC_MAX).as_secs_f64(),
            SpoolMode::Always { sync_every } => (sync_every + LOOK_EVERY + SYNC_MAX).as_secs_f64(),
        };
        let frames = (seconds * rate_hz).ceil().min(f64::from(ring_frames));
        Guarantee {
            #[expect(
                clippy::as_conversions,
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "whole, positive, and at most the size of the ring"
            )]
            frames: frames as u64,
            seconds,
            needs_disk: self.spool.mode != SpoolMode::Ram,
        }
    }
}

impl SpoolMode {
    /// `ram`, `outage` or `always`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ram => "ram",
            Self::Outage { .. } => "outage",
            Self::Always { .. } => "always",
        }
    }
}

impl std::fmt::Display for Guarantee {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            formatter,
            "a loss of power or a killed agent costs at most the {} frames that were read in the last {:.2} s and are not acknowledged",
            self.frames, self.seconds
        )?;
        if self.needs_disk {
            write!(
                formatter,
                ", while the disk syncs within {:.3} s",
                SYNC_MAX.as_secs_f64()
            )?;
        }
        Ok(())
    }
}

/// One I2C bus and the sensors on it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BusConfig {
    /// The bus' device file.
    pub path: PathBuf,
    /// The sensors, at different addresses.
    pub sensors: Vec<SensorConfig>,
}

/// One sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SensorConfig {
    /// Where it is on the bus.
    pub address: Address,
    /// How often it measures, nominally: a real sensor is off by several per cent.
    pub rate: FrameRate,
    /// Whether the chip itself averages two frames ("twice moving average", AMG88 spec §4-11-7).
    pub moving_average: bool,
}

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

    /// Adds what joining left.
    ///
    /// # Errors
    /// [`ConfigError::TwoCollectors`] if the configuration names one itself.
    pub fn join(&mut self, joined: Joined) -> Result<(), ConfigError> {
        if let Some(named) = &self.collector {
            return Err(ConfigError::TwoCollectors {
                named: named.clone(),
                joined: joined.collector,
            });
        }
        self.collector = Some(joined.collector);
        self.credentials = joined.credentials;
        self.device = self.device.take().or(joined.device);
        Ok(())
    }
}

impl BusConfig {
    /// A bus with one sensor at 10 Hz.
    #[must_use]
    pub fn with_one_sensor(path: impl Into<PathBuf>, address: Address) -> Self {
        Self {
            path: path.into(),
            sensors: vec![SensorConfig::at(address)],
        }
    }

    /// The sensor's name among all of this device: `i2c-1:0x69`.
    #[must_use]
    pub fn sensor_id(&self, sensor: &SensorConfig) -> String {
        let bus = self.path.file_name().map_or_else(
            || self.path.to_string_lossy(),
            |name| name.to_string_lossy(),
        );
        format!("{bus}:{}", sensor.address)
    }
}

impl SensorConfig {
    /// A sensor at 10 Hz without averaging.
    #[must_use]
    pub const fn at(address: Address) -> Self {
        Self {
            address,
            rate: FrameRate::Ten,
            moving_average: false,
        }
    }
}

const KEYS_HINT: &str = "the keys are device, collector, joined, body, post_every_ms, ring_frames, request_timeout_ms, \
    [spool], [health] listen, [[bus]] path and [[bus.sensor]] address, rate_hz, moving_average; see firmware-config/agent.toml";

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
struct RawSpool {
    mode: Option<toml::Spanned<String>>,
    folder: Option<toml::Spanned<PathBuf>>,
    after_ms: Option<toml::Spanned<u64>>,
    sync_every_ms: Option<toml::Spanned<u64>>,
    mib_max: Option<toml::Spanned<u64>>,
    free_mib_min: Option<toml::Spanned<u64>>,
    backlog_frames_per_s: Option<toml::Spanned<u64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawHealth {
    listen: toml::Spanned<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBus {
    path: toml::Spanned<PathBuf>,
    #[serde(default)]
    sensor: Vec<RawSensor>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSensor {
    address: toml::Spanned<u64>,
    rate_hz: Option<toml::Spanned<u64>>,
    #[serde(default)]
    moving_average: bool,
}

/// The text that is being read, to turn an offset into line and column.
struct Place<'a> {
    text: &'a str,
    origin: &'a str,
}

impl Place<'_> {
    fn refuse(&self, offset: usize, message: String, hint: impl Into<String>) -> ConfigError {
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

    fn milliseconds(
        &self,
        name: &str,
        given: Option<toml::Spanned<u64>>,
        default: u64,
        (min, max): (u64, u64),
    ) -> Result<Duration, ConfigError> {
        self.within(name, given, default, (min, max))
            .map(Duration::from_millis)
    }

    fn within(
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

/// Without a section there is no spool: an agent that is started by hand leaves nothing on the disk.
fn check_spool(raw: Option<RawSpool>, place: &Place<'_>) -> Result<SpoolConfig, ConfigError> {
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

/// Whether this is HOST:PORT. An address that cannot be right is refused at the start: as a failed delivery it would be
/// tried again for ever.
pub(crate) fn is_host_and_port(authority: &str) -> bool {
    let Some((host, port)) = authority.rsplit_once(':') else {
        return false;
    };
    let is_port =
        port.bytes().all(|b| b.is_ascii_digit()) && port.parse::<u16>().is_ok_and(|port| port != 0);
    let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let is_host = match host.strip_prefix('[') {
        Some(inner) => inner
            .strip_suffix(']')
            .is_some_and(|inner| inner.parse::<Ipv6Addr>().is_ok()),
        None => !host.is_empty() && host.chars().all(is_name),
    };
    is_port && is_host
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

fn check_bus(raw: RawBus, at: usize, place: &Place<'_>) -> Result<BusConfig, ConfigError> {
    if raw.path.get_ref().file_name().is_none() || !Path::new(raw.path.get_ref()).is_absolute() {
        let message = format!(
            "path: expected a device file, found {:?}",
            raw.path.get_ref()
        );
        return Err(place.refuse(
            raw.path.span().start,
            message,
            "on a Raspberry Pi it is /dev/i2c-1",
        ));
    }
    if raw.sensor.is_empty() {
        let hint = "add [[bus.sensor]] with address = 0x69 (or 0x68)";
        return Err(place.refuse(at, "expected at least one [[bus.sensor]]".to_owned(), hint));
    }
    let mut sensors: Vec<SensorConfig> = Vec::new();
    for raw_sensor in raw.sensor {
        let address_at = raw_sensor.address.span().start;
        let sensor = check_sensor(raw_sensor, place)?;
        if sensors.iter().any(|other| other.address == sensor.address) {
            let message = format!("address: {} is named twice on this bus", sensor.address);
            return Err(place.refuse(
                address_at,
                message,
                "two sensors on one bus are 0x68 and 0x69",
            ));
        }
        sensors.push(sensor);
    }
    Ok(BusConfig {
        path: raw.path.into_inner(),
        sensors,
    })
}

fn check_sensor(raw: RawSensor, place: &Place<'_>) -> Result<SensorConfig, ConfigError> {
    let found = *raw.address.get_ref();
    let address = u8::try_from(found)
        .ok()
        .and_then(|address| Address::try_from(address).ok());
    let Some(address) = address else {
        return Err(place.refuse(
            raw.address.span().start,
            format!("address: expected 0x68 or 0x69, found {found:#04x}"),
            if matches!(found, 68 | 69) {
                format!("write 0x{found}: without 0x it is a decimal number")
            } else {
                "give the 7-bit address: 0x69 on most breakout boards, 0x68 where AD_SELECT is at GND".to_owned()
            },
        ));
    };
    let rate = check_rate(raw.rate_hz, place)?;
    Ok(SensorConfig {
        address,
        rate,
        moving_average: raw.moving_average,
    })
}

fn check_rate(
    given: Option<toml::Spanned<u64>>,
    place: &Place<'_>,
) -> Result<FrameRate, ConfigError> {
    let found = given.as_ref().map_or(10, |rate| *rate.get_ref());
    let rate = u8::try_from(found).ok().and_then(FrameRate::from_fps);
    rate.ok_or_else(|| {
        place.refuse(
            given.map_or(0, |rate| rate.span().start),
            format!("rate_hz: expected 10 or 1, found {found}"),
            "the sensor measures ten times or once a second and at no other rate",
        )
    })
}

fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALLEST: &str = "collector = \"http://collector:8833/\"\n[[bus]]\npath = \"/dev/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n";

    fn refusal(text: &str) -> String {
        Config::parse(text, "agent.toml").unwrap_err().to_string()
    }

    #[test]
    fn the_smallest_configuration_has_the_documented_defaults() {
        let config = Config::parse(SMALLEST, "agent.toml").unwrap();
        assert_eq!(config.device, None);
        assert_eq!(config.collector.as_deref(), Some("http://collector:8833"));
        assert_eq!(config.body, Body::Json);
        assert_eq!(config.post_every, Duration::from_millis(500));
        assert_eq!(config.ring_frames, RING_FRAMES_DEFAULT);
        assert_eq!(config.request_timeout, Duration::from_secs(10));
        assert_eq!(
            config.buses,
            [BusConfig::with_one_sensor("/dev/i2c-1", Address::High)]
        );
    }

    /// Found, replaced with, and how the message begins.
    const REFUSALS: [(&str, &str, &str); 31] = [
        (
            "[[bus]]",
            "health.listen = \"0.0.0.0:8834\"\n[[bus]]",
            "agent.toml:2:17: listen: expected an address and port of this machine, found \"0.0.0.0:8834\"\nhint: listen = \"127.0.0.1:8834\"",
        ),
        (
            "[[bus]]",
            "health.listen = \"localhost\"\n[[bus]]",
            "agent.toml:2:17: listen: expected an address and port of this machine, found \"localhost\"\nhint: ",
        ),
        (
            "[[bus]]",
            "body = \"bytes\"\n[[bus]]",
            "agent.toml:2:8: body: expected \"json\" or \"binary\", found \"bytes\"\nhint: ",
        ),
        (
            "address = 0x69",
            "address = 0xd2",
            "agent.toml:5:11: address: expected 0x68 or 0x69, found 0xd2\nhint: give the 7-bit",
        ),
        (
            "address = 0x69",
            "address = 0x69\nrate_hz = 5",
            "agent.toml:6:11: rate_hz: expected 10 or 1, found 5\nhint: ",
        ),
        (
            "address = 0x69",
            "adress = 0x69",
            "agent.toml:5:1: unknown field `adress`",
        ),
        (
            "address = 0x69",
            "address = \"0x69\"",
            "agent.toml:5:11: invalid type: string \"0x69\", expected a whole number\nhint: ",
        ),
        (
            "address = 0x69",
            "address = 0x69\n[[bus.sensor]]\naddress = 0x69",
            "agent.toml:7:11: address: 0x69 is named twice on this bus\nhint: ",
        ),
        (
            "[[bus.sensor]]",
            "[bus.sensor]",
            "agent.toml:4:1: invalid type: map, expected a sequence\nhint: ",
        ),
        (
            "http://collector:8833/",
            "https://collector:8833",
            "agent.toml:1:13: collector: expected http://HOST:PORT, found \"https://collector:8833\"\nhint: https goes with a token",
        ),
        (
            "http://collector:8833/",
            "collector:8833",
            "agent.toml:1:13: collector: expected http://HOST:PORT",
        ),
        (
            "http://collector:8833/",
            "http://collector/v1/frames",
            "agent.toml:1:13: collector: expected http://HOST:PORT",
        ),
        (
            "[[bus]]",
            "post_every_ms = 5\n[[bus]]",
            "agent.toml:2:17: post_every_ms: expected 50 to 60000, found 5\nhint: leave post_every_ms out",
        ),
        (
            "[[bus]]",
            "ring_frames = 1\n[[bus]]",
            "agent.toml:2:15: ring_frames: expected 100 to 200000, found 1\nhint: ",
        ),
        (
            "[[bus]]",
            "device = \"a b\"\n[[bus]]",
            "agent.toml:2:10: device: expected 1 to 64 letters",
        ),
        (
            "/dev/i2c-1",
            "i2c-1",
            "agent.toml:3:8: path: expected a device file, found \"i2c-1\"\nhint: on a Raspberry Pi it is /dev/i2c-1",
        ),
        // A camera is no bus, and a rate is of a sensor.
        (
            "/dev/i2c-1",
            "v4l2:/dev/video0",
            "agent.toml:3:8: path: expected a device file, found \"v4l2:/dev/video0\"\nhint: on a Raspberry Pi it is /dev/i2c-1",
        ),
        (
            "[[bus.sensor]]",
            "rate_hz = 10\n[[bus.sensor]]",
            "agent.toml:4:1: unknown field `rate_hz`",
        ),
        (
            "address = 0x69",
            "address = 69",
            "agent.toml:5:11: address: expected 0x68 or 0x69, found 0x45\nhint: write 0x69: without 0x",
        ),
        (
            "http://collector:8833/",
            "http://collector",
            "agent.toml:1:13: collector: expected http://HOST:PORT",
        ),
        (
            "http://collector:8833/",
            "http://:8833",
            "agent.toml:1:13: collector: expected http://HOST:PORT",
        ),
        (
            "http://collector:8833/",
            "http://collector:99999",
            "agent.toml:1:13: collector: expected http://HOST:PORT",
        ),
        (
            "http://collector:8833/",
            "http://collector:0",
            "agent.toml:1:13: collector: expected http://HOST:PORT",
        ),
        (
            "http://collector:8833/",
            "http://[::1",
            "agent.toml:1:13: collector: expected http://HOST:PORT",
        ),
        ("[[bus]]", "[[bus]", "agent.toml:2:"),
        (
            "[[bus]]",
            "[spool]\nmode = \"disk\"\n[[bus]]",
            "agent.toml:3:8: mode: expected \"ram\", \"outage\" or \"always\", found \"disk\"\nhint: ",
        ),
        (
            "[[bus]]",
            "[spool]\nfolder = \"spool\"\n[[bus]]",
            "agent.toml:3:10: folder: expected an absolute path, found \"spool\"\nhint: leave folder out under systemd",
        ),
        (
            "[[bus]]",
            "[spool]\nmib_max = 0\n[[bus]]",
            "agent.toml:3:11: mib_max: expected 1 to 1048576, found 0\nhint: ",
        ),
        (
            "[[bus]]",
            "[spool]\nsync_every_ms = 5\n[[bus]]",
            "agent.toml:3:17: sync_every_ms: expected 50 to 60000, found 5\nhint: ",
        ),
        (
            "[[bus]]",
            "[spool]\nmib = 5\n[[bus]]",
            "agent.toml:3:1: unknown field `mib`",
        ),
        (
            "[[bus]]",
            "ring_frames = 150\n[spool]\n[[bus]]",
            "agent.toml:3:1: ring_frames: expected at least 200, which are 20 s of these sensors, found 150\nhint: write ring_frames = 200",
        ),
    ];

    #[test]
    fn the_spool_is_for_outages_unless_told_otherwise_and_its_guarantee_is_in_frames_and_seconds() {
        let with = |spool: &str| {
            let text = SMALLEST.replacen("[[bus]]", &format!("{spool}[[bus]]"), 1);
            Config::parse(&text, "agent.toml").unwrap()
        };
        let config = with("");
        assert_eq!(config.spool.mode, SpoolMode::Ram);
        // 10 frames a second, and 6 per cent more from the fastest sensor.
        assert_eq!(config.guarantee().frames, 10_000);
        assert!((config.guarantee().seconds - 943.4).abs() < 0.1);
        let config = with("[spool]\n");
        let after = SPOOL_AFTER_DEFAULT;
        assert_eq!(config.spool.mode, SpoolMode::Outage { after });
        assert_eq!(config.spool.bytes_max, 1 << 30);
        assert_eq!(
            config.guarantee().to_string(),
            "a loss of power or a killed agent costs at most the 109 frames that were read in the last 10.25 s and are not acknowledged, while the disk syncs within 0.125 s"
        );
        let config = with("[spool]\nmode = \"always\"\nsync_every_ms = 500\n");
        let guarantee = config.guarantee();
        assert_eq!((guarantee.frames, guarantee.seconds), (8, 0.75));
    }

    #[test]
    fn every_refusal_names_line_column_and_the_fix() {
        for (found, with, expected) in REFUSALS {
            let message = refusal(&SMALLEST.replacen(found, with, 1));
            assert!(message.starts_with(expected), "{with}: {message}");
            assert!(message.contains("\nhint: "), "{message}");
        }
    }

    #[test]
    fn a_collector_is_named_by_host_name_or_by_address_of_either_kind() {
        for collector in [
            "http://pc.local:8833",
            "http://192.168.1.20:80",
            "http://[fe80::1]:8833",
        ] {
            let text = SMALLEST.replace("http://collector:8833/", collector);
            assert_eq!(
                Config::parse(&text, "x").unwrap().collector.as_deref(),
                Some(collector)
            );
        }
    }

    #[test]
    fn what_joining_left_is_added_and_two_collectors_are_refused() {
        let joined = Joined {
            collector: "http://pc:8833".to_owned(),
            device: Some("pi-1".to_owned()),
            credentials: Credentials::default(),
        };
        let without = SMALLEST.replacen("collector = \"http://collector:8833/\"\n", "", 1);
        let mut config = Config::parse(&without, "x").unwrap();
        assert_eq!(config.collector, None);
        config.join(joined.clone()).unwrap();
        assert_eq!(config.collector.as_deref(), Some("http://pc:8833"));
        assert_eq!(config.device.as_deref(), Some("pi-1"));
        let named = format!("device = \"cellar\"\njoined = \"/x/collector.toml\"\n{without}");
        let mut config = Config::parse(&named, "x").unwrap();
        assert_eq!(
            config.joined.as_deref(),
            Some(Path::new("/x/collector.toml"))
        );
        config.join(joined.clone()).unwrap();
        assert_eq!(config.device.as_deref(), Some("cellar"));
        let mut config = Config::parse(SMALLEST, "x").unwrap();
        let error = config.join(joined).unwrap_err().to_string();
        assert!(error.contains("http://pc:8833") && error.contains("\nhint: take the line"));
    }

    #[test]
    fn a_configuration_without_a_bus_or_with_the_same_twice_is_refused() {
        assert!(refusal("collector = \"http://c:1\"").contains("missing field `bus`"));
        assert!(
            refusal("collector = \"http://c:1\"\nbus = []")
                .contains("expected 1 to 16 [[bus]], found 0")
        );
        let twice =
            format!("{SMALLEST}[[bus]]\npath = \"/dev/i2c-1\"\n[[bus.sensor]]\naddress = 0x68\n");
        assert!(
            refusal(&twice).starts_with("agent.toml:6:1: the bus /dev/i2c-1 is named twice"),
            "{}",
            refusal(&twice)
        );
        let bare = SMALLEST.replace("[[bus.sensor]]\naddress = 0x69", "sensor = []");
        assert!(refusal(&bare).contains("expected at least one [[bus.sensor]]"));
    }

    #[test]
    fn a_file_that_is_far_too_long_is_refused_unread() {
        let long = "#".repeat(CONFIG_BYTES_MAX + 1);
        assert!(
            matches!(Config::parse(&long, "x"), Err(ConfigError::TooLong { found, .. }) if found == CONFIG_BYTES_MAX + 1)
        );
    }
}
