//! Writes a segment.

use super::layout::{
    ACCOUNT, COUNTS_MAX, FRAME, FRAME_BYTES, HEADER_BYTES, MAGIC, STREAM, VERSION, crc32c,
};
use grideye_recording::record::layout::{Form, put, put_name};
use grideye_recording::wire::Account;
use grideye_recording::{Record, StreamId};
use std::sync::Arc;

/// Encodes the bytes of one segment.
#[derive(Debug, Clone)]
pub struct Encoder {
    number: u64,
    streams: Vec<Arc<StreamId>>,
}

impl Encoder {
    /// For the segment with this number, with no streams declared yet.
    #[must_use]
    pub fn new(number: u64) -> Self {
        Self {
            number,
            streams: Vec::new(),
        }
    }

    /// The header.
    #[must_use]
    pub fn header(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER_BYTES);
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(self.number.to_le_bytes());
        bytes.extend(crc32c(&[&bytes]).to_le_bytes());
        bytes
    }

    /// The streams declared so far, by index.
    #[must_use]
    pub fn streams(&self) -> &[Arc<StreamId>] {
        &self.streams
    }

    /// Appends a record, after the declaration of its stream if that is new. Returns the record's offset in `bytes` and
    /// its stream's index.
    pub fn record(
        &mut self,
        bytes: &mut Vec<u8>,
        id: &Arc<StreamId>,
        record: &Record,
    ) -> (usize, u16) {
        let stream = self.declare(bytes, id);
        let begin = bytes.len();
        let mut payload = Vec::with_capacity(FRAME_BYTES);
        payload.push(FRAME);
        payload.extend(stream.to_le_bytes());
        put(&mut payload, record, Form::Spool);
        self.push(bytes, &payload);
        (begin, stream)
    }

    /// Appends an account, after the declaration of its stream if that is new.
    pub fn account(&mut self, bytes: &mut Vec<u8>, id: &Arc<StreamId>, account: &Account) {
        let stream = self.declare(bytes, id);
        self.push(bytes, &account_payload(stream, account));
    }

    fn declare(&mut self, bytes: &mut Vec<u8>, id: &Arc<StreamId>) -> u16 {
        let known = self.streams.iter().position(|known| known == id);
        let index = known.unwrap_or(self.streams.len());
        let short = u16::try_from(index).unwrap_or(u16::MAX);
        if known.is_none() {
            self.streams.push(Arc::clone(id));
            let mut payload = vec![STREAM];
            payload.extend(short.to_le_bytes());
            for name in [&id.device, &id.boot, &id.sensor] {
                put_name(&mut payload, name);
            }
            self.push(bytes, &payload);
        }
        short
    }

    fn push(&self, bytes: &mut Vec<u8>, payload: &[u8]) {
        let length = u32::try_from(payload.len()).unwrap_or(u32::MAX);
        let length = length.to_le_bytes();
        let crc = crc32c(&[&self.number.to_le_bytes(), &length, payload]);
        bytes.extend(length);
        bytes.extend(crc.to_le_bytes());
        bytes.extend(payload);
    }
}

fn account_payload(stream: u16, account: &Account) -> Vec<u8> {
    let mut payload = vec![ACCOUNT];
    payload.extend(stream.to_le_bytes());
    for count in [account.read, account.missing, account.spooled] {
        payload.extend(count.to_le_bytes());
    }
    for counts in [&account.dropped, &account.errors] {
        let kept = counts.len().min(COUNTS_MAX);
        payload.push(u8::try_from(kept).unwrap_or(u8::MAX));
        for (name, count) in counts.iter().take(kept) {
            put_name(&mut payload, name);
            payload.extend(count.to_le_bytes());
        }
    }
    payload
}
