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
//! The header has the same form in every version. All numbers are little-endian. Each segment declares a stream before
//! using it, so that a segment can be read alone. The checksum covers the segment's number, which exposes blocks of
//! another file after a power cut. Reading stops at the first incomplete record.

mod decode;
mod encode;
mod layout;

pub use decode::{Entries, check_header};
pub use encode::Encoder;
pub use layout::{
    Entry, FRAME_BYTES, Fault, HEADER_BYTES, MAGIC, PAYLOAD_BYTES_MAX, VERSION, crc32c,
};
