//! What can be broken about a sensor and its bus: the kinds of faults, their chances and their counts.

use core::fmt;
use core::num::NonZeroU32;
use core::ops::AddAssign;
use grideye_frame::PixelIndex;

/// What can be broken on command. Beyond its faults, the sensor behaves as ever.
///
/// Any number of kinds may be active together, set by call or by a script. Where they meet in one transaction, the one
/// that comes first on the wire hides what would come behind it, in the order of this list: [`AdapterGone`], [`Hang`],
/// [`Timeout`], [`ArbitrationLoss`], [`BusError`], [`Unplugged`], [`NackAddress`]; what is hidden is not counted. Behind
/// an acknowledged address all the others act together: the byte that the sensor has is cut by [`ShortClock`], then
/// changed by [`BitFlip`], and a line held low ([`AllZero`]) wins over one that is released ([`StuckHigh`]).
///
/// [`AdapterGone`]: Self::AdapterGone
/// [`Hang`]: Self::Hang
/// [`Timeout`]: Self::Timeout
/// [`ArbitrationLoss`]: Self::ArbitrationLoss
/// [`BusError`]: Self::BusError
/// [`Unplugged`]: Self::Unplugged
/// [`NackAddress`]: Self::NackAddress
/// [`ShortClock`]: Self::ShortClock
/// [`BitFlip`]: Self::BitFlip
/// [`AllZero`]: Self::AllZero
/// [`StuckHigh`]: Self::StuckHigh
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fault {
    /// The sensor does not acknowledge its address: a loose wire, or no supply of the bus side.
    NackAddress,
    /// The sensor acknowledges its address and the bytes that are written to it up to this one, which is not; 0 is the
    /// first byte of a transaction, the register address.
    NackByte(u16),
    /// The controller reports a misplaced START or STOP (EIO).
    BusError,
    /// The controller reports that another one drove the bus.
    ArbitrationLoss,
    /// The controller gives up this transaction after [`HANG_TIMEOUT`](crate::HANG_TIMEOUT); transactions to other
    /// addresses go well.
    Timeout,
    /// A line is held low for as long as the fault lasts: whatever the address, the controller gives up after
    /// [`HANG_TIMEOUT`](crate::HANG_TIMEOUT).
    Hang,
    /// One SCL pulse is too short for the sensor, which does not see it, as the clock-stretching fault of a Raspberry
    /// Pi's controller makes them. While it is read, the bits behind the pulse come one place late; the sensor then
    /// takes the released line behind the byte for the end, and the rest of the message reads 0xFF. While it is written
    /// to, it has too few bits at the ninth pulse and does not acknowledge the byte, which is lost.
    ShortClock {
        /// The byte within the transaction, read or written, behind the address; 0 is the first.
        byte: u16,
        /// The bit within the byte, 7 (first on the wire) to 0.
        bit: u8,
    },
    /// One bit of a byte arrives inverted, in either direction. What is left open is any: without a register or a byte,
    /// every byte may be hit; without a bit, the seed says which.
    BitFlip {
        /// Only bytes of this register.
        register: Option<u8>,
        /// Only this byte of a transaction, read or written, behind the address; 0 is the first.
        byte: Option<u16>,
        /// Only this bit, 7 (first on the wire) to 0.
        bit: Option<u8>,
    },
    /// SDA is stuck high behind the acknowledge: every byte reads 0xFF.
    StuckHigh,
    /// Every byte reads 0x00.
    AllZero,
    /// The supply fails for a moment: the sensor starts over with its defaults, silently. Happens once, and does not
    /// stay.
    BrownOut,
    /// The sensor is one of those that freeze when they are woken within 100 ms of being sent to sleep, as with
    /// [`Options::freezes_on_fast_wake`](crate::Options::freezes_on_fast_wake).
    FastWake,
    /// The sensor measures no more; its registers read as before. An initial reset still empties them.
    Freeze,
    /// The sensor loses what AMG88 spec §4-11-11 promises: that its registers stand still within one transaction.
    /// (Between transactions they never do, with or without a fault.)
    Torn {
        /// Without it, a frame that falls due within a transaction comes into the registers there and then;
        /// the bus needs an SCL frequency for that to happen. With it, in every transaction the pixels before this one
        /// are read from the frame before the newest.
        pixel: Option<PixelIndex>,
    },
    /// The sensor is off the bus and without power: nobody acknowledges its address. It powers on when the fault ends.
    Unplugged,
    /// The adapter is gone, for whatever address on the bus, and all its sensors are without power. They power on when
    /// the fault ends.
    AdapterGone,
    /// A pixel of a measured frame has this word. The interrupts see it too.
    PixelGlitch {
        /// The pixel; without it, another one in each frame, as the seed says.
        pixel: Option<PixelIndex>,
        /// The twelve bits of the register word: 0x000 is 0.0 °C, 0xFFF is -0.25 °C.
        word: u16,
    },
    /// The thermistor reads this word in every frame.
    ThermistorFailure {
        /// The twelve bits of the register word: 0xFFF is what the specification of 2011 gives for a failed conversion.
        word: u16,
    },
    /// The sensor's own clock runs at this error instead of
    /// [`Options::clock_error_ppm`](crate::Options::clock_error_ppm), in parts per million: 50,000 is a frame period
    /// that is short by 5 %. Its phase does not jump.
    ClockError {
        /// Parts per million, positive is fast.
        ppm: i32,
    },
    /// SCL runs at this frequency instead of the bus's own.
    SclSpeed {
        /// Hertz.
        hz: NonZeroU32,
    },
}

impl Fault {
    /// Which kind it is, without its particulars.
    #[must_use]
    pub const fn kind(self) -> FaultKind {
        match self {
            Self::NackAddress => FaultKind::NackAddress,
            Self::NackByte(_) => FaultKind::NackByte,
            Self::BusError => FaultKind::BusError,
            Self::ArbitrationLoss => FaultKind::ArbitrationLoss,
            Self::Timeout => FaultKind::Timeout,
            Self::Hang => FaultKind::Hang,
            Self::ShortClock { .. } => FaultKind::ShortClock,
            Self::BitFlip { .. } => FaultKind::BitFlip,
            Self::StuckHigh => FaultKind::StuckHigh,
            Self::AllZero => FaultKind::AllZero,
            Self::BrownOut => FaultKind::BrownOut,
            Self::FastWake => FaultKind::FastWake,
            Self::Freeze => FaultKind::Freeze,
            Self::Torn { .. } => FaultKind::Torn,
            Self::Unplugged => FaultKind::Unplugged,
            Self::AdapterGone => FaultKind::AdapterGone,
            Self::PixelGlitch { .. } => FaultKind::PixelGlitch,
            Self::ThermistorFailure { .. } => FaultKind::ThermistorFailure,
            Self::ClockError { .. } => FaultKind::ClockError,
            Self::SclSpeed { .. } => FaultKind::SclSpeed,
        }
    }
}

/// What a kind of fault is drawn and counted by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Unit {
    /// A transaction that it broke or changed.
    Transaction,
    /// A byte that it changed.
    Byte,
    /// A frame of the sensor that it spoiled.
    Frame,
    /// A stretch of time: each one that begins is drawn and counted once, however much or little is sent in it.
    Stretch,
}

/// A [`Fault`] without its particulars.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FaultKind {
    /// [`Fault::NackAddress`].
    NackAddress,
    /// [`Fault::NackByte`].
    NackByte,
    /// [`Fault::BusError`].
    BusError,
    /// [`Fault::ArbitrationLoss`].
    ArbitrationLoss,
    /// [`Fault::Timeout`].
    Timeout,
    /// [`Fault::Hang`].
    Hang,
    /// [`Fault::ShortClock`].
    ShortClock,
    /// [`Fault::BitFlip`].
    BitFlip,
    /// [`Fault::StuckHigh`].
    StuckHigh,
    /// [`Fault::AllZero`].
    AllZero,
    /// [`Fault::BrownOut`].
    BrownOut,
    /// [`Fault::FastWake`].
    FastWake,
    /// [`Fault::Freeze`].
    Freeze,
    /// [`Fault::Torn`].
    Torn,
    /// [`Fault::Unplugged`].
    Unplugged,
    /// [`Fault::AdapterGone`].
    AdapterGone,
    /// [`Fault::PixelGlitch`].
    PixelGlitch,
    /// [`Fault::ThermistorFailure`].
    ThermistorFailure,
    /// [`Fault::ClockError`].
    ClockError,
    /// [`Fault::SclSpeed`].
    SclSpeed,
}

impl FaultKind {
    /// How many kinds there are.
    pub const COUNT: usize = 20;

    /// Every kind.
    pub const ALL: [Self; Self::COUNT] = [
        Self::NackAddress,
        Self::NackByte,
        Self::BusError,
        Self::ArbitrationLoss,
        Self::Timeout,
        Self::Hang,
        Self::ShortClock,
        Self::BitFlip,
        Self::StuckHigh,
        Self::AllZero,
        Self::BrownOut,
        Self::FastWake,
        Self::Freeze,
        Self::Torn,
        Self::Unplugged,
        Self::AdapterGone,
        Self::PixelGlitch,
        Self::ThermistorFailure,
        Self::ClockError,
        Self::SclSpeed,
    ];

    /// The name in scripts, traces and reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NackAddress => "nack-address",
            Self::NackByte => "nack-byte",
            Self::BusError => "bus-error",
            Self::ArbitrationLoss => "arbitration-loss",
            Self::Timeout => "timeout",
            Self::Hang => "hang",
            Self::ShortClock => "short-clock",
            Self::BitFlip => "bit-flip",
            Self::StuckHigh => "stuck-high",
            Self::AllZero => "all-zero",
            Self::BrownOut => "brown-out",
            Self::FastWake => "fast-wake",
            Self::Freeze => "freeze",
            Self::Torn => "torn",
            Self::Unplugged => "unplugged",
            Self::AdapterGone => "adapter-gone",
            Self::PixelGlitch => "pixel-glitch",
            Self::ThermistorFailure => "thermistor-failure",
            Self::ClockError => "clock-error",
            Self::SclSpeed => "scl-speed",
        }
    }

    /// The kind of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// What it is drawn and counted by.
    #[must_use]
    pub const fn unit(self) -> Unit {
        match self {
            Self::NackAddress
            | Self::NackByte
            | Self::BusError
            | Self::ArbitrationLoss
            | Self::Timeout
            | Self::Hang
            | Self::ShortClock
            | Self::StuckHigh
            | Self::AllZero
            | Self::Torn => Unit::Transaction,
            Self::BitFlip => Unit::Byte,
            Self::PixelGlitch | Self::ThermistorFailure => Unit::Frame,
            Self::BrownOut
            | Self::FastWake
            | Self::Freeze
            | Self::Unplugged
            | Self::AdapterGone
            | Self::ClockError
            | Self::SclSpeed => Unit::Stretch,
        }
    }

    /// Its place in [`ALL`](Self::ALL).
    pub(crate) fn place(self) -> usize {
        Self::ALL
            .iter()
            .position(|kind| *kind == self)
            .unwrap_or_default()
    }

    pub(super) const fn bit(self) -> u32 {
        match self {
            Self::NackAddress => 1,
            Self::NackByte => 1 << 1,
            Self::BusError => 1 << 2,
            Self::ArbitrationLoss => 1 << 3,
            Self::Timeout => 1 << 4,
            Self::Hang => 1 << 5,
            Self::ShortClock => 1 << 6,
            Self::BitFlip => 1 << 7,
            Self::StuckHigh => 1 << 8,
            Self::AllZero => 1 << 9,
            Self::BrownOut => 1 << 10,
            Self::FastWake => 1 << 11,
            Self::Freeze => 1 << 12,
            Self::Torn => 1 << 13,
            Self::Unplugged => 1 << 14,
            Self::AdapterGone => 1 << 15,
            Self::PixelGlitch => 1 << 16,
            Self::ThermistorFailure => 1 << 17,
            Self::ClockError => 1 << 18,
            Self::SclSpeed => 1 << 19,
        }
    }
}

impl fmt::Display for FaultKind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

/// A set of kinds of faults. Shown as their names with a space between.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct FaultSet(u32);

impl FaultSet {
    /// No fault.
    pub const EMPTY: Self = Self(0);

    /// Whether this kind is in the set.
    #[must_use]
    pub const fn contains(self, kind: FaultKind) -> bool {
        self.0 & kind.bit() != 0
    }

    /// Whether there is none.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The kinds in the order of [`FaultKind::ALL`].
    pub fn iter(self) -> impl Iterator<Item = FaultKind> {
        FaultKind::ALL
            .into_iter()
            .filter(move |kind| self.contains(*kind))
    }

    pub(crate) fn insert(&mut self, kind: FaultKind) {
        self.0 |= kind.bit();
    }

    pub(crate) fn join(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

impl FromIterator<FaultKind> for FaultSet {
    fn from_iter<I: IntoIterator<Item = FaultKind>>(kinds: I) -> Self {
        let mut set = Self::EMPTY;
        for kind in kinds {
            set.insert(kind);
        }
        set
    }
}

impl fmt::Display for FaultSet {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, kind) in self.iter().enumerate() {
            let space = if place == 0 { "" } else { " " };
            write!(formatter, "{space}{}", kind.name())?;
        }
        Ok(())
    }
}

/// How often each kind of fault struck, in its [`unit`](FaultKind::unit).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FaultCounts(pub(super) [u64; FaultKind::COUNT]);

impl FaultCounts {
    /// How often this kind struck.
    #[must_use]
    pub fn of(&self, kind: FaultKind) -> u64 {
        self.0.get(kind.place()).copied().unwrap_or_default()
    }

    /// All kinds together.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.0.iter().sum()
    }

    /// Every kind that struck, and how often.
    pub fn iter(&self) -> impl Iterator<Item = (FaultKind, u64)> {
        FaultKind::ALL
            .into_iter()
            .zip(self.0)
            .filter(|(_, count)| *count > 0)
    }

    pub(crate) fn add(&mut self, kind: FaultKind) {
        if let Some(count) = self.0.get_mut(kind.place()) {
            *count += 1;
        }
    }
}

impl AddAssign for FaultCounts {
    fn add_assign(&mut self, other: Self) {
        for (sum, count) in self.0.iter_mut().zip(other.0) {
            *sum += count;
        }
    }
}

/// How likely a fault strikes at each occasion that its [`Unit`] gives it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Chance(u64);

impl Chance {
    /// At every occasion.
    pub const ALWAYS: Self = Self(Self::ONE);
    /// At none.
    pub const NEVER: Self = Self(0);
    /// What 1 is held as: whole multiples of 2^-53, which an `f64` has exactly.
    const ONE: u64 = 1 << 53;

    /// This probability, 0 to 1; `None` when it lies outside or is not a number.
    #[must_use]
    pub fn new(probability: f64) -> Option<Self> {
        if !(0.0..=1.0).contains(&probability) {
            return None;
        }
        #[expect(
            clippy::as_conversions,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "a power of two, and a product between 0 and it"
        )]
        let parts = (probability * Self::ONE as f64) as u64;
        Some(Self(parts))
    }

    /// Whether this number, drawn from all of `u64`, hits.
    pub(crate) const fn hits(self, drawn: u64) -> bool {
        drawn >> 11 < self.0
    }
}

/// The number that a seed, a stream of draws and the draw's place in it yield, whatever else is drawn and in whichever
/// order. Each step is the finalizer of SplitMix64 (Steele, Lea, Flood: "Fast splittable pseudorandom number
/// generators", OOPSLA 2014).
pub(crate) const fn draw(seed: u64, stream: u64, place: u64) -> u64 {
    mix(mix(mix(seed) ^ stream) ^ place)
}

/// A seed of its own for each of several buses.
pub(crate) const fn mix(value: u64) -> u64 {
    let value = value.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let value = (value ^ (value >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    value ^ (value >> 31)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::string::ToString as _;

    #[test]
    fn kinds_have_one_name_one_place_and_one_bit_each() {
        let mut all = FaultSet::EMPTY;
        for (place, kind) in FaultKind::ALL.into_iter().enumerate() {
            assert_eq!(kind.place(), place);
            assert_eq!(kind.bit(), 1 << place);
            assert_eq!(FaultKind::from_name(kind.name()), Some(kind));
            assert!(!all.contains(kind));
            all.insert(kind);
        }
        assert_eq!(all.iter().count(), FaultKind::COUNT);
        assert_eq!(FaultKind::from_name("nack"), None);
    }

    #[test]
    fn sets_show_their_names() {
        assert_eq!(FaultSet::EMPTY.to_string(), "");
        let set: FaultSet = [FaultKind::Freeze, FaultKind::BitFlip]
            .into_iter()
            .collect();
        assert_eq!(set.to_string(), "bit-flip freeze");
    }

    #[test]
    fn chances_hold_to_their_ends() {
        assert_eq!(Chance::new(1.0), Some(Chance::ALWAYS));
        assert_eq!(Chance::new(0.0), Some(Chance::NEVER));
        for wrong in [-0.001, 1.001, f64::NAN, f64::INFINITY] {
            assert_eq!(Chance::new(wrong), None);
        }
        assert!(Chance::ALWAYS.hits(u64::MAX) && Chance::ALWAYS.hits(0));
        assert!(!Chance::NEVER.hits(u64::MAX) && !Chance::NEVER.hits(0));
        let half = Chance::new(0.5).unwrap();
        assert!(half.hits((1 << 63) - 1) && !half.hits(1 << 63));
    }

    /// The first outputs of SplitMix64 from the state 0 in Vigna's reference, https://prng.di.unimi.it/splitmix64.c.
    #[test]
    fn the_mixture_is_splitmix64() {
        assert_eq!(mix(0), 0xE220_A839_7B1D_CDAF);
        assert_eq!(mix(0x9E37_79B9_7F4A_7C15), 0x6E78_9E6A_A1B9_65F4);
    }
}
