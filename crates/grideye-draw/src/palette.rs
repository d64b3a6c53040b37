//! Colors: inferno for temperatures, blue to red for differences.

use crate::number::float;

/// A color: red, green and blue, each 0 to 255.
pub type Rgb = [u8; 3];

/// Every seventeenth color of matplotlib's inferno (Smith and van der Walt, CC0). Linear interpolation between them is
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

/// Too cold, equal, too warm: distinct without red-green vision, and lightest in the middle.
pub const DIFFERENCE: [Rgb; 3] = [[33, 102, 172], [247, 247, 247], [178, 24, 43]];

/// Objects in a room without a color of their own (PeerJ CS 11:e3124, "Object placement").
pub const OBJECT: Rgb = [0x5b, 0x8d, 0xd9];
/// People and other agents without one (the same paper, "Agent configuration").
pub const AGENT: Rgb = [0xd6, 0x3b, 0x33];
/// A sensor and what it has in view.
pub const VIEW: Rgb = [0xff, 0xd5, 0x2e];
/// The edges of both.
pub const VIEW_EDGE: Rgb = [0xb8, 0x86, 0x00];
/// The edges of a room's walls.
pub const WALL: Rgb = [0x99; 3];
/// A floor, and walls seen from within.
pub const FLOOR: Rgb = [0xf1; 3];
/// A wall that juts into its room.
pub const JUTTING_WALL: Rgb = [0xe6; 3];
/// Text and other prominent lines.
pub const INK: Rgb = [0x22; 3];
/// Remarks and reading aids.
pub const FAINT: Rgb = [0x6e; 3];
/// A drawing on a page.
pub const PANEL: Rgb = [0xfa; 3];
/// The page.
pub const PAPER: Rgb = [0xff; 3];

/// The color at `place` (0 to 1, clamped) along the stops.
#[must_use]
pub fn color(stops: &[Rgb], place: f64) -> Rgb {
    let last = stops.len().saturating_sub(1);
    let position = place.clamp(0.0, 1.0) * float(last);
    let below = (0..last)
        .rev()
        .find(|&stop| float(stop) <= position)
        .unwrap_or(0);
    let share = position - float(below);
    let (from, to) = (stops[below], stops[(below + 1).min(last)]);
    std::array::from_fn(|channel| blend(from[channel], to[channel], share))
}

/// Black or white as SVG and CSS write it, whichever is more readable on a color (relative luminance, WCAG 2.2).
#[must_use]
pub fn ink(color: Rgb) -> &'static str {
    let linear = color.map(|channel| (f64::from(channel) / 255.0).powf(2.2));
    let luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
    if luminance > 0.18 { "#000" } else { "#fff" }
}

/// A color as SVG and CSS write it: `#0a10ff`.
#[must_use]
pub fn hex([red, green, blue]: Rgb) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "rounded and between two bytes, so the value fits"
)]
fn blend(from: u8, to: u8, share: f64) -> u8 {
    let value = f64::from(from) + (f64::from(to) - f64::from(from)) * share.clamp(0.0, 1.0);
    value.round().clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lightness(color: Rgb) -> f64 {
        0.2126 * f64::from(color[0]) + 0.7152 * f64::from(color[1]) + 0.0722 * f64::from(color[2])
    }

    /// Keeps temperatures in order on gray prints and for eyes without color vision.
    #[test]
    fn inferno_grows_lighter_all_the_way() {
        let colors: Vec<f64> = (0..=150)
            .map(|step| lightness(color(&INFERNO, f64::from(step) / 150.0)))
            .collect();
        assert!(
            colors.windows(2).all(|pair| pair[1] >= pair[0]),
            "{colors:?}"
        );
        assert_eq!(color(&INFERNO, 0.0), INFERNO[0]);
        assert_eq!(color(&INFERNO, 1.0), INFERNO[15]);
        assert_eq!(color(&INFERNO, 2.0), INFERNO[15]);
        assert_eq!(color(&INFERNO, 1.0 / 15.0), INFERNO[1]);
    }

    #[test]
    fn differences_are_lightest_at_zero() {
        assert_eq!(color(&DIFFERENCE, 0.5), DIFFERENCE[1]);
        assert!(lightness(color(&DIFFERENCE, 0.2)) < lightness(color(&DIFFERENCE, 0.4)));
        assert!(lightness(color(&DIFFERENCE, 0.8)) < lightness(color(&DIFFERENCE, 0.6)));
    }

    #[test]
    fn text_stands_out() {
        assert_eq!(ink([0, 0, 4]), "#fff");
        assert_eq!(ink([252, 255, 164]), "#000");
    }
}
