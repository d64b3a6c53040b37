//! The parts of a segment: sizes, kinds, checksum, and reasons why reading fails.

use crc::Crc;
use grideye_frame::PIXELS;
use grideye_recording::wire::Account;
use grideye_recording::{Record, StreamId};
use std::sync::Arc;

/// The first bytes of every segment. The line break exposes programs that treated it as text.
pub const MAGIC: [u8; 8] = *b"GEYESPL\n";
/// The version of the format written, and the only one read.
pub const VERSION: u32 = 1;
/// Bytes of the header.
pub const HEADER_BYTES: usize = 24;
/// Bytes of a record's length and checksum.
pub(super) const PREFIX_BYTES: usize = 8;
/// Maximum payload: an account with 64 reasons and 64 errors, all names of full length.
pub const PAYLOAD_BYTES_MAX: usize = 16 * 1024;
/// Size of one frame in a segment.
pub const FRAME_BYTES: usize = PREFIX_BYTES + 1 + 2 + 8 + 8 + 8 + 1 + 1 + 2 + 2 * PIXELS;
/// Maximum number of reasons, and of errors, stored per account.
pub(super) const COUNTS_MAX: usize = 64;

pub(super) const STREAM: u8 = 1;
pub(super) const FRAME: u8 = 2;
pub(super) const ACCOUNT: u8 = 3;

/// One record of a segment.
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    /// From here on, records with this index belong to this stream.
    Stream(u16, Arc<StreamId>),
    /// A frame of the stream with this index, or the reason for its absence.
    Record(u16, Record),
    /// The agent's account of the stream with this index, when the following records were written.
    Account(u16, Account),
}

/// Why a segment or the rest of it cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// The file is no segment, or its header is damaged.
    #[error("no header of a segment")]
    NoHeader,
    /// The file is a segment in another format, with this version.
    #[error("format {0}, and this version reads format {VERSION}")]
    OtherVersion(u32),
    /// The header's segment number is this one, not that of the file's name.
    #[error("the header says segment {0}")]
    OtherNumber(u64),
    /// The record at this offset is cut off.
    #[error("a record at byte {0} is cut off")]
    Cut(usize),
    /// The record at this offset differs from what was written.
    #[error("a record at byte {0} is damaged")]
    Damaged(usize),
}

/// CRC-32C (Castagnoli, RFC 3720 appendix B.4) of consecutive pieces.
#[must_use]
pub fn crc32c(pieces: &[&[u8]]) -> u32 {
    let mut digest = CASTAGNOLI.digest();
    pieces.iter().for_each(|piece| digest.update(piece));
    digest.finalize()
}

static CASTAGNOLI: Crc<u32> = Crc::<u32>::new(&crc::CRC_32_ISCSI);
