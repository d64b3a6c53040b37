//! Entropy and mutual information of frames.

use crate::metrics::binning::Binning;
use crate::metrics::counting::{Binned, Counter, Joint, mutual_corrected, mutual_of};
use crate::numbers::{comparable, finite};

/// Shannon entropy of one frame, bits (PeerJ CS 11:e3124, Eq. 2).
#[must_use]
pub fn entropy(frame: &[f64], binning: Binning) -> Option<f64> {
    Some(Counter::new().binned(frame, binning)?.entropy)
}

/// Joint entropy of two frames, bits (PeerJ CS 11:e3124, Eq. 3); each frame is binned over its own range.
#[must_use]
pub fn joint_entropy(real: &[f64], simulated: &[f64], binning: Binning) -> Option<f64> {
    let (_, _, joint) = binned(real, simulated, binning)?;
    Some(joint.entropy)
}

/// Mutual information, bits: `H(X) + H(Y) - H(X, Y)` (PeerJ CS 11:e3124, Eq. 6); almost all bias on 64 pixels.
#[must_use]
pub fn mutual_information(real: &[f64], simulated: &[f64], binning: Binning) -> Option<f64> {
    let (real, simulated, joint) = binned(real, simulated, binning)?;
    Some(mutual_of(&real, &simulated, joint))
}

/// Mutual information less its small-sample bias: `I + (K(X) + K(Y) - K(X, Y) - 1) / (2 N ln 2)` with K bins (G. A.
/// Miller 1955).
#[must_use]
pub fn mutual_information_corrected(
    real: &[f64],
    simulated: &[f64],
    binning: Binning,
) -> Option<f64> {
    let (real, simulated, joint) = binned(real, simulated, binning)?;
    finite(mutual_corrected(&real, &simulated, joint))
}

pub(crate) fn binned(
    real: &[f64],
    simulated: &[f64],
    binning: Binning,
) -> Option<(Binned, Binned, Joint)> {
    comparable(real, simulated)?;
    let mut counter = Counter::new();
    let real = counter.binned(real, binning)?;
    let simulated = counter.binned(simulated, binning)?;
    let joint = counter.joint(&real, &simulated);
    Some((real, simulated, joint))
}
