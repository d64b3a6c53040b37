//! What each pixel shows too much: what is not smooth in the background.

use crate::characterize::characterization::Pattern;
use crate::characterize::histogram::Histogram;
use crate::characterize::limits::DIFFERENCE_BIN_C;
use crate::frames::pixels::Pixels;
use crate::numbers::{count, median};
use grideye_frame::{COLUMNS, PIXELS, ROWS};

/// What each pixel mostly is beside the others, segment by segment.
#[derive(Debug)]
pub(crate) struct PatternFinder(Vec<Histogram>);

impl Default for PatternFinder {
    fn default() -> Self {
        Self(vec![Histogram::new(DIFFERENCE_BIN_C); PIXELS])
    }
}

impl PatternFinder {
    /// Takes the levels of the pixels over one segment.
    pub(crate) fn push(&mut self, base: &Pixels) {
        let middle = median(base).unwrap_or_default();
        for (histogram, level) in self.0.iter_mut().zip(base) {
            histogram.push(level - middle);
        }
    }

    /// The middle of all segments, in which someone who sits in some of them does not show.
    /// `mean_c` is the mean of each pixel.
    pub(crate) fn finish(self, mean_c: Pixels) -> Option<Pattern> {
        if self.0.first().is_none_or(|pixel| pixel.total() == 0) {
            return None;
        }
        let levels: Pixels =
            std::array::from_fn(|pixel| self.0[pixel].quantile(0.5).unwrap_or(0.0));
        let surface_c = smooth(&levels);
        let offset_c: Pixels = std::array::from_fn(|pixel| levels[pixel] - surface_c[pixel]);
        let squares: f64 = offset_c.iter().map(|offset| offset * offset).sum();
        Some(Pattern {
            mean_c,
            surface_c,
            offset_c,
            sd_c: (squares / count(PIXELS - SURFACES)).sqrt(),
        })
    }
}

/// Functions of the surface that is taken for the scene's.
const SURFACES: usize = 6;

/// The smooth surface of second order nearest to the levels: 1, x, y, xy, and the squares of x and y. On a full grid
/// these are orthogonal once the squares have lost their mean, so that each has its own share.
fn smooth(levels: &Pixels) -> Pixels {
    let axis = |place: usize, of: usize| count(place) - (count(of) - 1.0) / 2.0;
    let at = |pixel: usize| (axis(pixel % COLUMNS, COLUMNS), axis(pixel / COLUMNS, ROWS));
    let mean_square = |of: usize| (count(of) * count(of) - 1.0) / 12.0;
    let functions: [&dyn Fn(f64, f64) -> f64; SURFACES] = [
        &|_, _| 1.0,
        &|x, _| x,
        &|_, y| y,
        &|x, y| x * y,
        &|x, _| x * x - mean_square(COLUMNS),
        &|_, y| y * y - mean_square(ROWS),
    ];
    let mut surface = [0.0; PIXELS];
    for function in functions {
        let values: Pixels = std::array::from_fn(|pixel| {
            let (x, y) = at(pixel);
            function(x, y)
        });
        let squares: f64 = values.iter().map(|value| value * value).sum();
        let product: f64 = values
            .iter()
            .zip(levels)
            .map(|(value, level)| value * level)
            .sum();
        for (sum, value) in surface.iter_mut().zip(values) {
            *sum += product / squares * value;
        }
    }
    surface
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_scene_is_no_pattern() {
        let scene: Pixels = std::array::from_fn(|pixel| {
            let (x, y) = (count(pixel % 8), count(pixel / 8));
            0.3 + 0.1 * x - 0.05 * y + 0.01 * x * y - 0.02 * x * x + 0.015 * y * y
        });
        let left: Vec<f64> = scene
            .iter()
            .zip(smooth(&scene))
            .map(|(scene, smooth)| scene - smooth)
            .collect();
        assert!(left.iter().all(|left| left.abs() < 1e-12), "{left:?}");
    }

    #[test]
    fn one_odd_pixel_is_found_although_someone_sits_elsewhere_for_a_while() {
        let mut finder = PatternFinder::default();
        for segment in 0..11 {
            let mut base = [21.0; PIXELS];
            base[27] += 0.5;
            if segment < 4 {
                base[40..46].fill(24.0);
            }
            finder.push(&base);
        }
        let pattern = finder.finish([21.0; PIXELS]).unwrap();
        assert!(
            (pattern.offset_c[27] - 0.5).abs() < 0.06,
            "{:?}",
            pattern.offset_c
        );
        assert!(pattern.offset_c[42].abs() < 0.06);
        // One of 64 by 0.5: sqrt(0.25 / 58).
        assert!((pattern.sd_c - 0.0657).abs() < 0.01, "{}", pattern.sd_c);
    }
}
