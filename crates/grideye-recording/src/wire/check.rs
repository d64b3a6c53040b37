//! Rules between the fields of a body, checked on reading and on writing.

use crate::record::{COUNT_MAX, Record, check_name};
use crate::wire::error::WireError;
use crate::wire::types::{Account, Acknowledgement, Batch, FRAMES_MAX, SensorBatch};
use crate::wire::values::limit;
use grideye_frame::NAME_RULE;
use std::collections::{BTreeMap, BTreeSet};

pub(super) fn batch(batch: &Batch) -> Result<(), WireError> {
    name(&batch.device, || "device".to_owned())?;
    name(&batch.boot, || "boot".to_owned())?;
    if let Some(sent) = batch.t_sent_boot_ns {
        count(sent, || "t_sent_boot_ns".to_owned())?;
    }
    let is_one = batch.sensors.len() == 1;
    let mut seen = BTreeSet::new();
    for (index, sensor) in batch.sensors.iter().enumerate() {
        let path = || format!("sensors[{index}]");
        sensor_batch(sensor, path)?;
        // Most agents have a single sensor, which needs no set.
        if !is_one && !seen.insert(sensor.sensor.as_str()) {
            let found = format!("{} a second time", sensor.sensor);
            let path = format!("{}.sensor", path());
            return Err(WireError::wrong_value(path, "each sensor once", found));
        }
    }
    Ok(())
}

/// The limit of frames covers all sensors together.
pub(super) fn frames_in_all(batch: &Batch) -> Result<(), WireError> {
    let mut frames = 0;
    for (index, sensor) in batch.sensors.iter().enumerate() {
        frames += sensor.frames.len();
        if frames > FRAMES_MAX {
            let path = format!("sensors[{index}].frames");
            return Err(WireError::too_many(path, &limit::<Record>()));
        }
    }
    Ok(())
}

pub(super) fn acknowledgement(acknowledgement: &Acknowledgement) -> Result<(), WireError> {
    counts(&acknowledgement.durable_through, || {
        "durable_through".to_owned()
    })?;
    for (index, gap) in acknowledgement.gaps.iter().enumerate() {
        name(&gap.sensor, || format!("gaps[{index}].sensor"))?;
        count(gap.to, || format!("gaps[{index}].to"))?;
        if gap.from > gap.to {
            let expected = format!("{} or more, as `from` says", gap.from);
            let path = format!("gaps[{index}].to");
            return Err(WireError::wrong_value(path, &expected, gap.to));
        }
    }
    Ok(())
}

fn sensor_batch(sensor: &SensorBatch, path: impl Fn() -> String) -> Result<(), WireError> {
    name(&sensor.sensor, || format!("{}.sensor", path()))?;
    if let Some(of_agent) = &sensor.account {
        account(of_agent, || format!("{}.account", path()))?;
    }
    let mut previous = None;
    for (index, frame) in sensor.frames.iter().enumerate() {
        record(frame, previous, || format!("{}.frames[{index}]", path()))?;
        previous = Some(frame.seq);
    }
    Ok(())
}

fn account(account: &Account, path: impl Fn() -> String) -> Result<(), WireError> {
    let field = |name: &str| format!("{}.{name}", path());
    count(account.read, || field("read"))?;
    count(account.missing, || field("missing"))?;
    count(account.spooled, || field("spooled"))?;
    counts(&account.dropped, || field("dropped"))?;
    counts(&account.errors, || field("errors"))
}

fn counts(by_name: &BTreeMap<String, u64>, path: impl Fn() -> String) -> Result<(), WireError> {
    for (key, value) in by_name {
        name(key, || format!("{}, a key", path()))?;
        count(*value, || format!("{}.{key}", path()))?;
    }
    Ok(())
}

fn record(
    record: &Record,
    previous: Option<u64>,
    path: impl Fn() -> String,
) -> Result<(), WireError> {
    count(record.seq, || format!("{}.seq", path()))?;
    count(record.stamp.t_boot_ns, || format!("{}.t_boot_ns", path()))?;
    match previous {
        Some(previous) if record.seq <= previous => Err(WireError::wrong_value(
            format!("{}.seq", path()),
            &format!("more than {previous}, the seq before it"),
            record.seq,
        )),
        _ => Ok(()),
    }
}

fn name(name: &str, path: impl Fn() -> String) -> Result<(), WireError> {
    check_name(name).map_err(|error| WireError::wrong_value(path(), NAME_RULE, error.found))
}

fn count(count: u64, path: impl Fn() -> String) -> Result<(), WireError> {
    if count <= COUNT_MAX {
        return Ok(());
    }
    let expected = format!("an integer from 0 to {COUNT_MAX}");
    Err(WireError::wrong_value(path(), &expected, count))
}
