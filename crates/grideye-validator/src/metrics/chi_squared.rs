//! Chi squared of the residuals between a frame and its claim, and its probability under noise.

use crate::numbers::{comparable, count, finite, sum_of};
use std::iter::Sum;

/// Sum of squared residuals in units of the noise variance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ChiSquared {
    /// The sum.
    pub value: f64,
    /// Expected value if claim and noise are right: pixels less one per frame, since the common offset is removed.
    pub degrees_of_freedom: usize,
}

impl ChiSquared {
    /// The sum per degree of freedom, about 1 if claim and noise are right.
    #[must_use]
    pub fn per_degree(&self) -> Option<f64> {
        finite(self.value / count(self.degrees_of_freedom))
    }

    /// Probability that noise alone makes at least this much.
    #[must_use]
    pub fn p_value(&self) -> Option<f64> {
        survival(self.value, self.degrees_of_freedom)
    }
}

impl Sum for ChiSquared {
    fn sum<I: Iterator<Item = Self>>(frames: I) -> Self {
        frames.fold(Self::default(), |sum, frame| Self {
            value: sum.value + frame.value,
            degrees_of_freedom: sum.degrees_of_freedom + frame.degrees_of_freedom,
        })
    }
}

/// `sum((real - claim - mean(real - claim))^2) / sigma^2`; `None` for fewer than two pixels or a sigma not above zero.
#[must_use]
pub fn chi_squared(real: &[f64], claim: &[f64], sigma_c: f64) -> Option<ChiSquared> {
    comparable(real, claim)?;
    let pixels = real.len();
    if pixels < 2 || !(sigma_c > 0.0 && sigma_c.is_finite()) {
        return None;
    }
    let offset = sum_of(real, claim, |x, y| x - y) / count(pixels);
    let squares = sum_of(real, claim, |x, y| (x - y - offset) * (x - y - offset));
    Some(ChiSquared {
        value: finite(squares / (sigma_c * sigma_c))?,
        degrees_of_freedom: pixels - 1,
    })
}

/// Probability that chi squared is at least `value`: `Q(degrees / 2, value / 2)` (Numerical Recipes, section 6.2).
#[must_use]
pub fn survival(value: f64, degrees_of_freedom: usize) -> Option<f64> {
    if degrees_of_freedom == 0 || !(value >= 0.0 && value.is_finite()) {
        return None;
    }
    let (shape, x) = (count(degrees_of_freedom) / 2.0, value / 2.0);
    if x <= 0.0 {
        return Some(1.0);
    }
    let front = (shape * x.ln() - x - ln_gamma(shape)).exp();
    let upper = if x < shape + 1.0 {
        1.0 - front * series(shape, x)
    } else {
        front * continued_fraction(shape, x)
    };
    finite(upper.clamp(0.0, 1.0))
}

/// Terms after which either series has converged; near the mean it needs about the root of the shape.
fn terms_max(shape: f64) -> u32 {
    let terms = 200.0 + 20.0 * shape.sqrt();
    // A million frames of 63 degrees of freedom stay below 120,000 terms.
    (0..21)
        .map(|bit| 1_u32 << bit)
        .find(|&terms_max| f64::from(terms_max) >= terms)
        .unwrap_or(1 << 20)
}

fn series(shape: f64, x: f64) -> f64 {
    let mut term = 1.0 / shape;
    let mut sum = term;
    for n in 1..terms_max(shape) {
        term *= x / (shape + f64::from(n));
        sum += term;
        if term < sum * f64::EPSILON {
            break;
        }
    }
    sum
}

/// Lentz's method.
fn continued_fraction(shape: f64, x: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let above_zero = |value: f64| if value.abs() < TINY { TINY } else { value };
    let mut b = x + 1.0 - shape;
    let mut c = 1.0 / TINY;
    let mut d = 1.0 / above_zero(b);
    let mut fraction = d;
    for n in 1..terms_max(shape) {
        let n = f64::from(n);
        let a = -n * (n - shape);
        b += 2.0;
        d = 1.0 / above_zero(a * d + b);
        c = above_zero(b + a / c);
        let change = d * c;
        fraction *= change;
        if (change - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    fraction
}

/// ln Γ from 1/2: recurrence up to 16, then Stirling's series (Abramowitz and Stegun, 6.1.41).
fn ln_gamma(shape: f64) -> f64 {
    let (mut z, mut product) = (shape, 1.0);
    while z < 16.0 {
        product *= z;
        z += 1.0;
    }
    let square = z * z;
    let series = (1.0 / 12.0
        - (1.0 / 360.0 - (1.0 / 1260.0 - 1.0 / (1680.0 * square)) / square) / square)
        / z;
    (z - 0.5) * z.ln() - z + 0.5 * (2.0 * std::f64::consts::PI).ln() + series - f64::ln(product)
}
