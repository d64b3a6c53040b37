//! Colours: inferno for temperatures, blue to red for differences.

use crate::numbers::count;
/// A colour as red, green and blue of 0 to 255.
pub type Rgb = [u8; 3];

/// Every seventeenth colour of matplotlib's inferno (Smith and van der Walt, CC0); between them it is straight to
/// within 7 of 255.
pub const INFERNO: [Rgb; 16] = [
    [0, 0, 4],
    [12, 8, 38],
    [36, 12, 79],
    [66, 10, 104],
    [93, 18, 110],
    [120, 28, 109],
    [147, 38, 103],
    [174, 48, 92],
    [199, 62, 76],
    [221, 81, 58],
    [237, 105, 37],
    [248, 133, 15],
    [252, 165, 10],
    [250, 198, 45],
    [242, 230, 97],
    [252, 255, 164],
];

/// Too cold, equal, too warm: told apart without red-green vision, and by lightness from the middle.
pub(crate) const DIFFERENCE: [Rgb; 3] = [[33, 102, 172], [247, 247, 247], [178, 24, 43]];

/// The colour at a place of 0 to 1 on a row of colours; places beyond are held at the ends.
#[must_use]
pub fn colour(stops: &[Rgb], place: f64) -> Rgb {
    let last = stops.len().saturating_sub(1);
    let position = place.clamp(0.0, 1.0) * count(last);
    let below = (0..last)
        .rev()
        .find(|&stop| count(stop) <= position)
        .unwrap_or(0);
    let share = position - count(below);
    let (from, to) = (stops[below], stops[(below + 1).min(last)]);
    std::array::from_fn(|channel| blend(from[channel], to[channel], share))
}

/// Whether black text is read better than white on a colour (relative luminance, WCAG 2.2).
#[must_use]
pub fn wants_black_text(colour: Rgb) -> bool {
    let linear = colour.map(|channel| (f64::from(channel) / 255.0).powf(2.2));
    0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2] > 0.18
}

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "rounded and held between two bytes, so the value fits"
)]
fn blend(from: u8, to: u8, share: f64) -> u8 {
    let value = f64::from(from) + (f64::from(to) - f64::from(from)) * share.clamp(0.0, 1.0);
    value.round().clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lightness(colour: Rgb) -> f64 {
        0.2126 * f64::from(colour[0])
            + 0.7152 * f64::from(colour[1])
            + 0.0722 * f64::from(colour[2])
    }

    /// A grey print and an eye without colour vision keep the order of temperatures.
    #[test]
    fn inferno_grows_lighter_all_the_way() {
        let colours: Vec<f64> = (0..=150)
            .map(|step| lightness(colour(&INFERNO, f64::from(step) / 150.0)))
            .collect();
        assert!(
            colours.windows(2).all(|pair| pair[1] >= pair[0]),
            "{colours:?}"
        );
        assert_eq!(colour(&INFERNO, 0.0), INFERNO[0]);
        assert_eq!(colour(&INFERNO, 1.0), INFERNO[15]);
        assert_eq!(colour(&INFERNO, 2.0), INFERNO[15]);
        assert_eq!(colour(&INFERNO, 1.0 / 15.0), INFERNO[1]);
    }

    #[test]
    fn differences_are_lightest_at_zero() {
        assert_eq!(colour(&DIFFERENCE, 0.5), DIFFERENCE[1]);
        assert!(lightness(colour(&DIFFERENCE, 0.2)) < lightness(colour(&DIFFERENCE, 0.4)));
        assert!(lightness(colour(&DIFFERENCE, 0.8)) < lightness(colour(&DIFFERENCE, 0.6)));
    }

    #[test]
    fn text_stands_out() {
        assert!(!wants_black_text([0, 0, 4]));
        assert!(wants_black_text([252, 255, 164]));
    }
}
