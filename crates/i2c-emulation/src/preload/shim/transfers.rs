//! The functions of the C library that read and write, intercepted.

use core::ffi::{c_int, c_long, c_void};

use super::super::protocol::Call;
use super::intercept::result;
use super::system::{self, EFAULT, EINVAL, EOPNOTSUPP};
use super::{channel, descriptor};

/// Most pieces that the kernel takes in one call (UIO_MAXIOV).
const PIECES_MAX: usize = 1024;
/// The one flag that the kernel lets a device have that knows only read() and write().
const RWF_HIPRI: c_int = 1;

/// `off_t`: 64 bits in musl, the width of a pointer in glibc.
#[cfg(target_env = "musl")]
type Offset = i64;
#[cfg(not(target_env = "musl"))]
type Offset = c_long;
/// `off64_t`.
type Offset64 = i64;

/// `struct iovec`.
#[repr(C)]
pub(crate) struct Piece {
    start: *mut c_void,
    length: usize,
}

type Transfer = unsafe extern "C" fn(c_int, *mut c_void, usize) -> isize;
type TransferChecked = unsafe extern "C" fn(c_int, *mut c_void, usize, usize) -> isize;
type TransferPieces = unsafe extern "C" fn(c_int, *const Piece, c_int) -> isize;
type TransferAt<O> = unsafe extern "C" fn(c_int, *mut c_void, usize, O) -> isize;
type TransferAtChecked<O> = unsafe extern "C" fn(c_int, *mut c_void, usize, O, usize) -> isize;
type TransferPiecesAt<O> = unsafe extern "C" fn(c_int, *const Piece, c_int, O) -> isize;
type TransferPiecesFlagged<O> = unsafe extern "C" fn(c_int, *const Piece, c_int, O, c_int) -> isize;

intercept! {
    fn read(file: c_int, buffer: *mut c_void, length: usize) -> isize {
        match descriptor::file_of(file) {
            Some(token) => read_device(token, buffer, length),
            None => pass_on!(read: Transfer, file, buffer, length),
        }
    }

    fn __read_chk(file: c_int, buffer: *mut c_void, length: usize, room: usize) -> isize {
        match descriptor::file_of(file) {
            Some(token) if length <= room => read_device(token, buffer, length),
            _ => pass_on!(__read_chk: TransferChecked, file, buffer, length, room),
        }
    }

    fn write(file: c_int, buffer: *mut c_void, length: usize) -> isize {
        match descriptor::file_of(file) {
            Some(token) => write_device(token, buffer, length),
            None => pass_on!(write: Transfer, file, buffer, length),
        }
    }

    fn readv(file: c_int, pieces: *const Piece, count: c_int) -> isize {
        match descriptor::file_of(file) {
            Some(token) => each_piece(token, pieces, count, read_device),
            None => pass_on!(readv: TransferPieces, file, pieces, count),
        }
    }

    fn writev(file: c_int, pieces: *const Piece, count: c_int) -> isize {
        match descriptor::file_of(file) {
            Some(token) => each_piece(token, pieces, count, write_device),
            None => pass_on!(writev: TransferPieces, file, pieces, count),
        }
    }
}

// i2c-dev ignores the position, and so does this; what is negative the kernel refuses before it asks the device.
macro_rules! positional {
    ($($offset:ty: $pread:ident $pread_checked:ident $pwrite:ident $preadv:ident $pwritev:ident $preadv2:ident $pwritev2:ident)*) => {$(intercept! {
        fn $pread(file: c_int, buffer: *mut c_void, length: usize, at: $offset) -> isize {
            match descriptor::file_of(file) {
                Some(token) => positioned(at.into(), || read_device(token, buffer, length)),
                None => pass_on!($pread: TransferAt<$offset>, file, buffer, length, at),
            }
        }

        fn $pread_checked(file: c_int, buffer: *mut c_void, length: usize, at: $offset, room: usize) -> isize {
            match descriptor::file_of(file) {
                Some(token) if length <= room => positioned(at.into(), || read_device(token, buffer, length)),
                _ => pass_on!($pread_checked: TransferAtChecked<$offset>, file, buffer, length, at, room),
            }
        }

        fn $pwrite(file: c_int, buffer: *mut c_void, length: usize, at: $offset) -> isize {
            match descriptor::file_of(file) {
                Some(token) => positioned(at.into(), || write_device(token, buffer, length)),
                None => pass_on!($pwrite: TransferAt<$offset>, file, buffer, length, at),
            }
        }

        fn $preadv(file: c_int, pieces: *const Piece, count: c_int, at: $offset) -> isize {
            match descriptor::file_of(file) {
                Some(token) => positioned(at.into(), || each_piece(token, pieces, count, read_device)),
                None => pass_on!($preadv: TransferPiecesAt<$offset>, file, pieces, count, at),
            }
        }

        fn $pwritev(file: c_int, pieces: *const Piece, count: c_int, at: $offset) -> isize {
            match descriptor::file_of(file) {
                Some(token) => positioned(at.into(), || each_piece(token, pieces, count, write_device)),
                None => pass_on!($pwritev: TransferPiecesAt<$offset>, file, pieces, count, at),
            }
        }

        fn $preadv2(file: c_int, pieces: *const Piece, count: c_int, at: $offset, flags: c_int) -> isize {
            match descriptor::file_of(file) {
                Some(token) => flagged(at.into(), flags, || each_piece(token, pieces, count, read_device)),
                None => pass_on!($preadv2: TransferPiecesFlagged<$offset>, file, pieces, count, at, flags),
            }
        }

        fn $pwritev2(file: c_int, pieces: *const Piece, count: c_int, at: $offset, flags: c_int) -> isize {
            match descriptor::file_of(file) {
                Some(token) => flagged(at.into(), flags, || each_piece(token, pieces, count, write_device)),
                None => pass_on!($pwritev2: TransferPiecesFlagged<$offset>, file, pieces, count, at, flags),
            }
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

/// A transfer at a position, which is ignored.
fn positioned(at: Offset64, transfer: impl FnOnce() -> isize) -> isize {
    if at < 0 {
        return result(Err(EINVAL));
    }
    transfer()
}

/// As [`positioned`]; -1 means no position.
fn flagged(at: Offset64, flags: c_int, transfer: impl FnOnce() -> isize) -> isize {
    if at < -1 {
        return result(Err(EINVAL));
    }
    if flags & !RWF_HIPRI != 0 {
        return result(Err(EOPNOTSUPP));
    }
    transfer()
}

/// One transfer for each piece, as the kernel does for a device that knows only read() and write().
fn each_piece(
    token: u64,
    pieces: *const Piece,
    count: c_int,
    transfer: fn(u64, *mut c_void, usize) -> isize,
) -> isize {
    let Some(count) = usize::try_from(count)
        .ok()
        .filter(|count| *count <= PIECES_MAX)
    else {
        return result(Err(EINVAL));
    };
    let mut total = 0;
    for index in 0..count {
        let Some(Piece { start, length }) = piece(pieces, index) else {
            return if total > 0 {
                total
            } else {
                result(Err(EFAULT))
            };
        };
        let done = transfer(token, start, length);
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

/// A piece of the program's list; `None` where its memory is not there.
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
