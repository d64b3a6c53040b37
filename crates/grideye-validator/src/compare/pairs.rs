//! Which real frame meets which simulated one.

use crate::frames::Protocol;
use crate::numbers::evenly;

pub(crate) fn pairs(protocol: Protocol, real: usize, simulated: usize) -> Vec<(usize, usize)> {
    match protocol {
        Protocol::Static => (0..real)
            .flat_map(|r| (0..simulated).map(move |s| (r, s)))
            .collect(),
        Protocol::Dynamic => (0..real.min(simulated)).map(|k| (k, k)).collect(),
    }
}

/// Up to `number` of the pairs, evenly spread, first and last included.
pub(crate) fn thinned(pairs: &[(usize, usize)], number: usize) -> Vec<(usize, usize)> {
    evenly(pairs.len(), number)
        .into_iter()
        .map(|index| pairs[index])
        .collect()
}
