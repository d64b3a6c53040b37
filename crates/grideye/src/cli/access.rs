//! Options of the collector, of its bridge to an MQTT broker, and of the commands that say who may do what there.

use super::shared::{Choices, one_of, within};
use clap::{Args, Subcommand};
use grideye_collector::LogEvent;
use grideye_collector::auth::Scope;
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;

/// Serve agents and the live page, and store what arrives.
///
/// On loopback everybody on this machine is let in until the first token is made (`grideye enroll`, `grideye token`).
/// Beyond loopback tokens are asked for, and TLS is on with a certificate of the collector's own authority.
///
/// Example: grideye collect --store frames.sqlite
#[derive(Debug, Args)]
pub(crate) struct Collect {
    /// Address to listen on.
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:8833")]
    pub(crate) listen: SocketAddr,
    /// SQLite file, or postgres://….
    ///
    /// The file is made if it is not there. `postgres://USER[:PASSWORD]@HOST[:PORT]/DATABASE` may be shared by several
    /// collectors; the password may stand in the file that PGPASSFILE names.
    #[arg(long, value_name = "FILE|URL", default_value = "grideye.sqlite")]
    pub(crate) store: String,
    /// Most that the store may take.
    ///
    /// With k, M, G or T, powers of 1024; by default what the disk has.
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub(crate) store_quota: Option<u64>,
    /// Delete older frames of no recording.
    ///
    /// Of a store in a file. Days without a collector do not count; no clock can make frames old, and no more than a tenth
    /// of the store is deleted in a fortieth of the time.
    #[arg(long, value_name = "DAYS", value_parser = clap::value_parser!(u64).range(1..=36_500))]
    pub(crate) keep_days: Option<u64>,
    /// Delete the oldest beyond, with k, M, G, T.
    ///
    /// Those that belong to no recording, when the file holds more; in an hour at most a tenth of the store, and twice what
    /// came.
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub(crate) keep_bytes: Option<u64>,
    #[command(flatten)]
    pub(crate) folder: Folder,
    /// Name to answer for, as pc.local; repeatable.
    ///
    /// It stands in the certificate too, beside the address listened on.
    #[arg(long = "host-name", value_name = "NAME")]
    pub(crate) host_names: Vec<String>,
    /// Encrypt on loopback too.
    #[arg(long, conflicts_with = "plain_http")]
    pub(crate) tls: bool,
    /// Do not encrypt: behind something that does.
    ///
    /// Or on loopback, where it is so by itself.
    #[arg(long, conflicts_with_all = ["tls_cert", "tls_client_ca"])]
    pub(crate) plain_http: bool,
    /// A certificate of your own, with its chain.
    ///
    /// In PEM, followed by its chain up to the authority.
    #[arg(long, value_name = "FILE", requires = "tls_key")]
    pub(crate) tls_cert: Option<PathBuf>,
    /// Its key, in PEM.
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    pub(crate) tls_key: Option<PathBuf>,
    /// Ask clients for a certificate of these.
    ///
    /// Authorities in PEM: every client must show a certificate of one of them, beside its token.
    #[arg(long, value_name = "FILE")]
    pub(crate) tls_client_ca: Option<PathBuf>,
    /// Listen beyond loopback without TLS.
    ///
    /// And, while there is no token, let everybody in who reaches the address.
    #[arg(long)]
    pub(crate) trust_network: bool,
    /// Address of a proxy in front; repeatable.
    ///
    /// The address that it names in `x-forwarded-for` counts as the sender's, for the limits of requests and sign-ins and in the
    /// log. From anyone else the header is ignored. The proxy is exempt from the limit of connections for one address.
    #[arg(long = "trusted-proxy", value_name = "ADDR", hide_short_help = true)]
    pub(crate) trusted_proxies: Vec<IpAddr>,
    /// Requests a second of each token.
    ///
    /// A tenth as many of an address without one.
    #[arg(long, value_name = "N", hide_short_help = true, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) requests_per_second: u32,
    /// How standard error is written.
    #[arg(long, value_parser = one_of(LOG_FORMATS), default_value = "text")]
    pub(crate) log: LogFormat,
    #[command(flatten)]
    pub(crate) scenes: Scenes,
    #[command(flatten)]
    pub(crate) mqtt: BridgeOptions,
}

/// What the live page can show beside a sensor.
#[derive(Debug, Args)]
pub(crate) struct Scenes {
    /// Scenes for the page [default: scenes].
    ///
    /// Folder of scenes that the page can show beside a sensor; by default `scenes`, where there is one.
    #[arg(long = "scenes", value_name = "DIR")]
    pub(crate) folder: Option<PathBuf>,
}

pub(crate) type LogFormat = fn(&LogEvent) -> String;

const LOG_FORMATS: Choices<LogFormat> = (
    &[LogEvent::to_string, LogEvent::to_json],
    "text `warning: refused code=bad_token peer=192.168.1.7`
json One JSON object a line",
);

/// Where tokens and keys are kept.
#[derive(Debug, Args)]
pub(crate) struct Folder {
    /// Folder of tokens and keys.
    ///
    /// It is made with the first of them.
    #[arg(long = "access", value_name = "DIR", default_value = "grideye-access")]
    pub(crate) path: PathBuf,
}

/// Print the line to paste on the Raspberry Pi, by which a device's agent joins.
///
/// Makes a token for its frames. The line is a whole command; the code in it holds the collector's address, the token, and the
/// SHA-256 of the authority behind the collector's certificate. Whoever has it can post frames of that device: it is printed
/// once, and the token is kept here only as a hash. `grideye enroll pi-1 | ssh pi sudo grideye-agent join -` pastes it.
/// Either way the token goes through standard input, so that no list of processes shows it.
///
/// Example: grideye enroll pi-1
#[derive(Debug, Args)]
pub(crate) struct Enroll {
    /// The device's name; several share one token.
    #[arg(value_name = "DEVICE", required = true)]
    pub(crate) devices: Vec<String>,
    #[command(flatten)]
    pub(crate) folder: Folder,
    /// The collector's address, as the agent calls it.
    ///
    /// By default where it was last started to listen.
    #[arg(long, value_name = "URL")]
    pub(crate) url: Option<String>,
    /// Authority of a certificate of your own, in PEM.
    ///
    /// Where the authority of the collector's certificate is not the collector's own.
    #[arg(long, value_name = "FILE")]
    pub(crate) authority: Option<PathBuf>,
    /// Print code and command as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Make, list and revoke tokens.
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

/// Make a token for the page or for programs, and print it once.
///
/// Example: grideye token make ana --scope read
#[derive(Debug, Args)]
pub(crate) struct TokenMake {
    /// Whose it is.
    pub(crate) name: String,
    /// What it allows.
    #[arg(long, value_parser = one_of(SCOPES))]
    pub(crate) scope: Scope,
    /// Write it to this file instead of printing it.
    ///
    /// For its owner alone.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) folder: Folder,
}

/// What a token that is not a device's allows.
const SCOPES: Choices<Scope> = (
    &[Scope::Read, Scope::Admin],
    "read To look: page, recordings, audit, metrics
admin To look, and to start and stop recordings",
);

/// List the tokens, but never the tokens themselves.
///
/// Number, scope, name, devices, when made, when revoked.
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

/// End a token permanently.
///
/// Example: grideye token revoke pi-1
#[derive(Debug, Args)]
pub(crate) struct TokenRevoke {
    /// Its number, or a name: then all of that name.
    #[arg(value_name = "ID|NAME")]
    pub(crate) named: String,
    #[command(flatten)]
    pub(crate) folder: Folder,
}

/// Where a running collector answers.
#[derive(Debug, Args)]
pub(crate) struct CollectorAddress {
    /// Address of the collector.
    #[arg(
        long = "collector",
        value_name = "URL",
        default_value = "http://127.0.0.1:8833"
    )]
    pub(crate) url: String,
    /// File with a token, where one is asked for.
    ///
    /// `grideye token make NAME --scope admin --out FILE` writes one.
    #[arg(long, value_name = "FILE")]
    pub(crate) token_file: Option<PathBuf>,
    /// Authority of its certificate, for https.
    ///
    /// In PEM: grideye-access/authority.pem on the collector's machine.
    #[arg(long, value_name = "FILE")]
    pub(crate) authority: Option<PathBuf>,
}

/// A number with k, M, G or T behind it, in powers of 1024; at least a MiB.
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

const HEADING: &str = "MQTT for Home Assistant";

/// Which broker, and where on it.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = HEADING)]
pub(crate) struct BrokerOptions {
    /// Broker, as `mqtt://[USER@]HOST[:PORT]`; `mqtts://` encrypts.
    #[arg(long = "mqtt", id = "mqtt", value_name = "URL")]
    pub(crate) url: Option<String>,
    /// File with the user's password [default: the environment variable GRIDEYE_MQTT_PASSWORD, if it is set].
    #[arg(long, hide_short_help = true, value_name = "FILE", requires = "mqtt")]
    pub(crate) mqtt_password_file: Option<PathBuf>,
    /// Authorities of the broker's certificate, in PEM, for mqtts; /etc/ssl/certs/ca-certificates.crt has the public ones.
    #[arg(long, hide_short_help = true, value_name = "FILE", requires = "mqtt")]
    pub(crate) mqtt_authority: Option<PathBuf>,
    /// Home Assistant's discovery prefix.
    #[arg(long = "mqtt-prefix", hide_short_help = true, value_name = "TOPIC", default_value = "homeassistant", value_parser = topic)]
    pub(crate) prefix: String,
    /// What everything else is published below; another one for each collector on the same broker.
    #[arg(long = "mqtt-topic", hide_short_help = true, value_name = "TOPIC", default_value = "grideye", value_parser = topic)]
    pub(crate) base: String,
}

/// What is published of the sensors, and how often.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = HEADING)]
pub(crate) struct BridgeOptions {
    #[command(flatten)]
    pub(crate) broker: BrokerOptions,
    /// Temperatures of a sensor every so often; presence at once when it changes.
    #[arg(long = "mqtt-every", hide_short_help = true, value_name = "SECONDS", default_value_t = 5.0, value_parser = seconds)]
    pub(crate) state_every_s: f64,
    /// Pictures of a sensor every so often; 0 for none.
    #[arg(long = "mqtt-image-every", hide_short_help = true, value_name = "SECONDS", default_value_t = 1.0, value_parser = seconds_or_none)]
    pub(crate) image_every_s: f64,
    /// A sensor without a new frame for so long is unavailable.
    #[arg(long = "mqtt-silent-after", hide_short_help = true, value_name = "SECONDS", default_value_t = 15.0, value_parser = seconds)]
    pub(crate) silent_after_s: f64,
    /// A sensor without a new frame for so long is removed from Home Assistant [default: never].
    #[arg(long = "mqtt-forget-after", hide_short_help = true, value_name = "DAYS", value_parser = days)]
    pub(crate) forget_after_days: Option<f64>,
    /// Somebody is present when so many pixels are warm.
    #[arg(long = "mqtt-presence-pixels", hide_short_help = true, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=32))]
    pub(crate) presence_pixels: u8,
    /// Warm is a pixel so many degrees above the median of its frame: a threshold, which a radiator passes too.
    #[arg(long = "mqtt-presence-above", hide_short_help = true, value_name = "CELSIUS", default_value_t = 1.5, value_parser = degrees)]
    pub(crate) presence_above_c: f64,
    /// Nobody is present once too few were warm for so long.
    #[arg(long = "mqtt-presence-hold", hide_short_help = true, value_name = "SECONDS", default_value_t = 5.0, value_parser = seconds_or_none)]
    pub(crate) presence_hold_s: f64,
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
/// What the broker keeps of it is taken away. Its entities go, with or without a collector running. A sensor that still sends comes back when its agent or the
/// collector is started again.
///
/// Example: grideye mqtt forget pi-1 i2c-1:0x69 --mqtt mqtt://homeassistant.local
#[derive(Debug, Args)]
#[command(mut_arg("mqtt", |argument| argument.required(true)))]
pub(crate) struct Forget {
    /// The device, as the live page names it.
    pub(crate) device: String,
    /// The device's sensor.
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

fn degrees(text: &str) -> Result<f64, String> {
    bounded(text, 0.25, 100.0)
}

/// A topic to publish below: without wildcards, and not one of the broker's own.
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
        assert!(degrees("0.2").is_err() && degrees("101").is_err());
    }
}
