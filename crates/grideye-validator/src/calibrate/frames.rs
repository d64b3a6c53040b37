//! The frames that a calibration uses.

use crate::calibrate::types::{FRAMES_DEFAULT, FRAMES_MAX, FRAMES_MIN, Half, Options};
use crate::error::ValidatorError;
use crate::frames::cleaning::{Read, clean};
use crate::frames::timeline::Timeline;
use crate::frames::types::Pixels;
use crate::numbers::{count, evenly};
use grideye_frame::PIXELS;
use grideye_recording::Record;
use std::ops::RangeInclusive;
use std::time::Duration;

#[derive(Debug)]
pub(crate) struct Frames {
    /// Times of the scene, before the fit of [`grideye_scene::uncertain::RECORDING_START`].
    pub(crate) times: Vec<Duration>,
    /// °C, frame by frame, less the profile's pattern if there is one.
    pub(crate) celsius: Vec<f64>,
    /// Frames read, and how many were left out as torn or repeated.
    pub(crate) read: usize,
    pub(crate) left_out: usize,
    pub(crate) half: Option<Half>,
}

impl Frames {
    /// Whole frames at the times of the scene `within` (`None`: all), thinned evenly to the number requested.
    pub(crate) fn of(
        records: &[Record],
        timeline: &Timeline,
        within: Option<&RangeInclusive<Duration>>,
        options: &Options,
    ) -> Result<Self, ValidatorError> {
        let wanted = options.frames.unwrap_or(FRAMES_DEFAULT);
        if !(FRAMES_MIN..=FRAMES_MAX).contains(&wanted) {
            return Err(ValidatorError::Refused(format!(
                "{wanted} frames requested, expected {FRAMES_MIN} to {FRAMES_MAX}\nhint: a few hundred frames are enough"
            )));
        }
        check_order(records)?;
        let is_timed = |at_ns: u64| timeline.time(at_ns).is_some();
        let all = records
            .iter()
            .filter(|record| record.reading.frame().is_some());
        let read = all
            .filter(|record| is_timed(record.stamp.t_boot_ns))
            .count();
        let (kept, _) = clean(records, true);
        let timed = |frame: Read| Some((timeline.time(frame.boot_ns)?, frame.celsius));
        let mut frames: Vec<(Duration, Pixels)> = kept.into_iter().filter_map(timed).collect();
        let left_out = read - frames.len();
        frames.retain(|(time, _)| within.is_none_or(|within| within.contains(time)));
        if let (Some(half), Some(first), Some(last)) = (options.half, frames.first(), frames.last())
        {
            let middle = (first.0 + last.0) / 2;
            frames.retain(|(time, _)| (*time <= middle) == (half == Half::First));
        }
        if frames.len() < FRAMES_MIN {
            return Err(ValidatorError::Refused(format!(
                "{} frames of the recording lie in the time of the scene, expected at least {FRAMES_MIN}\nhint: record longer, or set recording.start_s to when the recording begins",
                frames.len()
            )));
        }
        let chosen = evenly(frames.len(), wanted);
        let pattern = options.profile.as_ref().map_or(
            [0.0; PIXELS],
            grideye_scene::profile::Profile::in_its_room_c,
        );
        let less = |celsius: &[f64; PIXELS]| {
            std::array::from_fn::<f64, PIXELS, _>(|pixel| celsius[pixel] - pattern[pixel])
        };
        Ok(Self {
            times: chosen.iter().map(|&place| frames[place].0).collect(),
            celsius: chosen
                .iter()
                .flat_map(|&place| less(&frames[place].1))
                .collect(),
            read,
            left_out,
            half: options.half,
        })
    }

    pub(crate) fn len(&self) -> usize {
        self.times.len()
    }

    pub(crate) fn fewer(&self, most: usize) -> Self {
        let chosen = evenly(self.len(), most);
        let frame = |place: usize| &self.celsius[place * PIXELS..(place + 1) * PIXELS];
        Self {
            times: chosen.iter().map(|&place| self.times[place]).collect(),
            celsius: chosen
                .iter()
                .flat_map(|&place| frame(place))
                .copied()
                .collect(),
            ..*self
        }
    }

    /// The first and the last time.
    pub(crate) fn span(&self) -> (Duration, Duration) {
        let first = self.times.first().copied().unwrap_or_default();
        (first, self.times.last().copied().unwrap_or(first))
    }

    pub(crate) fn interval_s(&self) -> f64 {
        let (first, last) = self.span();
        (last - first).as_secs_f64() / count(self.len().max(2) - 1)
    }
}

fn check_order(records: &[Record]) -> Result<(), ValidatorError> {
    let read = records
        .iter()
        .filter(|record| record.reading.frame().is_some());
    let read: Vec<&Record> = read.collect();
    let is_back = |pair: &&[&Record]| pair[1].stamp.t_boot_ns < pair[0].stamp.t_boot_ns;
    match read.windows(2).find(is_back) {
        Some(pair) => Err(ValidatorError::Refused(format!(
            "the recording's clock runs backwards at frame {}\nhint: keep the rows before or after it",
            pair[1].seq
        ))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::types::record;

    /// At 10 Hz, each frame a step warmer than the one before.
    fn warming(frames: u16) -> Vec<Record> {
        let record = |index: u16| {
            let t_boot_ns = 3_000_000_000 + u64::from(index) * 100_000_000;
            record(u64::from(index), t_boot_ns, [80 + index; PIXELS])
        };
        (0..frames).map(record).collect()
    }

    /// Checks that times and pixels are of the same frames, and returns their numbers.
    fn taken(frames: &Frames) -> Vec<u128> {
        let by_time = frames.times.iter().map(|time| time.as_millis() / 100);
        let by_time: Vec<u128> = by_time.collect();
        let pixels = frames.celsius.chunks_exact(PIXELS);
        assert_eq!(pixels.len(), frames.len());
        for (index, pixels) in by_time.iter().zip(pixels) {
            let celsius = 20.0 + 0.25 * f64::from(u8::try_from(*index).unwrap());
            assert_eq!(pixels, [celsius; PIXELS], "{index}");
        }
        by_time
    }

    #[test]
    fn frames_are_chosen_evenly_from_the_first_to_the_last() {
        let options = Options {
            frames: Some(11),
            ..Options::default()
        };
        let timeline = Timeline::from_boot(3_000_000_000);
        let all = Frames::of(&warming(101), &timeline, None, &options).unwrap();
        assert_eq!(taken(&all), [0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100]);
        assert!((all.interval_s() - 1.0).abs() < 1e-12);
        assert_eq!(taken(&all.fewer(3)), [0, 50, 100]);
        let within = Duration::ZERO..=Duration::from_secs(5);
        let until = Frames::of(&warming(101), &timeline, Some(&within), &options).unwrap();
        assert_eq!(taken(&until), [0, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50]);
    }
}
