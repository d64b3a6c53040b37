//! How an object warms up and cools down as a whole, and how a body's print fades.
//!
//! | what | temperature |
//! |---|---|
//! | a lumped body, `dT/dt = -(T - Ta) / tau + P / C` | `Ta + r + (T0 - Ta - r) exp(-t / tau)` with `r = tau P / C` while the power is on |
//! | a half-space surface held `th` warmer for `tc`, without loss (Carslaw and Jaeger 1959, 2.5) | `th (2 / π) asin(√(tc / t))`, `t` from the start of contact |
//! | the same surface with loss, starting from a half-space warm throughout (the same, 2.7) | `th exp(x) erfc(√x)`, `x = t / (e / h)²` |

use std::f64::consts::PI;

/// How a body's warmth varies over its faces and over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Thermal {
    /// How much warmer than the body each face is, °C; empty if none is.
    pub(crate) offsets_c: Vec<f64>,
    pub(crate) transient: Option<Transient>,
    /// What it is made of, if warm prints are left on it.
    pub(crate) material: Option<Material>,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Transient {
    pub(crate) time_constant_s: f64,
    /// Final temperature above ambient while its power is on, °C.
    pub(crate) rise_c: f64,
    pub(crate) on_s: Vec<[f64; 2]>,
}

impl Transient {
    pub(crate) fn celsius(&self, start_c: f64, ambient_c: f64, time_s: f64) -> f64 {
        let mut excess_c = start_c - ambient_c;
        let mut reached_s = 0.0;
        let mut go_on = |until_s: f64, towards_c: f64| {
            let until_s = until_s.min(time_s);
            if until_s > reached_s {
                let fading = libm::exp((reached_s - until_s) / self.time_constant_s);
                excess_c = towards_c + (excess_c - towards_c) * fading;
                reached_s = until_s;
            }
        };
        for [from_s, until_s] in &self.on_s {
            go_on(*from_s, 0.0);
            go_on(*until_s, self.rise_c);
        }
        go_on(f64::INFINITY, 0.0);
        ambient_c + excess_c
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Material {
    Foam,
    Textile,
    Wood,
}

impl Material {
    /// (effusivity / coefficient of surface loss)² in seconds, with a loss of about 9 W/m²K.
    pub(crate) const fn fading_s(self) -> f64 {
        match self {
            Self::Foam => 37.0,
            Self::Textile => 296.0,
            Self::Wood => 1890.0,
        }
    }
}

/// The share of a print's warmth left `after_s` seconds after a contact of `contact_s`.
///
/// The product of the two solutions above, within 0.033 of the full one (a test compares it with finite differences).
pub(crate) fn left(contact_s: f64, after_s: f64, fading_s: f64) -> f64 {
    if after_s <= 0.0 {
        return 1.0;
    }
    let spread = 2.0 / PI * libm::asin((contact_s / (contact_s + after_s)).sqrt());
    spread * exp_erfc_root(after_s / fading_s)
}

fn exp_erfc_root(x: f64) -> f64 {
    if x < ASYMPTOTIC {
        return libm::exp(x) * libm::erfc(x.sqrt());
    }
    // Abramowitz and Stegun 7.1.23; the first omitted term is 15/8 x⁻³.
    (1.0 - 0.5 / x + 0.75 / (x * x)) / (PI * x).sqrt()
}

/// Use the asymptotic series from here on: its relative error is below 2e-6.
const ASYMPTOTIC: f64 = 100.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kettle_cools_and_a_radiator_warms_up() {
        let kettle = Transient {
            time_constant_s: 600.0,
            rise_c: 0.0,
            on_s: Vec::new(),
        };
        for minutes in [0.0, 1.0, 10.0, 60.0_f64] {
            let expected = 20.0 + 75.0 * (-minutes / 10.0).exp();
            let found = kettle.celsius(95.0, 20.0, minutes * 60.0);
            assert!((found - expected).abs() < 1e-9, "{minutes}: {found}");
        }
        // On for 900 s from 300 s: towards 60 °C with a time constant of 600 s, then back.
        let radiator = Transient {
            time_constant_s: 600.0,
            rise_c: 40.0,
            on_s: vec![[300.0, 1200.0]],
        };
        let top = 20.0 + 40.0 * (1.0 - (-1.5_f64).exp());
        for (time_s, expected) in [
            (0.0, 20.0),
            (300.0, 20.0),
            (900.0, 20.0 + 40.0 * (1.0 - (-1.0_f64).exp())),
            (1200.0, top),
            (1800.0, 20.0 + (top - 20.0) * (-1.0_f64).exp()),
        ] {
            let found = radiator.celsius(20.0, 20.0, time_s);
            assert!((found - expected).abs() < 1e-9, "{time_s}: {found}");
        }
    }

    #[test]
    fn the_law_of_cooling_holds_at_every_moment() {
        let heat = Transient {
            time_constant_s: 250.0,
            rise_c: 30.0,
            on_s: vec![[10.0, 100.0], [150.0, 1e9]],
        };
        let at = |time_s: f64| heat.celsius(35.0, 18.0, time_s);
        for (time_s, power) in [(5.0, 0.0), (50.0, 30.0), (120.0, 0.0), (200.0, 30.0)] {
            let slope = (at(time_s + 1e-3) - at(time_s - 1e-3)) / 2e-3;
            let expected = -(at(time_s) - 18.0) / 250.0 + power / 250.0;
            assert!((slope - expected).abs() < 1e-8, "{time_s}: {slope}");
        }
    }

    #[test]
    fn a_print_without_loss_is_the_arc_sine() {
        // After three times the contact, sqrt(1/4) = 1/2, the sine of 30°: a third is left.
        assert!((left(60.0, 180.0, 1e18) - 1.0 / 3.0).abs() < 1e-6);
        assert!((left(60.0, 60.0, 1e18) - 0.5).abs() < 1e-6);
        assert_eq!(left(60.0, 0.0, 37.0), 1.0);
    }

    #[test]
    fn a_print_of_an_endless_contact_fades_by_its_loss() {
        // exp(x) erfc(√x): 0.4275835761558070 at 1 (Abramowitz and Stegun, Table 7.2).
        assert!((left(1e12, 37.0, 37.0) - 0.427_583_576_155_807).abs() < 1e-5);
        let (before, after) = (exp_erfc_root(99.999), exp_erfc_root(100.001));
        assert!((before / after - 1.0).abs() < 2e-5, "{before} {after}");
        // exp(100) erfc(10), by its continued fraction.
        let found = exp_erfc_root(100.0) / 0.056_140_992_743_822_59;
        assert!((found - 1.0).abs() < 2e-6, "{found}");
    }

    /// Finite differences in a half-space: held at 1 during contact, then losing to air at 0.
    #[test]
    fn the_product_is_near_the_full_solution() {
        let mut worst: f64 = 0.0;
        // With effusivity and diffusivity 1, h is the inverse root of the fading time.
        let fading_s: f64 = 37.0;
        let loss = 1.0 / fading_s.sqrt();
        for contact_s in [5.0, 37.0, 300.0] {
            let (step_m, step_s, cells): (f64, f64, usize) = (0.25, 0.025, 400);
            let share = step_s / (step_m * step_m);
            let mut excess = vec![0.0_f64; cells];
            let mut time_s = 0.0;
            while time_s < contact_s + 120.0 {
                let held = time_s < contact_s;
                let old = excess.clone();
                for cell in 1..cells - 1 {
                    excess[cell] += share * (old[cell - 1] - 2.0 * old[cell] + old[cell + 1]);
                }
                // The first cell is half as deep, so that its center is the surface.
                let flow = (old[1] - old[0]) / step_m - loss * old[0];
                excess[0] = if held {
                    1.0
                } else {
                    old[0] + 2.0 * step_s / step_m * flow
                };
                time_s += step_s;
                let after_s = time_s - contact_s;
                if after_s > 1.0 {
                    let difference = left(contact_s, after_s, fading_s) - excess[0];
                    worst = worst.max(difference.abs());
                }
            }
        }
        assert!(worst < 0.033, "{worst}");
    }
}
