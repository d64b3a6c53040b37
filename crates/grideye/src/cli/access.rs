//! Options of the collector, of its MQTT bridge, and of the commands that manage tokens.

use super::count::CountLive;
use super::shared::{Choices, one_of, within};
use clap::{Args, Subcommand};
use grideye_collector::LogEvent;
use grideye_collector::auth::Scope;
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;

const SECURITY: &str = "TLS and access";
const LIMITS: &str = "Limits and logging";
const MQTT: &str = "MQTT for Home Assistant";

/// Receive frames from agents, store them and serve the live page.
///
/// On loopback, everyone on this machine has access until you make the first token (`grideye enroll`, `grideye token`).
/// Beyond loopback, tokens are required and TLS is on, with a certificate of the collector's own authority.
///
/// Example: grideye collect --store frames.sqlite
#[derive(Debug, Args)]
pub(crate) struct Collect {
    /// Address to listen on.
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:8833")]
    pub(crate) listen: SocketAddr,
    /// File or postgres://….
    ///
    /// An SQLite file is created if missing. Several collectors may share one `postgres://USER[:PASSWORD]@HOST[:PORT]/DATABASE`;
    /// the file that PGPASSFILE names may hold the password.
    #[arg(long, value_name = "FILE|URL", default_value = "grideye.sqlite")]
    pub(crate) store: String,
    /// Size limit, suffix k, M, G, T [default: none].
    ///
    /// In bytes, at least 1M; suffixes are powers of 1024. A full store accepts no frames. For SQLite only.
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub(crate) store_quota: Option<u64>,
    /// Delete frames after N days [default: never].
    ///
    /// For SQLite only. Only days with a running collector count, so a wrong clock cannot make frames old. At most a tenth of
    /// the store is deleted per fortieth of this time. Frames of a recording stay.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=36_500))]
    pub(crate) keep_days: Option<u64>,
    /// Delete the oldest above this size [default: never].
    ///
    /// For SQLite only. Suffix k, M, G or T, powers of 1024; at least 1M. Per hour, deletes at most a tenth of the store plus
    /// twice the frames that arrived. Frames of a recording stay.
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub(crate) keep_bytes: Option<u64>,
    #[command(flatten)]
    pub(crate) scenes: Scenes,
    #[command(flatten)]
    pub(crate) people: CountLive,
    #[command(flatten)]
    pub(crate) folder: Folder,
    /// Turn on TLS on loopback too.
    #[arg(long, conflicts_with = "plain_http")]
    pub(crate) tls: bool,
    /// Serve plain HTTP, for use behind a TLS proxy.
    ///
    /// The default on loopback; beyond loopback, needs --trust-network.
    #[arg(long, conflicts_with_all = ["tls_cert", "tls_client_ca"])]
    pub(crate) plain_http: bool,
    /// Listen beyond loopback without TLS.
    ///
    /// Until the first token is made, everyone who reaches the address has access.
    #[arg(long)]
    pub(crate) trust_network: bool,
    /// Start although the store was used with tokens and there are none.
    ///
    /// Everyone who reaches the address then has access.
    #[arg(long, hide_short_help = true, help_heading = SECURITY)]
    pub(crate) forget_tokens: bool,

    /// Host name for the certificate, such as pc.local; repeatable.
    ///
    /// The collector answers to these names and to the address it listens on.
    #[arg(long = "host-name", value_name = "NAME", hide_short_help = true, help_heading = SECURITY)]
    pub(crate) host_names: Vec<String>,
    /// Certificate of your own, with its chain up to the authority (PEM).
    ///
    /// Turns on TLS.
    #[arg(long, value_name = "FILE", requires = "tls_key", hide_short_help = true, help_heading = SECURITY)]
    pub(crate) tls_cert: Option<PathBuf>,
    /// Private key of --tls-cert (PEM).
    #[arg(long, value_name = "FILE", requires = "tls_cert", hide_short_help = true, help_heading = SECURITY)]
    pub(crate) tls_key: Option<PathBuf>,
    /// Authorities of client certificates (PEM).
    ///
    /// Turns on TLS. Every client then needs a certificate of one of them besides its token.
    #[arg(long, value_name = "FILE", hide_short_help = true, help_heading = SECURITY)]
    pub(crate) tls_client_ca: Option<PathBuf>,
    /// Address of a proxy in front of the collector; repeatable.
    ///
    /// The sender is then the address that the proxy names in `x-forwarded-for`, for request and sign-in limits and the log.
    /// From anyone else the header is ignored. The proxy is exempt from the connection limit per address.
    #[arg(long = "trusted-proxy", value_name = "ADDR", hide_short_help = true, help_heading = SECURITY)]
    pub(crate) trusted_proxies: Vec<IpAddr>,

    /// Requests per second allowed for each token.
    ///
    /// An address without a token is allowed a tenth as many.
    #[arg(long, value_name = "N", hide_short_help = true, help_heading = LIMITS, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) requests_per_second: u32,
    /// Format of the log on standard error.
    #[arg(long, value_parser = one_of(LOG_FORMATS), hide_short_help = true, help_heading = LIMITS, default_value = "text")]
    pub(crate) log: LogFormat,
    #[command(flatten)]
    pub(crate) mqtt: BridgeOptions,
}

/// Scenes for the live page.
#[derive(Debug, Args)]
pub(crate) struct Scenes {
    /// Folder of scenes for the page [default: scenes].
    ///
    /// The page shows a sensor beside one of these scenes. The default applies if that folder exists.
    #[arg(long = "scenes", value_name = "DIR")]
    pub(crate) folder: Option<PathBuf>,
}

pub(crate) type LogFormat = fn(&LogEvent) -> String;

const LOG_FORMATS: Choices<LogFormat> = (
    &[LogEvent::to_string, LogEvent::to_json],
    "text `warning: refused code=bad_token peer=192.168.1.7`
json One JSON object per line",
);

/// The folder of tokens and keys.
#[derive(Debug, Args)]
pub(crate) struct Folder {
    /// Folder of tokens and keys.
    ///
    /// Created with the first of them.
    #[arg(long = "access", value_name = "DIR", default_value = "grideye-access")]
    pub(crate) path: PathBuf,
}

/// Print the command that lets a device's agent join.
///
/// Paste it on the Raspberry Pi, or run `grideye enroll pi-1 | ssh pi sudo grideye-agent join -`. Either way the token passes
/// through standard input, so no process list shows it.
///
/// The code in the command holds the collector's address, a new token for the device's frames, and the SHA-256 of the
/// authority of the collector's certificate. Whoever has the code can send frames of that device. It is printed once; the
/// collector stores only a hash of the token.
///
/// Example: grideye enroll pi-1
#[derive(Debug, Args)]
pub(crate) struct Enroll {
    /// Name of the device; several names share one token.
    #[arg(value_name = "DEVICE", required = true)]
    pub(crate) devices: Vec<String>,
    #[command(flatten)]
    pub(crate) folder: Folder,
    /// Collector's address for agents [default: its last].
    ///
    /// The default is the last that was given here, or where the collector was last started to listen, whichever is newer;
    /// without both, port 8833 of this machine.
    #[arg(long, value_name = "URL")]
    pub(crate) url: Option<String>,
    /// File to write instead of printing.
    ///
    /// Only its owner may read it.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Authority of your own certificate (PEM).
    ///
    /// Needed if the collector's own authority did not sign its certificate.
    #[arg(long, value_name = "FILE")]
    pub(crate) authority: Option<PathBuf>,
    /// Print a header file for the ESP32's sketch.
    ///
    /// firmware-config/esp32/README.md has the sketch.
    #[arg(long, conflicts_with = "json")]
    pub(crate) esp32: bool,
    /// Print code and command as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Make, list and revoke access tokens.
///
/// A running collector notices within a second.
///
/// Example: grideye token list
#[derive(Debug, Args)]
pub(crate) struct TokenCommand {
    #[command(subcommand)]
    pub(crate) command: TokenWhat,
}

#[derive(Debug, Subcommand)]
pub(crate) enum TokenWhat {
    Make(TokenMake),
    List(TokenList),
    Revoke(TokenRevoke),
}

/// Make a token for the live page or a program.
///
/// Prints the token once. For a device, use `grideye enroll`.
///
/// Example: grideye token make ana --scope read
#[derive(Debug, Args)]
pub(crate) struct TokenMake {
    /// Name of the person or program.
    pub(crate) name: String,
    /// Permissions: read (view) or admin (also record).
    ///
    /// `read`: view the page, recordings, audit and metrics. `admin`: also start, stop, label and delete recordings.
    #[arg(long, value_parser = one_of(SCOPES), hide_possible_values = true)]
    pub(crate) scope: Scope,
    /// File to write instead of printing the token.
    ///
    /// Only its owner may read it.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) folder: Folder,
}

/// The scopes that people and programs may have.
const SCOPES: Choices<Scope> = (
    &[Scope::Read, Scope::Admin],
    "read View the page, recordings, audit and metrics
admin Also start, stop, label and delete recordings",
);

/// List the tokens by number, without their secrets.
///
/// Columns are number, state, scope, name and devices; --json adds when each was made and revoked.
///
/// Example: grideye token list
#[derive(Debug, Args)]
pub(crate) struct TokenList {
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) folder: Folder,
}

/// Revoke a token for good.
///
/// Example: grideye token revoke pi-1
#[derive(Debug, Args)]
pub(crate) struct TokenRevoke {
    /// Number of the token, or a name to revoke all of that name.
    #[arg(value_name = "ID|NAME")]
    pub(crate) named: String,
    #[command(flatten)]
    pub(crate) folder: Folder,
}

/// The address of a running collector.
#[derive(Debug, Args)]
pub(crate) struct CollectorAddress {
    /// Collector's address.
    #[arg(
        long = "collector",
        value_name = "URL",
        default_value = "http://127.0.0.1:8833"
    )]
    pub(crate) url: String,
    /// File with a token of scope read (record: admin).
    ///
    /// Needed if the collector asks for tokens. `grideye token make NAME --scope read --out FILE` writes one.
    #[arg(long, value_name = "FILE")]
    pub(crate) token_file: Option<PathBuf>,
    /// Authority of the collector's certificate (PEM).
    ///
    /// Needed for https: grideye-access/authority.pem on the collector's machine.
    #[arg(long, value_name = "FILE")]
    pub(crate) authority: Option<PathBuf>,
}

/// Parses a number with an optional suffix k, M, G or T (powers of 1024); at least 1 MiB.
fn bytes(text: &str) -> Result<u64, String> {
    const LEAST: u64 = 1 << 20;
    let suffix = text.chars().last().and_then(|last| "kMGT".find(last));
    let digits = suffix.map_or(text, |_| &text[..text.len() - 1]);
    let shift = suffix.map_or(0, |place| 10 * (place + 1));
    let number: Option<u64> = digits.parse().ok();
    number
        .and_then(|number| number.checked_mul(1 << shift))
        .filter(|bytes| *bytes >= LEAST)
        .ok_or_else(|| "expected a number of bytes, 1M or more, such as 500M or 20G".to_owned())
}

/// The broker and the topics on it.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = MQTT)]
pub(crate) struct BrokerOptions {
    /// Broker: `mqtt://[USER@]HOST[:PORT]`; `mqtts://` encrypts.
    #[arg(long = "mqtt", id = "mqtt", value_name = "URL")]
    pub(crate) url: Option<String>,
    /// File with the user's password [default: the variable GRIDEYE_MQTT_PASSWORD].
    #[arg(long, hide_short_help = true, value_name = "FILE", requires = "mqtt")]
    pub(crate) mqtt_password_file: Option<PathBuf>,
    /// Authorities of the broker's certificate (PEM), required for mqtts; /etc/ssl/certs/ca-certificates.crt has the public ones.
    #[arg(long, hide_short_help = true, value_name = "FILE", requires = "mqtt")]
    pub(crate) mqtt_authority: Option<PathBuf>,
    /// Discovery prefix of Home Assistant.
    #[arg(long = "mqtt-prefix", hide_short_help = true, value_name = "TOPIC", default_value = "homeassistant", value_parser = topic)]
    pub(crate) prefix: String,
    /// Topic above all others; choose one per collector on the same broker.
    #[arg(long = "mqtt-topic", hide_short_help = true, value_name = "TOPIC", default_value = "grideye", value_parser = topic)]
    pub(crate) base: String,
}

/// What the bridge publishes, and how often.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = MQTT)]
pub(crate) struct BridgeOptions {
    #[command(flatten)]
    pub(crate) broker: BrokerOptions,
    /// Seconds between a sensor's temperatures, 0.5 to 86400; people are sent when their number changes.
    #[arg(long = "mqtt-every", hide_short_help = true, value_name = "SECONDS", default_value_t = 5.0, value_parser = seconds)]
    pub(crate) state_every_s: f64,
    /// Seconds between a sensor's images, up to 86400; 0 sends none.
    #[arg(long = "mqtt-image-every", hide_short_help = true, value_name = "SECONDS", default_value_t = 1.0, value_parser = seconds_or_none)]
    pub(crate) image_every_s: f64,
    /// Seconds without a new frame until a sensor is unavailable, 0.5 to 86400.
    #[arg(long = "mqtt-silent-after", hide_short_help = true, value_name = "SECONDS", default_value_t = 15.0, value_parser = seconds)]
    pub(crate) silent_after_s: f64,
    /// Days without a new frame until a sensor is removed from Home Assistant [default: never].
    #[arg(long = "mqtt-forget-after", hide_short_help = true, value_name = "DAYS", value_parser = days)]
    pub(crate) forget_after_days: Option<f64>,
}

/// Remove from an MQTT broker what the bridge left there.
///
/// Example: grideye mqtt forget pi-1 i2c-1:0x69 --mqtt mqtt://homeassistant.local
#[derive(Debug, Args)]
pub(crate) struct MqttCommand {
    #[command(subcommand)]
    pub(crate) command: MqttWhat,
}

#[derive(Debug, Subcommand)]
pub(crate) enum MqttWhat {
    Forget(Forget),
}

/// Remove a sensor from Home Assistant.
///
/// Deletes its retained messages at the broker, and with them its entities, whether a collector runs or not. A sensor that
/// still sends comes back when its agent or the collector restarts.
///
/// Example: grideye mqtt forget pi-1 i2c-1:0x69 --mqtt mqtt://homeassistant.local
#[derive(Debug, Args)]
#[command(mut_arg("mqtt", |argument| argument.required(true)))]
pub(crate) struct Forget {
    /// Device, as the live page names it.
    pub(crate) device: String,
    /// Sensor of the device, as the live page names it.
    pub(crate) sensor: String,
    #[command(flatten)]
    pub(crate) broker: BrokerOptions,
}

const SECONDS_MAX: f64 = 86_400.0;
const DAYS_MAX: f64 = 36_500.0;
const TOPIC_CHARS_MAX: usize = 100;

fn bounded(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let expected = format!("expected a number from {least} to {most}");
    within(text, &(least..=most), expected)
}

fn seconds(text: &str) -> Result<f64, String> {
    bounded(text, 0.5, SECONDS_MAX)
}

fn seconds_or_none(text: &str) -> Result<f64, String> {
    bounded(text, 0.0, SECONDS_MAX)
}

fn days(text: &str) -> Result<f64, String> {
    bounded(text, 1e-5, DAYS_MAX)
}

/// Parses a topic: no wildcards, and not one of the broker's own.
fn topic(text: &str) -> Result<String, String> {
    let is_plain = |c: char| !c.is_control() && !matches!(c, '+' | '#' | '$');
    let is_topic = text.chars().all(is_plain)
        && text.chars().count() <= TOPIC_CHARS_MAX
        && text.split('/').all(|level| !level.is_empty());
    if is_topic {
        Ok(text.to_owned())
    } else {
        Err("expected a topic such as homeassistant or home/grideye".to_owned())
    }
}

/// Record the frames that arrive at a running collector.
///
/// If this program is killed, the recording ends 5 minutes later.
///
/// Example: grideye record empty-room --seconds 60 --out empty-room.csv
#[derive(Debug, Args)]
pub(crate) struct Record {
    /// Name of the recording.
    pub(crate) name: String,
    /// Duration in seconds [default: until Ctrl-C].
    #[arg(long, value_name = "N")]
    pub(crate) seconds: Option<u64>,
    /// Copy to write besides the one in the store.
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) out: Option<PathBuf>,
    /// Delete this recording; its frames stay.
    #[arg(long, conflicts_with_all = ["seconds", "out"])]
    pub(crate) delete: bool,
    #[command(flatten)]
    pub(crate) collector: CollectorAddress,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_taken_in_powers_of_1024() {
        assert_eq!(bytes("1M"), Ok(1 << 20));
        assert_eq!(bytes("20G"), Ok(20 << 30));
        assert_eq!(bytes("2048k"), Ok(2 << 20));
        assert_eq!(bytes("1048576"), Ok(1 << 20));
        assert_eq!(bytes("3T"), Ok(3 << 40));
        for bad in "M 1 1023k -1G 1.5G 1m 99999999999T 1é"
            .split(' ')
            .chain([""])
        {
            assert!(bytes(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn topics_have_levels_and_no_wildcards() {
        assert_eq!(topic("home/grideye"), Ok("home/grideye".to_owned()));
        for bad in ["", "/", "a/", "/a", "a//b", "a/+", "#", "$SYS", "a\n"] {
            assert!(topic(bad).is_err(), "{bad:?}");
        }
        assert!(topic(&"x".repeat(TOPIC_CHARS_MAX)).is_ok());
        assert!(topic(&"x".repeat(TOPIC_CHARS_MAX + 1)).is_err());
    }

    #[test]
    fn times_and_degrees_have_bounds() {
        assert!(seconds("0.4").is_err() && seconds("86401").is_err() && seconds("NaN").is_err());
        assert_eq!(seconds_or_none("0"), Ok(0.0));
        assert!(days("0").is_err() && days("36501").is_err());
    }
}
