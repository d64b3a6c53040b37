//! How a function of the C library is intercepted. What is not about a device goes on to the function that would have been
//! called without this library, with the very same arguments.

use super::system::{self, Errno};

/// The function of this name that would have been called without this library.
macro_rules! next {
    ($name:ident: $type:ty) => {{
        static ADDRESS: core::sync::atomic::AtomicUsize =
            core::sync::atomic::AtomicUsize::new(0);
        let mut address = ADDRESS.load(core::sync::atomic::Ordering::Relaxed);
        if address == 0 {
            let name = concat!(stringify!($name), "\0");
            address = core::ffi::CStr::from_bytes_with_nul(name.as_bytes()).map_or(0, super::system::next);
            ADDRESS.store(address, core::sync::atomic::Ordering::Relaxed);
        }
        // SAFETY: the address is 0, which is `None`, or that of the C library's function of this name, whose type this is.
        unsafe { core::mem::transmute::<usize, Option<$type>>(address) }
    }};
}

/// Passes a call on; a function that the C library lacks is ENOSYS.
macro_rules! pass_on {
    ($name:ident: $type:ty, $($argument:expr),*) => {
        match next!($name: $type) {
            // SAFETY: these are the program's own arguments to this very function.
            Some(function) => unsafe { function($($argument),*) },
            None => {
                super::system::set_errno(super::system::ENOSYS);
                -1
            }
        }
    };
}

/// Defines functions under their names in the C library. In the tests of this crate they are ordinary functions: there
/// the C library's own must stay what they are.
macro_rules! intercept {
    ($($(#[$attribute:meta])* fn $name:ident($($argument:ident: $type:ty),*) -> $result:ty $body:block)*) => {
        $(
            $(#[$attribute])*
            #[cfg_attr(not(test), unsafe(no_mangle))]
            pub(crate) extern "C" fn $name($($argument: $type),*) -> $result $body
        )*
    };
}

/// What a function of the C library returns.
pub(super) fn result(outcome: Result<usize, Errno>) -> isize {
    match outcome {
        Ok(value) => isize::try_from(value).unwrap_or(isize::MAX),
        Err(errno) => {
            system::set_errno(errno);
            -1
        }
    }
}
