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

use crate::geometry::count;
use pulp::{Simd, bytemuck};

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

    /// The best way to take the fourth root on a surface between these distances, meters.
    pub(crate) fn root(&self, glow: &Glow, (nearest_m, farthest_m): (f64, f64)) -> Root {
        if nearest_m <= NEAR_M {
            return Root::Exact;
        }
        let weight = |distance_m: f64| self.weight(glow, distance_m * distance_m);
        let weights = (weight(farthest_m), weight(nearest_m));
        Series::new(self, glow, weights).map_or(Root::Exact, Root::Series)
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

#[derive(Debug, Clone)]
pub(crate) enum Root {
    /// By two square roots, which take several times as long as a multiplication.
    Exact,
    /// By a power series with an error below [`SERIES_ERROR_C`].
    Series(Series),
}

/// Largest error of the series, °C; each power saved is a twentieth of the work in a cell.
const SERIES_ERROR_C: f64 = 1e-11;

/// The part of that error due to truncating Taylor's series: a few times the last bit of 300 K.
const TAYLOR_ERROR_C: f64 = 3e-13;

/// No shorter series has its own loop.
const SERIES_TERMS_MIN: usize = 5;

/// Beyond this many terms, square roots are as fast.
const SERIES_TERMS_MAX: usize = 16;

/// Taylor's series of the excess in the law's weight. Chebyshev polynomials replace the highest powers with lower ones,
/// within the error (Lanczos 1938).
#[derive(Debug, Clone)]
pub(crate) struct Series {
    center: f64,
    /// From the lowest order; the first `terms` of them are used.
    coefficients: [f64; SERIES_TERMS_MAX],
    terms: usize,
}

impl Series {
    /// For weights in this range; `None` if the series converges too slowly, as for glowing metal.
    fn new(air: &Air, glow: &Glow, (weight_min, weight_max): (f64, f64)) -> Option<Self> {
        let center = 0.5 * (weight_min + weight_max);
        let middle_k4 = air.ambient_k4 + center * glow.excess_k4;
        let middle_k = fourth_root(middle_k4);
        let ratio = glow.excess_k4 / middle_k4;
        let reach = (ratio * 0.5 * (weight_max - weight_min)).abs();
        let mut series = Self {
            center,
            coefficients: [0.0; SERIES_TERMS_MAX],
            terms: 0,
        };
        // Terms of (1 + x)^(1/4): each is the previous one times (1/4 - n) / (n + 1) times x.
        let (mut coefficient, mut bound_c, mut order) = (middle_k, middle_k, 0.0);
        for place in &mut series.coefficients {
            *place = coefficient;
            series.terms += 1;
            let next = (0.25 - order) / (order + 1.0);
            coefficient *= next * ratio;
            bound_c *= next.abs() * reach;
            order += 1.0;
            // The omitted terms decrease at least as fast as a geometric series of `reach`.
            if bound_c <= TAYLOR_ERROR_C * (1.0 - reach) {
                series.coefficients[0] -= air.ambient_k;
                series.economize(0.5 * (weight_max - weight_min));
                return Some(series);
            }
        }
        None
    }

    /// Drops the highest powers as far as the error allows, for weights within `half` of the center.
    fn economize(&mut self, half: f64) {
        let mut error_c = TAYLOR_ERROR_C;
        while self.terms > SERIES_TERMS_MIN {
            let order = self.terms - 1;
            // Bounds a Chebyshev polynomial with leading coefficient 1 over these weights.
            let bound = (0..order).fold(2.0, |bound, _| 0.5 * bound * half);
            error_c += (self.coefficients[order] * bound).abs();
            if error_c > SERIES_ERROR_C {
                return;
            }
            let mut coefficient = std::mem::take(&mut self.coefficients[order]);
            self.terms = order;
            for step in 0..order / 2 {
                let power = count::float(order - 2 * step);
                let (next, rest) = (count::float(step + 1), count::float(order - step - 1));
                coefficient *= half * half * power * (power - 1.0) / (4.0 * next * rest);
                if step % 2 == 0 {
                    self.coefficients[order - 2 * step - 2] += coefficient;
                } else {
                    self.coefficients[order - 2 * step - 2] -= coefficient;
                }
            }
        }
    }
}

pub(crate) trait Shade {
    /// °C above ambient, from the inverse of each ray's depth and its squared distance at depth 1.
    fn excesses_c<S: Simd>(&self, simd: S, inverse_depths: S::f64s, rays2: S::f64s) -> S::f64s;
}

pub(crate) trait WithShade<S: Simd> {
    fn with(self, simd: S, shade: impl Shade);
}

/// The first `TERMS` numbers of a [`Series`], copied so that the loop keeps them in registers.
struct BySeries<const IS_LAW_A: bool, const TERMS: usize> {
    emissivity: f64,
    center: f64,
    coefficients: [f64; TERMS],
}

impl<const IS_LAW_A: bool, const TERMS: usize> BySeries<IS_LAW_A, TERMS> {
    #[inline(always)]
    fn new(emissivity: f64, series: &Series) -> Self {
        let mut coefficients = [0.0; TERMS];
        coefficients.copy_from_slice(&series.coefficients[..TERMS]);
        Self {
            emissivity,
            center: series.center,
            coefficients,
        }
    }

    #[inline(always)]
    fn evaluate<S: Simd>(&self, simd: S, weights: S::f64s) -> S::f64s {
        // Separate even and odd powers, so that fewer steps wait. No fused multiply-add: its last bits differ by
        // processor.
        let powers = simd.sub_f64s(weights, simd.splat_f64s(self.center));
        let squares = simd.mul_f64s(powers, powers);
        let mut even = simd.splat_f64s(self.coefficients[(TERMS - 1) / 2 * 2]);
        for term in (0..TERMS.div_ceil(2) - 1).rev() {
            let coefficient = simd.splat_f64s(self.coefficients[2 * term]);
            even = simd.add_f64s(simd.mul_f64s(even, squares), coefficient);
        }
        let mut odd = simd.splat_f64s(self.coefficients[TERMS / 2 * 2 - 1]);
        for term in (0..TERMS / 2 - 1).rev() {
            let coefficient = simd.splat_f64s(self.coefficients[2 * term + 1]);
            odd = simd.add_f64s(simd.mul_f64s(odd, squares), coefficient);
        }
        simd.add_f64s(even, simd.mul_f64s(odd, powers))
    }
}

struct ByRoots<'a> {
    air: &'a Air,
    glow: &'a Glow,
}

impl<const IS_LAW_A: bool, const TERMS: usize> Shade for BySeries<IS_LAW_A, TERMS> {
    #[inline(always)]
    fn excesses_c<S: Simd>(&self, simd: S, inverse_depths: S::f64s, rays2: S::f64s) -> S::f64s {
        let squares = simd.mul_f64s(inverse_depths, inverse_depths);
        let radiating = simd.mul_f64s(simd.splat_f64s(self.emissivity), squares);
        let weights = if IS_LAW_A {
            let whole = simd.splat_f64s(1.0);
            let weights = simd.div_f64s(radiating, rays2);
            simd.select_f64s_m64s(simd.less_than_f64s(weights, whole), weights, whole)
        } else {
            simd.div_f64s(radiating, simd.add_f64s(radiating, rays2))
        };
        self.evaluate(simd, weights)
    }
}

impl Shade for ByRoots<'_> {
    #[inline(always)]
    fn excesses_c<S: Simd>(&self, simd: S, inverse_depths: S::f64s, rays2: S::f64s) -> S::f64s {
        let squares = simd.mul_f64s(inverse_depths, inverse_depths);
        let mut excesses_c = simd.div_f64s(rays2, squares);
        for place in bytemuck::cast_slice_mut::<S::f64s, f64>(std::slice::from_mut(&mut excesses_c))
        {
            *place = self.air.excess(self.glow, *place);
        }
        excesses_c
    }
}

impl Air {
    /// Runs a task with the shade of a surface, its law and number of terms being compile-time constants.
    #[inline(always)]
    pub(crate) fn shade<S: Simd>(
        &self,
        simd: S,
        glow: &Glow,
        root: &Root,
        task: impl WithShade<S>,
    ) {
        let Root::Series(series) = root else {
            task.with(simd, ByRoots { air: self, glow });
            return;
        };
        match self.law {
            Law::A => series.shade_a(simd, glow.emissivity, task),
            Law::B => series.shade_b(simd, glow.emissivity, task),
        }
    }
}

impl Series {
    /// Rounds up to a compiled number of terms, because each number is a separate loop.
    #[inline(always)]
    fn shade_b<S: Simd>(&self, simd: S, emissivity: f64, task: impl WithShade<S>) {
        match self.terms {
            ..=5 => task.with(simd, BySeries::<false, 5>::new(emissivity, self)),
            6 => task.with(simd, BySeries::<false, 6>::new(emissivity, self)),
            7 => task.with(simd, BySeries::<false, 7>::new(emissivity, self)),
            8 => task.with(simd, BySeries::<false, 8>::new(emissivity, self)),
            9..=10 => task.with(simd, BySeries::<false, 10>::new(emissivity, self)),
            _ => task.with(
                simd,
                BySeries::<false, SERIES_TERMS_MAX>::new(emissivity, self),
            ),
        }
    }

    #[inline(always)]
    fn shade_a<S: Simd>(&self, simd: S, emissivity: f64, task: impl WithShade<S>) {
        match self.terms {
            ..=8 => task.with(simd, BySeries::<true, 8>::new(emissivity, self)),
            _ => task.with(
                simd,
                BySeries::<true, SERIES_TERMS_MAX>::new(emissivity, self),
            ),
        }
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

    /// Finds the largest difference between a shade and the law.
    struct Differences<'a> {
        air: Air,
        glow: Glow,
        nearest_m: f64,
        largest: &'a mut f64,
    }

    impl<S: Simd> WithShade<S> for &mut Differences<'_> {
        fn with(self, simd: S, shade: impl Shade) {
            for step in 1..=96 {
                let inverse_depth = f64::from(step) / 96.0 / self.nearest_m;
                let expected = self
                    .air
                    .excess(&self.glow, 1.0 / (inverse_depth * inverse_depth));
                let (depths, rays2) = (simd.splat_f64s(inverse_depth), simd.splat_f64s(1.0));
                let found = [shade.excesses_c(simd, depths, rays2)];
                let difference = (bytemuck::cast_slice::<_, f64>(&found)[0] - expected).abs();
                *self.largest = self.largest.max(difference);
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
                let root = air.root(&glow, (nearest_m, f64::INFINITY));
                let person = (20.0..=31.0).contains(&celsius);
                assert!(!person || matches!(root, Root::Series(_)), "{nearest_m}");
                let mut task = Differences {
                    air,
                    glow,
                    nearest_m,
                    largest: &mut 0.0,
                };
                air.shade(pulp::Scalar256b, &glow, &root, &mut task);
                assert!(*task.largest < 1.1e-11, "{law:?} {celsius} {nearest_m}");
            }
        }
        let air = Air::new(Law::B, 20.0, 5.0);
        let metal = air.glow(Surface {
            celsius: 1500.0,
            emissivity: 1.0,
        });
        assert!(matches!(
            air.root(&metal, (0.5, f64::INFINITY)),
            Root::Exact
        ));
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
