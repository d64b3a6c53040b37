//! The body of `POST /v1/frames` and of its answer: one batch per device and half second.
//!
//! ```
//! use grideye_recording::wire::Batch;
//!
//! let body = br#"{"device":"pi-1","boot":"5f0c","sensors":[{"sensor":"i2c-1:0x69","frames":[
//!     {"seq":17,"t_boot_ns":81000000000,"t_utc_ns":1625163247274925000,"clock":"synced","missing":"nack"}]}]}"#;
//! let batch = Batch::from_json(body).unwrap();
//! assert_eq!(batch.sensors[0].frames[0].seq, 17);
//! ```
//!
//! A body is accepted or rejected as a whole. Unknown or repeated fields, `null`, fractions and the like are rejected,
//! so that a sender's mistake shows at once.
//!
//! # The compact body
//!
//! `POST /v1/frames` also takes a batch as bytes, with the content type [`BINARY_TYPE`]. Meaning, checks and limits are
//! those of the JSON body; the answer is always JSON. An agent with `body = "binary"` in its configuration sends it.
//!
//! Fixed-width integers are little-endian. A *count* is an unsigned number in groups of 7 bits, lowest first, with the
//! eighth bit set in all groups but the last, and no empty last group. A *name* is one byte with its length, at most 64,
//! then that many bytes of text.
//!
//! | part | bytes |
//! |---|---|
//! | mark and version | `47 45 42 02` |
//! | device, boot | two names |
//! | t_sent_boot_ns | one byte 0, or one byte 1 and 8 bytes |
//! | sensors | a count, then for each sensor: |
//! | · sensor | a name |
//! | · account | one byte: 0 for none, 1 for a current one, 2 for one that has `ended`; after 1 or 2: read, missing, spooled as counts; dropped and errors, each as a count of entries and for each a name and a count |
//! | · frames | a count, then for each frame: |
//! | · · seq, t_boot_ns, t_utc_ns | 8 bytes each, the last one signed |
//! | · · kind | one byte: clock in the upper half (0 unsynced, 1 synced, 2 stepped); in the lower half 0 for a frame, 1 for a missing one, 3 for a frame without its thermistor |
//! | · · a frame | thermistor_raw, 2 bytes (not with kind 3), and the 64 pixels_raw, packed: the lowest, 2 bytes; a width of 0 to 16, one byte; for each pixel, in order, its distance above the lowest in that many bits, lowest bit first |
//! | · · a missing one | the reason as a name |
//!
//! A packed frame of a room is 62 to 78 bytes instead of 155, because its pixels differ by 4 to 6 bits; it is at most 158.
//! Counts and widths are as small as possible, so equal batches are equal bytes. A later layout has another content type
//! and version byte; a collector rejects unknown versions.

mod binary;
mod check;
mod error;
mod json;
mod types;
mod values;

pub use error::{WireError, WireFault};
pub use types::{
    Account, Acknowledgement, BINARY_TYPE, BOOTS_TOLD_AGAIN, Batch, FRAME_BYTES_MAX, FRAMES_MAX,
    GAPS_MAX, Gap, JSON_TYPE, LOST_BY_COLLECTOR, LOST_IN_MEMORY, REASONS_MAX, SENSORS_MAX,
    SensorBatch,
};

impl Batch {
    /// Reads the body of a post.
    ///
    /// # Errors
    /// [`WireError`] for the first fault, with the field's path, expected and found.
    pub fn from_json(json: &[u8]) -> Result<Self, WireError> {
        let batch: Self = json::read(json)?;
        check::frames_in_all(&batch)?;
        check::batch(&batch)?;
        Ok(batch)
    }

    /// Writes the body of a post, without white space.
    ///
    /// # Errors
    /// [`WireError`] for content that [`Batch::from_json`] rejects, except too many frames.
    pub fn to_json(&self) -> Result<Vec<u8>, WireError> {
        check::batch(self)?;
        json::write(self)
    }

    /// Reads the compact body of a post ([`BINARY_TYPE`]), with the same checks and limits as JSON.
    ///
    /// # Errors
    /// [`WireError`] for the first fault, with the field's path, expected and found.
    pub fn from_binary(body: &[u8]) -> Result<Self, WireError> {
        let batch = binary::decode(body)?;
        check::frames_in_all(&batch)?;
        check::batch(&batch)?;
        Ok(batch)
    }

    /// Writes the compact body of a post: 62 to 78 bytes per frame of a room, at most 158.
    ///
    /// # Errors
    /// [`WireError`] for content that [`Batch::from_binary`] rejects, except too many frames.
    pub fn to_binary(&self) -> Result<Vec<u8>, WireError> {
        let mut body = Vec::new();
        self.append_binary(&mut body)?;
        Ok(body)
    }

    /// Appends the compact body to `body`.
    ///
    /// # Errors
    /// As [`Batch::to_binary`]; then nothing is written.
    pub fn append_binary(&self, body: &mut Vec<u8>) -> Result<(), WireError> {
        check::batch(self)?;
        binary::encode(self, body);
        Ok(())
    }
}

impl Acknowledgement {
    /// Reads the answer to a post.
    ///
    /// # Errors
    /// [`WireError`] for the first fault, with the field's path, expected and found.
    pub fn from_json(json: &[u8]) -> Result<Self, WireError> {
        let acknowledgement = json::read(json)?;
        check::acknowledgement(&acknowledgement)?;
        Ok(acknowledgement)
    }

    /// Writes the answer to a post, without white space.
    ///
    /// # Errors
    /// [`WireError`] for content that [`Acknowledgement::from_json`] rejects, except too many of it.
    pub fn to_json(&self) -> Result<Vec<u8>, WireError> {
        check::acknowledgement(self)?;
        json::write(self)
    }
}
