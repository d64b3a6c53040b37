//! A host that may be kept from running at any moment for any time: before a read, between its two transfers, and after
//! it. The model knows the true number of every frame.

use super::*;

/// How long the host stalls: mostly not at all, often for part of a period, sometimes for many.
fn pauses() -> impl Strategy<Value = Ns> {
    prop_oneof![
        6 => Just(0),
        4 => 0..5 * MS,
        3 => 0..60 * MS,
        2 => 0..250 * MS,
        1 => 0..2_500 * MS,
    ]
}

/// A sensor, and a host that is starved from time to time.
#[derive(Debug)]
struct Starved {
    error_ppm: i64,
    drift_ppm_per_s: i64,
    read_us: i64,
    knows_the_bus: bool,
    wakes_late: Vec<Ns>,
    held_up: Vec<[Ns; 3]>,
}

fn starved() -> impl Strategy<Value = Starved> {
    let held_up = [pauses(), pauses(), pauses()];
    (
        -60_000_i64..=60_000,
        -20_i64..=20,
        prop::sample::select(vec![100_i64, 3_100, 12_300]),
        any::<bool>(),
        prop::collection::vec(pauses(), 1..80),
        prop::collection::vec(held_up, 1..80),
    )
        .prop_map(
            |(error_ppm, drift_ppm_per_s, read_us, knows_the_bus, wakes_late, held_up)| Starved {
                error_ppm,
                drift_ppm_per_s,
                read_us,
                knows_the_bus,
                wakes_late,
                held_up,
            },
        )
}

impl Starved {
    fn model(&self) -> Model {
        let mut model = Model::new(100 * MS + self.error_ppm * 100, self.read_us * 1000, |n| n);
        model.drift_ppm_per_s = self.drift_ppm_per_s;
        model.delays.clone_from(&self.wakes_late);
        model.held_up.clone_from(&self.held_up);
        model
    }

    fn sampler(&self) -> Sampler {
        let known = if self.knows_the_bus { self.read_us } else { 0 };
        let mut sampler = Sampler::new(duration(100 * MS), Duration::ZERO, None);
        sampler.set_transfer_min(duration(known * 1000));
        sampler
    }
}

/// Checks that the offset between each frame's number and its true number changes only when the sampler reports it,
/// that no frame is repeated or out of order, and that a thermistor of another frame is counted. Returns how often the
/// sampler reported an estimate.
fn assert_true_numbers(outcome: &Outcome) -> Result<usize, TestCaseError> {
    let mut distance = None;
    let mut last = None;
    let (mut expected, mut estimates, mut strange, mut counted) = (0, 0, 0, 0);
    for event in &outcome.events {
        match event {
            Event::Fault(COUNT_ESTIMATED) => {
                estimates += 1;
                distance = None;
            }
            Event::Fault(kind) => {
                prop_assert_eq!(*kind, THERMISTOR_LATE, "no other fault");
                counted += 1;
            }
            Event::Record { seq, reading, .. } => {
                prop_assert_eq!(*seq, expected, "no gap and no repetition");
                expected += 1;
                let Reading::Frame(frame) = reading else {
                    prop_assert_eq!(*reading, Reading::NoData(NoData::HostStalled));
                    continue;
                };
                let number = number(frame);
                prop_assert!(last < Some(number), "frame {} behind {:?}", number, last);
                last = Some(number);
                strange += usize::from(frame.thermistor != thermistor(1 + number));
                let of_this = i128::from(*seq) - i128::from(number);
                prop_assert_eq!(*distance.get_or_insert(of_this), of_this, "frame {}", seq);
            }
        }
    }
    // The last frame's is counted with the next.
    prop_assert!(
        strange <= counted + 1,
        "{} of {} thermistors",
        counted,
        strange
    );
    Ok(estimates)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    /// For any schedule, from the first read on.
    #[test]
    fn no_frame_has_a_wrong_number_however_the_host_is_starved(starved in starved()) {
        let mut model = starved.model();
        let outcome = run(&mut model, &mut starved.sampler(), 120_000 * MS, |_| ());
        assert_true_numbers(&outcome)?;
        prop_assert!(!outcome.records.is_empty());
    }

    /// Once the sensor's clock is known, a starvation of a few seconds requires no estimate.
    #[test]
    fn the_count_stays_proven_through_three_seconds_of_starvation(starved in starved()) {
        let mut model = starved.model();
        (model.delays, model.held_up) = (vec![0], vec![[0; 3]]);
        let mut sampler = starved.sampler();
        let mut outcome = run(&mut model, &mut sampler, 30_000 * MS, |_| ());
        for _ in 0..5 {
            let now = model.now;
            (model.delays, model.held_up) = (starved.wakes_late.clone(), starved.held_up.clone());
            outcome.append(run(&mut model, &mut sampler, now + 1_500 * MS, |_| ()));
            (model.delays, model.held_up) = (vec![0], vec![[0; 3]]);
            let now = model.now;
            outcome.append(run(&mut model, &mut sampler, now + 10_000 * MS, |_| ()));
        }
        prop_assert_eq!(assert_true_numbers(&outcome)?, 0);
    }
}
