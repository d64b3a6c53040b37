//! The emulated machine: its buses with their sensors, in real time, and what went over them.

use crate::clock::{BusClock, Timebase};
use crate::error::RigError;
use crate::parts::Part;
use crate::show::World;
use crate::wires::{SensorBus, Wires};
use amg8833_emulator::script::Script;
use amg8833_emulator::trace::Transfer;
use amg8833_emulator::{BusError, Clock as _, Refusals};
use embedded_hal::i2c::{Error as _, ErrorKind, NoAcknowledgeSource};
use i2c_emulation::adapter::{EmulatedAdapter, Fault, HalAdapter, Message, TransferError};
use i2c_emulation::rack::{Rack, SharedAdapter};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::num::NonZeroU32;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How often sensors that nobody asks measure what has fallen due.
const KEEP_UP_EVERY: Duration = Duration::from_secs(1);

/// What a bus tells its messages to.
pub type Observer = Box<dyn FnMut(&Transfer<'_>) + Send>;

/// What the buses are like.
#[derive(Default)]
pub struct Wiring<'a> {
    /// `None`: transfers take no time.
    pub scl_hz: Option<NonZeroU32>,
    /// Begins with the first transfer on any bus.
    pub script: Option<Script>,
    /// Gives the bus of each number somebody who is told of every message.
    pub trace: Option<&'a dyn Fn(u32) -> Observer>,
}

/// All buses, switched on, with time standing still until [`start`](Self::start).
pub struct Machine {
    base: Arc<Timebase>,
    buses: BTreeMap<u32, Handle>,
    endings: Vec<Arc<AtomicBool>>,
}

/// What went over the buses.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Addressed by a START or a repeated one.
    pub transactions: u64,
    /// Address bytes included.
    pub bytes: u64,
    /// Bytes that nobody acknowledged.
    pub nacks: u64,
    /// What the sensors refused, by reason.
    pub refused: BTreeMap<&'static str, u64>,
    /// Faults that struck, by kind.
    pub faults: BTreeMap<&'static str, u64>,
}

impl Machine {
    /// Builds the buses and switches the sensors on, at time zero.
    ///
    /// # Errors
    /// Where a fault of the script names a bus or an address without a sensor.
    pub fn new(
        base: Arc<Timebase>,
        world: &Arc<World>,
        parts: Vec<Part>,
        wiring: &Wiring<'_>,
    ) -> Result<Self, RigError> {
        if let Some(script) = &wiring.script {
            check_targets(script, &parts)?;
        }
        let endings: Vec<_> = parts
            .iter()
            .map(|part| Arc::clone(&part.show.timeline.ended))
            .collect();
        let mut by_bus: BTreeMap<u32, Vec<Part>> = BTreeMap::new();
        for part in parts {
            by_bus.entry(part.planned.place.bus).or_default().push(part);
        }
        let lines: BTreeMap<u32, SharedLine> = by_bus
            .into_iter()
            .map(|(number, parts)| {
                let clock = BusClock::new(&base);
                let line = Line {
                    wires: HalAdapter::with_faults(wires(number, &clock, parts, wiring), fault),
                    clock,
                    endings: endings.clone(),
                };
                (number, Arc::new(Mutex::new(line)))
            })
            .collect();
        let all: Arc<[(u32, SharedLine)]> = lines
            .iter()
            .map(|(number, line)| (*number, Arc::clone(line)))
            .collect();
        let buses = lines
            .into_iter()
            .map(|(number, line)| {
                let handle = Handle {
                    number,
                    line,
                    all: Arc::clone(&all),
                    world: Arc::clone(world),
                    script: wiring.script.clone(),
                };
                (number, handle)
            })
            .collect();
        Ok(Self {
            base,
            buses,
            endings,
        })
    }

    /// The buses, for a way to reach them.
    #[must_use]
    pub fn rack(&self) -> Rack {
        let mut rack = Rack::new();
        for (number, handle) in &self.buses {
            rack.insert(*number, SharedAdapter::new(handle.clone()));
        }
        rack
    }

    /// Lets time run.
    pub fn start(&self) {
        self.base.start();
    }

    /// Whether everything that was to be shown was shown.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        all_set(&self.endings)
    }

    /// Does this while the sensors go on measuring, so that nobody who comes after an hour has to wait for that.
    pub fn keeping_up<T>(&self, serve: impl FnOnce() -> T) -> T {
        let (done, is_done) = mpsc::channel::<()>();
        std::thread::scope(|scope| {
            scope.spawn(move || {
                while is_done.recv_timeout(KEEP_UP_EVERY) == Err(RecvTimeoutError::Timeout) {
                    self.keep_up();
                }
            });
            let outcome = serve();
            drop(done);
            outcome
        })
    }

    fn keep_up(&self) {
        for handle in self.buses.values() {
            lock(&handle.line).wires.bus().advance();
        }
    }

    /// What went over the buses so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        let mut counts = Counts::default();
        for handle in self.buses.values() {
            counts.add(lock(&handle.line).wires.bus());
        }
        counts
    }
}

/// A fault of a sensor or bus that is not there would never strike, and nobody would be told.
fn check_targets(script: &Script, parts: &[Part]) -> Result<(), RigError> {
    for (number, rule) in (1..).zip(script.rules()) {
        let is_met = |part: &Part| {
            let place = &part.planned.place;
            rule.bus.is_none_or(|bus| bus == place.bus)
                && rule.address.is_none_or(|address| address == place.address)
        };
        if !parts.iter().any(is_met) {
            let places = parts.iter().map(|part| part.planned.place.to_string());
            let places = places.collect::<Vec<_>>().join(", ");
            return Err(RigError::NoTarget { number, places });
        }
    }
    Ok(())
}

/// One bus with its sensors, switched on.
fn wires(number: u32, clock: &Arc<BusClock>, parts: Vec<Part>, wiring: &Wiring<'_>) -> Wires {
    let mux = parts
        .iter()
        .find_map(|part| part.planned.place.branch)
        .map(|branch| branch.mux);
    let mut wires = Wires::new(clock, mux, wiring.scl_hz);
    for part in parts {
        let place = part.planned.place;
        let channel = place.branch.map(|branch| branch.channel);
        if let Some(bus) = wires.segment(channel) {
            bus.plug(place.address, part.show, part.options);
        }
    }
    if let Some(observer_of) = wiring.trace {
        wires.trunk().set_trace(observer_of(number));
    }
    wires
}

/// One bus in real time.
struct Line {
    wires: HalAdapter<Wires, fn(&BusError) -> Fault>,
    clock: Arc<BusClock>,
    endings: Vec<Arc<AtomicBool>>,
}

type SharedLine = Arc<Mutex<Line>>;

fn lock(line: &SharedLine) -> MutexGuard<'_, Line> {
    line.lock().unwrap_or_else(PoisonError::into_inner)
}

/// One bus as a way to it holds it. It knows the others, because what begins with the first transfer begins on all.
#[derive(Clone)]
struct Handle {
    number: u32,
    line: SharedLine,
    all: Arc<[(u32, SharedLine)]>,
    world: Arc<World>,
    script: Option<Script>,
}

impl EmulatedAdapter for Handle {
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        let (outcome, is_first) = self.transfer_here(messages);
        if is_first {
            self.script_elsewhere();
        }
        outcome
    }
}

impl Handle {
    /// The transfer, and whether it was the first on any bus.
    fn transfer_here(&self, messages: &mut [Message<'_>]) -> (Result<(), TransferError>, bool) {
        let mut line = lock(&self.line);
        line.clock.hold();
        let is_first = self.world.begin(line.clock.now());
        if is_first {
            self.script(&mut line, self.number);
        }
        let outcome = line.transfer(messages);
        line.clock.release();
        line.clock.settle();
        (outcome, is_first)
    }

    /// Lets the script begin on the other buses, with none of them locked while another is.
    fn script_elsewhere(&self) {
        for (number, line) in self.all.iter() {
            if *number != self.number {
                self.script(&mut lock(line), *number);
            }
        }
    }

    fn script(&self, line: &mut Line, number: u32) {
        if let Some(script) = &self.script {
            line.wires.bus().set_script(&script.for_bus(number));
        }
    }
}

impl Line {
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        match all_set(&self.endings) {
            true => Err(GONE),
            false => self.wires.transfer(messages),
        }
    }
}

impl Counts {
    fn add(&mut self, wires: &Wires) {
        let traffic = wires.traffic();
        self.transactions += traffic.transactions;
        self.bytes += traffic.bytes;
        self.nacks += traffic.nacks;
        for bus in wires.segments() {
            self.add_sensors(bus);
            for (kind, count) in bus.fault_counts().iter() {
                *self.faults.entry(kind.name()).or_default() += count;
            }
        }
    }

    fn add_sensors(&mut self, bus: &SensorBus) {
        use amg8833_emulator::Address;
        for device in Address::ALL
            .into_iter()
            .filter_map(|address| bus.device(address))
        {
            for (reason, count) in reasons(device.refusals()) {
                if count > 0 {
                    *self.refused.entry(reason).or_default() += count;
                }
            }
        }
    }
}

/// Why sensors ignored bytes; those that they did not acknowledge are counted on the bus.
fn reasons(refusals: Refusals) -> [(&'static str, u64); 5] {
    [
        ("asleep", refusals.asleep),
        ("read-only", refusals.read_only),
        ("reserved", refusals.reserved),
        ("without key", refusals.without_key),
        ("unknown command", refusals.unknown_commands),
    ]
}

impl fmt::Display for Counts {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "{} transactions, {} bytes, {} not acknowledged",
            self.transactions, self.bytes, self.nacks
        )?;
        write_list(formatter, "refused", &self.refused)?;
        write_list(formatter, "faults", &self.faults)
    }
}

/// `; NAME: 1 A, 2 B`, or nothing.
fn write_list(
    formatter: &mut fmt::Formatter<'_>,
    name: &str,
    counts: &BTreeMap<&'static str, u64>,
) -> fmt::Result {
    let items: Vec<String> = counts
        .iter()
        .map(|(what, count)| format!("{count} {what}"))
        .collect();
    match items.as_slice() {
        [] => Ok(()),
        items => write!(formatter, "; {name}: {}", items.join(", ")),
    }
}

/// What a transfer finds when the show is over.
const GONE: TransferError = TransferError {
    completed: 0,
    fault: Fault::Gone,
};

/// Whether there is an end and all have come to it.
fn all_set(endings: &[Arc<AtomicBool>]) -> bool {
    !endings.is_empty() && endings.iter().all(|ended| ended.load(Ordering::SeqCst))
}

/// What the adapter tells the kernel's callers of each fault of the emulated bus.
fn fault(error: &BusError) -> Fault {
    match error {
        BusError::Timeout => Fault::Timeout,
        BusError::Gone => Fault::Gone,
        other => match other.kind() {
            ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data) => Fault::NackData,
            ErrorKind::NoAcknowledge(_) => Fault::NackAddress,
            ErrorKind::ArbitrationLoss => Fault::ArbitrationLost,
            _ => Fault::Bus,
        },
    }
}
