//! The spool against a model, with crashes among the actions.

use super::*;

#[derive(Debug, Clone)]
enum Action {
    Write { sensor: usize, records: u64 },
    Deliver { records_max: usize },
    Tidy { keeps_writing: bool },
    Fail(Option<usize>),
    LosePower { tear: usize, keeps_names: bool },
    Kill,
}

const TEARS: [Tear; 5] = [
    Tear::Lost,
    Tear::Kept,
    Tear::Cut(40),
    Tear::Zeros(70),
    Tear::Cut(99),
];
const FAILURES: [Failure; 4] = [Failure::Full, Failure::ReadOnly, Failure::Sync, Failure::Io];

fn action() -> impl Strategy<Value = Action> {
    prop_oneof![
        8 => (0..2_usize, 1..25_u64).prop_map(|(sensor, records)| Action::Write { sensor, records }),
        6 => (1..30_usize).prop_map(|records_max| Action::Deliver { records_max }),
        4 => any::<bool>().prop_map(|keeps_writing| Action::Tidy { keeps_writing }),
        1 => prop::option::of(0..FAILURES.len()).prop_map(Action::Fail),
        2 => (0..TEARS.len(), any::<bool>()).prop_map(|(tear, keeps_names)| Action::LosePower { tear, keeps_names }),
        2 => Just(Action::Kill),
    ]
}

/// The model of one boot and sensor: the numbers that must come out, and those that may.
#[derive(Debug, Default)]
struct Model {
    next: u64,
    durable: BTreeSet<u64>,
    written: BTreeSet<u64>,
    delivered: BTreeMap<u64, u32>,
    order: Vec<u64>,
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]
    #[test]
    fn nothing_durable_is_lost_nothing_is_invented_and_the_order_stays(
        actions in prop::collection::vec(action(), 1..60),
    ) {
        let disk = ModelDisk::default();
        let mut runs = 1;
        let mut boot = "b1".to_owned();
        let mut spool = reopen(&disk, &boot);
        let mut models: BTreeMap<(String, usize), Model> = BTreeMap::new();
        let mut is_failing = false;
        for action in actions {
            match action {
                Action::Write { sensor, records } => {
                    let model = models.entry((boot.clone(), sensor)).or_default();
                    // Records left in memory by a failed write are written again.
                    let from = model.durable.last().map_or(0, |last| last + 1);
                    let to = from + records;
                    model.written.extend(from..to);
                    model.next = to;
                    model.durable.extend(spool_group(&mut spool, &boot, sensor, from..to));
                }
                Action::Deliver { records_max } => {
                    if let Ok(Some(batch)) = next_batch(&mut spool, records_max) {
                        for item in &batch.items {
                            let (boot, sensor, seq) = checked(item);
                            let sensor = SENSORS.iter().position(|name| *name == sensor).unwrap();
                            let model = models.get_mut(&(boot, sensor)).unwrap();
                            prop_assert!(model.written.contains(&seq));
                            *model.delivered.entry(seq).or_default() += 1;
                            model.order.push(seq);
                        }
                        let (_, returned) = spool.release(batch.items, None);
                        prop_assert!(returned.is_empty());
                    }
                }
                Action::Tidy { keeps_writing } => {
                    let _ = spool.tidy(keeps_writing);
                }
                Action::Fail(failure) => {
                    // Reads that fail drop segments; another test covers that.
                    let failure = failure.map(|index| FAILURES[index]).filter(|failure| *failure != Failure::Io);
                    is_failing = failure.is_some();
                    disk.fail(failure);
                }
                Action::LosePower { tear, keeps_names } => {
                    drop(spool);
                    disk.power_cycle(TEARS[tear], keeps_names);
                    is_failing = false;
                    runs += 1;
                    boot = format!("b{runs}");
                    spool = reopen(&disk, &boot);
                }
                Action::Kill => {
                    drop(spool);
                    runs += 1;
                    boot = format!("b{runs}");
                    spool = reopen(&disk, &boot);
                }
            }
            prop_assert!(spool.bytes() <= limits().bytes_max);
        }
        if is_failing {
            disk.fail(None);
        }
        for (boot, sensor, seq) in drain(&mut spool, 9) {
            let sensor = SENSORS.iter().position(|name| *name == sensor).unwrap();
            let model = models.get_mut(&(boot, sensor)).unwrap();
            *model.delivered.entry(seq).or_default() += 1;
            model.order.push(seq);
        }
        for (stream, model) in &models {
            for seq in &model.durable {
                prop_assert!(model.delivered.contains_key(seq), "{:?}: {} is lost", stream, seq);
            }
            // A start may resend from some point on, but then everything in order.
            let back = model.order.windows(2).filter(|pair| pair[1] <= pair[0]).count();
            prop_assert!(back < runs, "{:?}: {:?}", stream, model.order);
        }
        prop_assert_eq!(spool.waiting_frames(), (0, 0));
        prop_assert!(FRAME_BYTES > 128);
    }
}
