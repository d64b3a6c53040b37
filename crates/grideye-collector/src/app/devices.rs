//! `GET /v1/devices` and `/v1/devices/{device}`: every device as somebody looks at it who wants to know how it does. The figures of its sensors are
//! those of `GET /v1/sensors`; what its agent is and how it is set up, the agent says with its posts.

use crate::app::AppState;
use crate::app::answer::Refusal;
use crate::app::gate::check_own;
use crate::auth::Caller;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::{Extension, Json};
use grideye_recording::check_name;
use hashbrown::HashMap;
use hashbrown::hash_map::EntryRef;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, PoisonError};

/// The header in which an agent says how it is set up: one JSON object, now and then.
pub(super) const CONFIGURATION_HEADER: &str = "grideye-configuration";
/// Bytes of that header at most; a longer one is not looked at.
pub(super) const CONFIGURATION_BYTES_MAX: usize = 4096;
/// Characters of a program's name and version at most.
const PROGRAM_CHARS_MAX: usize = 64;
/// Sensors of one configuration at most.
const SENSORS_MAX: usize = 64;

/// What the agents have said of themselves since this collector started.
#[derive(Debug)]
pub(super) struct Agents {
    by_device: Mutex<HashMap<String, Said>>,
    devices_max: usize,
}

#[derive(Debug, Clone, Default)]
struct Said {
    program: Option<String>,
    configuration: Option<Configuration>,
}

/// How an agent is set up. What a later version may add is not looked at.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, Serialize)]
struct Configuration {
    post_every_ms: u64,
    ring_frames: u64,
    spool: String,
    sensors: BTreeMap<String, SensorSetUp>,
}

#[derive(Debug, Clone, PartialEq, Eq, Deserialize, Serialize)]
struct SensorSetUp {
    part: String,
    rate_hz: u64,
    moving_average: bool,
}

impl Agents {
    /// Of so many devices at most; of others nothing is remembered.
    pub(super) fn new(devices_max: usize) -> Self {
        Self {
            by_device: Mutex::default(),
            devices_max,
        }
    }

    /// What came with frames of this device that were taken. It is for show: what is not understood is not kept, and
    /// costs no frame.
    pub(super) fn heard(&self, device: &str, headers: &HeaderMap) {
        let program = headers
            .get(header::USER_AGENT)
            .and_then(|program| program.to_str().ok());
        let program = program.filter(|program| program.starts_with("grideye-agent/"));
        let configuration = headers
            .get(CONFIGURATION_HEADER)
            .and_then(|text| understood(text.as_bytes()));
        let mut by_device = self
            .by_device
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
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

    fn of(&self, device: &str) -> Said {
        let by_device = self
            .by_device
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
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

/// `GET /v1/devices`.
pub(super) async fn devices(State(state): State<AppState>) -> Json<Value> {
    let devices: Vec<Value> = by_device(&state)
        .into_iter()
        .map(|(device, sensors)| device_json(&device, &sensors, &state.0.agents.of(&device)))
        .collect();
    let recent = crate::live::RECENT_WITHIN.as_secs();
    Json(json!({ "devices": devices, "faults_recent_s": recent }))
}

/// `GET /v1/devices/{device}`: what a device's own token may ask for too, so that an agent can say that its frames came.
pub(super) async fn device(
    State(state): State<AppState>,
    caller: Option<Extension<Caller>>,
    Path(device): Path<String>,
) -> Result<Json<Value>, Refusal> {
    check_own(caller.as_deref(), &device)?;
    let sensors = by_device(&state).remove(&device).ok_or_else(|| {
        let what = "nothing of this device has come yet";
        Refusal::new(StatusCode::NOT_FOUND, "no_such_device", what)
            .field("device")
            .hint("GET /v1/devices names those of which something came")
    })?;
    let said = state.0.agents.of(&device);
    Ok(Json(device_json(&device, &sensors, &said)))
}

fn by_device(state: &AppState) -> BTreeMap<String, Vec<Value>> {
    let mut sensors = state.0.live.sensors_json();
    let sensors = match sensors["sensors"].take() {
        Value::Array(sensors) => sensors,
        _ => Vec::new(),
    };
    let mut by_device: BTreeMap<String, Vec<Value>> = BTreeMap::new();
    for sensor in sensors {
        let device = sensor["device"].as_str().unwrap_or_default().to_owned();
        by_device.entry(device).or_default().push(sensor);
    }
    by_device
}

/// Sums over the sensors; boot and clock are those of the sensor that was heard of last.
fn device_json(device: &str, sensors: &[Value], said: &Said) -> Value {
    let age = |sensor: &&Value| sensor["age_s"].as_f64().unwrap_or(f64::INFINITY);
    let newest = sensors.iter().min_by(|a, b| age(a).total_cmp(&age(b)));
    let sum = |key: &str| {
        sensors
            .iter()
            .filter_map(|sensor| sensor[key].as_u64())
            .fold(0, u64::saturating_add)
    };
    let rates = sensors
        .iter()
        .filter_map(|sensor| sensor["rate_hz"].as_f64());
    let version = said
        .program
        .as_deref()
        .and_then(|program| program.split_once('/'));
    json!({
        "device": device,
        "boot": newest.map(|sensor| &sensor["boot"]),
        "agent_version": version.map(|(_, version)| version),
        "age_s": newest.map(|sensor| &sensor["age_s"]),
        "clock": newest.map(clock),
        "rate_hz": rates.reduce(|sum, rate| sum + rate),
        "backlog": sum("spooled"),
        "read": sum("read"),
        "stored": sum("stored"),
        "missing": sum("missing"),
        "dropped": counts(sensors, "dropped"),
        "errors": counts(sensors, "errors"),
        "recent_faults": recent_faults(sensors),
        "rivals": sensors.iter().map(|sensor| &sensor["rivals"]).find(|rivals| !rivals.is_null()),
        "configuration": said.configuration,
        "sensors": sensors.iter().map(|sensor| sensor_json(sensor, said)).collect::<Vec<_>>(),
    })
}

fn sensor_json(sensor: &Value, said: &Said) -> Value {
    let name = sensor["sensor"].as_str().unwrap_or_default();
    let set_up = said
        .configuration
        .as_ref()
        .and_then(|set_up| set_up.sensors.get(name));
    let mut json = Map::new();
    for (key, of) in [
        ("sensor", "sensor"),
        ("boot", "boot"),
        ("age_s", "age_s"),
        ("rate_hz", "rate_hz"),
        ("backlog", "spooled"),
        ("read", "read"),
        ("stored", "stored"),
        ("missing", "missing"),
        ("balanced", "balanced"),
        ("dropped", "dropped"),
        ("errors", "errors"),
    ] {
        json.insert(key.to_owned(), sensor[of].clone());
    }
    json.insert("clock".to_owned(), clock(sensor).clone());
    json.insert(
        "missing_now".to_owned(),
        sensor["no_frame_now"]["missing"].clone(),
    );
    json.insert(
        "part".to_owned(),
        set_up.map(|set_up| set_up.part.as_str()).into(),
    );
    Value::Object(json)
}

/// `unsynced`, `synced` or `stepped` at the newest record.
fn clock(sensor: &Value) -> &Value {
    match &sensor["no_frame_now"]["clock"] {
        Value::Null => &sensor["frame"]["clock"],
        newer => newer,
    }
}

/// Of any sensor, in alphabetical order.
fn recent_faults(sensors: &[Value]) -> BTreeSet<&str> {
    let of_each = sensors
        .iter()
        .filter_map(|sensor| sensor["recent_faults"].as_array());
    of_each.flatten().filter_map(Value::as_str).collect()
}

/// By reason, over all sensors.
fn counts(sensors: &[Value], key: &str) -> BTreeMap<String, u64> {
    let mut sums = BTreeMap::new();
    for (reason, count) in sensors
        .iter()
        .filter_map(|sensor| sensor[key].as_object())
        .flatten()
    {
        let sum: &mut u64 = sums.entry(reason.clone()).or_default();
        *sum = sum.saturating_add(count.as_u64().unwrap_or(0));
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    const CONFIGURATION: &str = r#"{"post_every_ms":500,"ring_frames":10000,"spool":"outage","sensors":{"i2c-1:0x69":{"part":"AMG8833","rate_hz":10,"moving_average":false}}}"#;

    fn headers(program: &'static str, configuration: &str) -> HeaderMap {
        let mut headers = HeaderMap::new();
        headers.insert(header::USER_AGENT, HeaderValue::from_static(program));
        headers.insert(
            CONFIGURATION_HEADER,
            HeaderValue::from_str(configuration).unwrap(),
        );
        headers
    }

    #[test]
    fn what_an_agent_says_is_kept_until_it_says_otherwise_and_what_is_not_understood_is_not() {
        let agents = Agents::new(2);
        agents.heard("a", &headers("grideye-agent/1.2.3", CONFIGURATION));
        let said = agents.of("a");
        assert_eq!(said.program.as_deref(), Some("grideye-agent/1.2.3"));
        assert_eq!(
            said.configuration.as_ref().unwrap().sensors["i2c-1:0x69"].rate_hz,
            10
        );
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
        agents.heard(
            "a",
            &headers(
                "grideye-agent/2",
                &CONFIGURATION.replace("outage", "always"),
            ),
        );
        assert_eq!(agents.of("a").configuration.unwrap().spool, "always");
        agents.heard("b", &headers("grideye-agent/3", CONFIGURATION));
        agents.heard("c", &headers("grideye-agent/4", CONFIGURATION));
        assert!(agents.of("b").program.is_some());
        assert!(
            agents.of("c").program.is_none(),
            "one more than there is room for"
        );
    }

    #[test]
    fn a_device_is_the_sum_of_its_sensors_and_its_clock_that_of_the_newest_record() {
        let sensor = |name: &str, age_s: f64, clock: &str, nack: u64| {
            json!({
                "device": "d", "sensor": name, "boot": "b", "age_s": age_s, "rate_hz": 9.5, "spooled": 3, "read": 10,
                "stored": 6, "missing": 2, "balanced": true, "dropped": {"ring-full": 1}, "errors": {"nack": nack},
                "recent_faults": [name, "nack"], "no_frame_now": null, "frame": {"clock": clock},
            })
        };
        let mut older = sensor("y", 4.0, "unsynced", 2);
        older["no_frame_now"] = json!({"missing": "nack", "clock": "stepped"});
        let said = Said {
            program: Some("grideye-agent/1.2.3".to_owned()),
            configuration: understood(CONFIGURATION.replace("i2c-1:0x69", "x").as_bytes()),
        };
        let json = device_json("d", &[older, sensor("x", 0.5, "synced", 1)], &said);
        assert_eq!(json["agent_version"], "1.2.3");
        assert_eq!(
            (&json["age_s"], &json["clock"], &json["rate_hz"]),
            (&json!(0.5), &json!("synced"), &json!(19.0))
        );
        assert_eq!(
            (
                &json["backlog"],
                &json["read"],
                &json["stored"],
                &json["missing"]
            ),
            (&json!(6), &json!(20), &json!(12), &json!(4))
        );
        assert_eq!(
            (&json["dropped"], &json["errors"]),
            (&json!({"ring-full": 2}), &json!({"nack": 3}))
        );
        assert_eq!(json["recent_faults"], json!(["nack", "x", "y"]));
        let [y, x] = [&json["sensors"][0], &json["sensors"][1]];
        assert_eq!(
            (&y["clock"], &y["missing_now"], &y["part"]),
            (&json!("stepped"), &json!("nack"), &Value::Null)
        );
        assert_eq!(
            (&x["clock"], &x["missing_now"], &x["part"]),
            (&json!("synced"), &Value::Null, &json!("AMG8833"))
        );
    }
}
