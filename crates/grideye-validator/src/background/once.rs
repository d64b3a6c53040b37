//! What a background and a scene both have, such as a radiator: it is there once.

use crate::constants::UNCLAIMED_MIN_C;
use crate::frames::types::{Pixels, around, patches};
use crate::numbers::{count, median};
use grideye_draw::text::fixed;
use grideye_frame::{COLUMNS, PIXELS};

/// What the scene shows of an object that the background shows too.
pub(crate) struct Shared {
    /// Above or below the room, °C; 0 elsewhere.
    pub(crate) celsius: Pixels,
    /// The pixels, from 0, and the most that they show.
    rows: [usize; 2],
    columns: [usize; 2],
    most_c: f64,
}

/// Share of an object that the background must show to have it.
const HALF: f64 = 0.5;

impl Shared {
    /// Of a background (°C above the room) and the scene's empty room: each patch of it that is warmer or colder than the
    /// room, with the pixels about it, if the background follows it by half or more.
    pub(crate) fn of(background_c: &Pixels, empty_room_c: &[f64]) -> Vec<Self> {
        let level_c = median(empty_room_c).unwrap_or_default();
        let shown: Pixels = std::array::from_fn(|pixel| {
            empty_room_c
                .get(pixel)
                .map_or(0.0, |celsius| celsius - level_c)
        });
        let mut all = patches(|pixel| shown[pixel].abs() > UNCLAIMED_MIN_C);
        all.retain(|patch| slope(background_c, &shown, &with_edge(patch)) > HALF);
        all.iter().map(|patch| Self::new(&shown, patch)).collect()
    }

    fn new(shown: &Pixels, patch: &[usize]) -> Self {
        let edge = with_edge(patch);
        let extent = |of: fn(usize) -> usize| {
            let all = patch.iter().map(|pixel| of(*pixel));
            [all.clone().min().unwrap_or(0), all.max().unwrap_or(0)]
        };
        let most = patch.iter().map(|pixel| shown[*pixel]);
        Self {
            celsius: std::array::from_fn(|pixel| match edge.contains(&pixel) {
                true => shown[pixel],
                false => 0.0,
            }),
            rows: extent(|pixel| pixel / COLUMNS),
            columns: extent(|pixel| pixel % COLUMNS),
            most_c: most.fold(
                0.0,
                |most: f64, one| if one.abs() > most.abs() { one } else { most },
            ),
        }
    }

    pub(crate) fn warning(&self, as_measured: bool) -> String {
        let to = |[first, last]: [usize; 2]| match first == last {
            true => format!(" {}", first + 1),
            false => format!("s {} to {}", first + 1, last + 1),
        };
        let has = if as_measured { "background" } else { "scene" };
        let word = if self.most_c < 0.0 {
            "colder"
        } else {
            "warmer"
        };
        format!(
            "the scene and the profile's background both have what is up to {} °C {word} in row{}, column{}: it was counted once, as the {has} has it\nhint: measure the profile with the scene: `grideye characterize EMPTY.csv --scene SCENE --profile FILE`",
            fixed(self.most_c.abs(), 1),
            to(self.rows),
            to(self.columns)
        )
    }
}

fn with_edge(patch: &[usize]) -> Vec<usize> {
    let is_near = |pixel: &usize| around(*pixel).any(|near| patch.contains(&near));
    (0..PIXELS).filter(is_near).collect()
}

/// How much of what is shown there the background has: the least squares' slope, beside any level.
fn slope(background_c: &Pixels, shown: &Pixels, pixels: &[usize]) -> f64 {
    let mean =
        |of: &Pixels| pixels.iter().map(|pixel| of[*pixel]).sum::<f64>() / count(pixels.len());
    let (middle_c, middle) = (mean(background_c), mean(shown));
    let (mut product, mut square) = (0.0, 0.0);
    for &pixel in pixels {
        product += (background_c[pixel] - middle_c) * (shown[pixel] - middle);
        square += (shown[pixel] - middle).powi(2);
    }
    if square > 0.0 { product / square } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A room of 20 °C with 2 x 2 pixels of 24 in a corner, and a colder one elsewhere.
    fn room() -> Pixels {
        let mut room = [20.0; PIXELS];
        [9, 10, 17, 18]
            .into_iter()
            .for_each(|pixel| room[pixel] = 24.0);
        room[61] = 18.0;
        room
    }

    /// A unit's pattern of up to 0.6 °C, and a slope.
    fn pattern(pixel: usize) -> f64 {
        0.12 * count(pixel * 37 % 11) - 0.6 + 0.1 * count(pixel % COLUMNS)
    }

    #[test]
    fn an_object_that_both_have_is_found_and_no_other() {
        let background = |share: f64| -> Pixels {
            std::array::from_fn(|pixel| pattern(pixel) + share * (room()[pixel] - 20.0).max(0.0))
        };
        for share in [0.8, 1.0, 1.3] {
            let found = Shared::of(&background(share), &room());
            let [one] = found.as_slice() else {
                panic!("{share}: {} found", found.len());
            };
            assert_eq!(
                (one.celsius[9], one.celsius[61], one.most_c),
                (4.0, 0.0, 4.0)
            );
            assert!(
                one.warning(true)
                    .contains("4.0 °C warmer in rows 2 to 3, columns 2 to 3:")
            );
        }
        for share in [0.0, -0.2, 0.2] {
            assert!(
                Shared::of(&background(share), &room()).is_empty(),
                "{share}"
            );
        }
        // What only the background has is the room's.
        assert!(Shared::of(&background(1.0), &[20.0; PIXELS]).is_empty());
    }
}
