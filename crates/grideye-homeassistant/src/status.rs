//! The bridge's state, for `GET /v1/mqtt`.

use crate::fault::Fault;
use serde_json::{Value, json};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Shared by the bridge, which writes, and the route, which reads.
#[derive(Debug, Clone)]
pub(crate) struct Status(Arc<Mutex<Told>>);

#[derive(Debug, Default)]
struct Told {
    broker: String,
    is_connected: bool,
    connections: u64,
    fault: Option<Fault>,
    sensors: usize,
    published: u64,
    taken: u64,
    refused: u64,
}

impl Status {
    pub(crate) fn new(broker: String) -> Self {
        let told = Told {
            broker,
            ..Told::default()
        };
        Self(Arc::new(Mutex::new(told)))
    }

    pub(crate) fn connected(&self) {
        let mut told = self.told();
        told.is_connected = true;
        told.connections += 1;
        told.fault = None;
    }

    pub(crate) fn lost(&self, fault: &Fault) {
        let mut told = self.told();
        told.is_connected = false;
        told.fault = Some(fault.clone());
    }

    pub(crate) fn announced(&self, sensors: usize) {
        self.told().sensors = sensors;
    }

    pub(crate) fn published(&self) {
        self.told().published += 1;
    }

    pub(crate) fn took(&self) {
        self.told().taken += 1;
    }

    pub(crate) fn refused(&self) {
        self.told().refused += 1;
    }

    /// What is published, and what frames were taken.
    pub(crate) fn json(&self, frames: &Self) -> Value {
        let (told, frames) = (self.told(), frames.told());
        json!({
            "broker": told.broker,
            "connected": told.is_connected,
            "connections": told.connections,
            "fault": told.fault(),
            "sensors": told.sensors,
            "published": told.published,
            "frames": {
                "connected": frames.is_connected,
                "fault": frames.fault(),
                "taken": frames.taken,
                "refused": frames.refused,
            },
        })
    }

    fn told(&self) -> MutexGuard<'_, Told> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Told {
    fn fault(&self) -> Option<Value> {
        let fault = self.fault.as_ref();
        fault.map(|fault| json!({ "message": fault.what, "hint": fault.hint }))
    }
}
