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

use wide::{CmpLt as _, f64x4};

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
        self.seen(weight, glow)
    }

    /// The same for the rays of a row that meet one plane: one over the depth at which each does, and how warm the
    /// surface seems there.
    ///
    /// All slices have one length, a multiple of [`LANES`].
    pub(crate) fn excesses(
        &self,
        glow: &Glow,
        root: &Root,
        rays: &Rays<'_>,
        inverse_depth: &mut [f64],
        excess_c: &mut [f64],
    ) {
        let Root::Series(series) = root else {
            rays.each(inverse_depth, excess_c, |inverse_depth, ray2| {
                let distances_m2 = ray2 / (inverse_depth * inverse_depth);
                let excess = |distance_m2| self.excess(glow, distance_m2);
                f64x4::new(distances_m2.to_array().map(excess))
            });
            return;
        };
        // The number of terms is a constant in the loop, so that none of it is spent on counting.
        let places = (inverse_depth, excess_c);
        match series.terms {
            ..=6 => self.by_series::<6>(glow, series, rays, places),
            7..=8 => self.by_series::<8>(glow, series, rays, places),
            9..=10 => self.by_series::<10>(glow, series, rays, places),
            _ => self.by_series::<SERIES_TERMS_MAX>(glow, series, rays, places),
        }
    }

    fn by_series<const TERMS: usize>(
        &self,
        glow: &Glow,
        series: &Series,
        rays: &Rays<'_>,
        (inverse_depth, excess_c): (&mut [f64], &mut [f64]),
    ) {
        let emissivity = f64x4::splat(glow.emissivity);
        match self.law {
            Law::A => rays.each(inverse_depth, excess_c, |inverse_depth, ray2| {
                let weight = emissivity * (inverse_depth * inverse_depth) / ray2;
                let whole = f64x4::ONE;
                series.evaluate::<TERMS>(weight.cmp_lt(whole).blend(weight, whole))
            }),
            Law::B => rays.each(inverse_depth, excess_c, |inverse_depth, ray2| {
                let radiating = emissivity * (inverse_depth * inverse_depth);
                series.evaluate::<TERMS>(radiating / (radiating + ray2))
            }),
        }
    }

    /// How the fourth root is best taken on a surface of which no point is nearer than `depth_min_m`.
    pub(crate) fn root(&self, glow: &Glow, depth_min_m: f64) -> Root {
        if depth_min_m <= NEAR_M {
            return Root::Exact;
        }
        let distance_m2 = depth_min_m * depth_min_m;
        let weight_max = match self.law {
            Law::A => (glow.emissivity / distance_m2).min(1.0),
            Law::B => glow.emissivity / (glow.emissivity + distance_m2),
        };
        Series::new(self, glow, weight_max).map_or(Root::Exact, Root::Series)
    }

    fn seen(&self, weight: f64, glow: &Glow) -> f64 {
        fourth_root(self.ambient_k4 + weight * glow.excess_k4) - self.ambient_k
    }
}

/// How the law's fourth root is taken.
#[derive(Debug, Clone)]
pub(crate) enum Root {
    /// By two square roots, which take several times as long as a multiplication.
    Exact,
    /// By a power series, as far as its error stays below [`SERIES_ERROR_C`].
    Series(Series),
}

/// The most that a series may differ from the root, °C: a few times the last bit of 300 K.
const SERIES_ERROR_C: f64 = 3e-13;

/// With more terms than this, square roots are as fast.
const SERIES_TERMS_MAX: usize = 16;

/// Rays that are evaluated together, so that the compiler can do several at once.
pub(crate) const LANES: usize = 4;

/// Taylor series of the excess in the law's weight, around the middle of the weights that occur.
#[derive(Debug, Clone)]
pub(crate) struct Series {
    centre: f64,
    /// From the lowest order; `terms` of them count.
    coefficients: [f64; SERIES_TERMS_MAX],
    terms: usize,
}

impl Series {
    /// For weights from 0 to `weight_max`; `None` if the series converges too slowly, as for glowing metal.
    fn new(air: &Air, glow: &Glow, weight_max: f64) -> Option<Self> {
        let centre = 0.5 * weight_max;
        let middle_k4 = air.ambient_k4 + centre * glow.excess_k4;
        let middle_k = fourth_root(middle_k4);
        let ratio = glow.excess_k4 / middle_k4;
        let reach = (ratio * centre).abs();
        let mut series = Self {
            centre,
            coefficients: [0.0; SERIES_TERMS_MAX],
            terms: 0,
        };
        // The terms of (1 + x)^(1/4): each is the one before times (1/4 - n) / (n + 1) times x.
        let (mut coefficient, mut bound_c, mut order) = (middle_k, middle_k, 0.0);
        for place in &mut series.coefficients {
            *place = coefficient;
            series.terms += 1;
            let next = (0.25 - order) / (order + 1.0);
            coefficient *= next * ratio;
            bound_c *= next.abs() * reach;
            order += 1.0;
            // The terms that are left out fall at least as fast as a geometric series of `reach`.
            if bound_c <= SERIES_ERROR_C * (1.0 - reach) {
                series.coefficients[0] -= air.ambient_k;
                return Some(series);
            }
        }
        None
    }

    /// Turns weights into degrees above ambient; the terms beyond those that count are zero.
    #[inline]
    fn evaluate<const TERMS: usize>(&self, weights: f64x4) -> f64x4 {
        let powers = weights - f64x4::splat(self.centre);
        let mut sum = f64x4::splat(self.coefficients[TERMS - 1]);
        for term in (0..TERMS - 1).rev() {
            sum = sum * powers + f64x4::splat(self.coefficients[term]);
        }
        sum
    }
}

/// The rays of one row of cells before a plane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rays<'a> {
    /// One over the plane's depth on the ray without slope to the left, and what each unit of slope adds.
    pub(crate) inverse_depth: (f64, f64),
    /// Square of the distance to depth 1 on the ray without slope to the left.
    pub(crate) ray2: f64,
    /// Slopes to the left, and their squares.
    pub(crate) left: &'a [f64],
    pub(crate) left2: &'a [f64],
}

impl Rays<'_> {
    /// Calls `excess` for so many rays at once, with one over the depth and the square of the distance to depth 1.
    #[inline]
    fn each(
        &self,
        inverse_depth: &mut [f64],
        excess_c: &mut [f64],
        excess: impl Fn(f64x4, f64x4) -> f64x4,
    ) {
        let (at_axis, by_slope) = self.inverse_depth;
        let (at_axis, by_slope) = (f64x4::splat(at_axis), f64x4::splat(by_slope));
        let ray2 = f64x4::splat(self.ray2);
        let slopes = self
            .left
            .chunks_exact(LANES)
            .zip(self.left2.chunks_exact(LANES));
        let places = inverse_depth
            .chunks_exact_mut(LANES)
            .zip(excess_c.chunks_exact_mut(LANES));
        for ((left, left2), (inverse_depth, excess_c)) in slopes.zip(places) {
            let depths = at_axis + by_slope * lanes(left);
            inverse_depth.copy_from_slice(depths.as_array_ref());
            excess_c.copy_from_slice(excess(depths, ray2 + lanes(left2)).as_array_ref());
        }
    }
}

/// The first [`LANES`] of a slice of just as many.
#[inline]
pub(crate) fn lanes(values: &[f64]) -> f64x4 {
    let mut lanes = [0.0; LANES];
    lanes.copy_from_slice(values);
    f64x4::new(lanes)
}

pub(crate) fn fourth_power(kelvin: f64) -> f64 {
    let square = kelvin * kelvin;
    square * square
}

/// Two square roots, which IEEE 754 fixes to the last bit; `powf(0.25)` differs between C libraries.
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
    fn the_series_is_the_root() {
        for (law, celsius, ambient_c) in [
            (Law::B, 31.0, 20.0),
            (Law::A, 31.0, 20.0),
            (Law::B, 4.0, 23.5),
            (Law::B, 60.0, 20.0),
            (Law::B, 20.0, 20.0),
        ] {
            let air = Air::new(law, ambient_c, 5.0);
            let glow = air.glow(Surface {
                celsius,
                emissivity: 0.95,
            });
            for nearest_m in [0.3, 0.5, 0.95, 3.0] {
                let root = air.root(&glow, nearest_m);
                let person = (20.0..=31.0).contains(&celsius);
                assert!(!person || matches!(root, Root::Series(_)), "{nearest_m}");
                let left: Vec<f64> = (1..=96).map(|step| f64::from(step) / 96.0).collect();
                let rays = Rays {
                    inverse_depth: (0.0, 1.0 / nearest_m),
                    ray2: 1.0,
                    left: &left,
                    left2: &[0.0; 96],
                };
                let (mut inverse_depth, mut found) = ([0.0; 96], [0.0; 96]);
                air.excesses(&glow, &root, &rays, &mut inverse_depth, &mut found);
                assert_eq!(inverse_depth[95], 1.0 / nearest_m);
                for (found, inverse_depth) in found.iter().zip(inverse_depth) {
                    let expected = air.excess(&glow, 1.0 / (inverse_depth * inverse_depth));
                    assert!(
                        (found - expected).abs() < 1e-12,
                        "{law:?} {celsius} {nearest_m} {inverse_depth}: {found} {expected}"
                    );
                }
            }
        }
        let air = Air::new(Law::B, 20.0, 5.0);
        let metal = air.glow(Surface {
            celsius: 1500.0,
            emissivity: 1.0,
        });
        assert!(matches!(air.root(&metal, 0.5), Root::Exact));
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
