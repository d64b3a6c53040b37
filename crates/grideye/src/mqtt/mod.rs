//! The bridge to Home Assistant: what the collector's sensors say now, on an MQTT broker.
//!
//! ```text
//!  collector's newest frames ── twice a second ──▶ sensor ── what is due ──▶ broker ──▶ Home Assistant
//!                                                                ▲              │
//!                                                                └── removed, started again
//! ```
//!
//! An annex of the collector, which knows nothing of MQTT. Retained are the configurations by which Home Assistant
//! discovers a sensor, and whether sensor and bridge are there; values and pictures pass by and are old at once.

mod bridge;
mod broker;
mod connection;
mod discovery;
mod fault;
mod forget;
mod packet;
mod presence;
mod sensor;
mod status;
mod topics;

pub(crate) use forget::run as forget;

use crate::cli::{BridgeOptions, BrokerOptions};
use anyhow::Result;
use axum::Router;
use axum::response::Json;
use axum::routing::get;
use bridge::Bridge;
use broker::{Broker, PASSWORD_VARIABLE};
use grideye_collector::{Annex, Log};
use presence::Rule;
use sensor::Telling;
use status::Status;
use std::ffi::OsString;
use std::os::unix::ffi::OsStringExt as _;
use std::sync::Arc;
use std::time::Duration;
use topics::Topics;

/// The bridge, for the collector; `None` where no broker is named. It begins with the collector and ends with it.
///
/// # Errors
/// Bad input when the broker's URL, the password or the authority is none.
pub(crate) fn annex(options: &BridgeOptions, log: Log) -> Result<Option<Annex>> {
    let Some(broker) = broker(&options.broker)? else {
        return Ok(None);
    };
    let telling = telling(options);
    let annex = Annex::new("mqtt", move |inside| {
        let status = Status::new(broker.to_string());
        let source = (inside.newest.clone(), Arc::clone(&inside.clock));
        let told = (broker.clone(), telling.clone());
        let bridge = Bridge::new(told.0, told.1, source, log.clone(), status.clone());
        tokio::spawn(bridge.run());
        let answer = move || async move { Json(status.json()) };
        Router::new().route("/v1/mqtt", get(answer))
    });
    let annex = annex.described_by(include_str!("../../openapi/mqtt.json"));
    Ok(Some(annex))
}

fn broker(options: &BrokerOptions) -> Result<Option<Broker>> {
    let password = std::env::var_os(PASSWORD_VARIABLE);
    let password = password.filter(|password| !password.is_empty());
    Broker::of(options, password.map(OsString::into_vec))
}

fn telling(options: &BridgeOptions) -> Telling {
    let seconds = Duration::from_secs_f64;
    let image_every = (options.image_every_s > 0.0).then(|| seconds(options.image_every_s));
    let forget_after = options.forget_after_days;
    Telling {
        topics: topics_of(&options.broker),
        state_every: seconds(options.state_every_s),
        image_every,
        silent_after: seconds(options.silent_after_s),
        forget_after: forget_after.map(|days| seconds(86_400.0 * days)),
        presence: Rule {
            pixels: options.presence_pixels.into(),
            above_c: options.presence_above_c,
            hold: seconds(options.presence_hold_s),
        },
    }
}

fn topics_of(options: &BrokerOptions) -> Topics {
    Topics {
        discovery: options.prefix.clone(),
        base: options.base.clone(),
    }
}
