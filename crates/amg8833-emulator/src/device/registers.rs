//! The register file: what each address reads, and what a written byte does (AMG88 spec §4-10, §4-11).

use crate::device::options::{
    AfterWake, AverageReadback, InitialReset, InterruptFlag, InterruptOutput, Options,
    OverflowFlag, SleepImage, StandBy, StatusClear, ThermistorUpdate, UnspecifiedBits, ZeroLevels,
};
use crate::signal::InterruptPin;
use crate::word;
use crate::word::Words;
use grideye_frame::{PIXELS, PixelIndex};

mod address {
    pub(super) const POWER_CONTROL: u8 = 0x00;
    pub(super) const RESET: u8 = 0x01;
    pub(super) const FRAME_RATE: u8 = 0x02;
    pub(super) const INTERRUPT_CONTROL: u8 = 0x03;
    pub(super) const STATUS: u8 = 0x04;
    pub(super) const STATUS_CLEAR: u8 = 0x05;
    pub(super) const AVERAGE: u8 = 0x07;
    pub(super) const LEVELS_FIRST: u8 = 0x08;
    pub(super) const LEVELS_LAST: u8 = 0x0D;
    pub(super) const THERMISTOR_LOW: u8 = 0x0E;
    pub(super) const THERMISTOR_HIGH: u8 = 0x0F;
    pub(super) const TABLE_FIRST: u8 = 0x10;
    pub(super) const TABLE_LAST: u8 = 0x17;
    pub(super) const AVERAGE_KEY: u8 = 0x1F;
    pub(super) const PIXELS_FIRST: u8 = 0x80;
}

/// STAT bit 1, and INTCLR of the status clear register.
const INTERRUPT: u8 = 0x02;
/// STAT bit 2 (OVF_IRS), and OVS_CLR.
const PIXEL_OVERFLOW: u8 = 0x04;
/// STAT bit 3 (OVF_THS) in the 2011 specification, and OVT_CLR.
const THERMISTOR_OVERFLOW: u8 = 0x08;
/// FPSC bit 0: one frame per second.
const ONE_FPS: u8 = 0x01;
/// INTC bit 0: the INT pin is active.
const PIN_ENABLED: u8 = 0x01;
/// INTC bit 1: absolute values, otherwise differences.
const ABSOLUTE: u8 = 0x02;
const MOVING_AVERAGE: u8 = 0x20;
const HIGH_NIBBLE: u8 = 0x0F;
const WORD: u16 = 0x0FFF;

/// The power modes, numbered by their commands (AMG88 spec §4-11-1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mode {
    Normal = 0x00,
    Sleep = 0x10,
    StandBy60 = 0x20,
    StandBy10 = 0x21,
}

impl Mode {
    fn from_command(command: u8, stand_by: StandBy) -> Option<Self> {
        let all = [Self::Normal, Self::Sleep, Self::StandBy60, Self::StandBy10];
        let mode = all.into_iter().find(|mode| mode.command() == command);
        let missing = stand_by == StandBy::Missing;
        mode.filter(|mode| !missing || mode.stand_by_ticks().is_none())
    }

    #[expect(
        clippy::as_conversions,
        reason = "the variants are numbered by their commands"
    )]
    fn command(self) -> u8 {
        self as u8
    }

    pub(crate) fn stand_by_ticks(self) -> Option<u64> {
        match self {
            Self::StandBy60 => Some(600),
            Self::StandBy10 => Some(100),
            Self::Normal | Self::Sleep => None,
        }
    }
}

/// How often the sensor refused something since it was created.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Refusals {
    /// Addresses and bytes that were not acknowledged.
    pub nacks: u64,
    /// Bytes written in sleep mode, other than the wake command (AMG88 spec §4-11-1).
    pub asleep: u64,
    /// Bytes written to read-only registers.
    pub read_only: u64,
    /// Bytes written to reserved or undocumented registers.
    pub reserved: u64,
    /// Bytes written to the moving average register without its key (AMG88 spec §4-11-7).
    pub without_key: u64,
    /// Unknown commands in the power control and reset registers.
    pub unknown_commands: u64,
}

/// The effect of a written byte on the rest of the sensor.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Effect {
    /// None beyond the register file.
    Stored,
    /// The power mode changed from this one.
    ModeChanged(Mode),
    RateChanged,
    InitialReset,
    /// The byte had no effect; count it here.
    Refused(fn(&mut Refusals) -> &mut u64),
}

/// The key of the moving average register, written to register 0x1F (AMG88 spec §4-11-7).
const KEY: [u8; 3] = [0x50, 0x45, 0x57];

#[derive(Debug, Clone)]
pub(crate) struct Registers {
    pub(crate) mode: Mode,
    pub(crate) one_fps: bool,
    interrupt_control: u8,
    status: u8,
    average: u8,
    /// How many bytes of the key have come in a row.
    key: usize,
    levels: [u8; 6],
    thermistor: u16,
    pixels: [u16; PIXELS],
    /// The pixels of the previous frame, which only a fault shows.
    previous: [u16; PIXELS],
    /// Pixels outside their limits as of the newest frame, with hysteresis. Bit 0 is pixel 1.
    outside: u64,
    table: u64,
    /// Whether the pixels hold a frame for the next one to compare with.
    measured: bool,
    /// Whether the sensor woke without a reset since, so that its registers read anything.
    pub(crate) undefined: bool,
    /// Whether the mode reads 0x00 in sleep the next time.
    volatile: bool,
}

impl Registers {
    /// The registers at power-on: 0x00 everywhere, except the thermistor by option.
    pub(crate) fn new(options: &Options) -> Self {
        Self {
            mode: Mode::Normal,
            one_fps: false,
            interrupt_control: 0,
            status: 0,
            average: 0,
            key: 0,
            levels: [0; 6],
            thermistor: options.thermistor_at_power_on & WORD,
            pixels: [0; PIXELS],
            previous: [0; PIXELS],
            outside: 0,
            table: 0,
            measured: false,
            undefined: false,
            volatile: false,
        }
    }

    pub(crate) fn moving_average(&self) -> bool {
        self.average & MOVING_AVERAGE != 0
    }

    /// The level of the INT pin (AMG88 spec §4-7).
    pub(crate) fn interrupt_pin(&self, options: &Options) -> InterruptPin {
        let enabled = self.mode != Mode::Sleep
            && !self.undefined
            && self.interrupt_control & PIN_ENABLED != 0;
        match options.interrupt_output {
            _ if enabled && self.status & INTERRUPT != 0 => InterruptPin::Low,
            InterruptOutput::PushPull if enabled => InterruptPin::High,
            InterruptOutput::PushPull | InterruptOutput::OpenDrain => InterruptPin::HighZ,
        }
    }

    pub(crate) fn read(&mut self, register: u8, options: &Options) -> u8 {
        if self.mode == Mode::Sleep {
            return self.read_asleep(register, options.sleep_image);
        }
        if self.undefined {
            // Any number works that differs between registers and matches no valid image.
            return register.wrapping_mul(0x6D) ^ 0xB5;
        }
        let unspecified = match options.unspecified_bits {
            UnspecifiedBits::Ones if is_high_byte(register) => !HIGH_NIBBLE,
            UnspecifiedBits::Ones | UnspecifiedBits::Zero => 0,
        };
        unspecified | self.read_awake(register, options)
    }

    /// The previous frame's byte of a pixel register before `until`; `None` for all other registers.
    pub(crate) fn read_previous(&self, register: u8, until: PixelIndex) -> Option<u8> {
        let earlier = self.previous.get(..until.as_usize())?;
        let shown = self.mode != Mode::Sleep && !self.undefined;
        shown.then(|| pixel_byte(earlier, register)).flatten()
    }

    fn read_asleep(&mut self, register: u8, image: SleepImage) -> u8 {
        match (image, register) {
            (SleepImage::ModeByTurns, address::POWER_CONTROL) => {
                self.volatile = !self.volatile;
                if self.volatile { 0x10 } else { 0x00 }
            }
            (SleepImage::ModeAndSign, address::POWER_CONTROL) => 0x10,
            (SleepImage::ModeAndSign | SleepImage::ModeByTurns, address::THERMISTOR_HIGH) => 0x80,
            _ => 0,
        }
    }

    fn read_awake(&self, register: u8, options: &Options) -> u8 {
        match register {
            address::POWER_CONTROL => self.mode.command(),
            address::FRAME_RATE => u8::from(self.one_fps) * ONE_FPS,
            address::INTERRUPT_CONTROL => self.interrupt_control,
            address::STATUS => self.status,
            address::AVERAGE => match options.average_readback {
                AverageReadback::Setting => self.average,
                AverageReadback::Zero => 0,
            },
            address::LEVELS_FIRST..=address::LEVELS_LAST => {
                at(&self.levels, register - address::LEVELS_FIRST)
            }
            address::THERMISTOR_LOW => self.thermistor.to_le_bytes()[0],
            address::THERMISTOR_HIGH => self.thermistor.to_le_bytes()[1],
            address::TABLE_FIRST..=address::TABLE_LAST => {
                at(&self.table.to_le_bytes(), register - address::TABLE_FIRST)
            }
            _ => pixel_byte(&self.pixels, register).unwrap_or(0),
        }
    }

    pub(crate) fn write(&mut self, register: u8, byte: u8, options: &Options) -> Effect {
        if self.mode == Mode::Sleep && (register, byte) != (address::POWER_CONTROL, 0x00) {
            return Effect::Refused(|refusals| &mut refusals.asleep);
        }
        match register {
            address::AVERAGE_KEY => {
                self.key = match KEY.get(self.key) {
                    Some(next) if *next == byte => self.key + 1,
                    _ => usize::from(byte == KEY[0]),
                };
                return Effect::Stored;
            }
            address::AVERAGE if self.key == KEY.len() => {
                self.average = byte & MOVING_AVERAGE;
                return Effect::Stored;
            }
            _ => self.key = 0,
        }
        match register {
            address::POWER_CONTROL => return self.write_mode(byte, options.stand_by),
            address::RESET => return self.write_reset(byte, options),
            address::FRAME_RATE => {
                let before = core::mem::replace(&mut self.one_fps, byte & ONE_FPS != 0);
                if self.one_fps != before {
                    return Effect::RateChanged;
                }
            }
            address::INTERRUPT_CONTROL => self.interrupt_control = byte & (PIN_ENABLED | ABSOLUTE),
            address::STATUS_CLEAR => self.clear_status(byte, options.status_clear),
            address::AVERAGE => return Effect::Refused(|refusals| &mut refusals.without_key),
            address::LEVELS_FIRST..=address::LEVELS_LAST => {
                self.write_level(register - address::LEVELS_FIRST, byte);
            }
            address::STATUS
            | address::THERMISTOR_LOW..=address::TABLE_LAST
            | address::PIXELS_FIRST..=0xFF => {
                return Effect::Refused(|refusals| &mut refusals.read_only);
            }
            _ => return Effect::Refused(|refusals| &mut refusals.reserved),
        }
        Effect::Stored
    }

    /// Updates pixels, thermistor, table and flags together (AMG88 spec §4-11-10, §4-11-11).
    pub(crate) fn publish(&mut self, words: &Words, options: &Options) {
        if options.stand_by == StandBy::Interrupts || self.mode == Mode::Normal {
            self.interrupt(&words.pixels, options);
        }
        let overflow = match options.overflow_flag {
            OverflowFlag::Saturation => words.pixel_overflow,
            OverflowFlag::WordFff => words.pixels.contains(&WORD),
        };
        if overflow {
            self.status |= PIXEL_OVERFLOW;
        }
        if options.thermistor_update == ThermistorUpdate::WithFrame {
            self.set_thermistor(words.thermistor, words.thermistor_overflow, options);
        }
        self.previous = core::mem::replace(&mut self.pixels, words.pixels);
        self.measured = true;
    }

    pub(crate) fn set_thermistor(&mut self, word: u16, saturated: bool, options: &Options) {
        let overflow = match options.overflow_flag {
            OverflowFlag::Saturation => saturated,
            OverflowFlag::WordFff => word == WORD,
        };
        if overflow && options.thermistor_overflow_flag {
            self.status |= THERMISTOR_OVERFLOW;
        }
        self.thermistor = word;
    }

    fn interrupt(&mut self, pixels: &[u16; PIXELS], options: &Options) {
        self.outside = self.compared(pixels, options.zero_levels);
        let flag = if self.outside == 0 { 0 } else { INTERRUPT };
        match options.interrupt_flag {
            InterruptFlag::HoldsUntilCleared => {
                self.table |= self.outside;
                self.status |= flag;
            }
            InterruptFlag::FollowsFrames => {
                self.table = self.outside;
                self.status = (self.status & !INTERRUPT) | flag;
            }
        }
    }

    /// Wakes from sleep: the next frame has no predecessor to compare with.
    pub(crate) fn wake(&mut self, after_wake: AfterWake) {
        self.measured = false;
        self.volatile = false;
        self.undefined = after_wake == AfterWake::Undefined;
    }

    /// One bit per pixel: whether it is outside its limits, or was and is still within the hysteresis.
    fn compared(&self, pixels: &[u16; PIXELS], zero_levels: ZeroLevels) -> u64 {
        if zero_levels == ZeroLevels::AlwaysTrip && self.levels == [0; 6] {
            return u64::MAX;
        }
        let [upper, lower, hysteresis] = [0, 2, 4].map(|place| {
            let bytes = [self.levels[place], self.levels[place + 1]];
            word::signed(u16::from_le_bytes(bytes))
        });
        let absolute = self.interrupt_control & ABSOLUTE != 0;
        let mut outside = 0;
        for (place, (new, old)) in pixels.iter().zip(&self.pixels).enumerate() {
            let value = match (absolute, self.measured) {
                (true, _) => word::signed(*new),
                (false, true) => (word::signed(*new) - word::signed(*old)).clamp(-2048, 2047),
                (false, false) => 0,
            };
            // Trips beyond a level, not on it; releases only a hysteresis inside (AMG88 spec §4-11-8, users' reports).
            let beyond = value > upper || value < lower;
            let settled = value <= upper - hysteresis && value >= lower + hysteresis;
            let tripped = self.outside >> place & 1 != 0;
            if beyond || (tripped && !settled) {
                outside |= 1 << place;
            }
        }
        outside
    }

    fn write_mode(&mut self, command: u8, stand_by: StandBy) -> Effect {
        match Mode::from_command(command, stand_by) {
            None => Effect::Refused(|refusals| &mut refusals.unknown_commands),
            Some(mode) if mode == self.mode => Effect::Stored,
            Some(mode) => Effect::ModeChanged(core::mem::replace(&mut self.mode, mode)),
        }
    }

    fn write_reset(&mut self, command: u8, options: &Options) -> Effect {
        match command {
            0x30 => {
                self.status = 0;
                self.clear_table();
                Effect::Stored
            }
            0x3F => {
                self.reset_initially(options);
                Effect::InitialReset
            }
            _ => Effect::Refused(|refusals| &mut refusals.unknown_commands),
        }
    }

    fn write_level(&mut self, place: u8, byte: u8) {
        let existing = if place % 2 == 1 { HIGH_NIBBLE } else { 0xFF };
        if let Some(level) = self.levels.get_mut(usize::from(place)) {
            *level = byte & existing;
        }
    }

    fn clear_status(&mut self, selected: u8, clears: StatusClear) {
        self.status &= !(selected & (INTERRUPT | PIXEL_OVERFLOW | THERMISTOR_OVERFLOW));
        if selected & INTERRUPT != 0 && clears == StatusClear::FlagsAndTable {
            self.clear_table();
        }
    }

    fn clear_table(&mut self) {
        self.table = 0;
        self.outside = 0;
    }

    /// The thermistor stays, the pixels clear (AMG88 spec of 2016, table of resets in §4-11-2).
    fn reset_initially(&mut self, options: &Options) {
        self.status = 0;
        self.clear_table();
        if options.initial_reset == InitialReset::RestoresDefaults {
            let thermistor = self.thermistor;
            *self = Self::new(options);
            self.thermistor = thermistor;
        }
        self.pixels = [0; PIXELS];
        self.measured = false;
        self.undefined = false;
    }
}

/// Whether the register is the high byte of a level, the hysteresis, the thermistor or a pixel.
fn is_high_byte(register: u8) -> bool {
    let word = matches!(register, address::LEVELS_FIRST..=address::THERMISTOR_HIGH | address::PIXELS_FIRST..=0xFF);
    word && register % 2 == 1
}

/// The byte of this register if it belongs to one of these pixels.
fn pixel_byte(pixels: &[u16], register: u8) -> Option<u8> {
    let place = usize::from(register.checked_sub(address::PIXELS_FIRST)?);
    Some(pixels.get(place / 2)?.to_le_bytes()[place % 2])
}

fn at(bytes: &[u8], place: u8) -> u8 {
    bytes.get(usize::from(place)).copied().unwrap_or(0)
}
