//! Converts temperatures of gray surfaces to radiance and back.

use crate::radiometry::perceived::{ABSOLUTE_ZERO_C, Surface, fourth_power, fourth_root};

/// The wavelengths that a sensor detects.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Band {
    /// All wavelengths: radiance is proportional to the fourth power of temperature (Stefan and Boltzmann).
    #[default]
    All,
    /// A range of wavelengths in micrometers: Planck's law integrated over it.
    Window {
        /// The shortest, above 0.
        from_um: f64,
        /// The longest, above the shortest.
        to_um: f64,
    },
}

impl Band {
    /// A blackbody's radiance in units of `σ / π`: over all wavelengths, the fourth power of its temperature in kelvin.
    #[must_use]
    pub fn radiance_k4(self, kelvin: f64) -> f64 {
        let all = fourth_power(kelvin.max(0.0));
        match self {
            Self::All => all,
            Self::Window { from_um, to_um } => {
                all * (share_below(to_um * kelvin) - share_below(from_um * kelvin)).max(0.0)
            }
        }
    }

    /// The temperature in kelvin of a blackbody with this radiance; 0 for none.
    #[must_use]
    pub fn kelvin(self, radiance_k4: f64) -> f64 {
        if radiance_k4.is_nan() || radiance_k4 <= 0.0 {
            return 0.0;
        }
        match self {
            Self::All => fourth_root(radiance_k4),
            Self::Window { .. } => self.kelvin_by_search(radiance_k4),
        }
    }

    /// Bracketed secant search on log radiance over log temperature, which is nearly linear.
    fn kelvin_by_search(self, radiance_k4: f64) -> f64 {
        let wanted = libm::log(radiance_k4);
        let error = |log_kelvin: f64| {
            let found = self.radiance_k4(libm::exp(log_kelvin));
            libm::log(found.max(f64::MIN_POSITIVE)) - wanted
        };
        let (mut low, mut high) = (libm::log(KELVIN_MIN), libm::log(KELVIN_MAX));
        let mut at = libm::log(ROOM_K);
        let mut before = at + 1e-3;
        let mut error_before = error(before);
        for _ in 0..SEARCH_STEPS_MAX {
            let here = error(at);
            if here.abs() < SEARCH_ERROR {
                break;
            }
            if here > 0.0 {
                high = at;
            } else {
                low = at;
            }
            let next = at - here * (at - before) / (here - error_before);
            (before, error_before) = (at, here);
            // NaN, from two equal errors, counts as outside.
            at = if next > low && next < high {
                next
            } else {
                0.5 * (low + high)
            };
        }
        libm::exp(at)
    }
}

const ROOM_K: f64 = 293.15;
const KELVIN_MIN: f64 = 1e-3;
const KELVIN_MAX: f64 = 1e7;
/// Relative radiance error that ends a search: 1e-11 °C in a room. Rounding of the logarithm limits it.
const SEARCH_ERROR: f64 = 2e-13;
/// Halving alone needs as many steps from the bounds to the last bit.
const SEARCH_STEPS_MAX: u32 = 80;

const C2_UM_K: f64 = 14_387.768_775;
/// Limit on terms of the series; at 5000 °C and 14 µm the last is below a millionth.
const TERMS_MAX: u32 = 100;

/// Share of a blackbody's radiance below a wavelength (Chang and Rhee 1984), with `z = c2 / (λ T)`:
/// `15/π⁴ Σ e^(-n z) / n (z³ + 3z²/n + 6z/n² + 6/n³)`.
fn share_below(um_k: f64) -> f64 {
    if um_k <= 0.0 {
        return 0.0;
    }
    let z = C2_UM_K / um_k;
    let step = libm::exp(-z);
    let (mut sum, mut power) = (0.0, 1.0);
    for n in 1..=TERMS_MAX {
        let over = 1.0 / f64::from(n);
        power *= step;
        let term =
            power * over * (((6.0 * over + 6.0 * z) * over + 3.0 * z * z) * over + z * z * z);
        sum += term;
        if term <= 1e-17 * sum {
            break;
        }
    }
    let pi2 = std::f64::consts::PI * std::f64::consts::PI;
    sum * 15.0 / (pi2 * pi2)
}

/// The apparent temperature of a surface that fills a pixel's view, °C, reflecting a blackbody at `reflected_c`.
#[must_use]
pub fn apparent_celsius(surface: Surface, reflected_c: f64, band: Band) -> f64 {
    let light = Light::new(band, reflected_c, reflected_c);
    light.celsius(light.excess(surface))
}

/// What all surfaces of a room share; radiances are relative to the ambient's.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Light {
    band: Band,
    ambient_c: f64,
    ambient: f64,
    ambient_k: f64,
    /// Reflected radiance above the ambient's.
    reflected: f64,
}

impl Light {
    pub(crate) fn new(band: Band, ambient_c: f64, reflected_c: f64) -> Self {
        let ambient = band.radiance_k4(ambient_c - ABSOLUTE_ZERO_C);
        Self {
            band,
            ambient_c,
            ambient,
            ambient_k: band.kelvin(ambient),
            reflected: band.radiance_k4(reflected_c - ABSOLUTE_ZERO_C) - ambient,
        }
    }

    /// Emitted plus reflected radiance above the ambient's: exactly 0 if both are at ambient temperature.
    pub(crate) fn excess(&self, surface: Surface) -> f64 {
        let own = self.band.radiance_k4(surface.celsius - ABSOLUTE_ZERO_C) - self.ambient;
        surface.emissivity * own + (1.0 - surface.emissivity) * self.reflected
    }

    pub(crate) fn celsius(&self, excess: f64) -> f64 {
        if excess == 0.0 {
            return self.ambient_c;
        }
        self.ambient_c + (self.band.kelvin(self.ambient + excess) - self.ambient_k)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ATMOSPHERE: Band = Band::Window {
        from_um: 8.0,
        to_um: 14.0,
    };

    /// Planck's law integrated by Simpson's rule, in units of `σ / π`.
    fn by_simpson(from_um: f64, to_um: f64, kelvin: f64) -> f64 {
        const C1: f64 = 1.191_042_972e8; // W µm⁴ m⁻² sr⁻¹
        const SIGMA: f64 = 5.670_374_419e-8;
        let steps = 2000;
        let width = (to_um - from_um) / f64::from(steps);
        let planck = |um: f64| C1 / um.powi(5) / ((C2_UM_K / (um * kelvin)).exp() - 1.0);
        let sum: f64 = (0..=steps)
            .map(|step| {
                let weight = match step {
                    0 => 1.0,
                    last if last == steps => 1.0,
                    odd if odd % 2 == 1 => 4.0,
                    _ => 2.0,
                };
                weight * planck(from_um + width * f64::from(step))
            })
            .sum();
        sum * width / 3.0 * std::f64::consts::PI / SIGMA
    }

    #[test]
    fn a_window_is_plancks_law_between_its_ends() {
        for kelvin in [200.0, 293.15, 310.0, 473.15, 1500.0] {
            let found = ATMOSPHERE.radiance_k4(kelvin);
            let expected = by_simpson(8.0, 14.0, kelvin);
            assert!(
                (found / expected - 1.0).abs() < 1e-6,
                "{kelvin}: {found} {expected}"
            );
        }
        // Howell, Mengüç, Siegel, table of blackbody functions, at 8 µm and 14 µm and 300 K.
        assert!((share_below(2400.0) - 0.140_25).abs() < 1e-4);
        assert!((share_below(4200.0) - 0.516_04).abs() < 1e-4);
        assert!((share_below(1e9) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn radiance_and_temperature_round_trip() {
        for band in [Band::All, ATMOSPHERE] {
            for kelvin in [1.0, 100.0, 253.0, 293.15, 304.0, 473.0, 5000.0] {
                let radiance = band.radiance_k4(kelvin);
                if radiance > 1e-300 {
                    let found = band.kelvin(radiance);
                    assert!(
                        (found / kelvin - 1.0).abs() < 1e-11,
                        "{band:?} {kelvin}: {found}"
                    );
                }
            }
            assert_eq!(band.kelvin(0.0), 0.0);
            assert_eq!(band.kelvin(-1.0), 0.0);
        }
    }

    #[test]
    fn the_window_matters_for_a_kettle_but_hardly_for_people() {
        // thermal-model.md §2: 0.02 to 0.04 °C for people, 0.5 to 1 °C at 80 to 200 °C, in a half-filled pixel.
        let seen = |band, celsius: f64| {
            let light = Light::new(band, 20.0, 20.0);
            let surface = Surface {
                celsius,
                emissivity: 0.98,
            };
            light.celsius(0.5 * light.excess(surface))
        };
        let person = seen(ATMOSPHERE, 31.0) - seen(Band::All, 31.0);
        let kettle = seen(ATMOSPHERE, 80.0) - seen(Band::All, 80.0);
        assert!(person.abs() < 0.05, "{person}");
        assert!((0.2..2.0).contains(&kettle.abs()), "{kettle}");
    }
}
