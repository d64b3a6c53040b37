//! The bridge to Home Assistant: what the collector's sensors measure now, on an MQTT broker.
//!
//! ```text
//!  collector's newest frames ── twice a second ──▶ sensor ── what is due ──▶ broker ──▶ Home Assistant
//!                                                                ▲              │
//!                                                                └── removed, started again
//! ```
//!
//! An annex of the collector, which knows nothing of MQTT. Retained are the configurations by which Home Assistant
//! discovers a sensor, and whether sensor and bridge are there; values and pictures pass by and are old at once.
//!
//! ```
//! use grideye_homeassistant::{Broker, SettingNames};
//!
//! let names = SettingNames {
//!     url: "--broker",
//!     password_file: "--password-file",
//!     password_variable: "PASSWORD",
//!     authority: "--authority",
//!     topic: "--topic",
//! };
//! let broker = Broker::new("mqtt://homeassistant.local", None, None, names)?;
//! assert_eq!(broker.to_string(), "mqtt://homeassistant.local:1883");
//! # Ok::<(), grideye_homeassistant::BrokerError>(())
//! ```

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

pub use broker::{Broker, BrokerError, Password, SettingNames};
pub use fault::Fault;
pub use forget::forget;
pub use presence::Rule;
pub use sensor::{Images, Telling};
pub use topics::Topics;

use axum::Router;
use axum::response::Json;
use axum::routing::get;
use bridge::Bridge;
use grideye_collector::{Annex, Log};
use status::Status;
use std::sync::Arc;

/// The bridge, for the collector: it begins with the collector and ends with it.
#[must_use]
pub fn annex(broker: Broker, telling: Telling, log: Log) -> Annex {
    let annex = Annex::new("mqtt", move |inside| {
        let status = Status::new(broker.to_string());
        let source = (inside.newest.clone(), Arc::clone(&inside.clock));
        let told = (broker.clone(), telling.clone());
        let bridge = Bridge::new(told.0, told.1, source, log.clone(), status.clone());
        tokio::spawn(bridge.run());
        let answer = move || async move { Json(status.json()) };
        Router::new().route("/v1/mqtt", get(answer))
    });
    annex.described_by(include_str!("../openapi.json"))
}
