//! Tells which descriptors are tokens.

use super::super::protocol::{TOKEN_MARK, number_of};
use super::{setting, system};
use core::ffi::c_int;
use core::sync::atomic::{AtomicU64, Ordering};

/// Descriptors below this number can be tokens.
const DESCRIPTORS: usize = 64 * 64;
/// Descriptors below this number are checked when a program starts, for inherited tokens.
const INHERITED: c_int = 256;

/// One bit per descriptor: whether it may be a token. A descriptor closed behind the library's back keeps its bit, so
/// only the socket's own name is proof.
static MARKED: [AtomicU64; DESCRIPTORS / 64] = [const { AtomicU64::new(0) }; DESCRIPTORS / 64];

/// The number of the open file of a token; `None` for every other descriptor. Preserves errno.
pub(super) fn file_of(descriptor: c_int) -> Option<u64> {
    let (word, bit) = place(descriptor)?;
    if word.load(Ordering::Relaxed) & bit == 0 {
        return None;
    }
    let file = named(descriptor);
    if file.is_none() {
        unmark(descriptor);
    }
    file
}

/// As [`file_of`], also for a token from elsewhere, which is marked from then on.
pub(super) fn adopt(descriptor: c_int) -> Option<u64> {
    let file = named(descriptor)?;
    mark(descriptor);
    Some(file)
}

pub(super) fn adopt_inherited() {
    if setting::get().is_some() {
        for descriptor in 0..INHERITED {
            let _ = adopt(descriptor);
        }
    }
}

/// Marks a token; `false` if its number is too high.
pub(super) fn mark(descriptor: c_int) -> bool {
    let Some((word, bit)) = place(descriptor) else {
        return false;
    };
    word.fetch_or(bit, Ordering::Relaxed);
    true
}

pub(super) fn unmark(descriptor: c_int) {
    if let Some((word, bit)) = place(descriptor) {
        word.fetch_and(!bit, Ordering::Relaxed);
    }
}

fn named(descriptor: c_int) -> Option<u64> {
    let socket = setting::get()?.socket();
    let errno = system::errno();
    let file = system::with_own_name(descriptor, |name| number_of(name, socket, TOKEN_MARK));
    system::set_errno(errno);
    file
}

fn place(descriptor: c_int) -> Option<(&'static AtomicU64, u64)> {
    let descriptor = usize::try_from(descriptor).ok()?;
    Some((MARKED.get(descriptor / 64)?, 1 << (descriptor % 64)))
}
