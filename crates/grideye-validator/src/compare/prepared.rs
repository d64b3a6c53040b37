//! Frames prepared for repeated scoring.

use crate::compare::settings::Settings;
use crate::frames::types::Pixels;
use crate::frames::{Protocol, RealFrame, SimulatedFrame};
use crate::metrics::Blob;
use crate::metrics::distance::Centered;
use crate::metrics::entropy::Binned;
use crate::numbers::{evenly, median};
use grideye_frame::PIXELS;

/// A frame with its bins and its warm blob.
#[derive(Clone)]
pub(crate) struct Prepared {
    pub(crate) celsius: Pixels,
    /// Where warm pixels are read from: a noise-free claim, or a real frame itself.
    pub(crate) shown: Pixels,
    pub(crate) centered: Centered,
    /// `None` only for a frame that the checks refuse.
    pub(crate) binned: Option<Binned>,
    pub(crate) blob: Option<Blob>,
    /// The median of what is shown, against which pixels are warm; no order of the pixels changes it.
    background: f64,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Preparation {
    pub(crate) warm_above_c: f64,
}

/// Both sides of a comparison, and the blank frame.
pub(crate) struct ComparedFrames {
    pub(crate) real: Vec<Prepared>,
    pub(crate) simulated: Vec<Prepared>,
    pub(crate) blank: Prepared,
    pub(crate) preparation: Preparation,
}

impl Preparation {
    pub(crate) fn frame(&self, celsius: &Pixels, shown: &Pixels) -> Prepared {
        let background = median(shown).unwrap_or(0.0);
        Prepared {
            celsius: *celsius,
            shown: *shown,
            centered: Centered::new(celsius),
            binned: Binned::new(celsius),
            blob: self.blob(shown, background),
            background,
        }
    }

    /// A frame with its pixels reordered.
    pub(crate) fn permuted(&self, frame: &Prepared, order: &[usize]) -> Prepared {
        let pick = |values: &Pixels| -> Pixels { std::array::from_fn(|at| values[order[at]]) };
        let shown = pick(&frame.shown);
        Prepared {
            celsius: pick(&frame.celsius),
            centered: frame.centered.permuted(order),
            binned: frame.binned.as_ref().map(|binned| binned.permuted(order)),
            blob: self.blob(&shown, frame.background),
            background: frame.background,
            shown,
        }
    }

    fn blob(&self, shown: &Pixels, background: f64) -> Option<Blob> {
        Blob::above(shown, (background, self.warm_above_c))
    }
}

impl ComparedFrames {
    pub(crate) fn new(
        preparation: Preparation,
        real: &[RealFrame],
        simulated: &[SimulatedFrame],
        settings: &Settings,
    ) -> Self {
        let ambient = [settings.ambient_c; PIXELS];
        let real = real.iter();
        let simulated = simulated.iter();
        Self {
            real: real
                .map(|frame| preparation.frame(&frame.celsius, &frame.celsius))
                .collect(),
            simulated: simulated
                .map(|frame| preparation.frame(&frame.celsius, &frame.noise_free))
                .collect(),
            blank: preparation.frame(&ambient, &ambient),
            preparation,
        }
    }
}

pub(crate) fn pairs(protocol: Protocol, real: usize, simulated: usize) -> Vec<(usize, usize)> {
    match protocol {
        Protocol::Static => (0..real)
            .flat_map(|r| (0..simulated).map(move |s| (r, s)))
            .collect(),
        Protocol::Dynamic => (0..real.min(simulated)).map(|k| (k, k)).collect(),
    }
}

/// Up to `number` of the pairs, evenly spread, including first and last.
pub(crate) fn thinned(pairs: &[(usize, usize)], number: usize) -> Vec<(usize, usize)> {
    evenly(pairs.len(), number)
        .into_iter()
        .map(|index| pairs[index])
        .collect()
}
