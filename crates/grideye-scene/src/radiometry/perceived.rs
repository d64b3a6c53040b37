//! The temperature that a surface appears to have from a distance (PeerJ CS 11:e3124, "Perceived temperature
//! calculation").
//!
//! The copies of the paper that we had lack the formula; both laws below match its text. With kelvin and meters, object
//! `To`, ambient `Ta`, emissivity `e` and distance `d`:
//!
//! | law | perceived temperature |
//! |---|---|
//! | B (default) | `Tp⁴ = (e To⁴ + d² Ta⁴) / (e + d²)` |
//! | A | `w = min(1, e / d²)`, `Tp⁴ = w To⁴ + (1 - w) Ta⁴` |
//! | either, below 1 cm | `Tp = To - (To - Ta) d / operating distance` |

/// Which interpretation of the paper's formula to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Law {
    /// `w = min(1, e / d²)`, `Tp⁴ = w To⁴ + (1 - w) Ta⁴`.
    A,
    /// `Tp⁴ = (e To⁴ + d² Ta⁴) / (e + d²)`: the only law that meets the linear branch at 1 cm.
    #[default]
    B,
}

/// A surface as input to the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Temperature in °C, above absolute zero.
    pub celsius: f64,
    /// Emissivity, above 0 and up to 1.
    pub emissivity: f64,
}

/// Absolute zero in °C.
pub const ABSOLUTE_ZERO_C: f64 = -273.15;

/// The paper's linear branch applies below this distance.
pub const NEAR_M: f64 = 0.01;

/// The perceived temperature at `distance_m`, °C; `operating_distance_m` only matters below [`NEAR_M`].
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

/// What all points of one image share.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Air {
    law: Law,
    ambient_c: f64,
    /// Fourth root of `ambient_k4`, so that a surface at ambient has an excess of exactly 0.
    ambient_k: f64,
    ambient_k4: f64,
    operating_distance_m: f64,
}

/// What all points of one surface share.
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

    pub(crate) const fn ambient_c(&self) -> f64 {
        self.ambient_c
    }

    pub(crate) fn glow(&self, surface: Surface) -> Glow {
        Glow {
            excess_c: surface.celsius - self.ambient_c,
            emissivity: surface.emissivity,
            excess_k4: fourth_power(surface.celsius - ABSOLUTE_ZERO_C) - self.ambient_k4,
        }
    }

    /// The perceived temperature above ambient, °C, from the squared distance.
    pub(crate) fn excess(&self, glow: &Glow, distance_m2: f64) -> f64 {
        if distance_m2 < NEAR_M * NEAR_M {
            return glow.excess_c * (1.0 - distance_m2.sqrt() / self.operating_distance_m);
        }
        self.seen(self.weight(glow, distance_m2), glow)
    }

    /// The object's weight in the fourth powers; the air has the rest.
    fn weight(&self, glow: &Glow, distance_m2: f64) -> f64 {
        match self.law {
            Law::A => (glow.emissivity / distance_m2).min(1.0),
            Law::B => glow.emissivity / (glow.emissivity + distance_m2),
        }
    }

    fn seen(&self, weight: f64, glow: &Glow) -> f64 {
        fourth_root(self.ambient_k4 + weight * glow.excess_k4) - self.ambient_k
    }
}

pub(crate) fn fourth_power(kelvin: f64) -> f64 {
    let square = kelvin * kelvin;
    square * square
}

/// Two square roots, which IEEE 754 defines to the last bit; `powf(0.25)` differs between C libraries.
pub(crate) fn fourth_root(kelvin4: f64) -> f64 {
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
    fn the_linear_branch_takes_over_below_one_centimeter() {
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
    fn a_surface_at_ambient_appears_exactly_ambient() {
        for law in [Law::A, Law::B] {
            for step in 0..1000 {
                let distance_m = f64::from(step) * 0.007;
                assert_eq!(seen(law, 20.1, 20.1, distance_m), 20.1);
            }
        }
    }

    #[test]
    fn far_away_only_ambient_remains_and_nearby_only_the_object() {
        assert!((seen(Law::B, 31.0, 20.0, 1e6) - 20.0).abs() < 1e-9);
        assert!(seen(Law::B, 31.0, 20.0, 0.1) > 30.8);
        assert!(
            seen(Law::B, 10.0, 20.0, 1.0) < 20.0,
            "a cold surface appears cold"
        );
    }
}
