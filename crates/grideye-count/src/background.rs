//! What a sensor sees of the empty room, pixel by pixel: learned from the frames, or given.
//!
//! People come and go and only warm a pixel, so the empty room is the colder part of what a pixel showed. After the
//! start the background follows what nobody stands on. It holds still under and beside people, however long they sit,
//! and where somebody of the start has left, it follows within seconds, because nobody makes a pixel colder.

use grideye_frame::{COLUMNS, PIXELS, ROWS};

/// The start: so many frames, this far apart at least.
pub(crate) const START_FRAMES: usize = 60;
const START_EVERY_S: f64 = 0.5;
/// One in so many of a pixel's values is colder than its background.
const COLDER: usize = 3;
/// Frames that tell the empty room of a whole recording.
const ROOM_FRAMES: usize = 512;
/// A pixel is warm from this excess on: three times the noise of the sensor, less than half of a person's warmth.
pub(crate) const WARM_C: f32 = 0.75;
/// The time of the mean that tells warmth and cold from noise, in seconds.
const RECENT_S: f32 = 2.0;
/// The time in which the background follows the empty room, in seconds.
const FOLLOW_S: f32 = 60.0;
/// The same where somebody of the start has left.
const GHOST_S: f32 = 4.0;
/// The same where something warm stays.
const STAYS_S: f32 = 300.0;
/// A pixel that is warm for so long is part of the room.
const STAYS_AFTER_S: f32 = 8.0 * 3600.0;

#[derive(Debug, Clone)]
#[expect(
    clippy::large_enum_variant,
    reason = "nothing is allocated, and every background starts once"
)]
pub(crate) enum Background {
    Starting(Start),
    Known(Known),
}

#[derive(Debug, Clone)]
pub(crate) struct Start {
    held: [[f32; PIXELS]; START_FRAMES],
    count: usize,
    next_s: f64,
}

#[derive(Debug, Clone)]
pub(crate) struct Known {
    base: [f32; PIXELS],
    /// The excess of the last seconds.
    recent: [f32; PIXELS],
    /// For how long each pixel was warm without a break.
    warm_s: [f32; PIXELS],
}

impl Background {
    pub(crate) const fn starting() -> Self {
        Self::Starting(Start {
            held: [[0.0; PIXELS]; START_FRAMES],
            count: 0,
            next_s: f64::NEG_INFINITY,
        })
    }

    pub(crate) const fn known(base: [f32; PIXELS]) -> Self {
        Self::Known(Known {
            base,
            recent: [0.0; PIXELS],
            warm_s: [0.0; PIXELS],
        })
    }

    /// The frame less the background and less what all pixels share; `None` before the background is known.
    pub(crate) fn excess(&mut self, at_s: f64, celsius: &[f32; PIXELS]) -> Option<[f32; PIXELS]> {
        if let Self::Starting(start) = self {
            *self = Self::known(start.see(at_s, celsius)?);
        }
        match self {
            Self::Starting(_) => None,
            Self::Known(known) => Some(leveled(core::array::from_fn(|pixel| {
                celsius[pixel] - known.base[pixel]
            }))),
        }
    }

    /// Follows a frame of which `people` are the pixels of people.
    pub(crate) fn follow(&mut self, passed_s: f32, excess: &[f32; PIXELS], people: u64) {
        if let Self::Known(known) = self {
            known.follow(passed_s, excess, people);
        }
    }
}

impl Known {
    fn follow(&mut self, passed_s: f32, excess: &[f32; PIXELS], people: u64) {
        let weight = (passed_s / RECENT_S).min(1.0);
        for (recent, excess) in self.recent.iter_mut().zip(excess) {
            *recent += weight * (excess - *recent);
        }
        let warm = mask(|pixel| self.recent[pixel] >= WARM_C);
        // Nobody is there: what is warm all the same is no person.
        let held = if people == 0 { 0 } else { grown(warm | people) };
        let mut free = Mean::default();
        let mut waiting = 0_u64;
        for (pixel, excess) in excess.iter().enumerate() {
            let is_in = |pixels: u64| pixels >> pixel & 1 == 1;
            let warm_s = &mut self.warm_s[pixel];
            *warm_s = if is_in(warm) { *warm_s + passed_s } else { 0.0 };
            let within_s = match self.recent[pixel] {
                recent if recent <= -WARM_C => GHOST_S,
                _ if *warm_s > STAYS_AFTER_S => STAYS_S,
                _ if is_in(held) => {
                    waiting |= 1 << pixel;
                    continue;
                }
                _ => FOLLOW_S,
            };
            let change = excess * (passed_s / within_s).min(1.0);
            self.base[pixel] += change;
            free.add(change);
        }
        // Only differences between pixels count, so what waits goes along with the others.
        for (pixel, base) in self.base.iter_mut().enumerate() {
            if waiting >> pixel & 1 == 1 {
                *base += free.of_all();
            }
        }
    }
}

#[derive(Debug, Default)]
struct Mean {
    sum: f32,
    count: f32,
}

impl Mean {
    fn add(&mut self, value: f32) {
        self.sum += value;
        self.count += 1.0;
    }

    fn of_all(&self) -> f32 {
        if self.count > 0.0 {
            self.sum / self.count
        } else {
            0.0
        }
    }
}

impl Start {
    /// The background, once enough frames were seen.
    fn see(&mut self, at_s: f64, celsius: &[f32; PIXELS]) -> Option<[f32; PIXELS]> {
        if at_s < self.next_s {
            return None;
        }
        self.next_s = at_s + START_EVERY_S;
        self.held[self.count] = leveled(*celsius);
        self.count += 1;
        (self.count == START_FRAMES).then(|| empty_room(&mut self.held))
    }
}

/// The empty room of a whole recording, in a fixed amount of memory: of a long one, every second, fourth, … frame.
#[derive(Debug, Clone)]
pub struct Room {
    held: [[f32; PIXELS]; ROOM_FRAMES],
    count: usize,
    stride: usize,
    seen: usize,
}

impl Default for Room {
    fn default() -> Self {
        Self {
            held: [[0.0; PIXELS]; ROOM_FRAMES],
            count: 0,
            stride: 1,
            seen: 0,
        }
    }
}

impl Room {
    /// Takes the next frame, °C.
    pub fn see(&mut self, celsius: &[f32; PIXELS]) {
        self.seen += 1;
        if self.seen % self.stride != 0 {
            return;
        }
        if self.count == ROOM_FRAMES {
            self.count /= 2;
            self.stride *= 2;
            for kept in 0..self.count {
                self.held[kept] = self.held[2 * kept + 1];
            }
            return;
        }
        self.held[self.count] = leveled(*celsius);
        self.count += 1;
    }

    /// The empty room, °C up to a constant: of each pixel what it showed in its colder frames, so that people who come and
    /// go are not part of it.
    #[must_use]
    pub fn celsius(mut self) -> [f32; PIXELS] {
        empty_room(&mut self.held[..self.count])
    }
}

/// The empty room of frames in which people come and go: of each pixel a value that a third of the frames are below,
/// so that whoever stays for two thirds of the time is not part of it.
fn empty_room(frames: &mut [[f32; PIXELS]]) -> [f32; PIXELS] {
    core::array::from_fn(|pixel| {
        // Sorted by one pixel; the frames' order does not matter.
        frames.sort_unstable_by(|one, other| one[pixel].total_cmp(&other[pixel]));
        frames
            .get(frames.len() / COLDER)
            .map_or(0.0, |frame| frame[pixel])
    })
}

/// Less the median over the pixels, which follows whatever changes all of them: the room, the chip.
fn leveled(celsius: [f32; PIXELS]) -> [f32; PIXELS] {
    let mut sorted = celsius;
    sorted.sort_unstable_by(f32::total_cmp);
    let level = f32::midpoint(sorted[PIXELS / 2 - 1], sorted[PIXELS / 2]);
    celsius.map(|celsius| celsius - level)
}

/// The pixels that a condition holds for, the first as the lowest bit.
pub(crate) fn mask(mut holds: impl FnMut(usize) -> bool) -> u64 {
    (0..PIXELS).fold(0, |mask, pixel| mask | u64::from(holds(pixel)) << pixel)
}

/// The pixels and their neighbors.
fn grown(pixels: u64) -> u64 {
    mask(|pixel| {
        let (row, column) = (pixel / COLUMNS, pixel % COLUMNS);
        let rows = row.saturating_sub(1)..=(row + 1).min(ROWS - 1);
        rows.into_iter().any(|row| {
            let mut columns = column.saturating_sub(1)..=(column + 1).min(COLUMNS - 1);
            columns.any(|column| pixels >> (row * COLUMNS + column) & 1 == 1)
        })
    })
}
