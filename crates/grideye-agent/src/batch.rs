//! A batch: the records of one post to the collector, and where they wait until it has stored them.

use grideye_frame::Reading;
use grideye_recording::wire::{self, Account, Acknowledgement, SensorBatch};
use grideye_recording::{Record, StreamId};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Where the current boot's records begin in the log; those of earlier boots stand before.
pub const OWN_FIRST: u64 = 1 << 63;

/// Which records a batch has, by age.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lane {
    /// In memory and recent: the live page waits for them.
    Live,
    /// Left from an outage, on the disk or in memory.
    Backlog,
}

/// One record of the log.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// Its place in the log, unique while the agent runs.
    pub position: u64,
    /// The stream it belongs to.
    pub stream: Arc<StreamId>,
    /// The record.
    pub record: Record,
}

impl Item {
    /// The record at this position.
    #[must_use]
    pub const fn new(position: u64, stream: Arc<StreamId>, record: Record) -> Self {
        Self {
            position,
            stream,
            record,
        }
    }

    /// Whether it carries pixels rather than a reason for their absence.
    #[must_use]
    pub fn is_frame(&self) -> bool {
        matches!(self.record.reading, Reading::Frame(_))
    }
}

/// The records of one post, all of one boot, oldest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    /// Their age.
    pub lane: Lane,
    /// The agent's name in that boot.
    pub device: String,
    /// The boot.
    pub boot: String,
    /// The records.
    pub items: Vec<Item>,
}

impl Batch {
    pub(crate) fn of_backlog(device: &str, boot: &str, items: Vec<Item>) -> Self {
        Self {
            lane: Lane::Backlog,
            device: device.to_owned(),
            boot: boot.to_owned(),
            items,
        }
    }

    /// The post's body with these accounts. A sensor without records contributes its account alone.
    pub(crate) fn to_wire(&self, accounts: &BTreeMap<String, Account>) -> wire::Batch {
        let mut sensors: BTreeMap<&str, SensorBatch> = BTreeMap::new();
        let empty = |sensor: &str, account| SensorBatch {
            sensor: sensor.to_owned(),
            account,
            frames: Vec::new(),
        };
        for (sensor, account) in accounts {
            sensors.insert(sensor, empty(sensor, Some(account.clone())));
        }
        for item in &self.items {
            let sensor = item.stream.sensor.as_str();
            let batch = sensors.entry(sensor).or_insert_with(|| empty(sensor, None));
            batch.frames.push(item.record);
        }
        wire::Batch {
            device: self.device.clone(),
            boot: self.boot.clone(),
            t_sent_boot_ns: None,
            sensors: sensors.into_values().collect(),
        }
    }

    /// Send the first half first.
    pub(crate) fn halves(mut self) -> (Self, Self) {
        let rest = self.items.split_off(self.items.len() / 2);
        let second = Self {
            lane: self.lane,
            device: self.device.clone(),
            boot: self.boot.clone(),
            items: rest,
        };
        (self, second)
    }
}

/// Whether the answer to a post with this record confirms that the record is on disk. An answer proves nothing about
/// records outside its post.
pub(crate) fn is_durable(answer: &Acknowledgement, item: &Item) -> bool {
    let (sensor, seq) = (&item.stream.sensor, item.record.seq);
    let through = answer.durable_through.get(sensor);
    let is_gap = |gap: &wire::Gap| gap.sensor == *sensor && (gap.from..=gap.to).contains(&seq);
    through.is_some_and(|through| seq <= *through) && !answer.gaps.iter().any(is_gap)
}
