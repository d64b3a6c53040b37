//! What agents report about themselves with their batches: program version and configuration.

use crate::lock::lock;
use axum::http::{HeaderMap, header};
use grideye_recording::check_name;
use hashbrown::HashMap;
use hashbrown::hash_map::EntryRef;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Mutex;

/// The header with an agent's configuration: one JSON object, sent now and then.
pub(crate) const CONFIGURATION_HEADER: &str = "grideye-configuration";

/// Maximum bytes of that header; a longer one is ignored.
pub(crate) const CONFIGURATION_BYTES_MAX: usize = 4096;

const PROGRAM_CHARS_MAX: usize = 64;

const SENSORS_MAX: usize = 64;

/// What the agents have reported since this collector started.
#[derive(Debug)]
pub(crate) struct Agents {
    by_device: Mutex<HashMap<String, Said>>,
    devices_max: usize,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Said {
    pub(crate) program: Option<String>,
    /// The boot whose predecessors were settled.
    pub(crate) settled: Option<String>,
    pub(crate) configuration: Option<Configuration>,
}

/// An agent's configuration. Fields that a later version may add are ignored.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, Serialize)]
pub(crate) struct Configuration {
    post_every_ms: u64,
    ring_frames: u64,
    spool: String,
    pub(crate) sensors: BTreeMap<String, SensorSetUp>,
}

#[derive(Debug, Clone, PartialEq, Eq, Deserialize, Serialize)]
pub(crate) struct SensorSetUp {
    pub(crate) part: String,
    rate_hz: u64,
    moving_average: bool,
}

impl Agents {
    /// Remembers at most this many devices, and nothing of others.
    pub(crate) fn new(devices_max: usize) -> Self {
        Self {
            by_device: Mutex::default(),
            devices_max,
        }
    }

    /// Notes the headers of stored frames. They are only for display: an invalid one costs no frame.
    pub(crate) fn heard(&self, device: &str, headers: &HeaderMap) {
        let program = headers
            .get(header::USER_AGENT)
            .and_then(|program| program.to_str().ok());
        let program = program.filter(|program| program.starts_with("grideye-agent/"));
        let configuration = headers
            .get(CONFIGURATION_HEADER)
            .and_then(|text| understood(text.as_bytes()));
        let mut by_device = lock(&self.by_device);
        let is_full = by_device.len() >= self.devices_max;
        let said = match by_device.entry_ref(device) {
            EntryRef::Occupied(known) => known.into_mut(),
            EntryRef::Vacant(_) if is_full => return,
            EntryRef::Vacant(new) => new.insert(Said::default()),
        };
        let known = said.program.as_deref();
        if program.is_some_and(|program| known != Some(program)) {
            said.program = program.map(|program| program.chars().take(PROGRAM_CHARS_MAX).collect());
        }
        if configuration.is_some() {
            said.configuration = configuration;
        }
    }

    /// Whether earlier boots of the device may still have to be ended, because its agent, in this boot, keeps nothing on a
    /// disk. Asked with each configuration, once a minute.
    pub(crate) fn leaves_nothing(&self, device: &str, boot: &str, headers: &HeaderMap) -> bool {
        let said = headers
            .contains_key(CONFIGURATION_HEADER)
            .then(|| self.of(device));
        said.is_some_and(|said| {
            let set_up = said.configuration.as_ref();
            set_up.is_some_and(|set_up| set_up.spool == "ram")
                && said.settled.as_deref() != Some(boot)
        })
    }

    /// Notes that all boots before this one are ended.
    pub(crate) fn settled(&self, device: &str, boot: &str) {
        if let Some(said) = lock(&self.by_device).get_mut(device) {
            said.settled = Some(boot.to_owned());
        }
    }

    pub(crate) fn of(&self, device: &str) -> Said {
        let by_device = lock(&self.by_device);
        by_device.get(device).cloned().unwrap_or_default()
    }
}

fn understood(text: &[u8]) -> Option<Configuration> {
    if text.len() > CONFIGURATION_BYTES_MAX {
        return None;
    }
    let configuration: Configuration = serde_json::from_slice(text).ok()?;
    let names = configuration
        .sensors
        .iter()
        .flat_map(|(name, set_up)| [name, &set_up.part]);
    let is_plain = names
        .chain([&configuration.spool])
        .all(|name| check_name(name).is_ok());
    (is_plain && configuration.sensors.len() <= SENSORS_MAX).then_some(configuration)
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    const CONFIGURATION: &str = r#"{"post_every_ms":500,"ring_frames":10000,"spool":"outage","sensors":{"i2c-1:0x69":{"part":"AMG8833","rate_hz":10,"moving_average":false}}}"#;

    fn headers(program: &'static str, configuration: &str) -> HeaderMap {
        let mut headers = HeaderMap::new();
        headers.insert(header::USER_AGENT, HeaderValue::from_static(program));
        let configuration = HeaderValue::from_str(configuration).unwrap();
        headers.insert(CONFIGURATION_HEADER, configuration);
        headers
    }

    #[test]
    fn a_valid_agent_header_is_stored_until_the_next_and_an_invalid_one_is_ignored() {
        let agents = Agents::new(2);
        agents.heard("a", &headers("grideye-agent/1.2.3", CONFIGURATION));
        let said = agents.of("a");
        assert_eq!(said.program.as_deref(), Some("grideye-agent/1.2.3"));
        let set_up = said.configuration.as_ref().unwrap();
        assert_eq!(set_up.sensors["i2c-1:0x69"].rate_hz, 10);
        let longer = CONFIGURATION.replace("AMG8833", &"x".repeat(CONFIGURATION_BYTES_MAX));
        for bad in [
            "",
            "{",
            "[]",
            "{}",
            &longer,
            &CONFIGURATION.replace("AMG8833", "=1+1"),
            &CONFIGURATION.replace("10,", "-10,"),
        ] {
            agents.heard("a", &headers("curl/8", bad));
            assert_eq!(agents.of("a").configuration, said.configuration, "{bad}");
        }
        assert_eq!(agents.of("a").program, said.program);
        let always = CONFIGURATION.replace("outage", "always");
        agents.heard("a", &headers("grideye-agent/2", &always));
        assert_eq!(agents.of("a").configuration.unwrap().spool, "always");
        agents.heard("b", &headers("grideye-agent/3", CONFIGURATION));
        agents.heard("c", &headers("grideye-agent/4", CONFIGURATION));
        assert!(agents.of("b").program.is_some());
        // One device more than the limit.
        assert!(agents.of("c").program.is_none());
    }
}
