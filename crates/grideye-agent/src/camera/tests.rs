//! A camera that sends what a script says, on a clock that goes on by what it waits.

use super::*;
use crate::config::SensorConfig;
use amg8833::Address;
use grideye_frame::{PixelWord, ThermistorWord};
use grideye_recording::ClockState;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::sync::Mutex;

#[derive(Default)]
struct Hand(Mutex<Duration>);

impl Clock for Hand {
    fn boot(&self) -> Duration {
        *self.0.lock().unwrap()
    }

    fn utc(&self) -> (i64, ClockState) {
        (0, ClockState::Unsynced)
    }

    fn sleep_until(&self, boot: Duration) {
        let mut now = self.0.lock().unwrap();
        *now = boot.max(*now);
    }
}

/// What comes, and how many milliseconds after what came before.
type Script = VecDeque<(u64, Result<u16, NoData>)>;

struct Scripted {
    /// One for each time that it is opened.
    scripts: VecDeque<Script>,
    clock: Arc<Hand>,
}

struct Playing {
    script: Script,
    clock: Arc<Hand>,
}

impl OpenCamera for Scripted {
    type Camera = Playing;

    fn open(&mut self) -> Result<Playing, CameraError> {
        let script = self.scripts.pop_front();
        let script = script.ok_or_else(|| CameraError::NoSuchCamera {
            path: "/dev/video0".to_owned(),
        })?;
        Ok(Playing {
            script,
            clock: Arc::clone(&self.clock),
        })
    }

    fn name(&self) -> String {
        "/dev/video0".to_owned()
    }
}

impl Camera for Playing {
    fn frame(&mut self, longest: Duration) -> Result<Option<RawFrame>, NoData> {
        let Some((after_ms, _)) = self.script.front_mut() else {
            return Err(NoData::Unplugged);
        };
        let wait = Duration::from_millis(*after_ms).min(longest);
        self.clock.sleep_until(self.clock.boot() + wait);
        *after_ms -= u64::try_from(wait.as_millis()).unwrap();
        if *after_ms > 0 {
            return Ok(None);
        }
        let (_, what) = self.script.pop_front().unwrap();
        what.map(|word| {
            Some(RawFrame {
                thermistor: ThermistorWord(0x1A0),
                pixels: [PixelWord(word); 64],
            })
        })
    }
}

#[derive(Default)]
struct Seen {
    records: RefCell<Vec<(u64, Result<u16, NoData>)>>,
    faults: RefCell<Vec<&'static str>>,
}

/// Stops it once so many records have come.
struct Until<'a>(&'a Seen, usize);

impl Sink for Until<'_> {
    fn record(&self, sensor: usize, record: Record) {
        assert_eq!(sensor, 0);
        let reading = match record.reading {
            Reading::Frame(frame) => Ok(frame.pixels[0].0),
            Reading::NoData(reason) => Err(reason),
        };
        self.0.records.borrow_mut().push((record.seq, reading));
    }

    fn fault(&self, _sensor: usize, kind: &'static str) {
        self.0.faults.borrow_mut().push(kind);
    }

    fn is_stopping(&self) -> bool {
        self.0.records.borrow().len() >= self.1
    }
}

fn seen(scripts: &[&[(u64, Result<u16, NoData>)]], records: usize) -> Seen {
    let clock = Arc::<Hand>::default();
    let scripts = scripts
        .iter()
        .map(|script| script.iter().copied().collect());
    let opener = Scripted {
        scripts: scripts.collect(),
        clock: Arc::clone(&clock),
    };
    let config = BusConfig {
        path: "v4l2:/dev/video0".into(),
        sensors: vec![SensorConfig::at(Address::High)],
    };
    let seen = Seen::default();
    read_camera(
        opener,
        (&config, None),
        clock,
        Log::silent(),
        &Until(&seen, records),
    );
    seen
}

#[test]
fn frames_are_numbered_and_those_that_come_again_are_counted() {
    let script = [(250, Ok(1)), (100, Ok(2)), (104, Ok(2)), (96, Ok(3))];
    let seen = seen(&[&script], 4);
    assert_eq!(
        *seen.records.borrow(),
        [(0, Ok(1)), (1, Ok(2)), (2, Ok(2)), (3, Ok(3))]
    );
    assert_eq!(*seen.faults.borrow(), [UNCHANGED]);
}

#[test]
fn what_the_driver_could_not_read_is_missing_with_its_reason() {
    let script = [
        // Before the first frame there is no number for it.
        (100, Err(NoData::Nack)),
        (100, Ok(1)),
        (100, Err(NoData::Nack)),
        (100, Err(NoData::BusError)),
        (100, Ok(2)),
    ];
    let seen = seen(&[&script], 4);
    let expected = [
        (0, Ok(1)),
        (1, Err(NoData::Nack)),
        (2, Err(NoData::BusError)),
        (3, Ok(2)),
    ];
    assert_eq!(*seen.records.borrow(), expected);
    assert_eq!(*seen.faults.borrow(), ["nack", "nack", "bus-error"]);
}

/// Of the six frames of six periods two are held for the host that was kept; four are lost, and came after these two.
#[test]
fn frames_for_which_the_driver_had_no_buffer_are_missing_where_they_were() {
    let script = [
        (100, Ok(1)),
        (600, Ok(2)),
        (1, Ok(3)),
        (99, Ok(4)),
        (100, Ok(5)),
    ];
    let seen = seen(&[&script], 9);
    let lost = Err(NoData::HostStalled);
    let expected = [Ok(1), Ok(2), Ok(3), lost, lost, lost, lost, Ok(4), Ok(5)];
    let records = (0..).zip(expected).collect::<Vec<_>>();
    assert_eq!(*seen.records.borrow(), records);
}

#[test]
fn a_slow_or_uneven_camera_loses_nothing() {
    let mut script: Vec<(u64, Result<u16, NoData>)> = vec![(100, Ok(0))];
    script.extend((1..60).map(|word| (if word % 2 == 0 { 60 } else { 149 }, Ok(word))));
    let seen = seen(&[&script], 60);
    assert!(
        seen.records
            .borrow()
            .iter()
            .all(|(_, reading)| reading.is_ok())
    );
}

#[test]
fn a_camera_that_went_away_is_opened_again_and_the_time_between_is_missing() {
    let (first, second) = ([(100, Ok(1)), (100, Ok(2))], [(100, Ok(3)), (100, Ok(4))]);
    let seen = seen(&[&first, &second], 8);
    let records = seen.records.borrow();
    assert_eq!(records[..2], [(0, Ok(1)), (1, Ok(2))]);
    let gone = records
        .iter()
        .filter(|row| row.1 == Err(NoData::Unplugged))
        .count();
    // Half a second until it is opened again, and the wait for its first frame.
    assert!((3..=6).contains(&gone), "{records:?}");
    assert_eq!(seen.faults.borrow()[0], "unplugged");
}

#[test]
fn a_camera_that_falls_silent_is_opened_anew() {
    let silent = [(100, Ok(1)), (600_000, Ok(2))];
    let seen = seen(&[&silent, &[(100, Ok(3)), (100, Ok(4))]], 4);
    assert!(seen.faults.borrow().contains(&"bus-timeout"));
}
