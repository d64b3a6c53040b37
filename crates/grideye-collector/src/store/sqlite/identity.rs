//! Tells whether a store's file and its log (`-wal`) belong together.
//!
//! SQLite merges whatever log it finds beside a file. So the file's header has a mark, in the field that SQLite calls the
//! schema cookie: random in a new store and in a backup, and a little larger each time the log begins again. A log begins
//! with page 1, so the two can be compared before SQLite reads them.
//!
//! ```text
//!   file  m, odd    a collector writes the store: the file may lack what the log has
//!         m, even   the file is complete: after a clean end, or a backup
//!   log   m + 1 to m + 3, or m where the log is in the file already; any other log is foreign
//! ```

use crate::store::error::{Result, StoreError};
use crate::store::row::damaged;
use crate::store::sqlite::schema::APPLICATION_ID;
use ring::rand::{SecureRandom as _, SystemRandom};
use rusqlite::Connection;
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};

/// Marks are in this range; SQLite's own counts are below it, and after 2^30 logs of 32 MB a mark is still a positive
/// number of 32 bits.
const MARKS: std::ops::Range<u32> = 1 << 20..1 << 30;
/// How much a mark grows at most from one log to the next.
const STEP_MAX: u32 = 3;

/// Offset of the schema cookie in the header (<https://sqlite.org/fileformat2.html#the_database_header>).
const MARK_AT: u64 = 40;
const HEADER_BYTES: usize = 100;
/// Of a log, and of each frame in it (<https://sqlite.org/fileformat2.html#the_write_ahead_log>).
const LOG_HEADER_BYTES: u64 = 32;
const FRAME_HEADER_BYTES: u64 = 24;

/// What is at a store's path before SQLite opens it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Found {
    /// Nothing is known to be wrong.
    Whole,
    /// The log belongs to another store, or to another state of this one.
    ForeignLog,
    /// A collector was writing the file when it ended, and its log is not there.
    NoLog,
    /// The file ends before its last page.
    CutShort,
}

/// Judges a file that no collector has open, and its log.
pub(super) fn judge(file: &File, log: &Path) -> io::Result<Found> {
    let mut header = [0; HEADER_BYTES];
    if file.read_exact_at(&mut header, 0).is_err()
        || i64::from(number(&header, 68)) != APPLICATION_ID
    {
        return Ok(Found::Whole);
    }
    let mark = number(&header, 40);
    let in_log = marks_of(log)?;
    let first = in_log.as_ref().and_then(|marks| marks.first());
    let is_in_file = in_log.as_ref().is_some_and(|marks| marks.contains(&mark));
    // A program without marks wrote both, or the log has no page 1.
    let is_unknown = first.is_none_or(|first| !is_mark(*first) && !is_mark(mark));
    let follows = first
        .is_some_and(|first| is_mark(mark) && (1..=STEP_MAX).contains(&first.wrapping_sub(mark)));
    if !(is_unknown || is_in_file || follows) {
        return Ok(Found::ForeignLog);
    }
    let page = match u64::from(number(&header, 16) >> 16) {
        1 => 65_536,
        page => page,
    };
    // A killed checkpoint writes page 1 before the pages at the end.
    let is_complete = !is_in_file && number(&header, 24) == number(&header, 92);
    let bytes = page * u64::from(number(&header, 28));
    if is_complete && file.metadata()?.len() < bytes {
        return Ok(Found::CutShort);
    }
    let needs_log = is_mark(mark) && mark % 2 == 1;
    Ok(match in_log {
        None if needs_log => Found::NoLog,
        _ => Found::Whole,
    })
}

fn is_mark(cookie: u32) -> bool {
    cookie >= MARKS.start
}

fn number(bytes: &[u8], at: usize) -> u32 {
    let four = bytes.get(at..at + 4).and_then(|four| four.try_into().ok());
    u32::from_be_bytes(four.unwrap_or_default())
}

/// The marks of each page 1 in a log; `None` if there is no frame in it.
fn marks_of(log: &Path) -> io::Result<Option<Vec<u32>>> {
    let log = match File::open(log) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        opened => opened?,
    };
    let mut header = [0; 32];
    if log.read_exact_at(&mut header, 0).is_err() {
        return Ok(None);
    }
    let frame_bytes = FRAME_HEADER_BYTES + u64::from(number(&header, 8));
    let (mut at, mut marks) = (LOG_HEADER_BYTES, None);
    let mut frame = [0; 24];
    // Frames left over from before the log last began have other salts.
    while log.read_exact_at(&mut frame, at).is_ok() && frame[8..16] == header[16..24] {
        let marks = marks.get_or_insert_with(Vec::new);
        if number(&frame, 0) == 1 {
            marks.extend(mark_at(&log, at + FRAME_HEADER_BYTES));
        }
        at += frame_bytes;
    }
    Ok(marks)
}

/// The mark in the file's header.
pub(super) fn mark_of(file: &File) -> Option<u32> {
    mark_at(file, 0)
}

fn mark_at(file: &File, page: u64) -> Option<u32> {
    let mut four = [0; 4];
    file.read_exact_at(&mut four, page + MARK_AT).ok()?;
    Some(u32::from_be_bytes(four))
}

/// Gives a complete copy of a store, which no program has open, a mark of its own: no log belongs to it.
pub(super) fn mark_copy(file: &File) -> io::Result<()> {
    file.write_all_at(&(random() & !1).to_be_bytes(), MARK_AT)
}

fn random() -> u32 {
    let mut four = [0; 4];
    // Without randomness the range's first number: still above what SQLite counts.
    let _ = SystemRandom::new().fill(&mut four);
    MARKS.start + u32::from_be_bytes(four) % (MARKS.end - MARKS.start)
}

/// The mark of the store as the connection reads it.
pub(super) fn mark_in(connection: &Connection) -> Result<u32> {
    let mark: i64 = connection.pragma_query_value(None, "schema_version", |row| row.get(0))?;
    u32::try_from(mark).map_err(|_negative| damaged("a negative schema version"))
}

/// Writes the next mark: odd, or even if the store `is_complete`.
pub(super) fn renew(connection: &Connection, is_complete: bool) -> Result<u32> {
    let mark = match (mark_in(connection)?, is_complete) {
        (mark, _) if !is_mark(mark) => random() & !1 | u32::from(!is_complete),
        (mark, true) => (mark + 1) & !1,
        (mark, false) => (mark + 2) | 1,
    };
    connection.pragma_update(None, "schema_version", mark)?;
    Ok(mark)
}

/// Where SQLite's shared memory (`-shm`) says that the log ends, in frames, and the log's salts
/// (<https://sqlite.org/walformat.html#the_wal_index_header>). `None` while another program changes it.
pub(super) fn end_of_log(index: &File) -> Option<(u32, [u8; 8])> {
    let mut copies = [0; 96];
    index.read_exact_at(&mut copies, 0).ok()?;
    let (first, second) = copies.split_at(48);
    if first != second {
        return None;
    }
    let frames = u32::from_ne_bytes(first[16..20].try_into().ok()?);
    Some((frames, first[32..40].try_into().ok()?))
}

/// Whether the log begins with these salts and has all these frames, each with a page of so many bytes.
pub(super) fn is_whole(log: &File, (frames, salts): (u32, [u8; 8]), page_bytes: u64) -> bool {
    if frames == 0 {
        return true;
    }
    let mut found = [0; 8];
    let bytes = LOG_HEADER_BYTES + u64::from(frames) * (FRAME_HEADER_BYTES + page_bytes);
    log.read_exact_at(&mut found, 16).is_ok() && found == salts && reaches(log, bytes)
}

/// Whether the file has at least so many bytes.
pub(super) fn reaches(file: &File, bytes: u64) -> bool {
    bytes == 0 || file.read_exact_at(&mut [0], bytes - 1).is_ok()
}

/// The path with this at its end.
pub(super) fn beside(path: &Path, end: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(end);
    name.into()
}

/// A name with this word at its end that no file has.
pub(super) fn aside(path: &Path, word: &str) -> PathBuf {
    let name = |number: u32| beside(path, &format!(".{word}-{number}"));
    let is_free = |name: &PathBuf| name.symlink_metadata().is_err();
    (1..).map(name).find(is_free).unwrap_or_default()
}

impl From<io::Error> for StoreError {
    fn from(error: io::Error) -> Self {
        Self::Unusable(error.to_string())
    }
}
