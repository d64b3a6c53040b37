//! The intercepted C library functions that read and write.

use super::super::protocol::Call;
use super::intercept::{failed, result};
use super::system::{self, EFAULT, EINVAL, EOPNOTSUPP};
use super::{channel, descriptor};
#[cfg(not(target_env = "musl"))]
use core::ffi::c_long;
use core::ffi::{c_int, c_void};

/// The most pieces that the kernel takes in one call (UIO_MAXIOV).
const PIECES_MAX: usize = 1024;
/// The only flag that the kernel allows for a device with just read() and write().
const RWF_HIPRI: c_int = 1;

/// `off_t`: 64 bits in musl, the width of a pointer in glibc.
#[cfg(target_env = "musl")]
type Offset = i64;
#[cfg(not(target_env = "musl"))]
type Offset = c_long;
type Offset64 = i64;

#[repr(C)]
pub(crate) struct Piece {
    start: *mut c_void,
    length: usize,
}

intercept! {
    fn read(file: c_int, buffer: *mut c_void, length: usize) -> isize {
        Some(read_device(descriptor::file_of(file)?, buffer, length))
    }

    fn __read_chk(file: c_int, buffer: *mut c_void, length: usize, room: usize) -> isize {
        let token = descriptor::file_of(file).filter(|_| length <= room)?;
        Some(read_device(token, buffer, length))
    }

    fn write(file: c_int, buffer: *mut c_void, length: usize) -> isize {
        Some(write_device(descriptor::file_of(file)?, buffer, length))
    }

    fn readv(file: c_int, pieces: *const Piece, count: c_int) -> isize {
        Some(each_piece(descriptor::file_of(file)?, pieces, count, read_device))
    }

    fn writev(file: c_int, pieces: *const Piece, count: c_int) -> isize {
        Some(each_piece(descriptor::file_of(file)?, pieces, count, write_device))
    }
}

// i2c-dev ignores the position, and so do these; the kernel rejects a negative one before it asks the device.
macro_rules! positional {
    ($($offset:ty: $pread:ident $pread_checked:ident $pwrite:ident $preadv:ident $pwritev:ident $preadv2:ident $pwritev2:ident)*) => {$(intercept! {
        fn $pread(file: c_int, buffer: *mut c_void, length: usize, at: $offset) -> isize {
            positioned(file, at.into(), |token| read_device(token, buffer, length))
        }

        fn $pread_checked(file: c_int, buffer: *mut c_void, length: usize, at: $offset, room: usize) -> isize {
            (length <= room).then_some(())?;
            positioned(file, at.into(), |token| read_device(token, buffer, length))
        }

        fn $pwrite(file: c_int, buffer: *mut c_void, length: usize, at: $offset) -> isize {
            positioned(file, at.into(), |token| write_device(token, buffer, length))
        }

        fn $preadv(file: c_int, pieces: *const Piece, count: c_int, at: $offset) -> isize {
            positioned(file, at.into(), |token| each_piece(token, pieces, count, read_device))
        }

        fn $pwritev(file: c_int, pieces: *const Piece, count: c_int, at: $offset) -> isize {
            positioned(file, at.into(), |token| each_piece(token, pieces, count, write_device))
        }

        fn $preadv2(file: c_int, pieces: *const Piece, count: c_int, at: $offset, flags: c_int) -> isize {
            flagged(file, at.into(), flags, |token| each_piece(token, pieces, count, read_device))
        }

        fn $pwritev2(file: c_int, pieces: *const Piece, count: c_int, at: $offset, flags: c_int) -> isize {
            flagged(file, at.into(), flags, |token| each_piece(token, pieces, count, write_device))
        }
    })*};
}

positional! {
    Offset: pread __pread_chk pwrite preadv pwritev preadv2 pwritev2
    Offset64: pread64 __pread64_chk pwrite64 preadv64 pwritev64 preadv64v2 pwritev64v2
}

fn read_device(file: u64, buffer: *mut c_void, length: usize) -> isize {
    let (buffer, length) = span(buffer, length);
    result(channel::perform(file, Call::Read { buffer, length }))
}

fn write_device(file: u64, buffer: *mut c_void, length: usize) -> isize {
    let (buffer, length) = span(buffer, length);
    result(channel::perform(file, Call::Write { buffer, length }))
}

fn span(buffer: *mut c_void, length: usize) -> (u64, u64) {
    let address = u64::try_from(buffer.expose_provenance()).unwrap_or(0);
    (address, u64::try_from(length).unwrap_or(u64::MAX))
}

/// Transfers on a token at a position, which is ignored.
fn positioned(file: c_int, at: Offset64, transfer: impl FnOnce(u64) -> isize) -> Option<isize> {
    let token = descriptor::file_of(file)?;
    Some(if at < 0 {
        failed(EINVAL)
    } else {
        transfer(token)
    })
}

/// As [`positioned`]; -1 means no position.
fn flagged(
    file: c_int,
    at: Offset64,
    flags: c_int,
    transfer: impl FnOnce(u64) -> isize,
) -> Option<isize> {
    let token = descriptor::file_of(file)?;
    Some(if at < -1 {
        failed(EINVAL)
    } else if flags & !RWF_HIPRI != 0 {
        failed(EOPNOTSUPP)
    } else {
        transfer(token)
    })
}

/// One transfer per piece, as the kernel does for a device with just read() and write().
fn each_piece(
    token: u64,
    pieces: *const Piece,
    count: c_int,
    transfer: fn(u64, *mut c_void, usize) -> isize,
) -> isize {
    let count = usize::try_from(count).unwrap_or(usize::MAX);
    if count > PIECES_MAX {
        return failed(EINVAL);
    }
    let mut total = 0;
    for index in 0..count {
        let (done, length) = match piece(pieces, index) {
            Some(Piece { start, length }) => (transfer(token, start, length), length),
            None => (if total > 0 { -1 } else { failed(EFAULT) }, 0),
        };
        if done < 0 {
            return if total > 0 { total } else { done };
        }
        total += done;
        if usize::try_from(done).unwrap_or(0) < length {
            break;
        }
    }
    total
}

/// A piece of the program's list; `None` if its memory is not readable.
fn piece(pieces: *const Piece, index: usize) -> Option<Piece> {
    let at = pieces.wrapping_add(index);
    let mut bytes = [0; size_of::<Piece>()];
    system::peek(u64::try_from(at.expose_provenance()).ok()?, &mut bytes).ok()?;
    let (start, length) = bytes.split_at(size_of::<usize>());
    let word = |half: &[u8]| half.first_chunk().copied().map(usize::from_ne_bytes);
    Some(Piece {
        start: core::ptr::with_exposed_provenance_mut(word(start)?),
        length: word(length)?,
    })
}
