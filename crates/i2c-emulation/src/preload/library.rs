//! The preloaded library: a crate of its own that `build.rs` compiles without std and independent of any C library.
#![no_std]
#![deny(unsafe_op_in_unsafe_fn)]

#[expect(dead_code, reason = "each side uses its half")]
mod protocol;
mod shim;

/// Nothing here should panic; if it does, the program must not continue with a broken bus.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    shim::abort()
}

// Rust's core refers to this function in its unwind tables, which nothing here uses. It is never called, and hidden
// outside this library.
core::arch::global_asm!(
    ".globl rust_eh_personality",
    ".hidden rust_eh_personality",
    "rust_eh_personality:",
    ".long 0"
);
