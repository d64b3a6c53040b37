//! The active faults of one bus, and their effect on a transaction, a byte or a frame.

use crate::fault::kind::{Chance, Fault, FaultCounts, FaultKind, FaultSet, Unit, draw};
use crate::signal::{Address, BusError};
use crate::word::Words;
use core::num::NonZeroU32;
use grideye_frame::{PIXELS, PixelIndex};

/// The most faults that calls can set on one bus at a time, including its sensors.
pub const FAULTS_MAX: usize = 16;
const WORD: u16 = 0xFFF;
/// This bit separates the random streams of faults set by call from those of a script's rules.
const BY_CALL: u64 = 1 << 40;

#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    pub(crate) fault: Fault,
    pub(crate) chance: Chance,
    pub(crate) stream: u64,
    /// The sensor it is on; `None` for the whole bus.
    pub(crate) target: Option<Address>,
    pub(crate) left: Option<u32>,
}

impl Entry {
    fn kind(&self) -> FaultKind {
        self.fault.kind()
    }

    /// Whether a transaction to this address can meet it. A held line or a missing adapter affects every address.
    fn aims_at(&self, address: Option<Address>) -> bool {
        let of_the_bus = matches!(self.fault, Fault::Hang | Fault::AdapterGone);
        of_the_bus || self.target.is_none() || self.target == address
    }

    fn strikes(&self, seed: u64, place: u64) -> bool {
        self.chance.hits(draw(seed, self.stream, place))
    }

    /// As [`strikes`](Self::strikes), for a frame of the sensor at this address.
    fn spoils(&self, seed: u64, address: Address, number: u64) -> bool {
        self.kind().unit() == Unit::Frame
            && self.aims_at(Some(address))
            && self.strikes(seed, frame_place(address, number))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Condition {
    pub(crate) unpowered: bool,
    pub(crate) frozen: bool,
    pub(crate) fast_wake: bool,
    pub(crate) clock_error_ppm: Option<i32>,
}

/// What faults put into the words of the next frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spoil {
    pub(crate) pixels: [Option<u16>; PIXELS],
    pub(crate) thermistor: Option<u16>,
    pub(crate) kinds: FaultSet,
}

impl Spoil {
    pub(crate) fn apply(&self, words: &mut Words) {
        for (word, spoiled) in words.pixels.iter_mut().zip(self.pixels) {
            *word = spoiled.unwrap_or(*word) & WORD;
        }
        words.thermistor = self.thermistor.unwrap_or(words.thermistor) & WORD;
    }
}

/// The faults of one transaction after START.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Plan {
    /// Whether any fault affects the bytes.
    pub(crate) any: bool,
    pub(crate) silent: Option<FaultKind>,
    pub(crate) nack_byte: Option<u16>,
    pub(crate) short_clock: Option<(u16, u8)>,
    pub(crate) flips: bool,
    pub(crate) stuck_high: bool,
    pub(crate) all_zero: bool,
    pub(crate) torn: Option<Option<PixelIndex>>,
    /// Lasting faults of the sensor, for the trace.
    pub(crate) lasting: FaultSet,
}

#[derive(Debug, Default)]
pub(crate) struct Faults {
    pub(crate) seed: u64,
    by_call: [Option<Entry>; FAULTS_MAX],
    /// All slots from here on are empty, so without a fault none is checked.
    used: usize,
    #[cfg(feature = "alloc")]
    pub(crate) by_rule: alloc::vec::Vec<Option<Entry>>,
    pub(crate) counts: FaultCounts,
    /// Momentary faults since the last transaction, for the trace.
    pub(crate) happened: FaultSet,
    /// Transactions, data bytes and stretches set by call so far: the places in the random streams.
    transactions: u64,
    bytes: u64,
    stretches: u64,
}

impl Faults {
    /// Adds this fault or replaces the one of its kind and target. `false` if there is no room.
    pub(crate) fn set(&mut self, fault: Fault, target: Option<Address>, chance: Chance) -> bool {
        let kind = fault.kind();
        let same = |slot: &Option<Entry>| {
            slot.is_some_and(|entry| entry.kind() == kind && entry.target == target)
        };
        let mut places = self.by_call.iter();
        let free = places
            .position(same)
            .or_else(|| self.by_call.iter().position(Option::is_none));
        let Some(slot) = free.and_then(|place| self.by_call.get_mut(place)) else {
            return false;
        };
        let which = target.map_or(0, |address| u64::from(address.bits()));
        let stream = BY_CALL | u64::from(kind.bit()) << 8 | which;
        let mut entry = Entry {
            fault,
            chance,
            stream,
            target,
            left: None,
        };
        if kind.unit() == Unit::Stretch {
            self.stretches += 1;
            if !entry.strikes(self.seed, self.stretches) {
                return true;
            }
            self.counts.add(kind);
            entry.chance = Chance::ALWAYS;
        }
        *slot = Some(entry);
        self.note_used();
        true
    }

    pub(crate) fn clear(&mut self, target: Option<Address>) {
        for slot in &mut self.by_call {
            slot.take_if(|entry| entry.target == target);
        }
        self.note_used();
    }

    /// Every kind that the sensor at this address meets, its own or its bus's.
    pub(crate) fn at(&self, address: Option<Address>) -> FaultSet {
        self.aimed_at(address).map(Entry::kind).collect()
    }

    pub(crate) fn condition(&self, address: Address) -> Condition {
        let mut condition = Condition::default();
        for entry in self.aimed_at(Some(address)) {
            match entry.fault {
                Fault::Unplugged | Fault::AdapterGone => condition.unpowered = true,
                Fault::Freeze => condition.frozen = true,
                Fault::FastWake => condition.fast_wake = true,
                Fault::ClockError { ppm } => condition.clock_error_ppm = Some(ppm),
                _ => {}
            }
        }
        condition
    }

    pub(crate) fn scl_hz(&self) -> Option<NonZeroU32> {
        self.active().find_map(|entry| match entry.fault {
            Fault::SclSpeed { hz } => Some(hz),
            _ => None,
        })
    }

    /// Whether frames must be handled one by one.
    pub(crate) fn spoils_frames(&self) -> bool {
        self.active()
            .any(|entry| entry.kind().unit() == Unit::Frame)
    }

    /// The faults of this frame of the sensor at this address.
    pub(crate) fn spoil(&self, address: Address, number: u64) -> Option<Spoil> {
        let mut spoil = Spoil {
            pixels: [None; PIXELS],
            thermistor: None,
            kinds: FaultSet::EMPTY,
        };
        let spoils = |entry: &&Entry| entry.spoils(self.seed, address, number);
        for entry in self.active().filter(spoils) {
            match entry.fault {
                Fault::PixelGlitch { pixel, word } => {
                    let drawn = self.any(entry, frame_place(address, number), 6);
                    let drawn = usize::try_from(drawn).unwrap_or_default();
                    let place = pixel.map_or(drawn, PixelIndex::as_usize);
                    if let Some(pixel) = spoil.pixels.get_mut(place) {
                        *pixel = Some(word);
                    }
                }
                Fault::ThermistorFailure { word } => spoil.thermistor = Some(word),
                _ => {}
            }
            spoil.kinds.insert(entry.kind());
        }
        (!spoil.kinds.is_empty()).then_some(spoil)
    }

    /// Counts the faults of [`spoil`](Self::spoil) once the frame has come.
    pub(crate) fn settle_frame(&mut self, address: Address, number: u64) {
        let seed = self.seed;
        self.spend(|entry| entry.spoils(seed, address, number));
    }

    /// Begins a transaction; every draw in it uses the returned number.
    pub(crate) fn begin(&mut self) -> u64 {
        self.transactions += 1;
        self.transactions
    }

    /// The index in [`CONTROLLER`] of the strongest fault that blocks the controller.
    pub(crate) fn blocking(&self, address: Option<Address>, place: u64) -> Option<usize> {
        self.active().next()?;
        CONTROLLER.iter().position(|(kind, _)| {
            self.aimed_at(address)
                .any(|entry| entry.kind() == *kind && entry.strikes(self.seed, place))
        })
    }

    /// The faults of a transaction that reaches the sensor at this address.
    pub(crate) fn plan(&self, address: Address, place: u64) -> Plan {
        let mut plan = Plan::default();
        for entry in self.aimed_at(Some(address)) {
            if entry.kind().unit() == Unit::Stretch {
                plan.lasting.insert(entry.kind());
            }
            if matches!(entry.fault, Fault::Unplugged) {
                plan.silent = Some(FaultKind::Unplugged);
            } else if entry.kind() == FaultKind::BitFlip || entry.strikes(self.seed, place) {
                plan.take(entry.fault);
            }
        }
        plan
    }

    /// Ends a transaction: counts each kind that struck once, and spends one of its times.
    pub(crate) fn settle(&mut self, address: Option<Address>, place: u64, struck: FaultSet) {
        if struck.is_empty() {
            return;
        }
        let seed = self.seed;
        self.spend(|entry| {
            struck.contains(entry.kind())
                && entry.kind().unit() == Unit::Transaction
                && entry.aims_at(address)
                && entry.strikes(seed, place)
        });
    }

    pub(crate) fn pass_byte(&mut self) {
        self.bytes += 1;
    }

    /// Inverts bits of the passing byte; returns whether it did.
    pub(crate) fn flip(
        &mut self,
        byte: &mut u8,
        address: Address,
        at_register: Option<u8>,
        at_byte: u16,
    ) -> bool {
        let (seed, place) = (self.seed, self.bytes);
        let hit = |entry: &Entry| match entry.fault {
            Fault::BitFlip { register, byte, .. } => {
                register.is_none_or(|register| Some(register) == at_register)
                    && byte.is_none_or(|byte| byte == at_byte)
                    && entry.aims_at(Some(address))
                    && entry.strikes(seed, place)
            }
            _ => false,
        };
        let mut any = false;
        for entry in self.active().filter(|entry| hit(entry)) {
            if let Fault::BitFlip { bit, .. } = entry.fault {
                *byte ^=
                    1 << bit.map_or_else(|| self.any(entry, place, 3), |bit| u64::from(bit & 7));
                any = true;
            }
        }
        if any {
            self.spend(hit);
        }
        any
    }

    pub(crate) fn happen(&mut self, kind: FaultKind) {
        self.counts.add(kind);
        self.happened.insert(kind);
    }

    fn note_used(&mut self) {
        let last = self.by_call.iter().rposition(Option::is_some);
        self.used = last.map_or(0, |place| place + 1);
    }

    /// This many random bits for an open detail of a fault, independent of whether it strikes.
    fn any(&self, entry: &Entry, place: u64, bits: u32) -> u64 {
        draw(self.seed, !entry.stream, place) >> (64 - bits)
    }

    fn aimed_at(&self, address: Option<Address>) -> impl Iterator<Item = &Entry> {
        self.active().filter(move |entry| entry.aims_at(address))
    }

    fn active(&self) -> impl Iterator<Item = &Entry> {
        let slots = self.by_call.iter().take(self.used);
        #[cfg(feature = "alloc")]
        let slots = slots.chain(&self.by_rule);
        slots.flatten().filter(|entry| entry.left != Some(0))
    }

    /// Spends one time of each active fault that hit, and counts each of their kinds once.
    fn spend(&mut self, hit: impl Fn(&Entry) -> bool) {
        let slots = self.by_call.iter_mut().take(self.used);
        #[cfg(feature = "alloc")]
        let slots = slots.chain(&mut self.by_rule);
        let mut kinds = FaultSet::EMPTY;
        let active = slots.flatten().filter(|entry| entry.left != Some(0));
        for entry in active.filter(|entry| hit(entry)) {
            entry.left = entry.left.map(|left| left - 1);
            kinds.insert(entry.kind());
        }
        for kind in kinds.iter() {
            self.counts.add(kind);
        }
    }
}

impl Plan {
    fn take(&mut self, fault: Fault) {
        match fault {
            Fault::NackByte(byte) => {
                self.nack_byte = Some(self.nack_byte.map_or(byte, |first| first.min(byte)));
            }
            Fault::ShortClock { byte, bit } => {
                let first = self.short_clock.filter(|(earlier, _)| *earlier <= byte);
                self.short_clock = first.or(Some((byte, bit & 7)));
            }
            Fault::BitFlip { .. } => self.flips = true,
            Fault::StuckHigh => self.stuck_high = true,
            Fault::AllZero => self.all_zero = true,
            Fault::Torn { pixel } => self.torn = Some(pixel),
            Fault::NackAddress => {
                self.silent.get_or_insert(FaultKind::NackAddress);
                return;
            }
            _ => return,
        }
        self.any = true;
    }
}

/// The faults that block the controller, strongest first, with the error it reports.
pub(crate) const CONTROLLER: [(FaultKind, BusError); 5] = [
    (FaultKind::AdapterGone, BusError::Gone),
    (FaultKind::Hang, BusError::Timeout),
    (FaultKind::Timeout, BusError::Timeout),
    (FaultKind::ArbitrationLoss, BusError::ArbitrationLoss),
    (FaultKind::BusError, BusError::Bus),
];

fn frame_place(address: Address, number: u64) -> u64 {
    number | u64::from(address.bits()) << 56
}
