//! How a function of the C library is intercepted.

use super::system::{self, Errno};
use core::ffi::{CStr, c_int, c_void};
use core::sync::atomic::{AtomicUsize, Ordering};

/// Defines functions under their names in the C library. Each returns what its body has, or, where that is `None`, what the
/// function returns that would have been called without this library: `pass_on`, which the body can call as well. In C's
/// declaration `...` stands where it does here; on every machine that this is built for such arguments are passed alike.
///
/// In the tests of this crate they are ordinary functions: there the C library's own must stay what they are.
macro_rules! intercept {
    ($(fn $name:ident($($argument:ident: $type:ty),* $(; $dots:tt $rest:ident: $rest_type:ty)?) -> $result:ty $body:block)*) => {$(
        #[cfg_attr(not(test), unsafe(no_mangle))]
        pub(crate) extern "C" fn $name($($argument: $type,)* $($rest: $rest_type)?) -> $result {
            fn pass_on($($argument: $type,)* $($rest: $rest_type)?) -> $result {
                static ADDRESS: core::sync::atomic::AtomicUsize = core::sync::atomic::AtomicUsize::new(0);
                type Function = unsafe extern "C" fn($($type),* $(, $dots)?) -> $result;
                let address = super::intercept::next(&ADDRESS, concat!(stringify!($name), "\0"));
                // SAFETY: the address is 0, which is `None`, or that of the C library's function of this name and type.
                match unsafe { core::mem::transmute::<usize, Option<Function>>(address) } {
                    // SAFETY: these are the program's own arguments to this very function.
                    Some(function) => unsafe { function($($argument,)* $($rest)?) },
                    None => super::intercept::failed(super::system::ENOSYS),
                }
            }

            fn own($($argument: $type,)* $($rest: $rest_type)?) -> Option<$result> $body

            own($($argument,)* $($rest)?).unwrap_or_else(|| pass_on($($argument,)* $($rest)?))
        }
    )*};
}

/// The address of the function that would have been called without this library, or 0.
pub(super) fn next(known: &AtomicUsize, name: &str) -> usize {
    let mut address = known.load(Ordering::Relaxed);
    if address == 0 {
        address = CStr::from_bytes_with_nul(name.as_bytes()).map_or(0, system::next);
        known.store(address, Ordering::Relaxed);
    }
    address
}

/// What a function of the C library returns when it fails.
pub(super) trait Failed {
    const FAILED: Self;
}

impl Failed for c_int {
    const FAILED: Self = -1;
}

impl Failed for isize {
    const FAILED: Self = -1;
}

impl Failed for *mut c_void {
    const FAILED: Self = core::ptr::null_mut();
}

pub(super) fn failed<T: Failed>(errno: Errno) -> T {
    system::set_errno(errno);
    T::FAILED
}

/// What a function of the C library returns.
pub(super) fn result(outcome: Result<usize, Errno>) -> isize {
    match outcome {
        Ok(value) => isize::try_from(value).unwrap_or(isize::MAX),
        Err(errno) => failed(errno),
    }
}
