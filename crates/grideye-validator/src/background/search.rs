//! The search for empty stretches, and the background in them.

use crate::background::fit::{Empty, Stretch};
use crate::background::split::put_shown_into;
use crate::characterize::Characterization;
use crate::characterize::presence::stays_warm;
use crate::frames::types::{Pixels, decoded, middle_mean, two_by_two};
use crate::numbers::{count, median, trimmed_mean};
use grideye_frame::PIXELS;
use grideye_recording::Record;
use grideye_scene::profile::Profile;
use std::time::Duration;

/// Frames per mean: a second at full rate.
const BLOCK_FRAMES: usize = 10;
/// A longer interval between two frames ends a mean.
const GAP: Duration = Duration::from_secs(1);
/// Means in a row that make a stretch, including its two ends.
const STRETCH_BLOCKS: usize = 5;
/// A cluster has one in this many of the means.
const CLUSTER: usize = 8;
/// The coldest cluster up to this many times as wide as the narrowest wins, because few means spread wider.
const WIDTH_SLACK: f64 = 4.0;
/// Sigmas of 2 x 2 pixels that count as a person: chance makes them in one mean of 600.
const SOMEBODY: f64 = 4.0;
/// Fewest frames of a background that nobody asked for: the noise of its mean is then a tenth of a frame's.
const CERTAIN_FRAMES_MIN: usize = 100;
/// How often stretches are found again with levels from the stretches before.
const ROUNDS: usize = 3;

/// What each pixel shows of the empty room.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the names say it")]
pub struct Background {
    /// Mean over all frames of the stretches, °C.
    pub celsius: [f64; PIXELS],
    pub stretches: Vec<Stretch>,
    pub frames: usize,
}

/// Why no background was found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages say what each is")]
pub enum BackgroundError {
    #[error(
        "no empty stretch of five seconds was found\nhint: name one, as in --empty 12s..40s; pass --empty yes if the whole recording is empty; or record the empty room"
    )]
    NoneFound,
    #[error("{frames} frames between {from:.1} s and {to:.1} s, expected at least {BLOCK_FRAMES}\nhint: seconds count from the recording's first frame; the recording is {length:.1} s long", from = stretch.from.as_secs_f64(), to = stretch.to.as_secs_f64(), length = length.as_secs_f64())]
    TooFewFrames {
        stretch: Stretch,
        frames: usize,
        length: Duration,
    },
}

/// Learns the background from the records of one stream.
///
/// # Errors
/// [`BackgroundError`].
pub fn background(records: &[Record], empty: &Empty) -> Result<Background, BackgroundError> {
    let frames = frames(records);
    let stretches = match empty {
        Empty::Named(stretch) => vec![*stretch],
        Empty::Find => found(&blocks(&frames)),
    };
    let inside: Vec<&Pixels> = frames
        .iter()
        .filter(|(time, _)| stretches.iter().any(|stretch| stretch.holds(*time)))
        .map(|(_, pixels)| pixels)
        .collect();
    match empty {
        Empty::Named(stretch) if inside.len() < BLOCK_FRAMES => {
            return Err(BackgroundError::TooFewFrames {
                stretch: *stretch,
                frames: inside.len(),
                length: frames
                    .iter()
                    .map(|(time, _)| *time)
                    .max()
                    .unwrap_or_default(),
            });
        }
        _ if inside.is_empty() => return Err(BackgroundError::NoneFound),
        _ => {}
    }
    Ok(Background {
        celsius: std::array::from_fn(|pixel| {
            inside.iter().map(|frame| frame[pixel]).sum::<f64>() / count(inside.len())
        }),
        frames: inside.len(),
        stretches,
    })
}

impl Background {
    /// The background of a recording that is empty throughout; `None` without a hundred frames in a row.
    #[must_use]
    pub fn whole(found: &Characterization) -> Option<Self> {
        let whole = Stretch {
            from: Duration::ZERO,
            to: Duration::try_from_secs_f64(found.timing.span_s).unwrap_or_default(),
        };
        Some(Self {
            celsius: found.pattern?.mean_c,
            stretches: vec![whole],
            frames: usize::try_from(found.frames).unwrap_or(usize::MAX),
        })
    }

    /// Whether it can be taken unasked: long enough, and nothing stays warm in it beyond the empty room (64 values, °C, if
    /// they are known), as a person who keeps still would.
    #[must_use]
    pub fn is_certain(&self, empty_room: Option<&[f64]>) -> bool {
        self.frames >= CERTAIN_FRAMES_MIN && stays_warm(&self.celsius, empty_room).is_none()
    }

    /// Writes pattern and background into a profile, above `empty_room` (64 values, °C) or else the median pixel.
    pub fn put_into(&self, profile: &mut Profile, empty_room: Option<&[f64]>) {
        let middle = median(&self.celsius).unwrap_or_default();
        let room = |pixel: usize| empty_room.and_then(|room| room.get(pixel)).copied();
        let shown = |pixel: usize| self.celsius[pixel] - room(pixel).unwrap_or(middle);
        put_shown_into(profile, &std::array::from_fn(shown));
    }
}

fn frames(records: &[Record]) -> Vec<(Duration, Pixels)> {
    let first = records
        .iter()
        .find(|record| record.reading.frame().is_some())
        .map_or(0, |record| record.stamp.t_boot_ns);
    let frame = |record: &Record| {
        let raw = record.reading.frame()?;
        let since = record.stamp.t_boot_ns.saturating_sub(first);
        Some((Duration::from_nanos(since), decoded(raw)))
    };
    records.iter().filter_map(frame).collect()
}

struct Block {
    from: Duration,
    to: Duration,
    relative: Pixels,
    /// Whether it directly follows the block before.
    follows: bool,
}

fn blocks(frames: &[(Duration, Pixels)]) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let breaks = |pair: &(Duration, Pixels), next: &(Duration, Pixels)| {
        next.0 >= pair.0 && next.0 - pair.0 < GAP
    };
    let mut broken = true;
    for run in frames.chunk_by(breaks) {
        for block in run.chunks_exact(BLOCK_FRAMES) {
            let mean: Pixels = std::array::from_fn(|pixel| {
                block.iter().map(|(_, frame)| frame[pixel]).sum::<f64>() / count(BLOCK_FRAMES)
            });
            let middle = median(&mean).unwrap_or_default();
            blocks.push(Block {
                from: block[0].0,
                to: block[BLOCK_FRAMES - 1].0,
                relative: mean.map(|pixel| pixel - middle),
                follows: !broken,
            });
            broken = false;
        }
        broken = true;
    }
    blocks
}

fn found(blocks: &[Block]) -> Vec<Stretch> {
    if blocks.len() < STRETCH_BLOCKS {
        return Vec::new();
    }
    let mut levels: Pixels = std::array::from_fn(|pixel| {
        coldest_cluster(blocks.iter().map(|block| block.relative[pixel]).collect())
    });
    let mut used: Vec<usize> = Vec::new();
    for _ in 0..ROUNDS {
        used = empty_blocks(blocks, &levels);
        if used.is_empty() {
            return Vec::new();
        }
        levels = std::array::from_fn(|pixel| {
            let mut values: Vec<f64> = used.iter().map(|&at| blocks[at].relative[pixel]).collect();
            let quarter = values.len() / 4;
            trimmed_mean(&mut values, quarter)
        });
    }
    used.chunk_by(|one, next| one + 1 == *next && blocks[*next].follows)
        .map(|run| Stretch {
            from: blocks[run[0]].from,
            to: blocks[run[run.len() - 1]].to,
        })
        .collect()
}

fn empty_blocks(blocks: &[Block], levels: &Pixels) -> Vec<usize> {
    let above: Vec<Pixels> = blocks
        .iter()
        .map(|block| {
            let raw: Pixels = std::array::from_fn(|pixel| block.relative[pixel] - levels[pixel]);
            let level = middle_mean(&raw);
            raw.map(|pixel| pixel - level)
        })
        .collect();
    let squares: Vec<Vec<f64>> = above.iter().map(two_by_two).collect();
    // The median over all squares, most of which show the room; 1.4826 times it is a Gaussian's sigma.
    let sizes: Vec<f64> = squares
        .iter()
        .flatten()
        .map(|square| square.abs())
        .collect();
    let limit = SOMEBODY * 1.4826 * median(&sizes).unwrap_or_default();
    let is_empty: Vec<bool> = squares
        .iter()
        .map(|squares| squares.iter().all(|square| *square <= limit))
        .collect();
    let places: Vec<usize> = (0..blocks.len()).collect();
    places
        .chunk_by(|one, next| is_empty[*one] == is_empty[*next] && blocks[*next].follows)
        .filter(|run| is_empty[run[0]] && run.len() >= STRETCH_BLOCKS)
        .flat_map(|run| run[1..run.len() - 1].iter().copied())
        .collect()
}

/// Mean of the coldest cluster among the narrow ones.
fn coldest_cluster(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let size = (values.len() / CLUSTER).max(3).min(values.len());
    let width = |window: &[f64]| window[window.len() - 1] - window[0];
    let narrowest = values
        .windows(size)
        .map(width)
        .fold(f64::INFINITY, f64::min);
    values
        .windows(size)
        .find(|window| width(window) <= WIDTH_SLACK * narrowest)
        .map_or(0.0, |window| window.iter().sum::<f64>() / count(size))
}
