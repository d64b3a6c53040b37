//! Which faults are active on one bus, and what they do to one transaction, one byte, one frame.

use crate::fault::kind::{Chance, Fault, FaultCounts, FaultKind, FaultSet, Unit, draw};
use crate::signal::{Address, BusError};
use crate::word::Words;
use core::num::NonZeroU32;
use grideye_frame::{PIXELS, PixelIndex};

/// The most faults that can be set by call on one bus at a time, its sensors' included.
pub const FAULTS_MAX: usize = 16;
/// The bits of a register word that exist.
const WORD: u16 = 0xFFF;
/// Streams of draws: those of the faults set by call are told from those of a script's rules by this bit.
const BY_CALL: u64 = 1 << 40;

/// One active fault.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    pub(crate) fault: Fault,
    pub(crate) chance: Chance,
    /// Which stream of draws is its own.
    pub(crate) stream: u64,
    /// The sensor that has it; `None` for the whole bus.
    pub(crate) target: Option<Address>,
    /// How often it may strike yet.
    pub(crate) left: Option<u32>,
}

impl Entry {
    fn kind(&self) -> FaultKind {
        self.fault.kind()
    }

    /// Whether a transaction to this address can meet it. A held line or a missing adapter is everybody's, whoever
    /// brings it.
    fn aims_at(&self, address: Option<Address>) -> bool {
        let of_the_bus = matches!(self.fault, Fault::Hang | Fault::AdapterGone);
        of_the_bus || self.target.is_none() || self.target == address
    }

    fn strikes(&self, seed: u64, place: u64) -> bool {
        self.chance.hits(draw(seed, self.stream, place))
    }

    fn spend(&mut self) {
        if let Some(left) = &mut self.left {
            *left = left.saturating_sub(1);
        }
    }
}

/// What is lasting about a sensor's faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Condition {
    pub(crate) powered: bool,
    pub(crate) frozen: bool,
    pub(crate) fast_wake: bool,
    pub(crate) clock_error_ppm: Option<i32>,
}

impl Condition {
    pub(crate) const SOUND: Self = Self {
        powered: true,
        frozen: false,
        fast_wake: false,
        clock_error_ppm: None,
    };
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
        for (word, spoilt) in words.pixels.iter_mut().zip(self.pixels) {
            *word = spoilt.unwrap_or(*word) & WORD;
        }
        words.thermistor = self.thermistor.unwrap_or(words.thermistor) & WORD;
    }
}

/// What the faults of one transaction do behind START.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Plan {
    /// Whether there is anything at all.
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

#[derive(Debug)]
pub(crate) struct Faults {
    pub(crate) seed: u64,
    by_call: [Option<Entry>; FAULTS_MAX],
    /// All slots from here on are empty: without a fault, none is looked at.
    used: usize,
    /// A place for each rule of the script.
    #[cfg(feature = "alloc")]
    pub(crate) by_rule: alloc::vec::Vec<Option<Entry>>,
    pub(crate) counts: FaultCounts,
    /// What happened in a moment since the last transaction, for the trace.
    pub(crate) happened: FaultSet,
    /// Transactions so far, by which faults are drawn.
    transactions: u64,
    /// Bytes of data so far, by which flips are drawn.
    bytes: u64,
    /// Stretches set by call so far.
    stretches: u64,
}

impl Faults {
    pub(crate) const fn new() -> Self {
        Self {
            seed: 0,
            by_call: [None; FAULTS_MAX],
            used: 0,
            #[cfg(feature = "alloc")]
            by_rule: alloc::vec::Vec::new(),
            counts: FaultCounts([0; FaultKind::COUNT]),
            happened: FaultSet::EMPTY,
            transactions: 0,
            bytes: 0,
            stretches: 0,
        }
    }

    /// Adds this fault, or replaces the one of its kind and target. `false` when there is no room.
    pub(crate) fn set(&mut self, fault: Fault, target: Option<Address>, chance: Chance) -> bool {
        let kind = fault.kind();
        let same = |slot: &Option<Entry>| {
            slot.is_some_and(|entry| entry.kind() == kind && entry.target == target)
        };
        let free = self
            .by_call
            .iter()
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

    /// Removes what was set by call on this target.
    pub(crate) fn clear(&mut self, target: Option<Address>) {
        for slot in &mut self.by_call {
            if slot.is_some_and(|entry| entry.target == target) {
                *slot = None;
            }
        }
        self.note_used();
    }

    /// Every kind that the sensor at this address meets, itself or with its bus.
    pub(crate) fn at(&self, address: Option<Address>) -> FaultSet {
        self.aimed_at(address)
            .map(|(_, entry)| entry.kind())
            .collect()
    }

    pub(crate) fn condition(&self, address: Address) -> Condition {
        let mut condition = Condition::SOUND;
        for (_, entry) in self.aimed_at(Some(address)) {
            match entry.fault {
                Fault::Unplugged | Fault::AdapterGone => condition.powered = false,
                Fault::Freeze => condition.frozen = true,
                Fault::FastWake => condition.fast_wake = true,
                Fault::ClockError { ppm } => condition.clock_error_ppm = Some(ppm),
                _ => {}
            }
        }
        condition
    }

    /// The SCL frequency that a fault imposes.
    pub(crate) fn scl_hz(&self) -> Option<NonZeroU32> {
        self.active().find_map(|(_, entry)| match entry.fault {
            Fault::SclSpeed { hz } => Some(hz),
            _ => None,
        })
    }

    /// Whether frames have to be gone through one by one.
    pub(crate) fn spoils_frames(&self) -> bool {
        self.active()
            .any(|(_, entry)| entry.kind().unit() == Unit::Frame)
    }

    /// What the frame of this number of the sensor at this address gets.
    pub(crate) fn spoil(&self, address: Address, number: u64) -> Option<Spoil> {
        let mut spoil = Spoil {
            pixels: [None; PIXELS],
            thermistor: None,
            kinds: FaultSet::EMPTY,
        };
        for (_, entry) in self.spoiling(address, number) {
            match entry.fault {
                Fault::PixelGlitch { pixel, word } => {
                    let drawn = self.any_pixel(entry, address, number);
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

    /// Counts what [`spoil`](Self::spoil) said of a frame that has come.
    pub(crate) fn settle_frame(&mut self, address: Address, number: u64) {
        let hit = self.marked(|faults, entry| {
            entry.kind().unit() == Unit::Frame
                && entry.aims_at(Some(address))
                && entry.strikes(faults.seed, frame_place(address, number))
        });
        self.spend(&hit);
    }

    /// One more transaction; its number is what everything in it is drawn by.
    pub(crate) fn begin(&mut self) -> u64 {
        self.transactions += 1;
        self.transactions
    }

    /// What keeps the controller from reaching anybody: the first of these kinds.
    pub(crate) fn blocking(&self, address: Option<Address>, place: u64) -> Option<FaultKind> {
        self.active().next()?;
        CONTROLLER.into_iter().map(|(kind, _)| kind).find(|kind| {
            self.aimed_at(address)
                .any(|(_, entry)| entry.kind() == *kind && self.drawn(entry, place))
        })
    }

    /// What happens to a transaction that reaches the sensor at this address.
    pub(crate) fn plan(&self, address: Address, place: u64) -> Plan {
        let mut plan = Plan::default();
        for (_, entry) in self.aimed_at(Some(address)) {
            if entry.kind().unit() == Unit::Stretch {
                plan.lasting.insert(entry.kind());
            }
            if matches!(entry.fault, Fault::Unplugged) {
                plan.silent = Some(FaultKind::Unplugged);
            } else if entry.kind() == FaultKind::BitFlip || self.drawn(entry, place) {
                plan.take(entry.fault);
            }
        }
        plan.any = plan.acts();
        plan
    }

    /// The transaction is over, and these kinds struck: each is counted once, and spends one of its times.
    pub(crate) fn settle(&mut self, address: Option<Address>, place: u64, struck: FaultSet) {
        if struck.is_empty() {
            return;
        }
        let hit = self.marked(|faults, entry| {
            struck.contains(entry.kind())
                && entry.kind().unit() == Unit::Transaction
                && entry.aims_at(address)
                && faults.drawn(entry, place)
        });
        self.spend(&hit);
    }

    /// One more byte of data.
    pub(crate) fn pass_byte(&mut self) {
        self.bytes += 1;
    }

    /// Turns over the bits of the byte that passes; says whether any was.
    pub(crate) fn flip(
        &mut self,
        byte: &mut u8,
        address: Address,
        at_register: Option<u8>,
        at_byte: u16,
    ) -> bool {
        let place = self.bytes;
        let hit = self.marked(|faults, entry| match entry.fault {
            Fault::BitFlip { register, byte, .. } => {
                register.is_none_or(|register| Some(register) == at_register)
                    && byte.is_none_or(|byte| byte == at_byte)
                    && entry.aims_at(Some(address))
                    && entry.strikes(faults.seed, place)
            }
            _ => false,
        });
        let mut any = false;
        for (_, entry) in self.active().filter(|(slot, _)| hit.contains(*slot)) {
            if let Fault::BitFlip { bit, .. } = entry.fault {
                *byte ^= 1 << bit.map_or_else(|| self.any_bit(entry, place), |bit| bit & 7);
                any = true;
            }
        }
        if any {
            self.spend(&hit);
        }
        any
    }

    /// A moment's fault happened.
    pub(crate) fn happen(&mut self, kind: FaultKind) {
        self.counts.add(kind);
        self.happened.insert(kind);
    }

    fn note_used(&mut self) {
        let last = self.by_call.iter().rposition(Option::is_some);
        self.used = last.map_or(0, |place| place + 1);
    }

    fn drawn(&self, entry: &Entry, place: u64) -> bool {
        entry.strikes(self.seed, place)
    }

    fn spoiling(&self, address: Address, number: u64) -> impl Iterator<Item = (usize, &Entry)> {
        self.aimed_at(Some(address)).filter(move |(_, entry)| {
            entry.kind().unit() == Unit::Frame
                && entry.strikes(self.seed, frame_place(address, number))
        })
    }

    fn any_pixel(&self, entry: &Entry, address: Address, number: u64) -> usize {
        let drawn = draw(self.seed, !entry.stream, frame_place(address, number));
        usize::try_from(drawn >> 58).unwrap_or_default()
    }

    fn any_bit(&self, entry: &Entry, place: u64) -> u8 {
        let drawn = draw(self.seed, !entry.stream, place);
        u8::try_from(drawn >> 61).unwrap_or_default()
    }

    fn aimed_at(&self, address: Option<Address>) -> impl Iterator<Item = (usize, &Entry)> {
        self.active()
            .filter(move |(_, entry)| entry.aims_at(address))
    }

    /// The active faults and their slots: those by call first.
    fn active(&self) -> impl Iterator<Item = (usize, &Entry)> {
        let slots = self.by_call.iter().take(self.used);
        #[cfg(feature = "alloc")]
        let slots = slots.chain(&self.by_rule);
        slots.enumerate().filter_map(|(slot, entry)| {
            let entry = entry.as_ref()?;
            (entry.left != Some(0)).then_some((slot, entry))
        })
    }

    fn marked(&self, hit: impl Fn(&Self, &Entry) -> bool) -> Slots {
        let mut slots = Slots::default();
        for (slot, entry) in self.active() {
            if hit(self, entry) {
                slots.insert(slot);
            }
        }
        slots
    }

    /// Takes one time from each of these, and counts each of their kinds once.
    fn spend(&mut self, hit: &Slots) {
        let slots = self.by_call.iter_mut().take(self.used);
        #[cfg(feature = "alloc")]
        let slots = slots.chain(&mut self.by_rule);
        let mut kinds = FaultSet::EMPTY;
        for (slot, entry) in slots.enumerate() {
            if let Some(entry) = entry.as_mut().filter(|_| hit.contains(slot)) {
                entry.spend();
                kinds.insert(entry.kind());
            }
        }
        for kind in kinds.iter() {
            self.counts.add(kind);
        }
    }
}

impl Plan {
    fn take(&mut self, fault: Fault) {
        match fault {
            Fault::NackAddress => {
                self.silent.get_or_insert(FaultKind::NackAddress);
            }
            Fault::NackByte(byte) => {
                self.nack_byte = Some(self.nack_byte.map_or(byte, |first| first.min(byte)));
            }
            Fault::ShortClock { byte, bit } => {
                let pulse = (byte, bit & 7);
                let first = self.short_clock.filter(|(earlier, _)| *earlier <= byte);
                self.short_clock = first.or(Some(pulse));
            }
            Fault::BitFlip { .. } => self.flips = true,
            Fault::StuckHigh => self.stuck_high = true,
            Fault::AllZero => self.all_zero = true,
            Fault::Torn { pixel } => self.torn = Some(pixel),
            _ => {}
        }
    }

    fn acts(&self) -> bool {
        self.nack_byte.is_some()
            || self.short_clock.is_some()
            || self.flips
            || self.stuck_high
            || self.all_zero
            || self.torn.is_some()
    }
}

/// What keeps the controller from reaching anybody, the strongest first, and what it then reports.
const CONTROLLER: [(FaultKind, BusError); 5] = [
    (FaultKind::AdapterGone, BusError::Gone),
    (FaultKind::Hang, BusError::Timeout),
    (FaultKind::Timeout, BusError::Timeout),
    (FaultKind::ArbitrationLoss, BusError::ArbitrationLoss),
    (FaultKind::BusError, BusError::Bus),
];

/// What the controller reports of a fault that [`Faults::blocking`] found.
pub(crate) fn controller_error(kind: FaultKind) -> BusError {
    let found = CONTROLLER.into_iter().find(|(listed, _)| *listed == kind);
    found.map_or(BusError::Bus, |(_, error)| error)
}

/// Of two of these, the one that hides the other.
pub(crate) fn stronger(one: Option<FaultKind>, other: Option<FaultKind>) -> Option<FaultKind> {
    let listed = CONTROLLER.into_iter().map(|(kind, _)| kind);
    listed
        .into_iter()
        .find(|kind| Some(*kind) == one || Some(*kind) == other)
}

fn frame_place(address: Address, number: u64) -> u64 {
    number | u64::from(address.bits()) << 56
}

/// A set of slots; there are no more of them than [`FAULTS_MAX`] and the rules of a script.
#[derive(Debug, Default)]
struct Slots(u128);

impl Slots {
    fn insert(&mut self, slot: usize) {
        self.0 |= bit(slot);
    }

    fn contains(&self, slot: usize) -> bool {
        self.0 & bit(slot) != 0
    }
}

fn bit(slot: usize) -> u128 {
    let slot = u32::try_from(slot).unwrap_or(u32::MAX);
    1_u128.checked_shl(slot).unwrap_or_default()
}
