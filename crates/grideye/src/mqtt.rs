//! `grideye collect --mqtt` and `grideye mqtt forget`: from the options to the bridge for Home Assistant.

use crate::cli::{BridgeOptions, BrokerOptions, Forget};
use crate::exit::{Outcome, bad_input};
use crate::files;
use crate::output::outln;
use anyhow::{Context as _, Result, anyhow};
use grideye_collector::{Annex, Log};
use grideye_draw::still;
use grideye_homeassistant::{Broker, Images, Password, SettingNames, Telling, Topics};
use std::ffi::OsString;
use std::os::unix::ffi::OsStringExt as _;
use std::path::Path;
use std::time::Duration;

const NAMES: SettingNames = SettingNames {
    url: "--mqtt",
    password_file: "--mqtt-password-file",
    password_variable: "GRIDEYE_MQTT_PASSWORD",
    authority: "--mqtt-authority",
    topic: "--mqtt-topic",
};
/// Largest password or authority file: Debian's file of all public authorities has 220 kB.
const FILE_BYTES_MAX: u64 = 4 * 1024 * 1024;

/// The collector's bridge; `None` without a broker.
pub(crate) fn annex(options: &BridgeOptions, has_line: bool, log: Log) -> Result<Option<Annex>> {
    let broker = broker(&options.broker)?;
    Ok(broker.map(|broker| grideye_homeassistant::annex(broker, telling(options, has_line), log)))
}

pub(crate) fn forget(options: &Forget) -> Result<Outcome> {
    let broker = broker(&options.broker)?.context("--mqtt is missing")?;
    let topics = topics(&options.broker);
    let (device, sensor) = (&options.device, &options.sensor);
    let runtime = tokio::runtime::Runtime::new().context("cannot start a thread")?;
    let forgetting = grideye_homeassistant::forget(&broker, &topics, device, sensor);
    if !runtime.block_on(forgetting)? {
        return Err(anyhow!(
            "{broker} keeps nothing of the sensor {sensor} of {device}\nhint: the live page and `grideye audit` name devices and sensors; --mqtt-prefix and --mqtt-topic are those of the collector"
        ));
    }
    outln!("removed the sensor {sensor} of {device} from {broker}")?;
    Ok(Outcome::Done)
}

fn broker(options: &BrokerOptions) -> Result<Option<Broker>> {
    let Some(url) = &options.url else {
        return Ok(None);
    };
    let password = match &options.mqtt_password_file {
        Some(path) => Some(password(path)?),
        None => std::env::var_os(NAMES.password_variable)
            .filter(|password| !password.is_empty())
            .map(OsString::into_vec)
            .map(Password::new),
    };
    let authority = options.mqtt_authority.as_deref().map(|path| {
        let pem = files::short(path, FILE_BYTES_MAX)?;
        anyhow::Ok((path.display().to_string(), pem))
    });
    let authority = authority.transpose()?;
    let authority = authority
        .as_ref()
        .map(|(file, pem)| (file.as_str(), pem.as_slice()));
    let broker = Broker::new(url, password, authority, NAMES);
    broker.map(Some).map_err(bad_input)
}

fn password(path: &Path) -> Result<Password> {
    Password::first_line_of(&files::short(path, FILE_BYTES_MAX)?).ok_or_else(|| {
        bad_input(anyhow!(
            "{}: there is no password in its first line\nhint: printf %s 'PASSWORD' > FILE; chmod 600 FILE",
            path.display()
        ))
    })
}

fn telling(options: &BridgeOptions, has_line: bool) -> Telling {
    let seconds = Duration::from_secs_f64;
    let forget_after = options.forget_after_days;
    Telling {
        topics: topics(&options.broker),
        state_every: seconds(options.state_every_s),
        images: (options.image_every_s > 0.0).then(|| Images {
            every: seconds(options.image_every_s),
            draw: |celsius, seq| still::png(celsius, seq).ok(),
        }),
        silent_after: seconds(options.silent_after_s),
        forget_after: forget_after.map(|days| seconds(86_400.0 * days)),
        has_line,
    }
}

fn topics(options: &BrokerOptions) -> Topics {
    Topics {
        discovery: options.prefix.clone(),
        base: options.base.clone(),
    }
}
