//! Labels: what somebody saw in a range of a recording's frames.

use crate::store::error::StoreError;
use crate::store::row::damaged;
use serde::{Deserialize, Serialize};

/// What is to be seen in some of a recording's frames.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Label {
    /// In a word or a few, for example `two people`. Several labels may say the same.
    pub name: String,
    /// In which frames, at least one range.
    pub spans: Vec<LabelSpan>,
}

/// Frames of one stream, by their numbers: so that a label belongs to the same frames whatever becomes of clocks.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LabelSpan {
    /// The agent's name.
    pub device: String,
    /// The sensor.
    pub sensor: String,
    /// The run.
    pub boot: String,
    /// The first frame.
    pub first_seq: u64,
    /// The last frame, not before the first.
    pub last_seq: u64,
}

/// A label as the store has it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct KeptLabel {
    /// Its number among those of the recording, from 1, in the order in which they were added.
    pub number: i64,
    /// What it says.
    #[serde(flatten)]
    pub label: Label,
}

impl Label {
    /// How a store keeps it.
    pub(super) fn to_text(&self) -> Result<String, StoreError> {
        serde_json::to_string(self).map_err(|error| StoreError::Failed(error.to_string()))
    }
}

impl KeptLabel {
    pub(super) fn from_text(number: i64, text: &str) -> Result<Self, StoreError> {
        let label = serde_json::from_str(text);
        let label = label.map_err(|error| damaged(&format!("label {number}: {error}")))?;
        Ok(Self { number, label })
    }
}
