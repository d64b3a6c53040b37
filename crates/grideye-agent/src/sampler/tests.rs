//! The sampler against a model of a sensor's registers, which updates on its own clock but not during a read, and a
//! host that is late.

use super::content::Content;
use super::content::{Pending, Read};
use super::event::*;
use super::machine::{Sampler, State};
use super::phase::{Ns, Phase, Window};
use crate::clock::{duration, signed_ns};
use grideye_frame::{NoData, RawFrame, Reading, ThermistorWord};
use grideye_frame::{PIXELS, PixelWord};
use proptest::prelude::*;
use std::time::Duration;

const MS: Ns = 1_000_000;

/// A sensor that measures.
const AS_CONFIGURED: Checked = Checked::AsConfigured {
    has_measured: true,
    is_cleared: true,
};

struct Model {
    now: Ns,
    /// When the next update, number `updates`, happens.
    next_update: Ns,
    updates: u64,
    period: Ns,
    drift_ppm_per_s: Ns,
    read_ns: Ns,
    /// Host delays of each read, in turn: before the pixels' START, between it and the thermistor's, and after.
    held_up: Vec<[Ns; 3]>,
    reads: usize,
    /// The content of frame `n`, as a number.
    content: fn(u64) -> u64,
    /// The number of the frame in the registers, once there is one.
    held: Option<u64>,
    /// Whether a set-up clears the registers and restarts the measurement.
    starts_anew: bool,
    delays: Vec<Ns>,
    turn: usize,
}

impl Model {
    fn new(period: Ns, read_ns: Ns, content: fn(u64) -> u64) -> Self {
        Self {
            now: 0,
            next_update: 0,
            updates: 0,
            period,
            drift_ppm_per_s: 0,
            read_ns,
            held_up: vec![[0; 3]],
            reads: 0,
            content,
            held: None,
            starts_anew: true,
            delays: vec![0],
            turn: 0,
        }
    }
    fn sampler(&self, nominal: Ns) -> Sampler {
        let mut sampler = Sampler::new(duration(nominal), Duration::ZERO, None);
        sampler.set_transfer_min(duration(self.read_ns));
        sampler
    }

    fn sleep_until(&mut self, at: Duration) {
        if signed_ns(at) > self.now {
            self.turn += 1;
            self.pass(signed_ns(at) - self.now + self.delays[self.turn % self.delays.len()]);
        }
    }

    fn pass(&mut self, ns: Ns) {
        self.now += ns;
        while self.next_update <= self.now && self.updates < u64::MAX {
            self.held = Some(self.updates);
            self.updates += 1;
            let drift = self.drift_ppm_per_s * (self.now / MS) / 1000;
            self.next_update += self.period + self.period / 1_000_000 * drift;
        }
    }

    /// Two transfers; each copies the registers at its start and delays updates until its end.
    fn read(&mut self) -> (Span, RawFrame) {
        let before = duration(self.now);
        let [early, between, behind] = self.held_up[self.reads % self.held_up.len()];
        self.reads += 1;
        self.pass(early);
        let pixels = self.shown().pixels;
        self.pass(self.read_ns * 19 / 20);
        self.pass(between);
        let thermistor = self.shown().thermistor;
        self.pass(self.read_ns - self.read_ns * 19 / 20);
        self.pass(behind);
        let after = duration(self.now);
        (Span::new(before, after), RawFrame { thermistor, pixels })
    }

    fn shown(&self) -> RawFrame {
        frame(self.held.map_or(0, |n| 1 + (self.content)(n)))
    }

    fn start(&mut self) -> Span {
        let before = duration(self.now);
        self.pass(52 * MS);
        if self.starts_anew {
            self.held = None;
            self.updates = 0;
            self.next_update = self.now + 2 * self.period;
        }
        Span::new(before, duration(self.now))
    }
}

/// Added to the last pixel to make it look like a measurement.
const HIGH_DIGIT: u16 = 100;

fn frame(content: u64) -> RawFrame {
    let word = |shift: u32| PixelWord(u16::try_from(content >> shift & 0xFFF).unwrap());
    let mut pixels = [word(0); PIXELS];
    pixels[63] = if content == 0 {
        word(0)
    } else {
        PixelWord(word(12).0 + HIGH_DIGIT)
    };
    RawFrame {
        thermistor: thermistor(content),
        pixels,
    }
}

/// Fifty consecutive frames have different ones.
fn thermistor(content: u64) -> ThermistorWord {
    ThermistorWord(400 + u16::try_from(content % 50).unwrap())
}

fn number(frame: &RawFrame) -> u64 {
    u64::from(frame.pixels[0].0) + (u64::from(frame.pixels[63].0 - HIGH_DIGIT) << 12) - 1
}

#[derive(Default)]
struct Outcome {
    events: Vec<Event>,
    records: Vec<(u64, Reading<RawFrame>)>,
    faults: Vec<&'static str>,
    reads: u64,
}

impl Outcome {
    fn take_events(&mut self, sampler: &mut Sampler) {
        while let Some(event) = sampler.next_event() {
            self.events.push(event);
            match event {
                Event::Record { seq, reading, .. } => self.records.push((seq, reading)),
                Event::Fault(kind) => self.faults.push(kind),
            }
        }
    }

    fn append(&mut self, mut later: Self) {
        self.events.append(&mut later.events);
        self.records.append(&mut later.records);
        self.faults.append(&mut later.faults);
        self.reads += later.reads;
    }
}

/// Runs until `until`; `meddle` may change the model before each task.
fn run(
    model: &mut Model,
    sampler: &mut Sampler,
    until: Ns,
    mut meddle: impl FnMut(&mut Model),
) -> Outcome {
    let mut outcome = Outcome::default();
    while let Some(due) = sampler.due() {
        if model.now > until {
            break;
        }
        model.sleep_until(due.at);
        meddle(model);
        match due.task {
            Task::SetUp => sampler.set_up(model.start(), Ok(())),
            Task::CheckSettings => {
                let before = duration(model.now);
                model.pass(model.read_ns / 8);
                sampler.settings_checked(Span::new(before, duration(model.now)), Ok(AS_CONFIGURED));
            }
            Task::ReadFrame => {
                let (span, frame) = model.read();
                outcome.reads += 1;
                sampler.frame_read(span, Ok(frame));
            }
        }
        outcome.take_events(sampler);
    }
    outcome
}

/// Checks that records ascend without a gap, and each frame has the sensor's own number.
fn assert_exact(outcome: &Outcome, content: fn(u64) -> u64) -> Result<(), TestCaseError> {
    for (expected, (seq, reading)) in (0..).zip(&outcome.records) {
        prop_assert_eq!(*seq, expected);
        if let Reading::Frame(frame) = reading {
            prop_assert_eq!(number(frame), content(*seq), "frame {}", seq);
        }
    }
    Ok(())
}

fn missing(outcome: &Outcome) -> Vec<(u64, NoData)> {
    let records = outcome.records.iter();
    let missing = records.filter_map(|(seq, reading)| match reading {
        Reading::NoData(reason) => Some((*seq, *reason)),
        Reading::Frame(_) => None,
    });
    missing.collect()
}

proptest! {
    #[test]
    fn every_frame_is_recorded_once_whatever_the_clocks_and_the_host_do(
        error_ppm in -60_000_i64..=60_000,
        drift_ppm_per_s in -20_i64..=20,
        nominal_ms in prop::sample::select(vec![100_i64, 1000]),
        read_us in prop::sample::select(vec![3_100_i64, 12_300]),
        delays in prop::collection::vec(0_i64..=40 * MS, 1..50),
        share_of_delays in 0_usize..4,
    ) {
        let nominal = nominal_ms * MS;
        let mut model = Model::new(nominal + nominal / 1_000_000 * error_ppm, read_us * 1000, |n| n);
        model.drift_ppm_per_s = drift_ppm_per_s;
        let turns = delays.iter().enumerate().map(|(turn, delay)| if turn % 4 < share_of_delays { *delay } else { 0 });
        model.delays = turns.collect();
        let mut sampler = model.sampler(nominal);
        let outcome = run(&mut model, &mut sampler, 600 * nominal, |_| ());
        assert_exact(&outcome, |n| n)?;
        prop_assert_eq!(missing(&outcome), vec![]);
        prop_assert_eq!(&outcome.faults, &Vec::<&str>::new());
        prop_assert!(outcome.records.len() > 540, "{}", outcome.records.len());
        let frames = u64::try_from(outcome.records.len()).unwrap();
        prop_assert!(share_of_delays > 0 || outcome.reads < frames * 3 / 2 + 200, "{} reads", outcome.reads);
    }

    #[test]
    fn equal_frames_are_counted_by_the_sensors_own_period(
        error_ppm in -60_000_i64..=60_000,
        drift_ppm_per_s in -20_i64..=20,
        delays in prop::collection::vec(0_i64..=40 * MS, 1..50),
    ) {
        // Once the period is known, a scene may stand still for three frames of four.
        let content: fn(u64) -> u64 = |n| if n < 64 { n } else { n / 4 + 48 };
        let mut model = Model::new(100 * MS + error_ppm * 100, 12_300_000, content);
        model.drift_ppm_per_s = drift_ppm_per_s;
        model.delays = delays;
        let mut sampler = model.sampler(100 * MS);
        let outcome = run(&mut model, &mut sampler, 60_000 * MS, |_| ());
        assert_exact(&outcome, content)?;
        prop_assert_eq!(missing(&outcome), vec![]);
    }

    #[test]
    fn a_scene_that_stands_still_from_the_start_is_counted_as_well(
        error_ppm in -60_000_i64..=60_000,
        read_us in prop::sample::select(vec![3_100_i64, 12_300]),
    ) {
        let content: fn(u64) -> u64 = |n| n / 3;
        let mut model = Model::new(100 * MS + error_ppm * 100, read_us * 1000, content);
        let mut sampler = model.sampler(100 * MS);
        let outcome = run(&mut model, &mut sampler, 60_000 * MS, |_| ());
        assert_exact(&outcome, content)?;
        prop_assert_eq!(missing(&outcome), vec![]);
    }

    #[test]
    fn a_stall_of_the_host_costs_exactly_the_frames_that_passed(
        error_ppm in -60_000_i64..=60_000,
        stalls in prop::collection::vec((20_u64..60, 60 * MS..3_000 * MS), 1..12),
    ) {
        let mut model = Model::new(100 * MS + error_ppm * 100, 12_300_000, |n| n);
        let mut sampler = model.sampler(100 * MS);
        let mut stall_at = 60;
        let mut left = stalls.into_iter();
        let outcome = run(&mut model, &mut sampler, 60_000 * MS, |model| {
            if model.updates >= stall_at {
                if let Some((frames, stall)) = left.next() {
                    model.pass(stall);
                    stall_at = model.updates + frames;
                }
            }
        });
        assert_exact(&outcome, |n| n)?;
        prop_assert!(missing(&outcome).iter().all(|(_, reason)| *reason == NoData::HostStalled));
        prop_assert!(outcome.faults.iter().all(|kind| *kind == THERMISTOR_LATE), "{:?}", outcome.faults);
    }
}

#[test]
fn a_gap_of_days_is_listed_in_part_and_skipped_in_seq() {
    let mut model = Model::new(100 * MS, 3_100_000, |n| n);
    let mut sampler = model.sampler(100 * MS);
    let mut is_suspended = false;
    let two_days = 2 * 86_400_000 * MS;
    let until = 30_000 * MS + two_days;
    let outcome = run(&mut model, &mut sampler, until, |model| {
        if model.now > 20_000 * MS && !is_suspended {
            is_suspended = true;
            model.pass(two_days);
        }
    });
    let listed = missing(&outcome);
    assert_eq!(u64::try_from(listed.len()).unwrap(), ROWS_PER_GAP_MAX);
    assert!(outcome.faults.contains(&GAP_NOT_LISTED));
    let seqs: Vec<u64> = outcome.records.iter().map(|(seq, _)| *seq).collect();
    assert!(seqs.windows(2).all(|pair| pair[0] < pair[1]));
    // Two days are 1,728,000 frames, within the uncertainty of the period.
    let last = seqs[seqs.len() - 1];
    assert!(last.abs_diff(1_728_000) < 3_000, "{last}");
}

#[test]
fn a_sensor_that_cannot_be_set_up_is_tried_at_growing_intervals_up_to_the_limit() {
    let mut sampler = Sampler::new(duration(100 * MS), Duration::ZERO, None);
    let mut pauses = Vec::new();
    let mut now = Duration::ZERO;
    for _ in 0..8 {
        let due = sampler.due().unwrap();
        assert_eq!(due.task, Task::SetUp);
        pauses.push(due.at - now);
        now = due.at;
        sampler.set_up(Span::new(now, now), Err(NoData::Nack));
    }
    assert_eq!(pauses[1], SET_UP_PAUSE);
    assert_eq!(pauses[2], 2 * SET_UP_PAUSE);
    assert_eq!(pauses[7], SET_UP_PAUSE_MAX);
}

#[test]
fn a_sensor_whose_registers_stay_zero_is_set_up_again_in_time() {
    let mut sampler = Sampler::new(duration(100 * MS), Duration::ZERO, None);
    let mut now = Duration::from_millis(52);
    sampler.set_up(Span::new(Duration::ZERO, now), Ok(()));
    let zero = RawFrame {
        thermistor: ThermistorWord(400),
        pixels: [PixelWord(0); PIXELS],
    };
    while let Some(Due {
        at,
        task: Task::ReadFrame,
    }) = sampler.due()
    {
        let after = at + Duration::from_millis(3);
        sampler.frame_read(Span::new(at, after), Ok(zero));
        now = after;
    }
    let limit = Duration::from_millis(52) + FIRST_FRAME_PERIODS * Duration::from_millis(100);
    let late = now.saturating_sub(limit);
    assert!(now > limit && late < Duration::from_millis(40), "{now:?}");
    assert_eq!(sampler.next_event(), Some(Event::Fault("all-zero")));
    assert_eq!(sampler.next_event(), None);
}

/// The model's frames from `first` on, none missing, numbered from 0.
fn assert_numbered(outcome: &Outcome, first: u64) {
    for (expected, (seq, reading)) in (0..).zip(&outcome.records) {
        let found = (*seq, reading.frame().map(number));
        assert_eq!(found, (expected, Some(first + expected)));
    }
}

/// Followed without a fault, except that the first frame, of unknown age, may have the second one's thermistor.
fn assert_followed(outcome: &Outcome, first: u64) {
    assert_eq!(missing(outcome), []);
    let faults = &outcome.faults;
    assert!(
        faults.is_empty() || *faults == [THERMISTOR_LATE],
        "{faults:?}"
    );
    assert_numbered(outcome, first);
    assert!(outcome.records.len() > 90);
}

#[test]
fn a_sensor_that_keeps_its_registers_through_the_set_up_is_followed_from_any_phase() {
    for phase in 0..50 {
        let mut model = Model::new(104 * MS, 3_100_000, |n| n);
        model.starts_anew = false;
        model.next_update = phase * 2 * MS;
        let mut sampler = model.sampler(100 * MS);
        let outcome = run(&mut model, &mut sampler, 10_000 * MS, |_| ());
        let first = outcome.records[0].1.frame().map(number).unwrap();
        assert_followed(&outcome, first);
    }
}

#[test]
fn a_dead_link_after_the_set_up_reveals_nothing_about_the_phase() {
    for phase in 0..25 {
        let mut model = Model::new(104 * MS, 3_100_000, |n| n);
        let mut sampler = model.sampler(100 * MS);
        let mut link_since = None;
        sampler.set_up(model.start(), Ok(()));
        let restored = model.now + 850 * MS + phase * 4 * MS;
        let mut outcome = Outcome::default();
        while model.now < 12_000 * MS {
            let due = sampler.due().unwrap();
            model.sleep_until(due.at);
            let (span, mut read) = model.read();
            if signed_ns(span.before) < restored {
                read.pixels = [PixelWord(0); PIXELS];
            } else if link_since.is_none() {
                link_since = Some(number(&read));
            }
            match due.task {
                Task::ReadFrame => sampler.frame_read(span, Ok(read)),
                _ => sampler.settings_checked(span, Ok(AS_CONFIGURED)),
            }
            outcome.take_events(&mut sampler);
        }
        assert_followed(&outcome, link_since.unwrap());
    }
}

#[test]
fn a_late_update_is_waited_for_and_not_counted_as_an_equal_frame() {
    let mut model = Model::new(104 * MS, 3_100_000, |n| n);
    let mut sampler = model.sampler(100 * MS);
    let mut is_late = false;
    let outcome = run(&mut model, &mut sampler, 20_000 * MS, |model| {
        if model.updates == 100 && !is_late {
            is_late = true;
            model.next_update += 15 * MS;
        }
    });
    assert_eq!(outcome.faults, [OUT_OF_STEP]);
    assert_numbered(&outcome, 0);
}

#[test]
fn settings_are_read_back_after_a_fault_before_any_frame_counts() {
    let mut model = Model::new(100 * MS, 3_100_000, |n| n);
    let mut sampler = model.sampler(100 * MS);
    run(&mut model, &mut sampler, 3_000 * MS, |_| ());
    let due = sampler.due().unwrap();
    assert_eq!(due.task, Task::ReadFrame);
    let span = Span::new(due.at, due.at);
    sampler.frame_read(span, Err(NoData::Nack));
    assert_eq!(sampler.next_event(), Some(Event::Fault("nack")));
    assert_eq!(sampler.due().map(|due| due.task), Some(Task::CheckSettings));
    sampler.settings_checked(span, Ok(Checked::OtherSettings));
    assert_eq!(sampler.due().map(|due| due.task), Some(Task::SetUp));
}

#[test]
fn a_thermistor_that_dies_within_a_frame_is_a_fault_and_one_that_stays_dead_is_data() {
    for (dead, kind) in [(0, "all-zero"), (0xFFFF, "stuck-high")] {
        let mut model = Model::new(100 * MS, 3_100_000, |n| n);
        let mut sampler = model.sampler(100 * MS);
        let outcome = run(&mut model, &mut sampler, 3_000 * MS, |_| ());
        let seq = u64::try_from(outcome.records.len()).unwrap();
        let read = |model: &mut Model, sampler: &mut Sampler| {
            model.sleep_until(sampler.due().unwrap().at);
            let (span, mut frame) = model.read();
            frame.thermistor = ThermistorWord(dead);
            sampler.frame_read(span, Ok(frame));
            sampler.next_event()
        };
        assert_eq!(read(&mut model, &mut sampler), Some(Event::Fault(kind)));
        let next = read(&mut model, &mut sampler);
        assert!(
            matches!(next, Some(Event::Record { seq: found, reading: Reading::Frame(_), .. }) if found == seq),
            "{next:?}"
        );
    }
}

#[test]
fn a_hung_bus_has_missing_frames_and_its_late_result_is_not_a_frame() {
    let mut model = Model::new(104 * MS, 3_100_000, |n| n);
    let mut sampler = model.sampler(100 * MS);
    let mut outcome = run(&mut model, &mut sampler, 10_000 * MS, |_| ());
    model.sleep_until(sampler.due().unwrap().at);
    let (mut span, frame) = model.read();
    for turn in 0..20 {
        model.pass(500 * MS);
        if turn == 10 {
            sampler.hung(duration(model.now));
        }
        sampler.catch_up(duration(model.now));
    }
    span.after = duration(model.now);
    sampler.frame_read(span, Ok(frame));
    outcome.append(run(&mut model, &mut sampler, 30_000 * MS, |_| ()));
    assert_exact(&outcome, |n| n).unwrap();
    let missing = missing(&outcome);
    assert!((95..=98).contains(&missing.len()), "{}", missing.len());
    let of_hanging = |(_, reason): &(u64, NoData)| *reason == NoData::BusTimeout;
    assert!(missing.iter().all(of_hanging));
    assert_eq!(outcome.faults, [BUS_HUNG]);
}

#[test]
fn a_failed_pixel_is_counted_and_its_frame_recorded_unchanged() {
    let mut model = Model::new(100 * MS, 3_100_000, |n| n + 100);
    let mut sampler = model.sampler(100 * MS);
    run(&mut model, &mut sampler, 3_000 * MS, |_| ());
    model.sleep_until(sampler.due().unwrap().at);
    let (span, mut frame) = model.read();
    frame.pixels[9] = PixelWord(0);
    sampler.frame_read(span, Ok(frame));
    assert_eq!(sampler.next_event(), Some(Event::Fault(GLITCH_PIXEL)));
    let next = sampler.next_event();
    assert!(
        matches!(next, Some(Event::Record { reading: Reading::Frame(found), .. }) if found == frame),
        "{next:?}"
    );
}

#[test]
fn equal_frames_on_a_host_in_time_have_no_late_thermistor() {
    for (period, read_ns) in [(96, 3_100_000), (104, 3_100_000), (100, 12_300_000)] {
        let mut model = Model::new(period * MS, read_ns, |_| 7);
        let mut sampler = model.sampler(100 * MS);
        let outcome = run(&mut model, &mut sampler, 60_000 * MS, |_| ());
        assert!(outcome.records.len() > 550, "{}", outcome.records.len());
        assert!(
            !outcome.faults.contains(&THERMISTOR_LATE),
            "{:?}",
            outcome.faults
        );
    }
}

#[test]
fn a_bus_of_unknown_speed_is_not_read_in_vain() {
    let mut model = Model::new(104 * MS, 12_300_000, |n| n);
    let mut sampler = Sampler::new(duration(100 * MS), Duration::ZERO, None);
    let outcome = run(&mut model, &mut sampler, 120_000 * MS, |_| ());
    assert_exact(&outcome, |n| n).unwrap();
    assert_eq!(missing(&outcome), []);
    let frames = u64::try_from(outcome.records.len()).unwrap();
    let reads = outcome.reads;
    assert!(reads < frames * 5 / 4, "{reads} reads of {frames} frames");
}

mod pace;
mod starved;
