//! The bridge to an MQTT broker: publishes the sensors' current values for Home Assistant, and takes frames.
//!
//! ```text
//!    collector's newest frames ── twice a second ──▶ sensor ── what is due ──▶ broker ──▶ Home Assistant
//!                                                                  ▲              │
//!                                                                  └── removed, restarted
//! ```
//!
//! An annex of the collector, which knows nothing of MQTT. Retained are only the discovery configurations and the
//! availability of sensors and bridge; values and images are not, because they are outdated at once.
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
mod intake;
mod packet;
mod sensor;
mod status;
mod topics;

pub use broker::{Broker, BrokerError, Password, SettingNames};
pub use fault::Fault;
pub use forget::forget;
pub use sensor::{Images, Telling};
pub use topics::Topics;

use axum::Router;
use axum::response::Json;
use axum::routing::get;
use bridge::Bridge;
use grideye_collector::{Annex, Log};
use intake::Intake;
use status::Status;
use std::sync::Arc;

/// The bridge as an annex: it starts and ends with the collector.
#[must_use]
pub fn annex(broker: Broker, telling: Telling, log: Log) -> Annex {
    let annex = Annex::new("mqtt", move |inside| {
        let [told, taken] = [(); 2].map(|()| Status::new(broker.to_string()));
        let source = (inside.newest.clone(), Arc::clone(&inside.clock));
        let topics = telling.topics.clone();
        let intake = Intake::new(broker.clone(), topics, inside, log.clone(), taken.clone());
        let telling = telling.clone();
        let bridge = Bridge::new(broker.clone(), telling, source, log.clone(), told.clone());
        tokio::spawn(intake.run());
        tokio::spawn(bridge.run());
        let answer = move || async move { Json(told.json(&taken)) };
        Router::new().route("/v1/mqtt", get(answer))
    });
    annex.described_by(include_str!("../openapi.json"))
}
