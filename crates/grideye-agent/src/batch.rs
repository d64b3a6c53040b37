//! A batch: the records of one post to the collector, and where they wait until it has stored them.

use grideye_frame::Reading;
use grideye_recording::wire::{self, Account, Acknowledgement, SensorBatch};
use grideye_recording::{Record, StreamId};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Where a record is on the disk: its own bytes, plus those since the previous record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// The segment.
    pub segment: u64,
    /// The first byte.
    pub from: u64,
    /// One past the last byte.
    pub to: u64,
    /// Index in the segment.
    pub(crate) stream: u16,
}

/// Where a batch's records wait until they are acknowledged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lane {
    /// In memory and recent: the live page waits for them.
    Live,
    /// In memory, left from an outage.
    Late,
    /// On the spool's disk.
    Disk,
}

/// One record, and its place on the disk if it is there.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// The stream it belongs to.
    pub stream: Arc<StreamId>,
    /// The record.
    pub record: Record,
    /// Its bytes in the spool.
    pub place: Option<Place>,
}

impl Item {
    /// Whether it carries pixels rather than a reason for their absence.
    #[must_use]
    pub fn is_frame(&self) -> bool {
        matches!(self.record.reading, Reading::Frame(_))
    }
}

/// The records of one post, all of one boot, oldest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    /// Where they wait.
    pub lane: Lane,
    /// The agent's name in that boot.
    pub device: String,
    /// The boot.
    pub boot: String,
    /// The records.
    pub items: Vec<Item>,
}

impl Batch {
    pub(crate) fn on_disk(device: &str, boot: &str, items: Vec<Item>) -> Self {
        Self {
            lane: Lane::Disk,
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
