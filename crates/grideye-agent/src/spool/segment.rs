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
//! The header keeps its form in every version. All numbers are little-endian. A stream is declared before it is used,
//! again in each segment, so that a segment can be read alone. The checksum takes in the segment's number: blocks of another file that show after a loss of power do
//! not pass. A file ends where its first record ends that is not whole; what stands behind it is not guessed at.

mod decode;
mod encode;
mod layout;

pub use decode::{Entries, check_header};
pub use encode::Encoder;
pub use layout::{
    Entry, FRAME_BYTES, Fault, HEADER_BYTES, MAGIC, PAYLOAD_BYTES_MAX, VERSION, crc32c,
};
