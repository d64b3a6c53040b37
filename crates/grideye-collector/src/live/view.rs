//! Sensors as JSON.

use crate::live::sensor::{AgeBasis, Measured, Sensor};
use crate::store::{StreamSummary, account};
use amg8833::word;
use grideye_frame::{Celsius, Reading};
use grideye_recording::Record;
use serde_json::{Map, Value, json};
use std::time::Duration;

impl Sensor {
    /// For the live page: how the sensor does, and the frames to show, in degrees.
    pub(super) fn event(
        &self,
        frames: &[Measured<&Record>],
        now_ns: i128,
        rate_window: Duration,
    ) -> Value {
        let mut event = self.status(now_ns, rate_window);
        let frames = frames.iter().map(|shown| in_degrees(*shown, now_ns));
        event.insert("frames".to_owned(), frames.collect());
        Value::Object(event)
    }

    /// For `GET /v1/sensors`: the same with the newest frame alone, in degrees and as the bus said it.
    pub(super) fn state(&self, now_ns: i128, rate_window: Duration) -> Value {
        let mut state = self.status(now_ns, rate_window);
        let frame = self.newest_frame.as_ref().map(|newest| {
            let mut frame = in_degrees(newest.lent(), now_ns);
            if let Reading::Frame(raw) = &newest.record.reading {
                let pixels: Vec<u16> = raw.pixels.iter().map(|word| word.0).collect();
                frame["thermistor_raw"] = raw.thermistor.0.into();
                frame["pixels_raw"] = pixels.into();
            }
            frame
        });
        state.insert("frame".to_owned(), frame.into());
        Value::Object(state)
    }

    fn status(&self, now_ns: i128, rate_window: Duration) -> Map<String, Value> {
        let mut status = stream_json(&self.stream);
        let newest = self.newest.as_ref();
        let missing = newest.filter(|newest| newest.record.reading.frame().is_none());
        let now = Duration::from_nanos(u64::try_from(now_ns).unwrap_or(0));
        let of_now = [
            ("rate_hz", json!(self.rate_hz(now_ns, rate_window))),
            ("age_s", json!(newest.map(|newest| newest.age_s(now_ns)))),
            (
                "no_frame_now",
                json!(missing.map(|newest| in_degrees(newest.lent(), now_ns))),
            ),
            ("recent_faults", json!(self.faults.recent(now))),
            ("began_boot_ns", json!(self.began_boot_ns)),
        ];
        status.extend(of_now.map(|(key, value)| (key.to_owned(), value)));
        status
    }
}

/// What the store knows of a stream, and how the books stand.
pub(crate) fn stream_json(stream: &StreamSummary) -> Map<String, Value> {
    let gaps: Vec<Value> = stream
        .gaps
        .iter()
        .map(|gap| json!({ "from": gap.from, "to": gap.to }))
        .collect();
    let unaccounted = stream
        .unaccounted()
        .map(|frames| i64::try_from(frames).unwrap_or(i64::MAX));
    let account = stream.account.as_ref();
    let json = json!({
        "device": stream.id.device,
        "sensor": stream.id.sensor,
        "boot": stream.id.boot,
        "read": account.map(|account| account.read),
        "stored": stream.stored,
        "expired": stream.expired,
        "dropped": account.map(|account| &account.dropped),
        "spooled": stream.spooled(),
        "unaccounted": unaccounted,
        "balanced": unaccounted.map(|frames| frames == 0),
        "missing": stream.missing,
        "never_came": stream.never_came,
        "gaps": gaps,
        "durable_through": stream.durable_through,
        "errors": account.map(|account| &account.errors),
        "account": account.map(account::to_json),
        "t_last_arrival_ns": stream.t_last_arrival_ns,
    });
    match json {
        Value::Object(fields) => fields,
        _ => Map::new(),
    }
}

/// A record with its age, and with its pixels in degrees or the reason why it has none.
fn in_degrees(measured: Measured<&Record>, now_ns: i128) -> Value {
    let record = measured.record;
    let mut json = json!({
        "seq": record.seq,
        "t_boot_ns": record.stamp.t_boot_ns,
        "t_utc_ns": record.stamp.t_utc_ns,
        "clock": record.stamp.clock.name(),
        "age_s": measured.age_s(now_ns),
        "age_basis": measured.basis.name(),
    });
    match &record.reading {
        Reading::NoData(reason) => json["missing"] = reason.name().into(),
        Reading::Frame(raw) => {
            let frame = word::frame(raw);
            let pixels: Vec<f32> = frame.pixels.iter().copied().map(Celsius::get).collect();
            json["thermistor_celsius"] = frame.thermistor.get().into();
            json["pixels_celsius"] = pixels.into();
        }
    }
    json
}

impl<R> Measured<R> {
    /// Seconds since it was measured, never below 0.
    fn age_s(&self, now_ns: i128) -> f64 {
        let age_ns = u64::try_from((now_ns - self.measured_ns).max(0)).unwrap_or(u64::MAX);
        Duration::from_nanos(age_ns).as_secs_f64()
    }
}

impl AgeBasis {
    const fn name(self) -> &'static str {
        match self {
            Self::BootClock => "boot-clock",
            Self::WallClock => "wall-clock",
            Self::Arrival => "arrival",
        }
    }
}
