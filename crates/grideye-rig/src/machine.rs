//! The emulated machine: its buses with their wires and sensors, in real time, and counts of the traffic.

use crate::clock::{BusClock, Timebase};
use crate::error::RigError;
use crate::parts::Part;
use crate::place::{Branch, Place};
use crate::show::{Show, World};
use amg8833_emulator::script::{Rule, Script};
use amg8833_emulator::trace::Transfer;
use amg8833_emulator::{
    Address, Bus, BusError, CHANNELS, Clock as _, InterruptPin, Mux, Refusals, SCL_HZ,
};
use embedded_hal::i2c::{ErrorType, I2c, NoAcknowledgeSource, Operation};
use i2c_emulation::adapter::{Carry, EmulatedAdapter, Fault, HalAdapter, Message, TransferError};
use i2c_emulation::rack::{Awaited, Rack, SharedAdapter, Surroundings};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::num::NonZeroU32;
use std::ops::RangeInclusive;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A program meets a sensor that has been on for two frames: one that was switched on this instant reads zero.
pub const ON_BEFORE: Duration = Duration::from_millis(250);

/// How often a wait for an INT pin looks at it.
const LOOK_EVERY: Duration = Duration::from_millis(1);

/// How often idle sensors take their due measurements.
const KEEP_UP_EVERY: Duration = Duration::from_secs(1);

/// The bus clocks that adapters have; the sensor is specified for up to 400,000 Hz (AMG88 spec §4-6-2).
pub const SCL_HZ_RANGE: RangeInclusive<u32> = 1_000..=1_000_000;

/// Receives every message on a bus.
pub type Observer = Box<dyn FnMut(&Transfer<'_>) + Send>;

/// Properties of the buses.
pub struct Wiring<'a> {
    /// `None`: transfers take no time, as firmware in a simulator needs it, which takes the time of each byte by itself.
    pub scl_hz: Option<NonZeroU32>,
    /// Starts with the first transfer on any bus.
    pub script: Option<Script>,
    /// Creates the observer of each bus, by its number.
    pub trace: Option<&'a dyn Fn(u32) -> Observer>,
}

impl Default for Wiring<'_> {
    fn default() -> Self {
        Self {
            scl_hz: Some(SCL_HZ),
            script: None,
            trace: None,
        }
    }
}

/// All buses, powered on, with time stopped until [`start`](Self::start).
pub struct Machine {
    base: Arc<Timebase>,
    buses: Vec<Handle>,
    places: Vec<Place>,
    endings: Vec<Arc<AtomicBool>>,
}

/// Traffic on the buses.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Counted by START and repeated START.
    pub transactions: u64,
    /// Including address bytes.
    pub bytes: u64,
    /// Bytes that were not acknowledged.
    pub nacks: u64,
    /// What the sensors rejected, by reason.
    pub refused: BTreeMap<&'static str, u64>,
    /// Faults injected, by kind.
    pub faults: BTreeMap<&'static str, u64>,
}

impl Machine {
    /// Builds the buses and powers the sensors on, at time zero.
    /// # Errors
    /// If a fault of the script names a bus or address without a sensor.
    pub fn new(
        base: Arc<Timebase>,
        world: &Arc<World>,
        parts: Vec<Part>,
        wiring: &Wiring<'_>,
    ) -> Result<Self, RigError> {
        let places: Vec<Place> = parts.iter().map(|part| part.planned.place).collect();
        if let Some(script) = &wiring.script {
            check_targets(script, &places)?;
        }
        let ended = |part: &Part| Arc::clone(&part.show.timeline.ended);
        let endings: Vec<_> = parts.iter().map(ended).collect();
        let mut by_bus: BTreeMap<u32, Vec<Part>> = BTreeMap::new();
        for part in parts {
            by_bus.entry(part.planned.place.bus).or_default().push(part);
        }
        let line = |(number, parts)| {
            let clock = BusClock::new(&base);
            let line = Line {
                wires: HalAdapter::with_faults(wires(number, &clock, parts, wiring), fault),
                clock,
                endings: endings.clone(),
            };
            (number, Arc::new(Mutex::new(line)))
        };
        let lines: Arc<[(u32, SharedLine)]> = by_bus.into_iter().map(line).collect();
        let script = Arc::new(Mutex::new(wiring.script.clone()));
        let handle = |place| Handle {
            place,
            lines: Arc::clone(&lines),
            world: Arc::clone(world),
            script: Arc::clone(&script),
        };
        let buses = (0..lines.len()).map(handle).collect();
        Ok(Self {
            base,
            buses,
            places,
            endings,
        })
    }

    /// The buses, for a server or adapter.
    #[must_use]
    pub fn rack(&self) -> Rack {
        let mut rack = Rack::new();
        for handle in &self.buses {
            rack.insert(handle.here().0, SharedAdapter::new(handle.clone()));
        }
        let places = self.places.iter();
        let of = |place: &Place| {
            let on = |handle: &&Handle| handle.here().0 == place.bus;
            Some((self.buses.iter().find(on)?.clone(), *place))
        };
        rack.within(Arc::new(Outside {
            base: Arc::clone(&self.base),
            pins: places.filter_map(of).collect(),
        }))
    }

    /// Starts time.
    pub fn start(&self) {
        self.base.start();
    }

    /// The time now, since power-on.
    #[must_use]
    pub fn now(&self) -> Duration {
        self.base.now()
    }

    /// Moves time that is moved by hand, and lets the sensors take what measurements are due.
    pub fn advance(&self, by: Duration) {
        self.base.advance(by);
        self.keep_up();
    }

    /// Puts another script in place of the faults so far. It starts now, or with the first transfer if there was none.
    /// # Errors
    /// If a fault of the script names a bus or address without a sensor.
    pub fn inject(&self, script: &Script) -> Result<(), RigError> {
        check_targets(script, &self.places)?;
        for handle in &self.buses {
            *locked(&handle.script) = Some(script.clone());
            if handle.world.has_begun() {
                handle.script(&mut locked(&handle.here().1), handle.here().0);
            }
        }
        Ok(())
    }

    /// Whether everything has been shown to its end.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        all_set(&self.endings)
    }

    /// Runs `serve` while the sensors keep measuring, so that a read after an hour need not catch up first.
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
        for handle in &self.buses {
            locked(&handle.here().1).wires.bus().advance();
        }
    }

    /// The traffic so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        let mut counts = Counts::default();
        for handle in &self.buses {
            counts.add(locked(&handle.here().1).wires.bus());
        }
        counts
    }
}

/// Rejects a fault on a missing sensor or bus: it would never be injected, silently.
fn check_targets(script: &Script, places: &[Place]) -> Result<(), RigError> {
    for (number, rule) in (1..).zip(script.rules()) {
        let is_met = |place: &Place| {
            rule.bus.is_none_or(|bus| bus == place.bus)
                && rule.address.is_none_or(|address| address == place.address)
        };
        if !places.iter().any(is_met) {
            let places: Vec<String> = places.iter().map(ToString::to_string).collect();
            let places = places.join(", ");
            return Err(RigError::NoTarget(number, places));
        }
    }
    Ok(())
}

fn wires(number: u32, clock: &Arc<BusClock>, parts: Vec<Part>, wiring: &Wiring<'_>) -> Wires {
    let trunk = Bus::new(Arc::clone(clock));
    let trunk = match wiring.scl_hz {
        Some(scl_hz) => trunk.with_scl_hz(scl_hz),
        None => trunk.with_instant_transactions(),
    };
    let branch = parts.iter().find_map(|part| part.planned.place.branch);
    let mut wires = match branch {
        None => Wires::Plain(Box::new(trunk)),
        Some(Branch { mux, .. }) => {
            let channels: [_; CHANNELS] = std::array::from_fn(|_| Bus::new(Arc::clone(clock)));
            Wires::Branched(Box::new(Mux::new(trunk, mux, channels)))
        }
    };
    for part in parts {
        let place = part.planned.place;
        if let Some(bus) = wires.segment(place.branch) {
            bus.plug(place.address, part.show, part.options);
        }
    }
    if let Some(observer_of) = wiring.trace {
        wires.trunk().set_trace(observer_of(number));
    }
    wires
}

struct Line {
    wires: HalAdapter<Wires, fn(&BusError) -> Fault>,
    clock: Arc<BusClock>,
    endings: Vec<Arc<AtomicBool>>,
}

type SharedLine = Arc<Mutex<Line>>;

fn locked<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A server's handle of one bus. It knows the others, because the script starts on all with the first transfer.
#[derive(Clone)]
struct Handle {
    place: usize,
    lines: Arc<[(u32, SharedLine)]>,
    world: Arc<World>,
    script: Arc<Mutex<Option<Script>>>,
}

/// The machine's time and its sensors' INT pins, for a client of its socket.
struct Outside {
    base: Arc<Timebase>,
    pins: Vec<(Handle, Place)>,
}

impl Outside {
    /// Whether the INT pin of this sensor is high, as with the pull-up that it needs.
    fn is_high(handle: &Handle, place: Place) -> bool {
        let mut line = locked(&handle.here().1);
        let bus = line.wires.bus().segment(place.branch);
        bus.and_then(|bus| bus.interrupt_pin(place.address)) != Some(InterruptPin::Low)
    }
}

impl Surroundings for Outside {
    fn pass(&self, most: Duration, awaited: Option<Awaited>) -> Duration {
        let until = self.base.now().saturating_add(most);
        let pin = awaited.and_then(|awaited| Some((self.pins.get(awaited.pin)?, awaited.high)));
        let is_there =
            || pin.is_some_and(|((handle, place), high)| Self::is_high(handle, *place) == high);
        loop {
            let now = self.base.now();
            if now >= until || is_there() {
                return now;
            }
            let step = if pin.is_some() { LOOK_EVERY } else { most };
            self.base.wait(until.min(now.saturating_add(step)));
        }
    }

    fn pins(&self) -> Vec<bool> {
        let pins = self.pins.iter();
        pins.map(|(handle, place)| Self::is_high(handle, *place))
            .collect()
    }
}

impl EmulatedAdapter for Handle {
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        let (outcome, is_first) = self.transfer_here(messages);
        self.begin_elsewhere(is_first);
        outcome
    }

    /// Time goes on between the bytes: they come when the controller sends them.
    fn converse(
        &mut self,
        address: u16,
        reads: bool,
        talk: &mut dyn FnMut(Carry<'_>),
    ) -> Result<(), Fault> {
        let Ok(address) = u8::try_from(address) else {
            return Err(Fault::NackAddress);
        };
        let mut line = locked(&self.here().1);
        let is_first = self.begin(&mut line);
        let outcome = match all_set(&line.endings) {
            true => Err(Fault::Gone),
            false => line.wires.bus().converse(address, reads, talk),
        };
        line.clock.settle();
        drop(line);
        self.begin_elsewhere(is_first);
        outcome
    }
}

impl Handle {
    fn here(&self) -> &(u32, SharedLine) {
        &self.lines[self.place]
    }

    /// Performs the transfer; returns also whether it was the first on any bus.
    fn transfer_here(&self, messages: &mut [Message<'_>]) -> (Result<(), TransferError>, bool) {
        let mut line = locked(&self.here().1);
        line.clock.hold();
        let is_first = self.begin(&mut line);
        let outcome = if all_set(&line.endings) {
            let (completed, fault) = (0, Fault::Gone);
            Err(TransferError { completed, fault })
        } else {
            line.wires.transfer(messages)
        };
        line.clock.release();
        line.clock.settle();
        (outcome, is_first)
    }

    /// Whether this is the first transfer on any bus: it starts the world, and the script here.
    fn begin(&self, line: &mut Line) -> bool {
        let is_first = self.world.begin(line.clock.now());
        if is_first {
            self.script(line, self.here().0);
        }
        is_first
    }

    /// Starts the script on the other buses too, locking one at a time.
    fn begin_elsewhere(&self, is_first: bool) {
        for (number, line) in self.lines.iter().filter(|_| is_first) {
            if *number != self.here().0 {
                self.script(&mut locked(line), *number);
            }
        }
    }

    fn script(&self, line: &mut Line, number: u32) {
        if let Some(script) = &*locked(&self.script) {
            line.wires.bus().set_script(&script.for_bus(number));
        }
    }
}

impl Counts {
    fn add(&mut self, wires: &mut Wires) {
        let traffic = wires.trunk().traffic();
        self.transactions += traffic.transactions;
        self.bytes += traffic.bytes;
        self.nacks += traffic.nacks;
        for bus in wires.segments() {
            let sensors = Address::ALL.into_iter().filter_map(|at| bus.device(at));
            let refused = sensors.flat_map(|sensor| reasons(sensor.refusals()));
            for (reason, count) in refused.filter(|(_, count)| *count > 0) {
                *self.refused.entry(reason).or_default() += count;
            }
            for (kind, count) in bus.fault_counts().iter() {
                *self.faults.entry(kind.name()).or_default() += count;
            }
        }
    }
}

/// Why sensors ignored bytes; the bus counts those that were not acknowledged.
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
    if counts.is_empty() {
        return Ok(());
    }
    let items = counts.iter().map(|(what, count)| format!("{count} {what}"));
    let items: Vec<String> = items.collect();
    write!(formatter, "; {name}: {}", items.join(", "))
}

fn all_set(endings: &[Arc<AtomicBool>]) -> bool {
    !endings.is_empty() && endings.iter().all(|ended| ended.load(Ordering::SeqCst))
}

/// Maps each fault of the emulated bus to the adapter's fault.
fn fault(error: &BusError) -> Fault {
    match error {
        BusError::Timeout => Fault::Timeout,
        BusError::Gone => Fault::Gone,
        BusError::Bus => Fault::Bus,
        BusError::ArbitrationLoss => Fault::ArbitrationLost,
        BusError::NoAcknowledge { source, .. } => match source {
            NoAcknowledgeSource::Data => Fault::NackData,
            _ => Fault::NackAddress,
        },
    }
}

/// A bus, or one channel of a multiplexer, with up to two sensors.
type SensorBus = Bus<Arc<BusClock>, Show>;

enum Wires {
    Plain(Box<SensorBus>),
    Branched(Box<Mux<Arc<BusClock>, Show>>),
}

impl Wires {
    /// The bus before the multiplexer, or the only bus.
    fn trunk(&mut self) -> &mut SensorBus {
        match self {
            Self::Plain(bus) => bus,
            Self::Branched(mux) => mux.trunk_mut(),
        }
    }

    fn segments(&self) -> Box<dyn Iterator<Item = &SensorBus> + '_> {
        match self {
            Self::Plain(bus) => Box::new(std::iter::once(&**bus)),
            Self::Branched(mux) => Box::new(mux.buses()),
        }
    }

    /// The bus before the multiplexer, or one behind it.
    fn segment(&mut self, branch: Option<Branch>) -> Option<&mut SensorBus> {
        match (self, branch) {
            (Self::Branched(mux), Some(branch)) => mux.channel_mut(branch.channel),
            (wires, _) => Some(wires.trunk()),
        }
    }

    fn converse(
        &mut self,
        address: u8,
        reads: bool,
        talk: &mut dyn FnMut(Carry<'_>),
    ) -> Result<(), Fault> {
        let outcome = match self {
            Self::Plain(bus) => bus.converse(address, reads, talk),
            Self::Branched(mux) => mux.converse(address, reads, talk),
        };
        outcome.map_err(|error| fault(&error))
    }

    fn advance(&mut self) {
        match self {
            Self::Plain(bus) => bus.advance(),
            Self::Branched(mux) => mux.advance(),
        }
    }

    /// Starts this bus's script. Rules for the whole bus apply to the trunk; those for an address also apply to the
    /// sensors at that address behind the multiplexer, each with its own random draws.
    fn set_script(&mut self, script: &Script) {
        if let Self::Branched(mux) = self {
            let rules = script.rules().filter(|rule| rule.address.is_some());
            let rules: Vec<Rule> = rules.copied().collect();
            let seeds = script.seed().wrapping_add(1)..;
            for (seed, bus) in seeds.zip(mux.buses_mut().skip(1)) {
                // Any subset of a script's rules is a valid script.
                if let Ok(of_the_channel) = Script::new(seed, rules.clone()) {
                    bus.set_script(of_the_channel);
                }
            }
        }
        self.trunk().set_script(script.clone());
    }
}

impl ErrorType for Wires {
    type Error = BusError;
}

impl I2c for Wires {
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        match self {
            Self::Plain(bus) => bus.transaction(address, operations),
            Self::Branched(mux) => mux.transaction(address, operations),
        }
    }
}
