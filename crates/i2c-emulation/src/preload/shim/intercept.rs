//! How to intercept a function of the C library.

use super::system::{self, Errno};
use core::ffi::{CStr, c_int, c_void};
use core::sync::atomic::{AtomicUsize, Ordering};

/// Defines functions under their C library names. Each returns its body's value. If that is `None`, it returns the
/// result of `pass_on`, the function that the program would have called without this library; the body can call it too.
/// `...` stands where C's declaration has it; on every supported machine such arguments are passed the same way.
///
/// In this crate's tests they are ordinary functions, since the C library's own must stay in place there.
macro_rules! intercept {
    ($(fn $name:ident($($argument:ident: $type:ty),* $(; $dots:tt $rest:ident: $rest_type:ty)?) -> $result:ty $body:block)*) => {$(
        #[cfg_attr(not(test), unsafe(no_mangle))]
        pub(crate) extern "C" fn $name($($argument: $type,)* $($rest: $rest_type)?) -> $result {
            fn pass_on($($argument: $type,)* $($rest: $rest_type)?) -> $result {
                static ADDRESS: core::sync::atomic::AtomicUsize = core::sync::atomic::AtomicUsize::new(0);
                type Function = unsafe extern "C" fn($($type),* $(, $dots)?) -> $result;
                let address = super::intercept::next(&ADDRESS, concat!(stringify!($name), "\0"));
                // SAFETY: the address is 0, which is `None`, or that of the C library's function with this name and
                // type.
                match unsafe { core::mem::transmute::<usize, Option<Function>>(address) } {
                    // SAFETY: these are the program's own arguments to this function.
                    Some(function) => unsafe { function($($argument,)* $($rest)?) },
                    None => super::intercept::failed(super::system::ENOSYS),
                }
            }

            fn own($($argument: $type,)* $($rest: $rest_type)?) -> Option<$result> $body

            own($($argument,)* $($rest)?).unwrap_or_else(|| pass_on($($argument,)* $($rest)?))
        }
    )*};
}

/// The address of the function that the program would have called without this library, or 0.
pub(super) fn next(known: &AtomicUsize, name: &str) -> usize {
    let mut address = known.load(Ordering::Relaxed);
    if address == 0 {
        address = CStr::from_bytes_with_nul(name.as_bytes()).map_or(0, system::next);
        known.store(address, Ordering::Relaxed);
    }
    address
}

/// The return value of a failed C library function.
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

/// Converts a result to a C library function's return value.
pub(super) fn result(outcome: Result<usize, Errno>) -> isize {
    match outcome {
        Ok(value) => isize::try_from(value).unwrap_or(isize::MAX),
        Err(errno) => failed(errno),
    }
}
