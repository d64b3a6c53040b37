//! What is on its way to the collector: the records of one post, and where they are held meanwhile.

use crate::spool::Place;
use grideye_frame::Reading;
use grideye_recording::wire::{Account, Acknowledgement, Batch, SensorBatch};
use grideye_recording::{Record, StreamId};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Where a parcel's records are held until they are acknowledged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lane {
    /// In memory, and what a person at the page waits for.
    Live,
    /// In memory, left over from an outage.
    Late,
    /// On the spool's disk.
    Disk,
}

/// One record, and where it is on the disk if it is there.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// Whose.
    pub stream: Arc<StreamId>,
    /// The record.
    pub record: Record,
    /// Its bytes in the spool.
    pub place: Option<Place>,
}

impl Item {
    /// Whether it carries pixels; otherwise it says why there are none.
    #[must_use]
    pub fn is_frame(&self) -> bool {
        matches!(self.record.reading, Reading::Frame(_))
    }
}

/// The records of one post, all of one run, oldest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Parcel {
    /// Where they are held.
    pub lane: Lane,
    /// The agent's name in that run.
    pub device: String,
    /// The run.
    pub boot: String,
    /// The records.
    pub items: Vec<Item>,
}

impl Parcel {
    /// The body of the post, with these accounts: a sensor without records has its account alone.
    #[must_use]
    pub fn batch(&self, accounts: &BTreeMap<String, Account>) -> Batch {
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
        Batch {
            device: self.device.clone(),
            boot: self.boot.clone(),
            t_sent_boot_ns: None,
            sensors: sensors.into_values().collect(),
        }
    }

    /// The two halves, of which the first is to go first.
    #[must_use]
    pub fn halves(mut self) -> (Self, Self) {
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

/// Whether this answer says that the record, which was in the post, is on the collector's disk.
///
/// It vouches for nothing that was not in the post: its list of gaps is bounded.
#[must_use]
pub fn is_durable(answer: &Acknowledgement, item: &Item) -> bool {
    let (sensor, seq) = (&item.stream.sensor, item.record.seq);
    let through = answer.durable_through.get(sensor);
    let is_gap = |gap: &grideye_recording::wire::Gap| {
        gap.sensor == *sensor && (gap.from..=gap.to).contains(&seq)
    };
    through.is_some_and(|through| seq <= *through) && !answer.gaps.iter().any(is_gap)
}
