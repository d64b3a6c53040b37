//! A patch with its material, and helpers for rows and vectors.

use crate::picture::projection::Patch;
use crate::radiometry::{Glow, Root};
use pulp::{Arch, Scalar256b, WithSimd};
use std::ops::Range;

#[derive(Debug, Clone)]
pub(crate) struct ShadedPatch {
    pub(crate) patch: Patch,
    pub(crate) glow: Glow,
    pub(crate) root: Root,
    /// The owner that a cell shows.
    pub(crate) owner: u32,
}

/// Runs a task with the processor's widest vectors. The results are bit-identical for all widths.
pub(super) fn dispatch<T: WithSimd>(task: T) -> T::Output {
    match Arch::new() {
        // Four at once in plain code, which compilers turn into whatever every processor of this kind has.
        Arch::Scalar => task.with_simd(Scalar256b),
        arch => arch.dispatch(task),
    }
}

/// The smallest range that contains both; empty ranges do not count.
#[inline(always)]
pub(super) fn hull(one: Range<usize>, other: Range<usize>) -> Range<usize> {
    if one.is_empty() {
        return other;
    }
    if other.is_empty() {
        return one;
    }
    one.start.min(other.start)..one.end.max(other.end)
}
