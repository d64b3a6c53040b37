//! Options of the bridge to an MQTT broker, for Home Assistant.

use super::shared::within;
use clap::{Args, Subcommand};
use std::path::PathBuf;

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

/// The longest time that an option takes.
const SECONDS_MAX: f64 = 86_400.0;
const DAYS_MAX: f64 = 36_500.0;
/// Characters of a topic that an option takes.
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
