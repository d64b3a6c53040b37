//! The numbers that a caller sees when a system call fails.

use core::fmt;

/// An errno of Linux, positive, as in `errno(3)`.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Errno(i32);

impl Errno {
    /// Not permitted.
    pub const EPERM: Self = Self(libc::EPERM);
    /// Input or output failed: everything that has no better name.
    pub const EIO: Self = Self(libc::EIO);
    /// Nobody answered, in the words of a USB or SMBus adapter.
    pub const ENXIO: Self = Self(libc::ENXIO);
    /// Not an open file, or not one for reading or for writing.
    pub const EBADF: Self = Self(libc::EBADF);
    /// Arbitration was lost: try again.
    pub const EAGAIN: Self = Self(libc::EAGAIN);
    /// A pointer of the caller leads nowhere.
    pub const EFAULT: Self = Self(libc::EFAULT);
    /// A kernel driver owns the address.
    pub const EBUSY: Self = Self(libc::EBUSY);
    /// The adapter is gone.
    pub const ENODEV: Self = Self(libc::ENODEV);
    /// An argument out of range.
    pub const EINVAL: Self = Self(libc::EINVAL);
    /// Too many open files.
    pub const ENFILE: Self = Self(libc::ENFILE);
    /// Not a request that i2c-dev knows.
    pub const ENOTTY: Self = Self(libc::ENOTTY);
    /// Not implemented (the answer to a FUSE request that has no meaning here).
    pub const ENOSYS: Self = Self(libc::ENOSYS);
    /// No such file.
    pub const ENOENT: Self = Self(libc::ENOENT);
    /// The checksum (PEC) was wrong.
    pub const EBADMSG: Self = Self(libc::EBADMSG);
    /// The target broke the SMBus protocol.
    pub const EPROTO: Self = Self(libc::EPROTO);
    /// The adapter cannot do such a transfer.
    pub const EOPNOTSUPP: Self = Self(libc::EOPNOTSUPP);
    /// The bus was held for too long.
    pub const ETIMEDOUT: Self = Self(libc::ETIMEDOUT);
    /// Nobody answered, in the words of a Raspberry Pi.
    pub const EREMOTEIO: Self = Self(libc::EREMOTEIO);

    /// The positive number.
    #[must_use]
    pub const fn raw(self) -> i32 {
        self.0
    }
}

impl fmt::Debug for Errno {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Errno({self})")
    }
}

impl fmt::Display for Errno {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", std::io::Error::from_raw_os_error(self.0))
    }
}
