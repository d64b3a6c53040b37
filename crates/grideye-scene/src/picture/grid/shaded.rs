//! A patch with what it is made of, and what its rows and the processor's vectors need.

use crate::picture::projection::Patch;
use crate::radiometry::{Glow, Root};
use pulp::{Arch, Scalar256b, WithSimd};
use std::ops::Range;

#[derive(Debug, Clone)]
pub(crate) struct ShadedPatch {
    pub(crate) patch: Patch,
    pub(crate) glow: Glow,
    pub(crate) root: Root,
    /// Whose it is, for those who ask whom a cell shows.
    pub(crate) owner: u32,
}

/// Runs a task with the widest vectors that this processor has. The bits are the same with any.
pub(super) fn dispatch<T: WithSimd>(task: T) -> T::Output {
    match Arch::new() {
        // Four at once in plain code, of which compilers make what every processor of the kind has.
        Arch::Scalar => task.with_simd(Scalar256b),
        arch => arch.dispatch(task),
    }
}

/// The range that holds both; an empty one holds nothing.
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
