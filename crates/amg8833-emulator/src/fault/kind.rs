//! The kinds of faults, their chances and their counts.

use core::fmt;
use core::num::NonZeroU32;
use grideye_frame::PixelIndex;

/// A fault to inject; any number of kinds combine.
///
/// In one transaction, the first of these on the wire hides the later ones, which are then not counted: `AdapterGone`,
/// `Hang`, `Timeout`, `ArbitrationLoss`, `BusError`, `Unplugged`, `NackAddress`. After an acknowledged address all
/// others act together: `ShortClock` cuts the sensor's byte, then `BitFlip` changes it, and a line held low (`AllZero`)
/// wins over a released one (`StuckHigh`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fault {
    /// The sensor does not acknowledge its address: a loose wire, or no supply on the bus side.
    NackAddress,
    /// The sensor does not acknowledge this written byte of a transaction; 0 is the register address.
    NackByte(u16),
    /// The controller reports a misplaced START or STOP (EIO).
    BusError,
    /// The controller reports that another one drove the bus.
    ArbitrationLoss,
    /// The controller aborts this transaction after [`HANG_TIMEOUT`](crate::HANG_TIMEOUT); other addresses work.
    Timeout,
    /// A line is held low: the controller gives up after [`HANG_TIMEOUT`](crate::HANG_TIMEOUT), whatever the address.
    Hang,
    /// The sensor misses one SCL pulse. In a read, the later bits come one place late, and the rest reads 0xFF; a
    /// written byte is lost and not acknowledged. A Raspberry Pi's controller does this with clock stretching.
    ShortClock {
        /// The byte within the transaction, after the address; 0 is the first.
        byte: u16,
        /// The bit within the byte, 7 (first on the wire) to 0.
        bit: u8,
    },
    /// One bit of a byte arrives inverted, in either direction. A field left `None` can be any.
    BitFlip {
        /// Only bytes of this register.
        register: Option<u8>,
        /// Only this byte of a transaction, after the address; 0 is the first.
        byte: Option<u16>,
        /// Only this bit, 7 (first on the wire) to 0.
        bit: Option<u8>,
    },
    /// SDA is stuck high after the acknowledge: every byte reads 0xFF.
    StuckHigh,
    /// Every byte reads 0x00.
    AllZero,
    /// The supply dips: the sensor silently restarts with its defaults. Happens once.
    BrownOut,
    /// As [`Options::freezes_on_fast_wake`](crate::Options::freezes_on_fast_wake).
    FastWake,
    /// The sensor stops measuring; its registers read as before. An initial reset still clears them.
    Freeze,
    /// The registers change within a transaction, contrary to AMG88 spec §4-11-11.
    Torn {
        /// `None`: a frame that falls due within a transaction (one that takes time) arrives at once. Otherwise the
        /// pixels before this one always come from the second newest frame.
        pixel: Option<PixelIndex>,
    },
    /// The sensor is off the bus and unpowered. It powers on when the fault ends.
    Unplugged,
    /// The adapter is gone and all its sensors are unpowered. They power on when the fault ends.
    AdapterGone,
    /// A pixel of a measured frame has this word, which the interrupts also see.
    PixelGlitch {
        /// The pixel; `None`: a different one in each frame, chosen by the seed.
        pixel: Option<PixelIndex>,
        /// The twelve bits of the register word: 0xFFF is -0.25 °C.
        word: u16,
    },
    /// The thermistor reads this word in every frame.
    ThermistorFailure {
        /// The twelve bits of the register word: 0xFFF is a failed conversion in the 2011 specification.
        word: u16,
    },
    /// Another [`Options::clock_error_ppm`](crate::Options::clock_error_ppm), without a phase jump.
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

/// The unit in which a kind of fault is drawn and counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Unit {
    /// A transaction that the fault broke or changed.
    Transaction,
    /// A byte that the fault changed.
    Byte,
    /// A sensor frame that the fault spoiled.
    Frame,
    /// A stretch of time, drawn and counted once when it begins.
    Stretch,
}

macro_rules! kinds {
    ($($kind:ident = $name:literal, $unit:ident;)+) => {
        grideye_frame::named! {
            /// A [`Fault`] without its parameters, with its name in scripts, traces and reports.
            #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
            pub enum FaultKind {
                $(#[doc = concat!("[`Fault::", stringify!($kind), "`].")] $kind = $name;)+
            }
        }

        impl FaultKind {
            /// How many kinds there are.
            pub const COUNT: usize = Self::ALL.len();

            /// The unit in which this kind is drawn and counted.
            #[must_use]
            pub const fn unit(self) -> Unit {
                match self { $(Self::$kind => Unit::$unit),+ }
            }
        }

        impl Fault {
            /// The kind, without its parameters.
            #[must_use]
            pub const fn kind(self) -> FaultKind {
                match self { $(Self::$kind { .. } => FaultKind::$kind),+ }
            }
        }
    };
}

kinds! {
    NackAddress = "nack-address", Transaction;
    NackByte = "nack-byte", Transaction;
    BusError = "bus-error", Transaction;
    ArbitrationLoss = "arbitration-loss", Transaction;
    Timeout = "timeout", Transaction;
    Hang = "hang", Transaction;
    ShortClock = "short-clock", Transaction;
    BitFlip = "bit-flip", Byte;
    StuckHigh = "stuck-high", Transaction;
    AllZero = "all-zero", Transaction;
    BrownOut = "brown-out", Stretch;
    FastWake = "fast-wake", Stretch;
    Freeze = "freeze", Stretch;
    Torn = "torn", Transaction;
    Unplugged = "unplugged", Stretch;
    AdapterGone = "adapter-gone", Stretch;
    PixelGlitch = "pixel-glitch", Frame;
    ThermistorFailure = "thermistor-failure", Frame;
    ClockError = "clock-error", Stretch;
    SclSpeed = "scl-speed", Stretch;
}

impl FaultKind {
    /// Its index in [`ALL`](Self::ALL).
    #[expect(
        clippy::as_conversions,
        reason = "the place of a variant is its number"
    )]
    pub(super) const fn place(self) -> usize {
        self as usize
    }

    pub(super) const fn bit(self) -> u32 {
        1 << self.place()
    }
}

impl fmt::Display for FaultKind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

/// A set of fault kinds. Displays their names separated by spaces.
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

    /// Whether the set is empty.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The kinds in the order of [`FaultKind::ALL`].
    pub fn iter(self) -> impl Iterator<Item = FaultKind> {
        let kinds = FaultKind::ALL.into_iter();
        kinds.filter(move |kind| self.contains(*kind))
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
        Self(kinds.into_iter().fold(0, |set, kind| set | kind.bit()))
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
        let counts = FaultKind::ALL.into_iter().zip(self.0);
        counts.filter(|(_, count)| *count > 0)
    }

    pub(crate) fn add(&mut self, kind: FaultKind) {
        if let Some(count) = self.0.get_mut(kind.place()) {
            *count += 1;
        }
    }
}

/// How likely a fault strikes on each occasion, as counted by its [`Unit`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Chance(u64);

impl Chance {
    /// On every occasion.
    pub const ALWAYS: Self = Self(Self::ONE);
    /// Never.
    pub const NEVER: Self = Self(0);
    /// One in units of 2^-53, which an `f64` represents exactly.
    const ONE: u64 = 1 << 53;

    /// This probability; `None` outside 0 to 1.
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

    /// Whether a number drawn from all of `u64` hits.
    pub(crate) const fn hits(self, drawn: u64) -> bool {
        drawn >> 11 < self.0
    }
}

/// The number at this place of a random stream, by SplitMix64's finalizer (Steele, Lea, Flood, OOPSLA 2014).
pub(crate) const fn draw(seed: u64, stream: u64, place: u64) -> u64 {
    mix(mix(mix(seed) ^ stream) ^ place)
}

/// One SplitMix64 step. Also derives each bus's own seed.
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
        let set = FaultSet::from_iter([FaultKind::Freeze, FaultKind::BitFlip]);
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

    /// SplitMix64's first outputs from state 0, from Vigna's reference https://prng.di.unimi.it/splitmix64.c.
    #[test]
    fn the_mixture_is_splitmix64() {
        assert_eq!(mix(0), 0xE220_A839_7B1D_CDAF);
        assert_eq!(mix(0x9E37_79B9_7F4A_7C15), 0x6E78_9E6A_A1B9_65F4);
    }
}
