//! The library that is preloaded: a crate of its own, which `build.rs` compiles with neither std nor one C library in mind.
#![no_std]
#![deny(unsafe_op_in_unsafe_fn)]

#[expect(dead_code, reason = "each side uses its half")]
mod protocol;
mod shim;

/// Nothing here is meant to panic; if it does all the same, the program must not go on with a broken bus.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    shim::abort()
}

// Rust's own core names this function in its tables for unwinding, which nothing here does. It is never called, and not
// seen outside of this library.
core::arch::global_asm!(
    ".globl rust_eh_personality",
    ".hidden rust_eh_personality",
    "rust_eh_personality:",
    ".long 0"
);
