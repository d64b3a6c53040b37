//! From ticks to output frames: the mean of ten, the moving average of two, and which ticks count.

use crate::device::ticks::Ticks;
use crate::word;
use crate::word::Words;
use core::time::Duration;
use grideye_frame::{Frame, PIXELS};

pub(crate) const FRAMES_AT_ONE_FPS: u8 = 10;

/// A frame in degrees with room for exact sums.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Degrees {
    pixels: [f64; PIXELS],
    thermistor: f64,
}

impl Degrees {
    const ZERO: Self = Self {
        pixels: [0.0; PIXELS],
        thermistor: 0.0,
    };

    pub(crate) fn of(frame: &Frame) -> Self {
        Self {
            pixels: frame.pixels.map(|pixel| f64::from(pixel.get())),
            thermistor: f64::from(frame.thermistor.get()),
        }
    }

    fn add(&mut self, other: &Self) {
        for (sum, pixel) in self.pixels.iter_mut().zip(&other.pixels) {
            *sum += pixel;
        }
        self.thermistor += other.thermistor;
    }

    fn divided(&self, by: f64) -> Self {
        Self {
            pixels: self.pixels.map(|sum| sum / by),
            thermistor: self.thermistor / by,
        }
    }

    fn words(&self) -> Words {
        let thermistor = word::thermistor(self.thermistor);
        let pixels = self.pixels.map(word::pixel);
        Words {
            pixels: pixels.map(|pixel| pixel.bits),
            pixel_overflow: pixels.iter().any(|pixel| pixel.overflow),
            thermistor: thermistor.bits,
            thermistor_overflow: thermistor.overflow,
        }
    }
}

/// Makes output frames from internal ones. Averages the source's values, before quantization.
#[derive(Debug, Clone)]
pub(crate) struct Averaging {
    sum: Degrees,
    summed: u8,
    previous: Option<Degrees>,
}

impl Averaging {
    pub(crate) const fn new() -> Self {
        Self {
            sum: Degrees::ZERO,
            summed: 0,
            previous: None,
        }
    }

    /// Adds one internal frame at 1 fps; returns the mean of every ten.
    pub(crate) fn one_of_ten(&mut self, measured: &Degrees) -> Option<Degrees> {
        self.sum.add(measured);
        self.summed += 1;
        if self.summed < FRAMES_AT_ONE_FPS {
            return None;
        }
        let mean = self.sum.divided(f64::from(FRAMES_AT_ONE_FPS));
        self.sum = Degrees::ZERO;
        self.summed = 0;
        Some(mean)
    }

    pub(crate) fn missing(&self) -> u64 {
        u64::from(FRAMES_AT_ONE_FPS - self.summed)
    }

    /// The words of an output frame, averaged with the previous output frame if the moving average is on.
    pub(crate) fn output(&mut self, frame: Degrees, moving_average: bool) -> Words {
        match self.previous.replace(frame) {
            Some(mut sum) if moving_average => {
                sum.add(&frame);
                sum.divided(2.0).words()
            }
            _ => frame.words(),
        }
    }
}

/// Which ticks are done, and the first one that counts.
#[derive(Debug, Clone)]
pub(crate) struct Progress {
    pub(crate) ticks: Ticks,
    pub(crate) last: u64,
    pub(crate) first_valid: u64,
    /// The tick from which the stand-by interval is counted.
    pub(crate) base: u64,
    /// The tick of an initial reset, until the first frame after it.
    pub(crate) reset: Option<u64>,
}

impl Progress {
    pub(crate) fn new(ticks: Ticks) -> Self {
        Self {
            ticks,
            last: 0,
            first_valid: 1,
            base: 0,
            reset: None,
        }
    }

    /// Starts over: the current tick is the first that may count.
    pub(crate) fn restart(&mut self, now: Duration) {
        let tick = self.ticks.count(now);
        self.last = self.last.max(tick);
        self.base = tick;
        self.first_valid = self.first_valid.max(tick + 1);
    }

    /// Starts over at an initial reset: omits the current tick and `left_out` more.
    pub(crate) fn reset(&mut self, now: Duration, left_out: u64) {
        self.restart(now);
        self.reset = Some(self.base);
        self.leave_out(left_out);
    }

    /// Omits this many ticks after an initial reset that has had no frame yet.
    pub(crate) fn leave_out(&mut self, ticks: u64) {
        if let Some(reset) = self.reset {
            self.first_valid = (reset + 1 + ticks).max(self.last + 1);
        }
    }

    /// Skips old ticks, leaving about the newest `kept`, and only by whole means of `mean`.
    pub(crate) fn skip(&mut self, due: u64, kept: u64, mean: u64) {
        let start = self.last.max(self.first_valid - 1);
        let skipped = due.saturating_sub(kept).saturating_sub(start);
        if skipped >= mean {
            self.last = start + skipped - skipped % mean;
        }
    }

    /// The next tick after `last` to measure; in stand-by, one every `stand_by_ticks` from the base.
    pub(crate) fn next(&self, stand_by_ticks: Option<u64>) -> u64 {
        let earliest = self.first_valid.max(self.last + 1);
        match stand_by_ticks {
            None => earliest,
            Some(every) => self.base + earliest.saturating_sub(self.base).div_ceil(every) * every,
        }
    }
}
