//! What temperature a surface seems to have from a distance (PeerJ CS 11:e3124, "Perceived temperature calculation").
//!
//! The paper's formula is lost in the copies that were to hand; its text asks for a form that comes from the
//! Stefan-Boltzmann law, falls with the square of the distance, tends to ambient far away and to the object nearby,
//! and goes over into a linear branch at 1 cm. [`Law::B`] does all of that; [`Law::A`] is the other form that fits
//! the words. With kelvin and metres, object `To`, ambient `Ta`, emissivity `e` and distance `d`:
//!
//! | law | perceived temperature |
//! |---|---|
//! | B (default) | `Tp⁴ = (e To⁴ + d² Ta⁴) / (e + d²)` |
//! | A | `w = min(1, e / d²)`, `Tp⁴ = w To⁴ + (1 - w) Ta⁴` |
//! | either, below 1 cm | `Tp = To - (To - Ta) d / operating distance` |
//!
//! ```
//! use grideye_scene::perceived::{Law, Surface, perceived_celsius};
//! let head = Surface { celsius: 31.0, emissivity: 0.8 };
//! let seen = perceived_celsius(Law::B, head, 20.0, 1.0, 5.0);
//! assert!((seen - 25.04).abs() < 0.005);
//! ```

/// Which reading of the paper's formula is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Law {
    /// `w = min(1, e / d²)`, `Tp⁴ = w To⁴ + (1 - w) Ta⁴`.
    A,
    /// `Tp⁴ = (e To⁴ + d² Ta⁴) / (e + d²)`: the only one that meets the linear branch at 1 cm.
    #[default]
    B,
}

/// A surface as the law sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Temperature in °C, above absolute zero.
    pub celsius: f64,
    /// Emissivity, above 0 and up to 1.
    pub emissivity: f64,
}

/// Absolute zero in °C.
pub const ABSOLUTE_ZERO_C: f64 = -273.15;

/// Below this distance the paper's linear branch holds.
pub const NEAR_M: f64 = 0.01;

/// The temperature in °C that a surface seems to have from `distance_m`, in a room at `ambient_c`.
///
/// `operating_distance_m` only matters below [`NEAR_M`]. A surface at ambient temperature seems to have exactly that.
#[must_use]
pub fn perceived_celsius(
    law: Law,
    surface: Surface,
    ambient_c: f64,
    distance_m: f64,
    operating_distance_m: f64,
) -> f64 {
    let air = Air::new(law, ambient_c, operating_distance_m);
    ambient_c + air.excess(&air.glow(surface), distance_m * distance_m)
}

/// What all points of one picture have in common.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Air {
    law: Law,
    ambient_c: f64,
    /// Fourth root of `ambient_k4`, so that a surface at ambient differs from it by exactly nothing.
    ambient_k: f64,
    ambient_k4: f64,
    operating_distance_m: f64,
}

/// What all points of one surface have in common.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Glow {
    excess_c: f64,
    emissivity: f64,
    excess_k4: f64,
}

impl Air {
    pub(crate) fn new(law: Law, ambient_c: f64, operating_distance_m: f64) -> Self {
        let ambient_k4 = fourth_power(ambient_c - ABSOLUTE_ZERO_C);
        Self {
            law,
            ambient_c,
            ambient_k: fourth_root(ambient_k4),
            ambient_k4,
            operating_distance_m,
        }
    }

    pub(crate) fn glow(&self, surface: Surface) -> Glow {
        Glow {
            excess_c: surface.celsius - self.ambient_c,
            emissivity: surface.emissivity,
            excess_k4: fourth_power(surface.celsius - ABSOLUTE_ZERO_C) - self.ambient_k4,
        }
    }

    /// How much warmer than ambient the surface seems, °C, from the square of its distance.
    pub(crate) fn excess(&self, glow: &Glow, distance_m2: f64) -> f64 {
        if distance_m2 < NEAR_M * NEAR_M {
            return glow.excess_c * (1.0 - distance_m2.sqrt() / self.operating_distance_m);
        }
        let weight = match self.law {
            Law::A => (glow.emissivity / distance_m2).min(1.0),
            Law::B => glow.emissivity / (glow.emissivity + distance_m2),
        };
        fourth_root(self.ambient_k4 + weight * glow.excess_k4) - self.ambient_k
    }
}

fn fourth_power(kelvin: f64) -> f64 {
    let square = kelvin * kelvin;
    square * square
}

/// Two square roots, which IEEE 754 fixes to the last bit; `powf(0.25)` differs between C libraries.
fn fourth_root(kelvin4: f64) -> f64 {
    kelvin4.sqrt().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(law: Law, object_c: f64, ambient_c: f64, distance_m: f64) -> f64 {
        let surface = Surface {
            celsius: object_c,
            emissivity: 0.8,
        };
        perceived_celsius(law, surface, ambient_c, distance_m, 5.0)
    }

    #[test]
    fn reference_values_of_both_laws() {
        for (law, object_c, ambient_c, distance_m, expected) in [
            (Law::B, 31.0, 20.0, 1.0, 25.04),
            (Law::B, 31.0, 20.0, 0.95, 25.32),
            (Law::B, 28.0, 23.5, 0.95, 25.64),
            (Law::B, 26.0, 20.0, 1.4, 21.78),
            (Law::B, 27.0, 21.0, 1.2, 23.18),
            (Law::B, 31.0, 20.0, 5.0, 20.36),
            (Law::A, 31.0, 20.0, 1.0, 28.89),
            (Law::A, 28.0, 23.5, 0.95, 27.50),
            (Law::A, 26.0, 20.0, 1.4, 22.49),
        ] {
            let found = seen(law, object_c, ambient_c, distance_m);
            assert!(
                (found - expected).abs() <= 0.005,
                "{law:?} {object_c} {ambient_c} {distance_m}: {found}"
            );
        }
    }

    #[test]
    fn the_linear_branch_takes_over_below_one_centimetre() {
        assert!((seen(Law::B, 31.0, 20.0, 0.01) - 31.0).abs() < 0.005);
        assert!((seen(Law::B, 31.0, 20.0, 0.009_999_9) - 30.978).abs() < 0.000_01);
        assert!((seen(Law::B, 31.0, 20.0, 0.005) - (31.0 - 11.0 * 0.005 / 5.0)).abs() < 1e-12);
        assert_eq!(seen(Law::A, 31.0, 20.0, 0.0), 31.0);
        let surface = Surface {
            celsius: 31.0,
            emissivity: 0.8,
        };
        let short_sighted = perceived_celsius(Law::B, surface, 20.0, 0.005, 0.1);
        assert!((short_sighted - (31.0 - 11.0 * 0.05)).abs() < 1e-12);
    }

    #[test]
    fn a_surface_at_ambient_seems_to_be_exactly_that() {
        for law in [Law::A, Law::B] {
            for step in 0..1000 {
                let distance_m = f64::from(step) * 0.007;
                assert_eq!(seen(law, 20.1, 20.1, distance_m), 20.1);
            }
        }
    }

    #[test]
    fn far_away_ambient_is_left_and_nearby_the_object() {
        assert!((seen(Law::B, 31.0, 20.0, 1e6) - 20.0).abs() < 1e-9);
        assert!(seen(Law::B, 31.0, 20.0, 0.1) > 30.8);
        assert!(
            seen(Law::B, 10.0, 20.0, 1.0) < 20.0,
            "a cold surface seems cold"
        );
    }
}
