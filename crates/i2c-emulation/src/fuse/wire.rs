//! The bytes of the FUSE protocol (`linux/fuse.h`), as far as one file needs them.

use crate::ioctl::Errno;

/// The protocol version that the answers are written in. Kernels since 4.20 speak it, newer ones stay compatible.
pub(super) const MAJOR: u32 = 7;
pub(super) const MINOR: u32 = 28;
/// Largest write that the kernel may hand over at once; i2c-dev takes 8192 bytes of it.
pub(super) const WRITE_BYTES_MAX: u32 = 64 * 1024;
/// What one read of /dev/fuse must have room for: the largest write and its two headers, and some to spare.
pub(super) const REQUEST_BYTES_MAX: usize = 64 * 1024 + 4096;
/// Bytes of the header in front of every request.
pub(super) const REQUEST_HEADER_BYTES: usize = 40;
/// The file's mode: a regular file that everyone may read and write.
pub(super) const FILE_MODE: u32 = 0o100_666;

const ROOT_INODE: u64 = 1;
const ATTRIBUTES_VALID_S: u64 = 3600;
const BLOCK_BYTES: u32 = 4096;
const NAME_BYTES_MAX: u32 = 255;
/// FOPEN_DIRECT_IO: no page cache. FOPEN_NONSEEKABLE and FOPEN_STREAM would make lseek() ESPIPE, as a character device
/// does, but pread() and pwrite() with it, which i2c-dev takes.
const OPEN_FLAGS: u32 = 1;
const IOCTL_FROM_32_BIT: u32 = 1 << 3;
const SETATTR_MODE_OR_OWNER: u32 = 0b111;

/// What the kernel asks for.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Question<'a> {
    Init {
        major: u32,
        minor: u32,
        read_ahead: u32,
    },
    /// Nothing is ever below a file.
    Lookup,
    /// No answer is expected.
    Forget,
    GetAttributes,
    /// Truncation is ignored, as by a character device; a change of mode or owner is refused.
    SetAttributes {
        of_mode_or_owner: bool,
    },
    Open,
    Release {
        handle: u64,
    },
    Flush,
    Access,
    Statistics,
    Read {
        handle: u64,
        length: usize,
    },
    Write {
        handle: u64,
        bytes: &'a [u8],
    },
    Ioctl {
        handle: u64,
        request: u32,
        argument: u64,
        from_32_bit: bool,
    },
    Destroy,
    Other,
}

/// One request of the kernel.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Request<'a> {
    pub(super) unique: u64,
    pub(super) pid: u32,
    pub(super) question: Result<Question<'a>, Errno>,
}

impl<'a> Request<'a> {
    /// `None` if there is not even a header to answer to.
    pub(super) fn parse(bytes: &'a [u8]) -> Option<Self> {
        let header = Fields(bytes.get(..REQUEST_HEADER_BYTES)?);
        let body = Fields(bytes.get(REQUEST_HEADER_BYTES..)?);
        Some(Self {
            unique: header.u64(8)?,
            pid: header.u32(32)?,
            question: question(header.u32(4)?, body).ok_or(Errno::EINVAL),
        })
    }
}

fn question(opcode: u32, body: Fields<'_>) -> Option<Question<'_>> {
    Some(match opcode {
        1 => Question::Lookup,
        2 | 42 => Question::Forget,
        3 => Question::GetAttributes,
        4 => Question::SetAttributes {
            of_mode_or_owner: body.u32(0)? & SETATTR_MODE_OR_OWNER != 0,
        },
        14 => Question::Open,
        15 => Question::Read {
            handle: body.u64(0)?,
            length: body.length(16)?,
        },
        16 => write_question(body)?,
        17 => Question::Statistics,
        18 => Question::Release {
            handle: body.u64(0)?,
        },
        25 => Question::Flush,
        26 => Question::Init {
            major: body.u32(0)?,
            minor: body.u32(4)?,
            read_ahead: body.u32(8)?,
        },
        34 => Question::Access,
        38 => Question::Destroy,
        39 => Question::Ioctl {
            handle: body.u64(0)?,
            request: body.u32(12)?,
            argument: body.u64(16)?,
            from_32_bit: body.u32(8)? & IOCTL_FROM_32_BIT != 0,
        },
        _ => Question::Other,
    })
}

fn write_question(body: Fields<'_>) -> Option<Question<'_>> {
    const HEADER_BYTES: usize = 40;
    let length = body.length(16)?;
    let bytes = body.0.get(HEADER_BYTES..)?.get(..length)?;
    Some(Question::Write {
        handle: body.u64(0)?,
        bytes,
    })
}

/// Numbers at offsets, in the machine's byte order.
#[derive(Clone, Copy)]
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn u32(self, offset: usize) -> Option<u32> {
        let bytes = self.0.get(offset..)?.first_chunk()?;
        Some(u32::from_ne_bytes(*bytes))
    }

    fn u64(self, offset: usize) -> Option<u64> {
        let bytes = self.0.get(offset..)?.first_chunk()?;
        Some(u64::from_ne_bytes(*bytes))
    }

    fn length(self, offset: usize) -> Option<usize> {
        usize::try_from(self.u32(offset)?).ok()
    }
}

/// One answer, header included.
pub(super) fn answer(unique: u64, outcome: Result<Vec<u8>, Errno>) -> Vec<u8> {
    const HEADER_BYTES: usize = 16;
    let (error, body) = match outcome {
        Ok(body) => (0, body),
        Err(errno) => (-errno.raw(), Vec::new()),
    };
    let length = u32::try_from(HEADER_BYTES + body.len()).unwrap_or(u32::MAX);
    let mut bytes = Bytes::default();
    bytes.u32(length).i32(error).u64(unique);
    bytes.0.extend_from_slice(&body);
    bytes.0
}

/// `struct fuse_init_out`: no feature is asked for.
pub(super) fn init(read_ahead: u32) -> Vec<u8> {
    let mut bytes = Bytes::default();
    bytes.u32(MAJOR).u32(MINOR).u32(read_ahead).u32(0);
    // max_background and congestion_threshold, two halves of a word: the kernel's own defaults.
    bytes.u32(0).u32(WRITE_BYTES_MAX).u32(1);
    bytes.zeros(36);
    bytes.0
}

/// `struct fuse_attr_out` of the one file there is.
pub(super) fn attributes(owner: u32, group: u32) -> Vec<u8> {
    let mut bytes = Bytes::default();
    bytes.u64(ATTRIBUTES_VALID_S).u64(0);
    // Inode; then size, blocks, three times and their nanoseconds: all zero.
    bytes.u64(ROOT_INODE).zeros(5 * 8 + 3 * 4);
    bytes
        .u32(FILE_MODE)
        .u32(1)
        .u32(owner)
        .u32(group)
        .u32(0)
        .u32(BLOCK_BYTES)
        .u32(0);
    bytes.0
}

/// `struct fuse_open_out`.
pub(super) fn opened(handle: u64) -> Vec<u8> {
    let mut bytes = Bytes::default();
    bytes.u64(handle).u32(OPEN_FLAGS).u32(0);
    bytes.0
}

/// `struct fuse_write_out`.
pub(super) fn written(length: usize) -> Vec<u8> {
    let mut bytes = Bytes::default();
    bytes.u32(u32::try_from(length).unwrap_or(u32::MAX)).u32(0);
    bytes.0
}

/// `struct fuse_ioctl_out` of an ioctl whose buffers were reached another way.
pub(super) fn ioctl_done(result: i32) -> Vec<u8> {
    let mut bytes = Bytes::default();
    bytes.i32(result).zeros(12);
    bytes.0
}

/// `struct fuse_statfs_out` of a file system without blocks.
pub(super) fn statistics() -> Vec<u8> {
    let mut bytes = Bytes::default();
    bytes.zeros(5 * 8);
    bytes
        .u32(BLOCK_BYTES)
        .u32(NAME_BYTES_MAX)
        .u32(BLOCK_BYTES)
        .zeros(7 * 4);
    bytes.0
}

#[derive(Default)]
struct Bytes(Vec<u8>);

impl Bytes {
    fn i32(&mut self, value: i32) -> &mut Self {
        self.0.extend_from_slice(&value.to_ne_bytes());
        self
    }

    fn u32(&mut self, value: u32) -> &mut Self {
        self.0.extend_from_slice(&value.to_ne_bytes());
        self
    }

    fn u64(&mut self, value: u64) -> &mut Self {
        self.0.extend_from_slice(&value.to_ne_bytes());
        self
    }

    fn zeros(&mut self, length: usize) -> &mut Self {
        self.0.resize(self.0.len() + length, 0);
        self
    }
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
        assert_eq!(answer(7, Err(Errno::EIO))[4..8], (-5i32).to_ne_bytes());
    }

    #[test]
    fn a_write_that_is_shorter_than_it_says_is_refused() {
        let mut bytes = vec![0; REQUEST_HEADER_BYTES + 40 + 3];
        bytes[4] = 16;
        bytes[REQUEST_HEADER_BYTES + 16] = 4;
        assert_eq!(Request::parse(&bytes).unwrap().question, Err(Errno::EINVAL));
        bytes.push(9);
        let expected = Question::Write {
            handle: 0,
            bytes: &[0, 0, 0, 9],
        };
        assert_eq!(Request::parse(&bytes).unwrap().question, Ok(expected));
    }
}
