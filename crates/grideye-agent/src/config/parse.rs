//! Reads `agent.toml` and rejects any unknown key or value out of range.

use super::types::{
    BACKLOG_PER_S_DEFAULT, Body, BusConfig, CONFIG_BYTES_MAX, Config, ConfigError,
    RING_FRAMES_DEFAULT, SPOOL_AFTER_DEFAULT, SensorConfig, SpoolConfig, SpoolMode,
};
use crate::join::{Credentials, is_host_and_port};
use crate::limits::RING_FRAMES_MAX;
use amg8833::{Address, FrameRate};
use serde::Deserialize;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;
use toml::Spanned;

/// Maximum number of buses, because each has a thread.
pub const BUSES_MAX: usize = 16;

const MIB: u64 = 1 << 20;

const KEYS_HINT: &str = "the keys are device, collector, joined, body, post_every_ms, ring_frames, request_timeout_ms, \
    [spool], [health] listen, [[bus]] path and [[bus.sensor]] address, rate_hz, moving_average; see firmware-config/agent.toml";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawConfig {
    device: Option<Spanned<String>>,
    collector: Option<Spanned<String>>,
    joined: Option<PathBuf>,
    body: Option<Spanned<String>>,
    post_every_ms: Option<Spanned<u64>>,
    ring_frames: Option<Spanned<u64>>,
    request_timeout_ms: Option<Spanned<u64>>,
    spool: Option<Spanned<RawSpool>>,
    health: Option<RawHealth>,
    bus: Vec<Spanned<RawBus>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawHealth {
    listen: Spanned<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBus {
    path: Spanned<PathBuf>,
    #[serde(default)]
    sensor: Vec<RawSensor>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSensor {
    address: Spanned<u64>,
    rate_hz: Option<Spanned<u64>>,
    #[serde(default)]
    moving_average: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSpool {
    mode: Option<Spanned<String>>,
    folder: Option<Spanned<PathBuf>>,
    after_ms: Option<Spanned<u64>>,
    sync_every_ms: Option<Spanned<u64>>,
    mib_max: Option<Spanned<u64>>,
    free_mib_min: Option<Spanned<u64>>,
    backlog_frames_per_s: Option<Spanned<u64>>,
}

impl Config {
    /// Reads and checks a configuration. `origin` is the file's name in errors.
    ///
    /// # Errors
    /// [`ConfigError`] for anything not fully understood.
    pub fn parse(text: &str, origin: &str) -> Result<Self, ConfigError> {
        if text.len() > CONFIG_BYTES_MAX {
            return Err(ConfigError::TooLong(origin.to_owned(), text.len()));
        }
        let place = Place { text, origin };
        let raw = toml::from_str(text).map_err(|error| {
            let offset = error.span().map_or(0, |span| span.start);
            // People who write a configuration do not know the TOML crate's `u64`.
            let words: Vec<&str> = error.message().split_whitespace().collect();
            let message = words.join(" ");
            let message = message.replace("expected u64", "expected a whole number");
            place.refuse(offset, message, KEYS_HINT)
        })?;
        place.check(raw)
    }
}

type Checked<T> = Result<T, ConfigError>;

/// The text being read, which turns an offset into line and column.
struct Place<'a> {
    text: &'a str,
    origin: &'a str,
}

impl Place<'_> {
    fn refuse(&self, offset: usize, message: String, hint: impl Into<String>) -> ConfigError {
        let before = self.text.get(..offset).unwrap_or(self.text);
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        let line = before.matches('\n').count() + 1;
        let column = before[line_start..].chars().count() + 1;
        let place = format!("{}:{line}:{column}", self.origin);
        ConfigError::Refused(place, message, hint.into())
    }

    /// The value that `understand` makes of it, or an error that `expected` was not found.
    fn expect<T, V: std::fmt::Debug>(
        &self,
        given: &Spanned<V>,
        understand: impl FnOnce(&V) -> Option<T>,
        expected: &str,
        hint: &str,
    ) -> Checked<T> {
        let found = given.get_ref();
        understand(found).ok_or_else(|| {
            let message = format!("{expected}, found {found:?}");
            self.refuse(given.span().start, message, hint)
        })
    }

    /// [`Self::expect`] for a key that may be absent.
    fn optional<T, V: std::fmt::Debug>(
        &self,
        given: Option<&Spanned<V>>,
        understand: impl FnOnce(&V) -> Option<T>,
        expected: &str,
        hint: &str,
    ) -> Checked<Option<T>> {
        let found = given.map(|given| self.expect(given, understand, expected, hint));
        found.transpose()
    }

    fn within(
        &self,
        name: &str,
        given: Option<&Spanned<u64>>,
        default: u64,
        (min, max): (u64, u64),
    ) -> Checked<u64> {
        let is_within = |found: &u64| (min..=max).contains(found).then_some(*found);
        let expected = format!("{name}: expected {min} to {max}");
        let hint = format!("leave {name} out for the default of {default}");
        let found = self.optional(given, is_within, &expected, &hint)?;
        Ok(found.unwrap_or(default))
    }

    fn milliseconds(
        &self,
        name: &str,
        given: Option<&Spanned<u64>>,
        default: u64,
        bounds: (u64, u64),
    ) -> Checked<Duration> {
        let found = self.within(name, given, default, bounds);
        found.map(Duration::from_millis)
    }

    fn check(&self, raw: RawConfig) -> Checked<Config> {
        let ring_bounds = (100, u64::try_from(RING_FRAMES_MAX).unwrap_or(u64::MAX));
        let ring_default = u64::try_from(RING_FRAMES_DEFAULT).unwrap_or(u64::MAX);
        let ring_frames = raw.ring_frames.as_ref();
        let ring_frames = self.within("ring_frames", ring_frames, ring_default, ring_bounds)?;
        let buses = self.buses(&raw.bus)?;
        let spool_at = raw.spool.as_ref().map_or(0, |spool| spool.span().start);
        let spool = self.spool(raw.spool.map(Spanned::into_inner))?;
        let (pause, timeout) = (&raw.post_every_ms, &raw.request_timeout_ms);
        let (pause, timeout) = (pause.as_ref(), timeout.as_ref());
        let timeout_bounds = (100, 120_000);
        let config = Config {
            device: self.device(raw.device.as_ref())?,
            collector: self.collector(raw.collector.as_ref())?,
            joined: raw.joined,
            credentials: Credentials::default(),
            body: self.body(raw.body.as_ref())?.unwrap_or_default(),
            post_every: self.milliseconds("post_every_ms", pause, 500, (50, 60_000))?,
            ring_frames: usize::try_from(ring_frames).unwrap_or(RING_FRAMES_MAX),
            request_timeout: self.milliseconds(
                "request_timeout_ms",
                timeout,
                10_000,
                timeout_bounds,
            )?,
            spool,
            health: self.listen(raw.health.as_ref().map(|health| &health.listen))?,
            buses,
        };
        self.ring_for_spool(&config, spool_at)?;
        Ok(config)
    }

    /// Memory must have room for the records that wait for the disk.
    fn ring_for_spool(&self, config: &Config, spool_at: usize) -> Checked<()> {
        let SpoolMode::Outage { after } = config.spool.mode else {
            return Ok(());
        };
        let seconds = after.as_secs() + 10;
        let needed = u64::from(config.rate_hz()) * seconds;
        if u64::try_from(config.ring_frames).is_ok_and(|frames| frames >= needed) {
            return Ok(());
        }
        let message = format!(
            "ring_frames: expected at least {needed} ({seconds} s of these sensors), found {}",
            config.ring_frames
        );
        let hint = format!("write ring_frames = {needed}, or lower spool.after_ms");
        Err(self.refuse(spool_at, message, hint))
    }

    fn device(&self, device: Option<&Spanned<String>>) -> Checked<Option<String>> {
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
        let is_name = |name: &String| (1..=64).contains(&name.len()) && name.chars().all(plain);
        self.optional(
            device,
            |name| is_name(name).then(|| name.clone()),
            "device: expected 1 to 64 letters, digits, dots, hyphens or underscores",
            "leave device out to use the host's name",
        )
    }

    fn collector(&self, collector: Option<&Spanned<String>>) -> Checked<Option<String>> {
        let hint = if collector.is_some_and(|url| url.get_ref().starts_with("https://")) {
            "https goes with a token and a pin: paste the line that `grideye enroll DEVICE` prints on the collector's machine, instead of this key"
        } else {
            "give only the collector's address and port, for example http://192.168.1.20:8833"
        };
        let understand = |found: &String| {
            let url = found.trim_end_matches('/');
            let authority = url.strip_prefix("http://");
            let is_address = authority.is_some_and(is_host_and_port);
            is_address.then(|| url.to_owned())
        };
        let expected = "collector: expected http://HOST:PORT";
        self.optional(collector, understand, expected, hint)
    }

    fn body(&self, body: Option<&Spanned<String>>) -> Checked<Option<Body>> {
        self.optional(
            body,
            |found| match found.as_str() {
                "json" => Some(Body::Json),
                "binary" => Some(Body::Binary),
                _ => None,
            },
            "body: expected \"json\" or \"binary\"",
            "\"binary\" is for fleets and slow lines; a collector that does not know it gets JSON",
        )
    }

    fn listen(&self, listen: Option<&Spanned<String>>) -> Checked<Option<SocketAddr>> {
        self.optional(
            listen,
            |found| found.parse().ok().filter(|at: &SocketAddr| at.ip().is_loopback()),
            "listen: expected an address and port of this machine",
            "listen = \"127.0.0.1:8834\"; other machines can ask the collector: GET /v1/devices, /metrics",
        )
    }

    fn buses(&self, raw: &[Spanned<RawBus>]) -> Checked<Vec<BusConfig>> {
        if raw.is_empty() || raw.len() > BUSES_MAX {
            let message = format!("expected 1 to {BUSES_MAX} [[bus]], found {}", raw.len());
            let hint = "name the bus that the sensor is wired to: [[bus]] path = \"/dev/i2c-1\"";
            return Err(self.refuse(0, message, hint));
        }
        let mut buses: Vec<BusConfig> = Vec::new();
        for bus in raw {
            let at = bus.span().start;
            let bus = self.bus(bus.get_ref(), at)?;
            let is_named = |other: &BusConfig| other.path.file_name() == bus.path.file_name();
            if buses.iter().any(is_named) {
                let message = format!("the bus {} is named twice", bus.path.display());
                return Err(self.refuse(at, message, "put all sensors of a bus below one [[bus]]"));
            }
            buses.push(bus);
        }
        Ok(buses)
    }

    fn bus(&self, raw: &RawBus, at: usize) -> Checked<BusConfig> {
        let is_file = |path: &PathBuf| path.file_name().is_some() && path.is_absolute();
        let path = self.expect(
            &raw.path,
            |path| is_file(path).then(|| path.clone()),
            "path: expected a device file",
            "on a Raspberry Pi it is /dev/i2c-1",
        )?;
        if raw.sensor.is_empty() {
            let hint = "add [[bus.sensor]] with address = 0x69 (or 0x68)";
            return Err(self.refuse(at, "expected at least one [[bus.sensor]]".to_owned(), hint));
        }
        let mut sensors: Vec<SensorConfig> = Vec::new();
        for raw in &raw.sensor {
            let at = raw.address.span().start;
            let sensor = self.sensor(raw)?;
            if sensors.iter().any(|other| other.address == sensor.address) {
                let message = format!("address: {} is named twice on this bus", sensor.address);
                let hint = "two sensors on one bus are 0x68 and 0x69";
                return Err(self.refuse(at, message, hint));
            }
            sensors.push(sensor);
        }
        Ok(BusConfig { path, sensors })
    }

    fn sensor(&self, raw: &RawSensor) -> Checked<SensorConfig> {
        let found = *raw.address.get_ref();
        let address = u8::try_from(found).ok();
        let Some(address) = address.and_then(|address| Address::try_from(address).ok()) else {
            let hint = if matches!(found, 68 | 69) {
                format!("write 0x{found}: without 0x it is a decimal number")
            } else {
                "give the 7-bit address: 0x69 on most breakout boards, 0x68 where AD_SELECT is at GND".to_owned()
            };
            let message = format!("address: expected 0x68 or 0x69, found {found:#04x}");
            return Err(self.refuse(raw.address.span().start, message, hint));
        };
        let rate = self.optional(
            raw.rate_hz.as_ref(),
            |found| u8::try_from(*found).ok().and_then(FrameRate::from_fps),
            "rate_hz: expected 10 or 1",
            "the sensor measures either 10 times or once per second",
        )?;
        Ok(SensorConfig {
            rate: rate.unwrap_or(FrameRate::Ten),
            moving_average: raw.moving_average,
            ..SensorConfig::at(address)
        })
    }

    /// No section means no spool, so that an agent started by hand leaves nothing on the disk.
    fn spool(&self, raw: Option<RawSpool>) -> Checked<SpoolConfig> {
        let Some(raw) = raw else {
            return Ok(SpoolConfig {
                mode: SpoolMode::Ram,
                folder: None,
                bytes_max: MIB,
                free_bytes_min: 0,
                backlog_per_s: BACKLOG_PER_S_DEFAULT,
            });
        };
        let folder = self.optional(
            raw.folder.as_ref(),
            |path| path.is_absolute().then(|| path.clone()),
            "folder: expected an absolute path",
            "leave folder out under systemd, which gives one (StateDirectory=); else /var/lib/grideye-agent/spool",
        )?;
        let after_default = u64::try_from(SPOOL_AFTER_DEFAULT.as_millis()).unwrap_or(u64::MAX);
        let (after, sync_every) = (raw.after_ms.as_ref(), raw.sync_every_ms.as_ref());
        let after = self.milliseconds("after_ms", after, after_default, (100, 600_000))?;
        let sync_every = self.milliseconds("sync_every_ms", sync_every, 1000, (50, 60_000))?;
        let mode = self.optional(
            raw.mode.as_ref(),
            |found| match found.as_str() {
                "ram" => Some(SpoolMode::Ram),
                "outage" => Some(SpoolMode::Outage { after }),
                "always" => Some(SpoolMode::Always { sync_every }),
                _ => None,
            },
            "mode: expected \"ram\", \"outage\" or \"always\"",
            "\"outage\" spares the card: it is written only while the collector is away",
        )?;
        let (per_s, default) = (raw.backlog_frames_per_s, BACKLOG_PER_S_DEFAULT.into());
        let bounds = (10, 100_000);
        let backlog = self.within("backlog_frames_per_s", per_s.as_ref(), default, bounds)?;
        let (most, free) = (raw.mib_max.as_ref(), raw.free_mib_min.as_ref());
        Ok(SpoolConfig {
            mode: mode.unwrap_or(SpoolMode::Outage { after }),
            folder,
            bytes_max: MIB * self.within("mib_max", most, 1024, (1, 1 << 20))?,
            free_bytes_min: MIB * self.within("free_mib_min", free, 256, (0, 1 << 20))?,
            backlog_per_s: u32::try_from(backlog).unwrap_or(BACKLOG_PER_S_DEFAULT),
        })
    }
}
