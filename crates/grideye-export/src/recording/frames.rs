//! The frames of one stream, for images; missing ones are skipped, which the times below the images show.

use super::rows::{Rows, check_length};
use crate::error::ExportError;
use grideye_draw::thermogram::Scale;
use std::time::Duration;

/// The frames of one stream.
pub(super) struct Frames {
    /// Columns and rows of a frame.
    pub(super) size: (usize, usize),
    /// Time since the first frame, and pixels in °C.
    frames: Vec<(Duration, Vec<f32>)>,
}

impl Frames {
    /// At least one.
    pub(super) fn of(rows: Rows<'_>) -> Result<Self, ExportError> {
        let size = rows.size;
        let mut only = None;
        let mut frames: Vec<(Duration, Vec<f32>)> = Vec::new();
        let mut first_ns = None;
        for row in rows {
            let row = row?;
            let stream = only.get_or_insert_with(|| row.stream.clone());
            if *stream != row.stream {
                return Err(ExportError::Frames(format!(
                    "the recording holds several streams, but an image shows only one\nhint: choose one with --sensor, for example --sensor {}/{}",
                    stream.device, stream.sensor
                )));
            }
            if let Ok(pixels_c) = row.pixels_c {
                let at_ns = row.stamp.t_boot_ns;
                let since_ns = at_ns.saturating_sub(*first_ns.get_or_insert(at_ns));
                frames.push((Duration::from_nanos(since_ns), pixels_c));
                check_length(frames.len(), size)?;
            }
        }
        if frames.is_empty() {
            let none = "the recording holds no frame\nhint: all of its rows say that a frame is missing, or it has no rows";
            return Err(ExportError::Frames(none.to_owned()));
        }
        Ok(Self { size, frames })
    }

    pub(super) fn scale(&self) -> Result<Scale, ExportError> {
        let all = self.frames.iter().flat_map(|(_, pixels_c)| pixels_c);
        Scale::of(all.copied().map(f64::from)).ok_or(ExportError::NotANumber)
    }

    pub(super) fn count(&self) -> usize {
        self.frames.len()
    }

    /// Every second, third … frame, in °C, and its time.
    pub(super) fn every(&self, step: usize) -> Vec<(Vec<f64>, String)> {
        let frames = self.frames.iter().step_by(step);
        let frame = |(time, pixels_c): &(Duration, Vec<f32>)| {
            let celsius = pixels_c.iter().copied().map(f64::from);
            (celsius.collect(), format!("{:.2} s", time.as_secs_f64()))
        };
        frames.map(frame).collect()
    }

    /// Frames per second from the median interval; 10 without any.
    pub(super) fn sampling_hz(&self) -> f64 {
        let mut intervals: Vec<Duration> = self
            .frames
            .windows(2)
            .map(|pair| pair[1].0.saturating_sub(pair[0].0))
            .filter(|interval| !interval.is_zero())
            .collect();
        intervals.sort_unstable();
        let median = intervals.get(intervals.len() / 2);
        median.map_or(10.0, |median| 1.0 / median.as_secs_f64())
    }

    /// The note on skipped frames, for the description of the result.
    pub(super) fn left_out(&self, step: usize) -> String {
        match step {
            1 => String::new(),
            _ => format!(", every {step}. of {},", self.count()),
        }
    }
}
