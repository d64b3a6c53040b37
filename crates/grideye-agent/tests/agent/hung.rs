//! A transfer that never returns: only its own bus's frames are missing, with a reason.

use crate::patience::wait_for;
use crate::support::*;
use amg8833::Address as Target;
use amg8833_emulator::{Address, Bus, BusError, Options};
use embedded_hal::i2c::{ErrorType, I2c, Operation};
use grideye_agent::agent::{Agent, AgentHandle, AnyBus, Start};
use grideye_agent::bus::{OpenBus, OpenError};
use grideye_agent::clock::{Clock, SystemClock};
use grideye_agent::config::{BusConfig, SensorConfig};
use grideye_agent::log::{Level, Log};
use grideye_agent::sampler::{BUS_HUNG, COUNT_ESTIMATED};
use grideye_frame::NoData;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// The machine's time, so that a hung bus cannot stop the clock of the others.
struct Real(SystemClock);

impl amg8833_emulator::Clock for Real {
    fn now(&self) -> Duration {
        self.0.boot()
    }
}

/// An emulated bus with one transaction that waits until the test releases it.
struct Gated {
    bus: Bus<Real, Counter>,
    transactions: u32,
    hangs_at: Option<u32>,
    gate: Receiver<()>,
}

impl ErrorType for Gated {
    type Error = BusError;
}

impl I2c for Gated {
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        self.transactions += 1;
        if self.hangs_at == Some(self.transactions) {
            let _ = self.gate.recv();
        }
        self.bus.transaction(address, operations)
    }
}

struct Opener(Option<Gated>);

impl OpenBus for Opener {
    type Bus = Gated;

    fn open(&mut self) -> Result<Gated, OpenError> {
        self.0.take().ok_or(OpenError::NoSuchBus("gone".to_owned()))
    }
}

/// Buses 1 and 3 with a sensor each; on bus 3, this transaction hangs until the sender is dropped.
struct Rig {
    agent: AgentHandle,
    release: Sender<()>,
    lines: Arc<Mutex<Vec<(Level, String)>>>,
}

fn rig(collector: &Collector, hangs_at: u32) -> Rig {
    let (release, gate) = channel();
    let (_, never) = channel();
    let bus = |path: &str, ppm, hangs_at, gate| {
        let config = BusConfig {
            path: path.into(),
            sensors: vec![SensorConfig::at(Target::High)],
        };
        let options = Options {
            clock_error_ppm: ppm,
            ..Options::default()
        };
        let mut bus = Bus::new(Real(SystemClock::default()));
        bus.plug(Address::High, Counter::at_10_hz(), options);
        let gated = Gated {
            bus,
            transactions: 0,
            hangs_at,
            gate,
        };
        (config, AnyBus::new(Opener(Some(gated))))
    };
    let buses = vec![
        bus("/dev/i2c-3", -43_000, Some(hangs_at), gate),
        bus("/dev/i2c-1", 20_000, None, never),
    ];
    let lines = Arc::new(Mutex::new(Vec::new()));
    let sink = Arc::clone(&lines);
    let log = Log::new(move |level, line| sink.lock().unwrap().push((level, line.to_owned())));
    let start = Start {
        hung_after: Duration::from_millis(300),
        ..Start::new(config(&collector.url), "host")
    };
    let agent = Agent::start(start, buses, Arc::new(SystemClock::default()), log).unwrap();
    Rig {
        agent,
        release,
        lines,
    }
}

const HANGS: &str = "i2c-3:0x69";

fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    wait_for(what, || is_so().then_some(()));
}

fn frames(collector: &Collector, sensor: &str) -> usize {
    let records = collector.records(sensor);
    records.len() - missing(&records).len()
}

#[test]
fn a_hung_bus_has_missing_frames_with_a_reason_and_the_count_goes_on() {
    let collector = Collector::storing();
    // The set-up and about 30 frames come first.
    let rig = rig(&collector, 120);
    wait_until("rows of the bus that hangs", || {
        missing(&collector.records(HANGS)).len() >= 30
    });
    let read_before = frames(&collector, SENSOR);
    wait_until("frames of the other bus", || {
        frames(&collector, SENSOR) > read_before + 20
    });
    drop(rig.release);
    let read_before = frames(&collector, HANGS);
    wait_until("frames behind the hang", || {
        frames(&collector, HANGS) > read_before + 50
    });
    let summary = rig.agent.stop(Duration::from_secs(10));
    assert_eq!(summary.hung_buses, [""; 0]);

    // A busy machine costs frames too, but with another reason.
    for (sensor, reason) in [(HANGS, NoData::BusTimeout), (SENSOR, NoData::HostStalled)] {
        let errors = &summary.sensors[sensor].account.errors;
        let records = collector.records(sensor);
        if !errors.contains_key(COUNT_ESTIMATED) {
            assert_exact_by(&records, |n| n, number_in_pixels);
        }
        let possible = [reason, NoData::HostStalled];
        let missing = missing(&records);
        assert!(
            missing.iter().all(|(_, why)| possible.contains(why)),
            "{missing:?}"
        );
        let hangs = u64::from(sensor == HANGS);
        assert_eq!(
            errors.get(BUS_HUNG).copied().unwrap_or(0),
            hangs,
            "{errors:?}"
        );
    }
    let lines = rig.lines.lock().unwrap();
    let said = |level, words: &str| {
        let hits = lines
            .iter()
            .filter(|(of, line)| *of == level && line.starts_with(words));
        hits.count()
    };
    assert_eq!(said(Level::Error, "/dev/i2c-3: transfer has been stuck"), 1);
    assert_eq!(said(Level::Error, "/dev/i2c-1"), 0, "{lines:?}");
}

#[test]
fn a_bus_that_never_returns_is_abandoned_with_its_account() {
    let collector = Collector::storing();
    let rig = rig(&collector, 3);
    wait_until("the watchdog", || {
        let accounts = rig.agent.accounts();
        accounts[HANGS].errors.contains_key(BUS_HUNG)
    });
    wait_until("the count at the collector", || {
        let store = collector.store.lock().unwrap();
        let accounts = store
            .batches
            .iter()
            .flat_map(|batch| &batch.sensors)
            .filter_map(|sensor| sensor.account.as_ref());
        accounts
            .into_iter()
            .any(|account| account.errors.contains_key(BUS_HUNG))
    });
    let summary = rig.agent.stop(Duration::from_secs(5));
    assert_eq!(summary.hung_buses, ["/dev/i2c-3"]);
    drop(rig.release);
}
