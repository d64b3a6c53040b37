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
