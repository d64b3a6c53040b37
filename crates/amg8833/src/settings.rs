//! Settings to write, the configuration read back, and how the two differ.

use crate::levels::InterruptLevels;
use crate::power::PowerMode;
use crate::register::{average, frame_rate, interrupt};
use crate::timing::{SETTLING_FRAMES, SLOW_CLOCK_PERCENT};
use core::fmt;
use core::time::Duration;
use grideye_frame::TICK;

/// Every sensor setting except the power mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Settings {
    /// Frames per second.
    pub frame_rate: FrameRate,
    /// Whether the sensor averages each frame with the previous one.
    pub moving_average: MovingAverage,
    /// What the interrupt compares, and whether its pin is active.
    pub interrupt: InterruptControl,
    /// When a pixel enters and leaves the interrupt table.
    pub levels: InterruptLevels,
}

impl Default for Settings {
    /// The power-on values (AMG88 spec §4-10), but with [`InterruptLevels::NEVER`].
    fn default() -> Self {
        Self {
            frame_rate: FrameRate::Ten,
            moving_average: MovingAverage::Off,
            interrupt: InterruptControl::default(),
            levels: InterruptLevels::NEVER,
        }
    }
}

/// How often the sensor updates its registers (AMG88 spec §4-11-3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FrameRate {
    /// 10 frames per second, the power-on value.
    Ten,
    /// 1 frame per second, each the mean of ten: a third of the noise (AMG88 spec §4-4: 0.05 against 0.16 °C).
    One,
}

impl FrameRate {
    /// The rate with this many frames per second; `None` unless 1 or 10.
    #[must_use]
    pub const fn from_fps(fps: u8) -> Option<Self> {
        match fps {
            1 => Some(Self::One),
            10 => Some(Self::Ten),
            _ => None,
        }
    }

    /// Nominal frames per second.
    #[must_use]
    pub const fn fps(self) -> u8 {
        match self {
            Self::Ten => 10,
            Self::One => 1,
        }
    }

    /// The nominal time between frames: real clocks are off by several percent.
    #[must_use]
    pub const fn period(self) -> Duration {
        match self {
            Self::Ten => TICK,
            Self::One => Duration::from_secs(1),
        }
    }

    /// How long to wait after a wake, a reset or power-on: [`SETTLING_FRAMES`] of a sensor that runs
    /// [`SLOW_CLOCK_PERCENT`] slow, 220 ms or 2.2 s.
    #[must_use]
    pub fn settling_time(self) -> Duration {
        self.period() * SETTLING_FRAMES * (100 + SLOW_CLOCK_PERCENT) / 100
    }

    pub(crate) const fn byte(self) -> u8 {
        match self {
            Self::Ten => 0,
            Self::One => frame_rate::ONE_FPS,
        }
    }

    pub(crate) const fn from_byte(byte: u8) -> Self {
        if byte & frame_rate::ONE_FPS == 0 {
            Self::Ten
        } else {
            Self::One
        }
    }
}

impl fmt::Display for FrameRate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} fps", self.fps())
    }
}

/// Whether each frame is the mean of itself and the previous one (AMG88 spec §4-11-7).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MovingAverage {
    /// Frames as measured, the power-on value.
    Off,
    /// "Twice moving average": √2 less noise, but a step takes one frame longer.
    Twice,
}

impl MovingAverage {
    pub(crate) const fn byte(self) -> u8 {
        match self {
            Self::Off => 0,
            Self::Twice => average::TWICE,
        }
    }

    pub(crate) const fn from_byte(byte: u8) -> Self {
        if byte & average::TWICE == 0 {
            Self::Off
        } else {
            Self::Twice
        }
    }
}

/// The interrupt's pin and mode (AMG88 spec §4-11-4).
///
/// The pin idles at VDD and is at GND while a pixel is in the table (AMG88 spec §4-7).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct InterruptControl {
    /// Whether the INT pin is active. The table and the flag follow the levels either way.
    pub pin_active: bool,
    /// What is compared with the levels.
    pub mode: InterruptMode,
}

/// What is compared with the interrupt levels (AMG88 spec §4-11-4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum InterruptMode {
    /// The change of a pixel since the previous frame, the power-on value.
    #[default]
    Difference,
    /// The temperature of a pixel.
    Absolute,
}

impl InterruptControl {
    pub(crate) const fn byte(self) -> u8 {
        let pin = if self.pin_active { interrupt::PIN } else { 0 };
        match self.mode {
            InterruptMode::Difference => pin,
            InterruptMode::Absolute => pin | interrupt::ABSOLUTE,
        }
    }

    pub(crate) const fn from_byte(byte: u8) -> Self {
        let mode = if byte & interrupt::ABSOLUTE == 0 {
            InterruptMode::Difference
        } else {
            InterruptMode::Absolute
        };
        Self {
            pin_active: byte & interrupt::PIN != 0,
            mode,
        }
    }
}

impl fmt::Display for InterruptControl {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mode = match self.mode {
            InterruptMode::Difference => "difference",
            InterruptMode::Absolute => "absolute",
        };
        let not = if self.pin_active { "" } else { "in" };
        write!(formatter, "{mode} with the pin {not}active")
    }
}

/// The sensor's settings, read back in one transaction.
///
/// After a supply dip the sensor keeps measuring with its power-on settings: only this reveals it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Configuration {
    /// The power mode; unreliable in sleep (AMG88 spec §4-11-1).
    pub power: PowerMode,
    /// Frames per second.
    pub frame_rate: FrameRate,
    /// The moving average as read back; parts in the field were seen to always read as off.
    pub moving_average: MovingAverage,
    /// The interrupt's pin and mode.
    pub interrupt: InterruptControl,
    /// The interrupt levels, which [`InterruptLevels::new`] might reject.
    pub levels: InterruptLevels,
}

impl Configuration {
    /// The first register that differs from `settings` in normal mode; `None` if none does.
    ///
    /// Skips the moving average, which may not read back. A supply dip shows in the levels (AMG88 spec §4-11-2), unless
    /// `settings` use the power-on levels of 0 °C.
    #[must_use]
    pub fn deviation(&self, settings: &Settings) -> Option<Deviation> {
        let (power, rate) = (PowerMode::Normal, settings.frame_rate);
        if self.power != power {
            Some(Deviation::Power(power, self.power))
        } else if self.frame_rate != rate {
            Some(Deviation::FrameRate(rate, self.frame_rate))
        } else if self.interrupt != settings.interrupt {
            Some(Deviation::Interrupt(settings.interrupt, self.interrupt))
        } else if self.levels != settings.levels {
            Some(Deviation::Levels(settings.levels, self.levels))
        } else {
            None
        }
    }
}

/// A setting that differs: expected value, then found value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Deviation {
    /// The power mode.
    Power(PowerMode, PowerMode),
    /// The frame rate.
    FrameRate(FrameRate, FrameRate),
    /// The interrupt's pin or mode.
    Interrupt(InterruptControl, InterruptControl),
    /// A level or the hysteresis: 0 °C in all three marks a reset.
    Levels(InterruptLevels, InterruptLevels),
}

impl fmt::Display for Deviation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (what, expected, found): (_, &dyn fmt::Display, &dyn fmt::Display) = match self {
            Self::Power(expected, found) => ("power mode", expected, found),
            Self::FrameRate(expected, found) => ("frame rate", expected, found),
            Self::Interrupt(expected, found) => ("interrupt", expected, found),
            Self::Levels(expected, found) => ("interrupt levels", expected, found),
        };
        write!(formatter, "{what}: expected {expected}, found {found}")
    }
}
