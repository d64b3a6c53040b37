//! What the live page is told.

use serde_json::Value;
use std::sync::Arc;

/// One server-sent event.
#[derive(Debug, Clone)]
pub(crate) struct Event {
    pub(crate) name: &'static str,
    pub(crate) data: Arc<str>,
}

impl Event {
    pub(crate) fn new(name: &'static str, data: &Value) -> Self {
        Self {
            name,
            data: data.to_string().into(),
        }
    }
}
