//! What an agent did, when it has ended.

use grideye_recording::wire::Account;
use std::collections::BTreeMap;
use std::fmt;

/// What an agent did, by sensor.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Summary {
    /// The account of each sensor, by its name.
    pub sensors: BTreeMap<String, SensorSummary>,
    /// Buses whose thread hung in a transfer and was left behind.
    pub hung_buses: Vec<String>,
}

/// What became of one sensor's frames.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SensorSummary {
    /// The agent's account.
    pub account: Account,
    /// Frames read that the collector has on disk.
    pub acknowledged: u64,
    /// Frames read that wait in the spool for the next run.
    pub on_disk: u64,
}

impl Summary {
    /// Whether every frame of every sensor was read and is on a disk, the collector's or the spool's.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let is_complete = |sensor: &SensorSummary| {
            let account = &sensor.account;
            account.missing == 0 && account.dropped.is_empty() && account.spooled == sensor.on_disk
        };
        self.hung_buses.is_empty() && self.sensors.values().all(is_complete)
    }
}

impl fmt::Display for Summary {
    /// One line a sensor: `i2c-1:0x69: 100 read = 98 stored + 2 dropped + 0 in memory; 1 missing`, and `+ 5 on disk` in
    /// front of the semicolon where the spool holds some.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (name, sensor)) in self.sensors.iter().enumerate() {
            let account = &sensor.account;
            let dropped: u64 = account.dropped.values().sum();
            let line_break = if index == 0 { "" } else { "\n" };
            write!(
                formatter,
                "{line_break}{name}: {} read = {} stored + {dropped} dropped + {} in memory",
                account.read,
                sensor.acknowledged,
                account.spooled.saturating_sub(sensor.on_disk),
            )?;
            if sensor.on_disk > 0 {
                write!(formatter, " + {} on disk", sensor.on_disk)?;
            }
            write!(formatter, "; {} missing", account.missing)?;
        }
        for bus in &self.hung_buses {
            write!(formatter, "\n{bus}: hung in a transfer")?;
        }
        Ok(())
    }
}
