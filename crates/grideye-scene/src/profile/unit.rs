//! What a unit with a profile measures, tick by tick.

use crate::geometry::count::float;
use crate::profile::read;
use crate::profile::types::{CYCLE_TICKS, CommonMode, FixedPattern, Profile, Thermistor};
use crate::radiometry::ABSOLUTE_ZERO_C;
use grideye_frame::{Celsius, Frame, PIXELS};
use grideye_text::Refusal;
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use std::time::Duration;

impl Profile {
    /// Parses a profile; messages name the file `origin`.
    ///
    /// # Errors
    /// The first mistake, with its place, the key, what was expected, and what to do.
    pub fn parse(text: &str, origin: &str) -> Result<Self, Refusal> {
        read::profile(text, origin)
    }

    /// The profile as a file that [`parse`](Self::parse) reads back to the same numbers; keys without effect are
    /// omitted.
    #[must_use]
    pub fn to_toml(&self) -> String {
        read::toml(self)
    }

    /// What this `seed`'s unit measures of a perfect frame in 100 ms tick `index`, at `t` since power-on.
    ///
    /// At tick `i`, each pixel `p` measures
    ///
    /// ```text
    /// scene[p] + offset_c[p] + spread_c · N(unit, p)                               pattern
    ///          + sd_c · W(t / correlation_s) - cycle_depth_c if i ≡ seed (mod 5)   common mode
    ///          + start_c · exp(-t / time_constant_s) + drift_c_per_hour · t        warm-up
    ///          + sigma_c[p] · N(i, p)                                              noise
    /// ```
    ///
    /// and the thermistor `ambient + offset_c · (1 - exp(-t / lag_s)) + sigma_c · N(i)`. `N` are independent standard
    /// normal draws. `W` has variance 1 everywhere and an autocorrelation of 0.29 at 1 and 0 from 2 on: it is drawn at
    /// whole numbers and blended in between. Octaves, which imitate the flicker of real sensors, add independent `W(x)`,
    /// `W(2x)`, `W(4x)` and so on, divided by the root of their number. With the glitches' probability, one pixel then
    /// becomes 0.0 °C.
    ///
    /// Draws are ChaCha with 12 rounds. Key, little-endian: seed (8), purpose (8: 1 tick, 2 wander, 3 unit), the
    /// wander's octave or zero (8), `grideyep` (8). Stream: the tick, the wander's knot, or 0. Results never go below
    /// absolute zero.
    #[must_use]
    pub fn apply(&self, seed: u64, index: u64, t: Duration, scene: Frame) -> Frame {
        let t_s = t.as_secs_f64();
        let common_c = self.common_c(seed, index, t_s);
        let unit_c = self.fixed_pattern.of_unit(seed);
        let mut tick = Draws::tick(seed, index);
        let mut measured = scene;
        for (pixel, celsius) in measured.pixels.iter_mut().enumerate() {
            let noise_c = self.noise_sigma_c[pixel] * tick.normal();
            *celsius = sum(*celsius, common_c + unit_c[pixel] + noise_c);
        }
        measured.thermistor = sum(scene.thermistor, self.thermistor_c(t_s, tick.normal()));
        if tick.happens(self.glitch_probability) {
            measured.pixels[tick.pixel()] = Celsius::new(0.0);
        }
        measured
    }

    /// What the unit adds to a scene of the room where it was measured: its pattern, and the background if known, °C.
    #[must_use]
    pub fn in_its_room_c(&self) -> [f64; PIXELS] {
        let background_c = self.background_c.unwrap_or([0.0; PIXELS]);
        std::array::from_fn(|pixel| self.fixed_pattern.offset_c[pixel] + background_c[pixel])
    }

    /// Root mean square of the pixels' own noise, °C: one number for all 64.
    #[must_use]
    pub fn sigma_c(&self) -> f64 {
        let squares: f64 = self.noise_sigma_c.iter().map(|sigma| sigma * sigma).sum();
        (squares / float(PIXELS)).sqrt()
    }

    /// Error of the sensor's clock at time 0, parts per million.
    #[must_use]
    pub const fn clock_error_ppm(&self) -> i32 {
        self.clock.error_ppm
    }

    /// Change of that error per hour, parts per million.
    #[must_use]
    pub const fn clock_drift_ppm_per_hour(&self) -> i32 {
        self.clock.drift_ppm_per_hour
    }

    fn common_c(&self, seed: u64, index: u64, t_s: f64) -> f64 {
        let CommonMode {
            sd_c,
            correlation_s,
            octaves,
            cycle_depth_c,
        } = self.common_mode;
        let mut common_c = self.warm_up.drift_c_per_hour * (t_s / SECONDS_PER_HOUR);
        if sd_c > 0.0 {
            common_c += sd_c * wander(seed, t_s / correlation_s, octaves);
        }
        if index % CYCLE_TICKS == seed % CYCLE_TICKS {
            common_c -= cycle_depth_c;
        }
        if self.warm_up.start_c != 0.0 {
            common_c += self.warm_up.start_c * libm::exp(-t_s / self.warm_up.time_constant_s);
        }
        common_c
    }

    fn thermistor_c(&self, t_s: f64, draw: f64) -> f64 {
        let Thermistor {
            offset_c,
            sigma_c,
            lag_s,
        } = self.thermistor;
        let risen = if lag_s > 0.0 {
            1.0 - libm::exp(-t_s / lag_s)
        } else {
            1.0
        };
        offset_c * risen + sigma_c * draw
    }
}

impl FixedPattern {
    pub(crate) fn of_unit(&self, seed: u64) -> [f64; PIXELS] {
        let mut offset_c = self.offset_c;
        if self.spread_c > 0.0 {
            let mut unit = Draws::unit(seed);
            for pixel in &mut offset_c {
                *pixel += self.spread_c * unit.normal();
            }
        }
        offset_c
    }
}

const SECONDS_PER_HOUR: f64 = 3600.0;

/// A random function of variance 1 everywhere: the sum of `octaves` equally strong octaves.
fn wander(seed: u64, at: f64, octaves: u32) -> f64 {
    let mut sum = 0.0;
    let mut quicker = at;
    for octave in 0..octaves {
        sum += smooth(seed, octave, quicker);
        quicker *= 2.0;
    }
    sum / f64::from(octaves).sqrt()
}

/// A smooth random function of variance 1 everywhere, with independent values at integers.
fn smooth(seed: u64, octave: u32, at: f64) -> f64 {
    let knot = crate::geometry::count::floor(at);
    let share = at - float(knot);
    let number = u64::try_from(knot).unwrap_or(u64::MAX);
    let before = Draws::knot(seed, octave, number).normal();
    let after = Draws::knot(seed, octave, number.saturating_add(1)).normal();
    let (left, right) = (1.0 - share, share);
    // Normalize: a weighted sum of independent draws has the sum of squared weights as its variance.
    (left * before + right * after) / (left * left + right * right).sqrt()
}

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "frames store single precision, 2 µK at 20 °C"
)]
fn sum(celsius: Celsius, added_c: f64) -> Celsius {
    Celsius::new((f64::from(celsius.get()) + added_c).max(ABSOLUTE_ZERO_C) as f32)
}

/// The random numbers of one unit, with a separate stream for each purpose.
struct Draws(ChaCha12Rng);

const TICK: u64 = 1;
const KNOT: u64 = 2;
const SPECIMEN: u64 = 3;

impl Draws {
    fn tick(seed: u64, index: u64) -> Self {
        Self::new(seed, TICK, 0, index)
    }

    fn knot(seed: u64, octave: u32, number: u64) -> Self {
        Self::new(seed, KNOT, octave, number)
    }

    fn unit(seed: u64) -> Self {
        Self::new(seed, SPECIMEN, 0, 0)
    }

    fn new(seed: u64, purpose: u64, octave: u32, stream: u64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&purpose.to_le_bytes());
        key[16..24].copy_from_slice(&u64::from(octave).to_le_bytes());
        key[24..].copy_from_slice(b"grideyep");
        let mut generator = ChaCha12Rng::from_seed(key);
        generator.set_stream(stream);
        Self(generator)
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// True with this probability: never at 0, always at 1.
    fn happens(&mut self, probability: f64) -> bool {
        let draw = f64::from(self.0.next_u32()) / TWO_TO_32;
        draw < probability
    }

    fn pixel(&mut self) -> usize {
        // 64 divides the range of a byte evenly.
        usize::from(self.0.next_u32().to_le_bytes()[0]) % PIXELS
    }
}

const TWO_TO_32: f64 = 4_294_967_296.0;
