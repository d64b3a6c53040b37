//! One sensor as shown: its newest records, their ages and the frame rate; also as JSON.

use crate::limits::Limits;
use crate::live::faults::Faults;
use crate::live::people::Counted;
use crate::store::{StreamSummary, account};
use grideye_frame::word;
use grideye_frame::{Celsius, Reading};
use grideye_recording::{ClockState, Record};
use serde_json::{Map, Value, json};
use std::collections::VecDeque;
use std::time::Duration;

pub(super) struct Sensor {
    pub(super) stream: StreamSummary,
    /// The record with the latest measurement time.
    pub(super) newest: Option<Measured>,
    pub(super) newest_frame: Option<Measured>,
    /// The device's boot clock at record 0 of the boot, if that arrived while this collector ran.
    pub(super) began_boot_ns: Option<u64>,
    /// Boot times of the frames within the rate window, in nanoseconds.
    pub(super) recent_boot_ns: VecDeque<u64>,
    pub(super) faults: Faults,
    /// `None` if the collector does not count people.
    pub(super) counted: Option<Counted>,
}

/// A record, owned or borrowed, with its measurement time. Batches lend their records; only the newest is stored.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measured<R = Record> {
    pub(super) record: R,
    /// On the collector's monotonic clock; negative if before that clock began.
    pub(super) measured_ns: i128,
    pub(super) basis: AgeBasis,
}

/// How the age of a frame is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AgeBasis {
    /// From the device's boot clock at reading and at sending.
    BootClock,
    /// From the wall clocks of the collector and of the device, whose clock was set.
    WallClock,
    /// Only from the arrival: a lower bound.
    Arrival,
}

/// Maximum frame times remembered per sensor for the rate.
const RECENT_MAX: usize = 128;

impl Sensor {
    pub(super) fn new(stream: StreamSummary) -> Self {
        Self {
            stream,
            newest: None,
            newest_frame: None,
            began_boot_ns: None,
            recent_boot_ns: VecDeque::new(),
            faults: Faults::default(),
            counted: None,
        }
    }

    /// Shows the records that are newer than the last one, and returns them. A backlog is stored, not shown.
    pub(super) fn take<'r>(
        &mut self,
        stream: StreamSummary,
        arrived: impl Iterator<Item = Measured<&'r Record>>,
        limits: &Limits,
    ) -> Vec<Measured<&'r Record>> {
        let mut shown = Vec::with_capacity(arrived.size_hint().1.unwrap_or(0));
        for measured in arrived {
            let own = self.newest.as_ref().map(Measured::lent);
            let newest = shown.last().copied().or(own);
            if self.stream.id == stream.id {
                if newest.is_some_and(|newest| newest.record.seq >= measured.record.seq) {
                    continue;
                }
            } else if newest.is_some_and(|newest| newest.measured_ns >= measured.measured_ns) {
                continue;
            } else {
                // The room stays what it was.
                let counted = self.counted.take();
                *self = Self::new(stream.clone());
                self.counted = counted;
            }
            shown.push(measured);
        }
        self.show(&shown, limits);
        if self.stream.id == stream.id {
            self.stream = stream;
        }
        shown
    }

    /// Shows records in ascending order.
    pub(super) fn show(&mut self, shown: &[Measured<&Record>], limits: &Limits) {
        let Some(newest) = shown.last() else { return };
        let has_pixels = |measured: &&Measured<&Record>| measured.record.reading.frame().is_some();
        let boot_ns = |measured: &Measured<&Record>| measured.record.stamp.t_boot_ns;
        if let Some(first) = shown.iter().find(|measured| measured.record.seq == 0) {
            self.began_boot_ns = Some(boot_ns(first));
        }
        self.newest = Some(newest.held());
        if let Some(frame) = shown.iter().rfind(has_pixels) {
            self.newest_frame = Some(frame.held());
        }
        let frames = shown.iter().filter(has_pixels);
        self.recent_boot_ns.extend(frames.map(boot_ns));
        let window_ns = u64::try_from(limits.rate_window.as_nanos()).unwrap_or(u64::MAX);
        let oldest_ns = boot_ns(newest).saturating_sub(window_ns);
        while self.recent_boot_ns.len() > RECENT_MAX
            || self
                .recent_boot_ns
                .front()
                .is_some_and(|first| *first < oldest_ns)
        {
            self.recent_boot_ns.pop_front();
        }
    }

    /// The newest frame, and after it the newest record if that has no pixels.
    pub(super) fn last_shown(&self) -> Vec<Measured<&Record>> {
        let newest = self.newest.as_ref();
        let missing = newest.filter(|newest| newest.record.reading.frame().is_none());
        let shown = self.newest_frame.as_ref().into_iter().chain(missing);
        shown.map(Measured::lent).collect()
    }

    /// Frames per second by the device's own clock; `None` if the sensor was silent for the whole window.
    pub(super) fn rate_hz(&self, now_ns: i128, window: Duration) -> Option<f64> {
        let newest = self.newest_frame.as_ref()?;
        if now_ns - newest.measured_ns > nanoseconds(window) {
            return None;
        }
        let (first, last) = (self.recent_boot_ns.front()?, self.recent_boot_ns.back()?);
        let span = Duration::from_nanos(last.checked_sub(*first)?);
        let intervals = u32::try_from(self.recent_boot_ns.len() - 1).ok()?;
        (!span.is_zero()).then(|| f64::from(intervals) / span.as_secs_f64())
    }
}

impl Measured {
    pub(super) fn lent(&self) -> Measured<&Record> {
        self.with(&self.record)
    }
}

impl<'r> Measured<&'r Record> {
    pub(super) fn held(&self) -> Measured {
        self.with(*self.record)
    }

    /// Finds the measurement time of a record that arrived at `arrived_ns` on the monotonic clock.
    pub(super) fn new(
        record: &'r Record,
        t_sent_boot_ns: Option<u64>,
        arrived_ns: i128,
        t_arrival_ns: i64,
    ) -> Self {
        let by_boot_clock = t_sent_boot_ns
            .and_then(|sent| sent.checked_sub(record.stamp.t_boot_ns))
            .map(|age| (i128::from(age), AgeBasis::BootClock));
        let by_wall_clock = || {
            let age = i128::from(t_arrival_ns) - i128::from(record.stamp.t_utc_ns);
            let believed = record.stamp.clock != ClockState::Unsynced && age >= 0;
            believed.then_some((age, AgeBasis::WallClock))
        };
        let (age_ns, basis) = by_boot_clock
            .or_else(by_wall_clock)
            .unwrap_or((0, AgeBasis::Arrival));
        Self {
            record,
            measured_ns: arrived_ns - age_ns,
            basis,
        }
    }
}

pub(super) fn nanoseconds(duration: Duration) -> i128 {
    i128::try_from(duration.as_nanos()).unwrap_or(i128::MAX)
}

impl Sensor {
    /// For the live page: the sensor's state and the frames to show, in degrees.
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

    /// For `GET /v1/sensors`: the same with only the newest frame, in degrees and as raw words.
    pub(super) fn state(&self, now_ns: i128, rate_window: Duration) -> Value {
        let mut state = self.status(now_ns, rate_window);
        let frame = self.newest_frame.as_ref().map(|newest| {
            let mut frame = in_degrees(newest.lent(), now_ns);
            if let Reading::Frame(raw) = &newest.record.reading {
                let pixels: Vec<u16> = raw.pixels.iter().map(|word| word.0).collect();
                frame["thermistor_raw"] = raw.thermistor.map(|word| word.0).into();
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
        let people = self.counted.iter().flat_map(Counted::json);
        status.extend(people.map(|(key, value)| (key.to_owned(), value)));
        status
    }
}

/// A stream's state in the store, and whether its counts balance.
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

/// A record with its age, and its pixels in degrees or the reason why it has none.
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
            let pixels = word::pixels(&raw.pixels).map(Celsius::get);
            let thermistor = raw.thermistor.map(word::thermistor_celsius);
            json["thermistor_celsius"] = thermistor.map(Celsius::get).into();
            json["pixels_celsius"] = pixels.as_slice().into();
        }
    }
    json
}

impl<R> Measured<R> {
    const fn with<S>(&self, record: S) -> Measured<S> {
        Measured {
            record,
            measured_ns: self.measured_ns,
            basis: self.basis,
        }
    }

    /// Seconds since the measurement, never negative.
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
