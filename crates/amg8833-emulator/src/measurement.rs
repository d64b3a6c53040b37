//! What the array does between two frames in the registers: ticks, the mean of ten, the moving average of two.

use crate::ticks::Ticks;
use crate::{registers::Words, word};
use core::time::Duration;
use grideye_frame::{Frame, PIXELS};

/// Internal frames in one output frame at 1 fps.
const FRAMES_AT_ONE_FPS: u32 = 10;

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

    fn mean(&self, other: &Self) -> Self {
        let mut sum = *self;
        sum.add(other);
        sum.divided(2.0)
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

/// How output frames are made of internal ones. Means are taken of the source's values, before the quantisation.
#[derive(Debug, Clone)]
pub(crate) struct Averaging {
    sum: Degrees,
    summed: u32,
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

    /// Takes one internal frame at 1 fps; yields the mean of every ten.
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

    /// The words of an output frame; with the moving average, of its mean with the output frame before.
    pub(crate) fn output(&mut self, frame: Degrees, moving_average: bool) -> Words {
        let previous = self.previous.replace(frame);
        match previous {
            Some(previous) if moving_average => frame.mean(&previous).words(),
            _ => frame.words(),
        }
    }
}

/// Which ticks have been gone through, and from which one on they count.
#[derive(Debug, Clone)]
pub(crate) struct Progress {
    pub(crate) ticks: Ticks,
    /// The last tick that has been gone through.
    pub(crate) last: u64,
    /// The first tick whose frame is valid.
    pub(crate) first_valid: u64,
    /// The tick from which the stand-by interval is counted.
    pub(crate) base: u64,
}

impl Progress {
    pub(crate) fn new(origin: Duration, clock_error_ppm: i32) -> Self {
        Self {
            ticks: Ticks::new(origin, clock_error_ppm),
            last: 0,
            first_valid: 1,
            base: 0,
        }
    }

    /// Starts over at this time: the tick under way is the first that may count, `warm_up` more are left out.
    pub(crate) fn restart(&mut self, now: Duration, warm_up: u64) {
        let tick = self.ticks.count(now);
        self.last = self.last.max(tick);
        self.base = tick;
        self.first_valid = self.first_valid.max(tick + 1 + warm_up);
    }

    /// The next tick after `last` that is measured, if one is every so many ticks from the base.
    pub(crate) fn next(&self, stand_by_ticks: Option<u64>) -> u64 {
        let earliest = self.first_valid.max(self.last + 1);
        match stand_by_ticks {
            None => earliest,
            Some(every) => self.base + earliest.saturating_sub(self.base).div_ceil(every) * every,
        }
    }
}
