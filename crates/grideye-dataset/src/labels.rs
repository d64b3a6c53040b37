//! Labels of one frame, as a person who looks at it would give them.

use grideye_scene::count::single;
use grideye_scene::{Agent, Filled, Image, Mask};
use std::time::Duration;

/// From when on somebody in the image counts as in view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CountsFrom {
    /// Pixels that show the agent: the sum of its mask.
    pub pixels: f64,
    /// What the agent changes in its warmest or coldest pixel, °C.
    pub contrast_c: f64,
}

impl Default for CountsFrom {
    /// People who label frames do not see somebody who fills one pixel at the edge: on LINAIGE, networks trained on
    /// simulated frames alone counted real people better from 2.5 pixels on than from 0.7; with real frames added, better
    /// from 2 on than from 0.7. The contrast is an assumption: real empty frames vary by 0.5 to 1.25 °C and real people
    /// stand out by 1 °C and more, noise included; half of that is left without it.
    fn default() -> Self {
        Self {
            pixels: 2.5,
            contrast_c: 0.5,
        }
    }
}

/// What is known of an agent in a frame.
#[derive(Debug)]
pub struct Label {
    /// Its position, meters.
    pub position_m: [f64; 3],
    /// Visible share of the agent, 0 to 1.
    pub visibility: f64,
    /// How many pixels the agent would fill if nothing hid it.
    pub pixels: f64,
    /// What it changes in the pixel where it changes most, °C.
    pub contrast_c: f64,
    /// Whether it counts as in view.
    pub counts: bool,
    /// Whether nobody could think otherwise: it fills less than [`UNSEEN_PIXELS`], or as much as counts.
    pub(crate) clear: bool,
    /// Column and row of its middle, from the middle of the first pixel; `None` out of view.
    pub center_px: Option<[f64; 2]>,
    /// Left, top, right and bottom edge of its box, pixels; `None` out of view.
    pub box_px: Option<[f64; 4]>,
    /// A person's posture.
    pub posture: Option<&'static str>,
    /// What a person does.
    pub doing: Option<&'static str>,
    /// The agent's share of each pixel, 0 to 1.
    pub mask: Vec<f32>,
}

/// Whoever labels a frame sees nobody who fills less than one pixel.
const UNSEEN_PIXELS: f64 = 1.0;

/// A pixel belongs to an agent's box from this share on.
const BOX_SHARE: f64 = 0.25;

/// The labels of the agents who are in the room, in the order of the scene.
pub(crate) fn labels(
    agents: &[Agent],
    time: Duration,
    filled: Vec<Filled>,
    (truth, empty): (&Image, &Image),
    from: CountsFrom,
) -> Vec<Option<Label>> {
    let changes = truth.celsius.iter().zip(&empty.celsius);
    let changes: Vec<f64> = changes
        .map(|(with, without)| (with - without).abs())
        .collect();
    let shares = |pixel: usize| filled.iter().map(move |filled| filled.seen.share[pixel]);
    let contrasts = filled.iter().map(|filled| {
        let mine = filled.seen.share.iter().enumerate();
        let mine = mine.filter(|(_, share)| **share > 0.0);
        let mine = mine.map(|(pixel, share)| changes[pixel] * share / shares(pixel).sum::<f64>());
        mine.fold(0.0, f64::max)
    });
    let contrasts: Vec<f64> = contrasts.collect();
    let labels = agents.iter().zip(filled).zip(contrasts);
    let labels = labels.map(|((agent, filled), contrast_c)| {
        agent.is_here(time).then(|| {
            let pixels = filled.seen.pixels();
            Label {
                position_m: agent.position_m(time).to_array(),
                visibility: filled.visibility(),
                pixels: filled.unhidden.pixels(),
                contrast_c,
                counts: pixels > 0.0 && pixels >= from.pixels && contrast_c >= from.contrast_c,
                clear: pixels < UNSEEN_PIXELS || pixels >= from.pixels,
                center_px: center_px(&filled.seen),
                box_px: box_px(&filled.seen),
                posture: agent.posture(time).map(grideye_scene::Posture::name),
                doing: agent.doing(time).map(grideye_scene::Doing::name),
                mask: filled.seen.share.into_iter().map(single).collect(),
            }
        })
    });
    labels.collect()
}

/// Column, row and share of each pixel.
fn pixels(mask: &Mask) -> impl Iterator<Item = ([f64; 2], f64)> {
    let pixels = (0_u32..).zip(&mask.share);
    let columns = u32::try_from(mask.columns).unwrap_or(u32::MAX);
    pixels.map(move |(pixel, share)| {
        let (column, row) = (pixel % columns, pixel / columns);
        ([f64::from(column), f64::from(row)], *share)
    })
}

fn center_px(mask: &Mask) -> Option<[f64; 2]> {
    let whole = mask.pixels();
    let sum = |axis: usize| -> f64 { pixels(mask).map(|(at, share)| share * at[axis]).sum() };
    (whole > 0.0).then(|| [sum(0) / whole, sum(1) / whole])
}

/// Around the pixels of which the agent fills a quarter; if there are none, around the one it fills most.
fn box_px(mask: &Mask) -> Option<[f64; 4]> {
    let most = mask.share.iter().copied().fold(0.0, f64::max);
    if most <= 0.0 {
        return None;
    }
    let nothing = [f64::INFINITY, f64::INFINITY, 0.0, 0.0];
    let inside = pixels(mask).filter(|(_, share)| *share >= most.min(BOX_SHARE));
    Some(
        inside.fold(nothing, |[left, top, right, bottom], ([column, row], _)| {
            [
                left.min(column),
                top.min(row),
                right.max(column + 1.0),
                bottom.max(row + 1.0),
            ]
        }),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_around_what_the_agent_fills() {
        let mut mask = Mask {
            columns: 4,
            rows: 3,
            share: vec![0.0; 12],
        };
        assert_eq!((center_px(&mask), box_px(&mask)), (None, None));
        mask.share[7] = 0.1;
        assert_eq!(box_px(&mask), Some([3.0, 1.0, 4.0, 2.0]));
        let [column, row] = center_px(&mask).unwrap();
        assert!((column - 3.0).abs() < 1e-12 && (row - 1.0).abs() < 1e-12);
        // Columns 1 and 2 of the last row.
        mask.share[7] = 0.0;
        mask.share[9] = 0.75;
        mask.share[10] = 0.25;
        assert_eq!(box_px(&mask), Some([1.0, 2.0, 3.0, 3.0]));
        assert_eq!(center_px(&mask), Some([1.25, 2.0]));
    }
}
