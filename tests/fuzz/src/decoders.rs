//! What is done with bytes from outside: each decoder of the product, held to what it says. What is decoded must encode to
//! what decodes the same.
//!
//! libFuzzer feeds it for hours (`tests/fuzz/run`), and the tests for a moment (`tests/tests/decoders.rs`).

use grideye_agent::config::Config;
use grideye_agent::join::{JoinLine, Joined};
use grideye_agent::spool::segment::{Encoder, Entries, Entry, crc32c};
use grideye_collector::store::segment as sealed_segment;
use grideye_recording::wire::{Acknowledgement, Batch};
use grideye_recording::{csv, is_recording};
use grideye_scene::Scene;
use grideye_scene::profile::Profile;
use std::io;

/// Panics where bytes are not taken as they should be.
pub(crate) type Decoder = fn(&[u8]);

/// Every decoder by its name.
pub(crate) const DECODERS: [(&str, Decoder); 8] = [
    ("wire", wire),
    ("binary", binary),
    ("csv", recording),
    ("scene", scene),
    ("join", join),
    ("segment", segment),
    ("sealed", sealed),
    ("bare", bare),
];

fn wire(data: &[u8]) {
    if let Ok(batch) = Batch::from_json(data) {
        let json = batch.to_json().expect("what was read can be written");
        let again = Batch::from_json(&json).expect("what was written can be read");
        assert_eq!(batch, again);
    }
    if let Ok(answer) = Acknowledgement::from_json(data) {
        let json = answer.to_json().expect("what was read can be written");
        assert_eq!(Acknowledgement::from_json(&json), Ok(answer));
    }
}

/// Both forms of a body mean the same.
fn binary(data: &[u8]) {
    if let Ok(batch) = Batch::from_binary(data) {
        let bytes = batch.to_binary().expect("what was read can be written");
        assert_eq!(Batch::from_binary(&bytes).as_ref(), Ok(&batch));
        let json = batch.to_json().expect("what was read can be written");
        assert_eq!(Batch::from_json(&json).as_ref(), Ok(&batch));
    }
}

fn recording(data: &[u8]) {
    let first = data.split(|byte| *byte == b'\n').next().unwrap_or_default();
    let _ = is_recording(first);
    if let Ok(reader) = csv::Reader::new(data) {
        // It ends at the first row that is not understood.
        let rows = reader.take_while(Result::is_ok).count();
        assert!(rows <= data.len());
    }
}

/// Files of other people.
fn bare(data: &[u8]) {
    let options = grideye_import::Options::default();
    let opened = grideye_import::open(
        io::Cursor::new(data.to_vec()),
        "frames_2021-07-01.csv",
        &options,
    );
    if let Ok(import) = opened {
        assert!(import.take_while(Result::is_ok).count() <= data.len());
    }
}

fn scene(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    let none = |_: &str| -> io::Result<String> { Err(io::ErrorKind::NotFound.into()) };
    if let Err(error) = Scene::parse(text, "scene.toml", &none) {
        assert!(!error.to_string().is_empty());
    }
    let _ = Profile::parse(text, "profile.toml");
}

fn join(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    if let Ok(line) = text.parse::<JoinLine>() {
        assert_eq!(line.reveal().parse(), Ok(line));
    }
    let _ = Joined::parse(text, "collector.toml");
    let _ = Config::parse(text, "agent.toml");
}

/// Once as a file that somebody damaged, once as payloads whose checksums are right: a checksum is not to be guessed, and
/// decoders must reach what stands behind it.
fn segment(data: &[u8]) {
    const NUMBER: u64 = 7;
    if let Ok(entries) = Entries::of_segment(NUMBER, data) {
        check_entries(entries);
    }
    let mut file = Encoder::new(NUMBER).header();
    let mut rest = data;
    while let Some((length, behind)) = rest.split_first_chunk::<2>() {
        let (payload, behind) =
            behind.split_at(behind.len().min(usize::from(u16::from_le_bytes(*length))));
        let length = u32::try_from(payload.len())
            .expect("two bytes of length")
            .to_le_bytes();
        file.extend(length);
        file.extend(crc32c(&[&NUMBER.to_le_bytes(), &length, payload]).to_le_bytes());
        file.extend(payload);
        rest = behind;
    }
    check_entries(Entries::of_segment(NUMBER, &file).expect("the header is whole"));
}

/// What was read is written, and read again.
fn check_entries(entries: Entries<'_>) {
    let mut encoder = Encoder::new(8);
    let mut bytes = encoder.header();
    let (mut streams, mut read) = (Vec::new(), Vec::new());
    for (_, entry) in entries.map_while(Result::ok) {
        match entry {
            Entry::Stream(index, id) if usize::from(index) == streams.len() => streams.push(id),
            Entry::Stream(..) => {}
            Entry::Record(stream, record) => {
                let id = &streams[usize::from(stream)];
                encoder.record(&mut bytes, id, &record);
                read.push((id.clone(), Ok(record)));
            }
            Entry::Account(stream, account) => {
                let id = &streams[usize::from(stream)];
                encoder.account(&mut bytes, id, &account);
                read.push((id.clone(), Err(account)));
            }
        }
    }
    let mut again = read.into_iter();
    for entry in Entries::of_segment(8, &bytes).expect("the header was written") {
        let (stream, found) = match entry.expect("what was written can be read").1 {
            Entry::Stream(..) => continue,
            Entry::Record(stream, record) => (stream, Ok(record)),
            Entry::Account(stream, account) => (stream, Err(account)),
        };
        let id = encoder.streams()[usize::from(stream)].clone();
        assert_eq!(again.next(), Some((id, found)));
    }
    assert!(again.next().is_none());
}

/// A sealed segment of the store: once as it is, once with the columns compressed as they should be, which is not to be
/// guessed either.
fn sealed(data: &[u8]) {
    const HEAD: &[u8] = b"GES\x01";
    check_sealed(data);
    let Some((rows, columns)) = data.split_first_chunk::<2>() else {
        return;
    };
    let compressed = zstd::bulk::compress(columns, 1).expect("memory");
    let length = u32::try_from(columns.len()).expect("short").to_le_bytes();
    let rows = u32::from(u16::from_le_bytes(*rows)).to_le_bytes();
    check_sealed(&[HEAD, &rows, &length, &compressed].concat());
}

fn check_sealed(segment: &[u8]) {
    if let Ok(rows) = sealed_segment::open(segment) {
        let again = sealed_segment::seal(&rows).expect("what was read can be written");
        let read = sealed_segment::open(&again).expect("what was written can be read");
        assert_eq!(read, rows);
    }
}
