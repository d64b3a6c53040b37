//! Faults as the header has them: a kind and numbers.

use crate::error::Error;
use amg8833_emulator::{CLOCK_ERROR_PPM_MAX, Chance, Fault as Emulated, FaultKind};
use core::num::NonZeroU32;
use grideye_frame::PixelIndex;

/// `amg8833_fault` of the header: -1 is any, or none.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
#[expect(missing_docs, reason = "the header says what they are")]
pub struct Fault {
    pub kind: i32,
    pub byte: i32,
    pub bit: i32,
    pub reg: i32,
    pub pixel: i32,
    pub value: i32,
    pub chance: f64,
}

impl Fault {
    pub(crate) fn emulated(&self) -> Result<(Emulated, Chance), Error> {
        let chance = Chance::new(self.chance).ok_or(Error::Value)?;
        Ok((self.particular()?, chance))
    }

    fn particular(&self) -> Result<Emulated, Error> {
        Ok(match kind(self.kind)? {
            FaultKind::NackAddress => Emulated::NackAddress,
            FaultKind::NackByte => Emulated::NackByte(within(self.byte)?),
            FaultKind::BusError => Emulated::BusError,
            FaultKind::ArbitrationLoss => Emulated::ArbitrationLoss,
            FaultKind::Timeout => Emulated::Timeout,
            FaultKind::Hang => Emulated::Hang,
            FaultKind::ShortClock => Emulated::ShortClock {
                byte: within(self.byte)?,
                bit: bit(self.bit)?,
            },
            FaultKind::BitFlip => Emulated::BitFlip {
                register: if_any(self.reg, within)?,
                byte: if_any(self.byte, within)?,
                bit: if_any(self.bit, bit)?,
            },
            FaultKind::StuckHigh => Emulated::StuckHigh,
            FaultKind::AllZero => Emulated::AllZero,
            FaultKind::BrownOut => Emulated::BrownOut,
            FaultKind::FastWake => Emulated::FastWake,
            FaultKind::Freeze => Emulated::Freeze,
            FaultKind::Torn => Emulated::Torn {
                pixel: if_any(self.pixel, pixel)?,
            },
            FaultKind::Unplugged => Emulated::Unplugged,
            FaultKind::AdapterGone => Emulated::AdapterGone,
            FaultKind::PixelGlitch => Emulated::PixelGlitch {
                pixel: if_any(self.pixel, pixel)?,
                word: word(self.value)?,
            },
            FaultKind::ThermistorFailure => Emulated::ThermistorFailure {
                word: word(self.value)?,
            },
            FaultKind::ClockError => {
                let is_sane = self.value.unsigned_abs() <= CLOCK_ERROR_PPM_MAX.unsigned_abs();
                let ppm = is_sane.then_some(self.value).ok_or(Error::Value)?;
                Emulated::ClockError { ppm }
            }
            FaultKind::SclSpeed => {
                let hz = NonZeroU32::new(within(self.value)?).ok_or(Error::Value)?;
                Emulated::SclSpeed { hz }
            }
        })
    }
}

pub(crate) fn kind(number: i32) -> Result<FaultKind, Error> {
    let place = usize::try_from(number).ok();
    let kind = place.and_then(|place| FaultKind::ALL.get(place).copied());
    kind.ok_or(Error::Value)
}

fn within<T: TryFrom<i32>>(number: i32) -> Result<T, Error> {
    T::try_from(number).or(Err(Error::Value))
}

fn if_any<T>(number: i32, of: fn(i32) -> Result<T, Error>) -> Result<Option<T>, Error> {
    (number != -1).then(|| of(number)).transpose()
}

fn bit(number: i32) -> Result<u8, Error> {
    within(number).and_then(|bit| if bit < 8 { Ok(bit) } else { Err(Error::Value) })
}

fn pixel(number: i32) -> Result<PixelIndex, Error> {
    PixelIndex::new(within(number)?).ok_or(Error::Value)
}

fn word(number: i32) -> Result<u16, Error> {
    within(number).and_then(|word| {
        if word <= 0xFFF {
            Ok(word)
        } else {
            Err(Error::Value)
        }
    })
}
