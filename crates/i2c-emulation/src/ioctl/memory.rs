//! How the ioctl layer reaches the calling program's buffers.

use super::errno::Errno;
use super::uapi::PointerWidth;

/// The calling program's memory, wherever it is.
///
/// Addresses are those of the caller and may be anything: an implementation answers EFAULT, it never trusts them.
/// As in the kernel, an unaligned address is an ordinary address.
pub trait CallerMemory {
    /// Copies bytes out of the caller; all of them or none are used.
    ///
    /// # Errors
    /// EFAULT where the caller has no such memory; EPERM where it may not be looked into.
    fn read(&mut self, address: u64, into: &mut [u8]) -> Result<(), Errno>;

    /// Copies bytes into the caller. After an error some of them may have been written, as in the kernel.
    ///
    /// # Errors
    /// EFAULT where the caller has no such memory, or may not write to it; EPERM where it may not be reached.
    fn write(&mut self, address: u64, bytes: &[u8]) -> Result<(), Errno>;

    /// How wide the caller's pointers are.
    fn pointer_width(&self) -> PointerWidth {
        PointerWidth::Bits64
    }
}
