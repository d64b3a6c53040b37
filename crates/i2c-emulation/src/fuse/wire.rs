//! The bytes of the FUSE protocol (`linux/fuse.h`), as far as a single file needs it.

use crate::ioctl::Errno;

/// The protocol version of the answers. Kernels since 4.20 speak it, and newer ones stay compatible.
pub(super) const MAJOR: u32 = 7;
pub(super) const MINOR: u32 = 28;
/// The largest write the kernel may pass at once; i2c-dev uses 8192 bytes of it.
const WRITE_BYTES_MAX: u32 = 64 * 1024;
/// Room for one read of /dev/fuse: the largest write, its two headers, and some spare.
pub(super) const REQUEST_BYTES_MAX: usize = 64 * 1024 + 4096;
const REQUEST_HEADER_BYTES: usize = 40;
/// A regular file that everyone may read and write.
pub(super) const FILE_MODE: u32 = 0o100_666;

const ROOT_INODE: u64 = 1;
const ATTRIBUTES_VALID_S: u64 = 3600;
const BLOCK_BYTES: u32 = 4096;
const NAME_BYTES_MAX: u32 = 255;
/// FOPEN_DIRECT_IO: no page cache. FOPEN_NONSEEKABLE and FOPEN_STREAM would make lseek() return ESPIPE, as for a
/// character device, but also pread() and pwrite(), which i2c-dev accepts.
const OPEN_FLAGS: u32 = 1;

pub(super) mod opcode {
    pub(crate) const LOOKUP: u32 = 1;
    pub(crate) const FORGET: u32 = 2;
    pub(crate) const GETATTR: u32 = 3;
    pub(crate) const SETATTR: u32 = 4;
    pub(crate) const OPEN: u32 = 14;
    pub(crate) const READ: u32 = 15;
    pub(crate) const WRITE: u32 = 16;
    pub(crate) const STATFS: u32 = 17;
    pub(crate) const RELEASE: u32 = 18;
    pub(crate) const FLUSH: u32 = 25;
    pub(crate) const INIT: u32 = 26;
    pub(crate) const ACCESS: u32 = 34;
    pub(crate) const DESTROY: u32 = 38;
    pub(crate) const IOCTL: u32 = 39;
    pub(crate) const BATCH_FORGET: u32 = 42;
}

pub(super) struct Request<'a> {
    pub(super) unique: u64,
    pub(super) pid: u32,
    pub(super) opcode: u32,
    pub(super) body: Fields<'a>,
}

impl<'a> Request<'a> {
    /// `None` without a complete header, which an answer needs.
    pub(super) fn parse(bytes: &'a [u8]) -> Option<Self> {
        let (header, body) = bytes.split_at_checked(REQUEST_HEADER_BYTES)?;
        let header = Fields(header);
        Some(Self {
            unique: header.u64(8).ok()?,
            pid: header.u32(32).ok()?,
            opcode: header.u32(4).ok()?,
            body: Fields(body),
        })
    }
}

/// Numbers at offsets, in the machine's byte order; a truncated one is EINVAL.
#[derive(Clone, Copy)]
pub(super) struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn u32(self, offset: usize) -> Result<u32, Errno> {
        self.array(offset).map(u32::from_ne_bytes)
    }

    pub(super) fn u64(self, offset: usize) -> Result<u64, Errno> {
        self.array(offset).map(u64::from_ne_bytes)
    }

    /// `size` of `struct fuse_read_in` and of `struct fuse_write_in`.
    pub(super) fn length(self) -> Result<usize, Errno> {
        usize::try_from(self.u32(16)?).or(Err(Errno::INVAL))
    }

    /// The bytes after `struct fuse_write_in`.
    pub(super) fn written(self) -> Result<&'a [u8], Errno> {
        const HEADER_BYTES: usize = 40;
        let bytes = self.0.get(HEADER_BYTES..).unwrap_or_default();
        bytes.get(..self.length()?).ok_or(Errno::INVAL)
    }

    fn array<const N: usize>(self, offset: usize) -> Result<[u8; N], Errno> {
        let bytes = self.0.get(offset..).and_then(<[u8]>::first_chunk);
        bytes.copied().ok_or(Errno::INVAL)
    }
}

pub(super) fn answer(unique: u64, outcome: Result<Vec<u8>, Errno>) -> Vec<u8> {
    const HEADER_BYTES: usize = 16;
    let (error, body) = match outcome {
        Ok(body) => (0, body),
        Err(errno) => (-errno.raw_os_error(), Vec::new()),
    };
    let length = u32::try_from(HEADER_BYTES + body.len()).unwrap_or(u32::MAX);
    let (length, error) = (length.to_ne_bytes(), error.to_ne_bytes());
    [&length[..], &error, &unique.to_ne_bytes(), &body].concat()
}

/// `struct fuse_init_out`: requests no feature; max_background and congestion_threshold stay the kernel's own.
pub(super) fn init(read_ahead: u32) -> Vec<u8> {
    let front = words([MAJOR, MINOR, read_ahead, 0, 0, WRITE_BYTES_MAX, 1]);
    [&front[..], &[0; 36]].concat()
}

/// `struct fuse_attr_out` of the only file; size, blocks and times are zero.
pub(super) fn attributes(owner: u32, group: u32) -> Vec<u8> {
    let inode = [ATTRIBUTES_VALID_S, 0, ROOT_INODE].map(u64::to_ne_bytes);
    let mode = words([FILE_MODE, 1, owner, group, 0, BLOCK_BYTES, 0]);
    [inode.as_flattened(), &[0; 5 * 8 + 3 * 4], &mode].concat()
}

/// `struct fuse_open_out`.
pub(super) fn opened(handle: u64) -> Vec<u8> {
    [&handle.to_ne_bytes()[..], &words([OPEN_FLAGS, 0])].concat()
}

/// `struct fuse_write_out`.
pub(super) fn written(length: usize) -> Vec<u8> {
    words([u32::try_from(length).unwrap_or(u32::MAX), 0])
}

/// `struct fuse_ioctl_out` of an ioctl without buffers in the protocol.
pub(super) fn ioctl_done(result: i32) -> Vec<u8> {
    [&result.to_ne_bytes()[..], &[0; 12]].concat()
}

/// `struct fuse_statfs_out` of a file system without blocks.
pub(super) fn statistics() -> Vec<u8> {
    let sizes = words([BLOCK_BYTES, NAME_BYTES_MAX, BLOCK_BYTES]);
    [&[0; 5 * 8][..], &sizes, &[0; 7 * 4]].concat()
}

fn words<const N: usize>(words: [u32; N]) -> Vec<u8> {
    words.map(u32::to_ne_bytes).as_flattened().to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sizes of the C structures, as `sizeof` gives them.
    #[test]
    fn answers_have_the_sizes_of_the_kernels_structures() {
        assert_eq!(init(0).len(), 64);
        assert_eq!(attributes(0, 0).len(), 16 + 88);
        assert_eq!(opened(1).len(), 16);
        assert_eq!(written(1).len(), 8);
        assert_eq!(ioctl_done(0).len(), 16);
        assert_eq!(statistics().len(), 80);
        assert_eq!(answer(7, Ok(vec![0; 4])).len(), 20);
        assert_eq!(answer(7, Err(Errno::IO))[4..8], (-5i32).to_ne_bytes());
    }
}
