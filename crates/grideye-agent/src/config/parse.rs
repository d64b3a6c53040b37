//! Reads `agent.toml` by the rows of its keys: any other key or value is rejected.

use super::types::{
    BACKLOG_PER_S_DEFAULT, Body, BusConfig, CONFIG_BYTES_MAX, Config, ConfigError,
    RING_FRAMES_DEFAULT, SPOOL_AFTER_DEFAULT, SensorConfig, SpoolConfig, SpoolMode,
};
use crate::join::{Credentials, is_host_and_port};
use crate::limits::RING_FRAMES_MAX;
use amg8833::{Address, FrameRate};
use grideye_text::Number::Integer;
use grideye_text::{Kind, Place, Refusal, Rows, Style, Table, Value, rows};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Maximum number of buses, because each has a thread.
pub const BUSES_MAX: usize = 16;

const MIB: u64 = 1 << 20;

const KEYS_HINT: &str = "the keys are device, collector, joined, body, post_every_ms, ring_frames, request_timeout_ms, \
    [spool], [health] listen, [[bus]] path and [[bus.sensor]] address, rate_hz, moving_average; see firmware-config/agent.toml";

const STYLE: Style = Style {
    unknown: KEYS_HINT,
    missing: KEYS_HINT,
    mistyped: KEYS_HINT,
    no_toml: KEYS_HINT,
    bytes_max: (CONFIG_BYTES_MAX, "is this really agent.toml?"),
    wrong: |key, found, expected| format!("{key}: expected {expected}, found {found}"),
    names_key: false,
};

/// The agent's configuration.
pub static CONFIG: Rows = Rows {
    rows: &[rows! {
        "device" Kind::Text(is_device), "", "1 to 64 letters, digits, dots, hyphens or underscores", "leave device out to use the host's name";
        "collector" Kind::Text(|_| true), "", "http://HOST:PORT", "give only the collector's address and port, for example http://192.168.1.20:8833";
        "joined" Kind::Text(|_| true), "", "", "the file that joining wrote, instead of collector";
        "body" Kind::Word(&["json", "binary"]), "", "", "\"binary\" is for fleets and slow lines; a collector that does not know it gets JSON";
        "post_every_ms" Kind::Number(Integer(50.0, 60_000.0)), "", "", "leave post_every_ms out for the default of 500";
        "ring_frames" Kind::Number(Integer(100.0, 200_000.0)), "", "", "leave ring_frames out for the default of 10000";
        "request_timeout_ms" Kind::Number(Integer(100.0, 120_000.0)), "", "", "leave request_timeout_ms out for the default of 10000";
        "spool" Kind::Table(&SPOOL), "", "", "frames go to the disk while the collector is away; without this table, never";
        "health" Kind::Table(&HEALTH), "", "", "the agent's health over HTTP; without this table, not served";
        "bus" Kind::Tables(&BUS, usize::MAX), "", "", "1 to 16, each with at least one sensor";
    }],
    required: &["bus"],
    ..Rows::EMPTY
};
static SPOOL: Rows = Rows {
    rows: &[rows! {
        "mode" Kind::Word(&["ram", "outage", "always"]), "", "", "\"outage\" spares the card: it is written only while the collector is away";
        "folder" Kind::Text(|path| Path::new(path).is_absolute()), "", "an absolute path", "leave folder out under systemd, which gives one (StateDirectory=); else /var/lib/grideye-agent/spool";
        "after_ms" Kind::Number(Integer(100.0, 600_000.0)), "", "", "leave after_ms out for the default of 10000";
        "sync_every_ms" Kind::Number(Integer(50.0, 60_000.0)), "", "", "leave sync_every_ms out for the default of 1000";
        "mib_max" Kind::Number(Integer(1.0, 1_048_576.0)), "", "", "leave mib_max out for the default of 1024";
        "free_mib_min" Kind::Number(Integer(0.0, 1_048_576.0)), "", "", "leave free_mib_min out for the default of 256";
        "backlog_frames_per_s" Kind::Number(Integer(10.0, 100_000.0)), "", "", "leave backlog_frames_per_s out for the default of 1000";
    }],
    ..Rows::EMPTY
};
static HEALTH: Rows = Rows {
    rows: &[rows! {
        "listen" Kind::Text(|at| loopback(at).is_some()), "", "an address and port of this machine", "listen = \"127.0.0.1:8834\"; other machines can ask the collector: GET /v1/devices, /metrics";
    }],
    required: &["listen"],
    ..Rows::EMPTY
};
static BUS: Rows = Rows {
    rows: &[rows! {
        "path" Kind::Text(is_file), "", "a device file", "on a Raspberry Pi it is /dev/i2c-1";
        "bus.sensor" Kind::Tables(&SENSOR, usize::MAX), "", "", "each at another address";
    }],
    required: &["path"],
    ..Rows::EMPTY
};
static SENSOR: Rows = Rows {
    rows: &[rows! {
        "address" Kind::Number(Integer(0.0, f64::MAX)), "", "0x68 or 0x69", "give the 7-bit address: 0x69 on most breakout boards, 0x68 where AD_SELECT is at GND";
        "rate_hz" Kind::Number(Integer(f64::MIN, f64::MAX)), "", "10 or 1", "the sensor measures either 10 times or once per second";
        "moving_average" Kind::Flag, "", "", "whether the chip averages two frames";
    }],
    required: &["address"],
    ..Rows::EMPTY
};

fn is_device(name: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    (1..=64).contains(&name.len()) && name.chars().all(plain)
}

fn is_file(path: &str) -> bool {
    let path = Path::new(path);
    path.file_name().is_some() && path.is_absolute()
}

fn loopback(at: &str) -> Option<SocketAddr> {
    at.parse()
        .ok()
        .filter(|at: &SocketAddr| at.ip().is_loopback())
}

impl Config {
    /// Reads and checks a configuration. `origin` is the file's name in errors.
    ///
    /// # Errors
    /// [`ConfigError`] for anything not fully understood.
    pub fn parse(text: &str, origin: &str) -> Result<Self, ConfigError> {
        Ok(grideye_text::read((origin, text), &STYLE, &CONFIG, config)?)
    }
}

type Checked<T> = Result<T, Refusal>;

fn config(table: &Table<'_>) -> Checked<Config> {
    let ring_frames = table
        .whole("ring_frames")
        .and_then(|frames| usize::try_from(frames).ok());
    let config = Config {
        device: table.text("device").map(str::to_owned),
        collector: table.get("collector").map(collector).transpose()?,
        joined: table.text("joined").map(PathBuf::from),
        credentials: Credentials::default(),
        body: match table.text("body") {
            Some("binary") => Body::Binary,
            _ => Body::Json,
        },
        post_every: milliseconds(table, "post_every_ms", 500),
        ring_frames: ring_frames
            .unwrap_or(RING_FRAMES_DEFAULT)
            .min(RING_FRAMES_MAX),
        request_timeout: milliseconds(table, "request_timeout_ms", 10_000),
        spool: spool(table.table("spool")),
        health: table.text("health.listen").and_then(loopback),
        buses: buses(table)?,
    };
    check_ring(table, &config)?;
    Ok(config)
}

/// A number that its row keeps from being negative.
fn natural(table: &Table<'_>, key: &str, default: u64) -> u64 {
    let given = table.whole(key).and_then(|whole| u64::try_from(whole).ok());
    given.unwrap_or(default)
}

fn milliseconds(table: &Table<'_>, key: &str, default: u64) -> Duration {
    Duration::from_millis(natural(table, key, default))
}

/// Memory must have room for the records that wait for the disk.
fn check_ring(table: &Table<'_>, config: &Config) -> Checked<()> {
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
    let at = table.table("spool").map_or(0, |spool| spool.start);
    Err(table.source.place(at).refused(message, &hint))
}

fn collector(given: Value<'_>) -> Checked<String> {
    let text = given.text().unwrap_or_default();
    let url = text.trim_end_matches('/');
    if url.strip_prefix("http://").is_some_and(is_host_and_port) {
        return Ok(url.to_owned());
    }
    if text.starts_with("https://") {
        let hint = "https goes with a token and a pin: paste the line that `grideye enroll DEVICE` prints on the collector's machine, instead of this key";
        return Err(given.refused_with("http://HOST:PORT", hint));
    }
    Err(given.wrong())
}

fn buses(table: &Table<'_>) -> Checked<Vec<BusConfig>> {
    let refuse = |at, message, hint| Err(table.source.place(at).refused(message, hint));
    let found = table.tables("bus").count();
    if found == 0 || found > BUSES_MAX {
        let message = format!("expected 1 to {BUSES_MAX} [[bus]], found {found}");
        let hint = "name the bus that the sensor is wired to: [[bus]] path = \"/dev/i2c-1\"";
        return refuse(0, message, hint);
    }
    let mut buses: Vec<BusConfig> = Vec::new();
    for table in table.tables("bus") {
        let bus = bus(&table)?;
        let is_named = |other: &BusConfig| other.path.file_name() == bus.path.file_name();
        if buses.iter().any(is_named) {
            let message = format!("the bus {} is named twice", bus.path.display());
            return refuse(
                table.start,
                message,
                "put all sensors of a bus below one [[bus]]",
            );
        }
        buses.push(bus);
    }
    Ok(buses)
}

fn bus(table: &Table<'_>) -> Checked<BusConfig> {
    let mut sensors: Vec<SensorConfig> = Vec::new();
    for table in table.tables("sensor") {
        let sensor = sensor(&table)?;
        if sensors.iter().any(|other| other.address == sensor.address) {
            let message = format!("address: {} is named twice on this bus", sensor.address);
            let hint = "two sensors on one bus are 0x68 and 0x69";
            return Err(at_address(&table).refused(message, hint));
        }
        sensors.push(sensor);
    }
    if sensors.is_empty() {
        let message = "expected at least one [[bus.sensor]]".to_owned();
        let hint = "add [[bus.sensor]] with address = 0x69 (or 0x68)";
        return Err(table.source.place(table.start).refused(message, hint));
    }
    let path = PathBuf::from(table.text("path").unwrap_or_default());
    Ok(BusConfig { path, sensors })
}

fn at_address(table: &Table<'_>) -> Place {
    let given = table.get("address");
    given.map_or_else(|| table.source.place(table.start), |given| given.place())
}

fn sensor(table: &Table<'_>) -> Checked<SensorConfig> {
    let found = table.whole("address").unwrap_or_default();
    let address = u8::try_from(found).ok();
    let Some(address) = address.and_then(|address| Address::try_from(address).ok()) else {
        let hint = if matches!(found, 68 | 69) {
            format!("write 0x{found}: without 0x it is a decimal number")
        } else {
            "give the 7-bit address: 0x69 on most breakout boards, 0x68 where AD_SELECT is at GND"
                .to_owned()
        };
        let message = format!("address: expected 0x68 or 0x69, found {found:#04x}");
        return Err(at_address(table).refused(message, &hint));
    };
    let mut sensor = SensorConfig::at(address);
    if let Some(given) = table.get("rate_hz") {
        let rate = given.whole().and_then(|rate| u8::try_from(rate).ok());
        let rate = rate.and_then(FrameRate::from_fps);
        sensor.rate = rate.ok_or_else(|| given.wrong())?;
    }
    sensor.moving_average = table.flag("moving_average").unwrap_or(false);
    Ok(sensor)
}

/// No section means no spool, so that an agent started by hand leaves nothing on the disk.
fn spool(table: Option<Table<'_>>) -> SpoolConfig {
    let Some(table) = &table else {
        return SpoolConfig {
            mode: SpoolMode::Ram,
            folder: None,
            bytes_max: MIB,
            free_bytes_min: 0,
            backlog_per_s: BACKLOG_PER_S_DEFAULT,
        };
    };
    let backlog = natural(table, "backlog_frames_per_s", BACKLOG_PER_S_DEFAULT.into());
    let after = table
        .whole("after_ms")
        .and_then(|after_ms| u64::try_from(after_ms).ok());
    SpoolConfig {
        mode: match table.text("mode") {
            Some("ram") => SpoolMode::Ram,
            Some("always") => SpoolMode::Always {
                sync_every: milliseconds(table, "sync_every_ms", 1000),
            },
            _ => SpoolMode::Outage {
                after: after.map_or(SPOOL_AFTER_DEFAULT, Duration::from_millis),
            },
        },
        folder: table.text("folder").map(PathBuf::from),
        bytes_max: MIB * natural(table, "mib_max", 1024),
        free_bytes_min: MIB * natural(table, "free_mib_min", 256),
        backlog_per_s: u32::try_from(backlog).unwrap_or(BACKLOG_PER_S_DEFAULT),
    }
}
