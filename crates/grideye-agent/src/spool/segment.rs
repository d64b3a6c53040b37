//! The format of a segment: a header, then records, each with its length and checksum.
//!
//! ```text
//!   header  magic 8 | version u32 | number u64 | crc32c u32 of what stands before it
//!   record  length u32 of the payload | crc32c u32 of number, length and payload | payload
//!   payload 1  stream:  index u16, device, boot, sensor (each a length u8 and its bytes)
//!           2  frame:   index u16, seq u64, t_boot_ns u64, t_utc_ns i64, clock u8,
//!                       then 0 u8, thermistor u16, 64 pixels u16  or  1 u8, a reason (length u8 and its bytes)
//!           3  account: index u16, read u64, missing u64, spooled u64, dropped and errors (each a count u8, then name, u64)
//! ```
//!
//! The header keeps its form in every version. All numbers are little-endian. A stream is declared before it is used, again in each segment, so that a segment can be
//! read alone. The checksum takes in the segment's number: blocks of another file that show after a loss of power do
//! not pass. A file ends where its first record ends that is not whole; what stands behind it is not guessed at.

mod decode;
mod encode;
#[cfg(test)]
mod tests;

pub use decode::{Entries, check_header};
pub use encode::Encoder;

use crc::Crc;
use grideye_frame::PIXELS;
use grideye_recording::wire::Account;
use grideye_recording::{Record, StreamId};
use std::sync::Arc;

/// How every segment begins. The line break shows what took it for text.
pub const MAGIC: [u8; 8] = *b"GEYESPL\n";
/// The version of the format that is written, and the only one that is read.
pub const VERSION: u32 = 1;
/// Bytes of the header.
pub const HEADER_BYTES: usize = 24;
/// The same, as an offset in a file.
pub(super) const HEADER_BYTES_U64: u64 = 24;
/// Bytes of a record's length and checksum.
const PREFIX_BYTES: usize = 8;
/// The longest payload: an account with 64 reasons and as many errors, all names of full length.
pub const PAYLOAD_BYTES_MAX: usize = 16 * 1024;
/// Bytes that one frame takes in a segment.
pub const FRAME_BYTES: usize = PREFIX_BYTES + 1 + 2 + 8 + 8 + 8 + 1 + 1 + 2 + 2 * PIXELS;
/// Reasons, and errors, of one account that are kept.
const COUNTS_MAX: usize = 64;

const STREAM: u8 = 1;
const FRAME: u8 = 2;
const ACCOUNT: u8 = 3;

/// What one record of a segment says.
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    /// From here on, records of this index are of this stream.
    Stream {
        /// The index.
        index: u16,
        /// Whose.
        id: Arc<StreamId>,
    },
    /// A frame, or the reason why there is none.
    Record {
        /// The stream's index.
        stream: u16,
        /// The record.
        record: Record,
    },
    /// The agent's count of a stream as it was when the records behind it were written.
    Account {
        /// The stream's index.
        stream: u16,
        /// The count.
        account: Account,
    },
}

/// Why a segment, or the rest of it, cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// The file is no segment, or its header is damaged.
    #[error("no header of a segment")]
    NoHeader,
    /// The file is a segment in another format.
    #[error("format {found}, and this version reads format {VERSION}")]
    OtherVersion {
        /// Its version.
        found: u32,
    },
    /// The file's name says another number than its header.
    #[error("the header says segment {found}")]
    OtherNumber {
        /// The header's number.
        found: u64,
    },
    /// The record at this offset is cut off.
    #[error("a record at byte {offset} is cut off")]
    Cut {
        /// Where it begins.
        offset: usize,
    },
    /// The record at this offset is not what was written.
    #[error("a record at byte {offset} is damaged")]
    Damaged {
        /// Where it begins.
        offset: usize,
    },
}
/// CRC-32C (Castagnoli, RFC 3720 appendix B.4) of some pieces of bytes in a row.
#[must_use]
pub fn crc32c(pieces: &[&[u8]]) -> u32 {
    let mut digest = CASTAGNOLI.digest();
    pieces.iter().for_each(|piece| digest.update(piece));
    digest.finalize()
}

static CASTAGNOLI: Crc<u32> = Crc::<u32>::new(&crc::CRC_32_ISCSI);
