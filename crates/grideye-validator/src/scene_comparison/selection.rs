//! Which frames are compared, and which is whose repeat.

use crate::error::ValidatorError;
use crate::frames::pixels::Pixels;
use crate::frames::{Protocol, RealFrame};
use crate::numbers::{count, evenly};
use crate::scene_comparison::types::{DYNAMIC_FRAMES, LAG_FRAMES_MAX, STATIC_FRAMES, TimedFrame};
use grideye_frame::TICK;
use std::time::Duration;

/// The repeat under the dynamic protocol is this much later: new noise, and too short to walk away.
const DYNAMIC_LAG: Duration = TICK;
const STATIC_LAG_FRAMES: usize = 3;

pub(crate) fn lag(
    timed: &[TimedFrame],
    protocol: Protocol,
    asked: Option<usize>,
) -> Result<usize, ValidatorError> {
    let lag = match (asked, protocol) {
        (Some(asked), _) => asked,
        (None, Protocol::Static) => STATIC_LAG_FRAMES,
        (None, Protocol::Dynamic) => period(timed).map_or(STATIC_LAG_FRAMES, lag_of_period),
    };
    if (1..=LAG_FRAMES_MAX).contains(&lag) {
        return Ok(lag);
    }
    Err(ValidatorError::Setting {
        name: "lag_frames",
        expected: "a number from 1 to 600",
        found: count(lag),
    })
}

fn period(timed: &[TimedFrame]) -> Option<Duration> {
    let (first, last) = (timed.first()?, timed.last()?);
    let frames = u32::try_from(last.seq.checked_sub(first.seq)?).ok()?;
    (last.time.saturating_sub(first.time)).checked_div(frames)
}

/// The lag of 1 to 600 frames that comes nearest to [`DYNAMIC_LAG`].
fn lag_of_period(period: Duration) -> usize {
    if period.is_zero() {
        return STATIC_LAG_FRAMES;
    }
    let frames = (DYNAMIC_LAG + period / 2).as_nanos() / period.as_nanos();
    usize::try_from(frames)
        .unwrap_or(LAG_FRAMES_MAX)
        .clamp(1, LAG_FRAMES_MAX)
}

pub(crate) fn number(protocol: Protocol, asked: Option<usize>) -> Result<usize, ValidatorError> {
    match (asked, protocol) {
        (Some(0), _) => Err(ValidatorError::Setting {
            name: "frames",
            expected: "a number above zero",
            found: 0.0,
        }),
        (Some(asked), _) => Ok(asked),
        (None, Protocol::Static) => Ok(STATIC_FRAMES),
        (None, Protocol::Dynamic) => Ok(DYNAMIC_FRAMES),
    }
}

/// Chooses evenly among the frames that have a repeat; among all if fewer than two have one.
pub(crate) fn chosen(
    timed: &[TimedFrame],
    lag_frames: usize,
    number: usize,
    notes: &mut Vec<String>,
) -> Vec<RealFrame> {
    let with_repeat: Vec<usize> = (0..timed.len())
        .filter(|&index| repeat(timed, index, lag_frames).is_some())
        .collect();
    let candidates = if with_repeat.len() < 2 {
        (0..timed.len()).collect()
    } else {
        with_repeat
    };
    let chosen = evenly(candidates.len(), number);
    notes.push(format!(
        "{} of the {} frames that were read are compared, chosen evenly over the recording.",
        chosen.len(),
        timed.len()
    ));
    let frame = |index: usize| RealFrame {
        time: timed[index].time,
        celsius: timed[index].celsius.to_vec(),
        later: repeat(timed, index, lag_frames).map(|later| later.to_vec()),
    };
    chosen
        .into_iter()
        .map(|place| frame(candidates[place]))
        .collect()
}

/// The frame whose number is `lag_frames` higher. A gap, or a new start of the count, between the two leaves none.
fn repeat(timed: &[TimedFrame], index: usize, lag_frames: usize) -> Option<&Pixels> {
    let sought = timed[index]
        .seq
        .checked_add(u64::try_from(lag_frames).ok()?)?;
    let following = timed.get(index + 1..)?;
    let near = following.iter().take(lag_frames);
    near.into_iter()
        .find(|frame| frame.seq == sought)
        .map(|frame| &frame.celsius)
}
