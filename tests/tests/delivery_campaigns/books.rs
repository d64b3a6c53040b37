//! The books of a campaign, made up without the collector's and the agent's word: what the emulated sensor gave, from the
//! trace of its bus, beside what the
//! collector gives back of everything and what its store holds, by SQL.

use crate::agents::{identifiable, source_frames};
use grideye_tests::emulated::{pixel_c, thermistor_c};
use rusqlite::{Connection, OpenFlags, Row};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt;
use std::path::Path;

/// What became of every frame.
#[derive(Debug, Default)]
pub(crate) struct Books {
    /// Frames that passed on the bus, each once.
    pub(crate) given: u64,
    /// The agents' own count, and the collector's, as `grideye audit` has them.
    pub(crate) read: u64,
    pub(crate) stored: u64,
    pub(crate) dropped: BTreeMap<String, u64>,
    pub(crate) spooled: u64,
    pub(crate) missing: u64,
    pub(crate) runs: usize,
    /// Rows of a number, or of a frame of the sensor, that is there already.
    pub(crate) twice: u64,
    /// Frames that stood on a spool's disk when its agent was killed, and are not stored.
    pub(crate) lost_from_disk: Vec<(String, u64)>,
    /// Frames with a stored one behind them in the same run, that are neither stored nor have a row with a reason.
    pub(crate) lost_between: u64,
    /// Of each run, what was read behind its last stored frame: frames, and seconds from the first to the last of them.
    pub(crate) at_ends: Vec<(u64, f64)>,
}

/// The fastest that a sensor at its nominal 10 Hz may be, as the agent allows for it.
const RATE_MAX_HZ: f64 = 10.6;

/// What was in memory when runs were killed.
#[derive(Debug)]
pub(crate) struct Ends {
    frames: u64,
    frames_max: u64,
    seconds_max: f64,
    delay_max_s: f64,
    guarantee: (u64, f64),
    /// Frames, seconds and delay of each that cost more than is stated.
    pub(crate) beyond: Vec<(u64, f64, f64)>,
}

impl Ends {
    /// Holds what was in memory at each end, frames and seconds, to what is stated. What this machine kept an agent from
    /// doing within so many seconds, as `delay_s` has measured it, is not the agent's fault.
    pub(crate) fn of(
        ends: &[(u64, f64)],
        guarantee: (u64, f64),
        delay_s: impl Fn(f64) -> f64,
    ) -> Self {
        let late =
            |(frames, seconds): &(u64, f64)| (*frames, *seconds, delay_s(seconds.max(guarantee.1)));
        let ends: Vec<_> = ends.iter().map(late).collect();
        let is_beyond = |(frames, seconds, late_s): &(u64, f64, f64)| {
            let frames_late = f64::from(u32::try_from(frames.saturating_sub(guarantee.0)).unwrap());
            frames_late > (late_s * RATE_MAX_HZ).ceil() || *seconds > guarantee.1 + late_s
        };
        Self {
            frames: ends.iter().map(|end| end.0).sum(),
            frames_max: ends.iter().map(|end| end.0).max().unwrap_or(0),
            seconds_max: ends.iter().map(|end| end.1).fold(0.0, f64::max),
            delay_max_s: ends.iter().map(|end| end.2).fold(0.0, f64::max),
            beyond: ends.iter().copied().filter(is_beyond).collect(),
            guarantee,
        }
    }
}

impl fmt::Display for Ends {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "in memory when runs were killed: {} frames, at most {} and {:.2} s at one, where {} and {:.2} s are stated and this machine delayed for at most {:.3} s; beyond that (frames, s, delay in s): {:?}",
            self.frames,
            self.frames_max,
            self.seconds_max,
            self.guarantee.0,
            self.guarantee.1,
            self.delay_max_s,
            self.beyond
        )
    }
}

impl fmt::Display for Books {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "{} runs; given by the sensor {}; read {} = stored {} + dropped {:?} + in spool {}; missing with reason {}; twice {}; lost from a disk {:?}; lost between stored ones {}",
            self.runs,
            self.given,
            self.read,
            self.stored,
            self.dropped,
            self.spooled,
            self.missing,
            self.twice,
            self.lost_from_disk,
            self.lost_between
        )
    }
}

/// Makes up the books: `audit` is what `grideye audit` says, `on_disk` what spools held when their agents were killed.
///
/// Panics at a row that is torn, changed, or out of its order.
pub(crate) fn settle(
    csv: &str,
    store: &Path,
    trace: &Path,
    audit: &[Value],
    on_disk: &BTreeSet<(String, u64)>,
) -> Books {
    let runs = recorded(csv);
    let twice = twice(store, &runs);
    let sessions = given(trace);
    let mut books = Books {
        runs: runs.len(),
        twice,
        given: sessions
            .iter()
            .map(|session| u64::try_from(session.len()).unwrap())
            .sum(),
        ..Books::default()
    };
    for row in audit {
        take_in(&mut books, row, &runs);
    }
    let is_stored =
        |(boot, seq): &&(String, u64)| runs.get(boot).is_some_and(|run| run.seqs.contains(seq));
    books.lost_from_disk = on_disk
        .iter()
        .filter(|record| !is_stored(record))
        .cloned()
        .collect();
    let boots: HashMap<u64, &str> = runs
        .iter()
        .flat_map(|(boot, run)| run.frames.keys().map(move |index| (*index, boot.as_str())))
        .collect();
    for session in &sessions {
        let of_session: BTreeSet<&str> = session
            .keys()
            .filter_map(|index| boots.get(index).copied())
            .collect();
        assert!(of_session.len() < 2, "{of_session:?} read as one");
        let Some(boot) = of_session.first() else {
            books.at_ends.push(span(session, 0));
            continue;
        };
        let run = &runs[*boot];
        let (first, last) = (run.frames.keys().next(), run.frames.keys().next_back());
        let between = session.range(first.unwrap()..=last.unwrap());
        let not_stored = count(between.filter(|(index, _)| !run.frames.contains_key(*index)));
        books.lost_between += not_stored.saturating_sub(run.refused);
        books.at_ends.push(span(session, last.unwrap() + 1));
    }
    books
}

fn count<T>(items: impl Iterator<Item = T>) -> u64 {
    u64::try_from(items.count()).unwrap()
}

/// How many frames from `from` on, and the seconds from the first to the last.
fn span(session: &BTreeMap<u64, f64>, from: u64) -> (u64, f64) {
    let times: Vec<f64> = session.range(from..).map(|(_, time_s)| *time_s).collect();
    let seconds = times.last().unwrap_or(&0.0) - times.first().unwrap_or(&0.0);
    (u64::try_from(times.len()).unwrap(), seconds)
}

/// The collector's and the agent's count of one run beside what the store holds of it.
fn take_in(books: &mut Books, row: &Value, runs: &BTreeMap<String, Kept>) {
    assert_eq!(row["balanced"], true, "{row}");
    let number = |name: &str| row[name].as_u64().unwrap();
    books.read += number("read");
    books.stored += number("stored");
    books.spooled += number("spooled");
    books.missing += number("missing");
    for (reason, count) in row["dropped"].as_object().unwrap() {
        *books.dropped.entry(reason.clone()).or_default() += count.as_u64().unwrap();
    }
    let boot = row["boot"].as_str().unwrap();
    let Some(run) = runs.get(boot) else {
        assert_eq!((number("stored"), number("missing")), (0, 0), "{row}");
        return;
    };
    assert_eq!(count(run.frames.keys()), number("stored"), "{row}");
    let estimates = row["errors"]["count-estimated"].as_u64().unwrap_or(0);
    assert!(
        run.moved <= estimates,
        "run {boot}: its count moved {} times, and {estimates} were announced",
        run.moved
    );
    // What is found with the next frame may not have been said before the run was killed.
    let late = row["errors"]["thermistor-late"].as_u64().unwrap_or(0);
    assert!(
        run.late <= late + 1,
        "run {boot}: {} frames with a later thermistor, and {late} were announced",
        run.late
    );
}

/// What the store holds of one run.
#[derive(Debug, Default)]
struct Kept {
    seqs: BTreeSet<u64>,
    /// The sensor's number of each frame, and the row's.
    frames: BTreeMap<u64, u64>,
    /// Rows without a frame that had been read.
    refused: u64,
    /// How often the distance between the two numbers changed, and what it is.
    moved: u64,
    distance: Option<i128>,
    /// Frames with the thermistor of a later one.
    late: u64,
    /// The boot time of the last frame.
    last_ns: u64,
}

impl Kept {
    /// It is read behind the pixels: where the host stalls between the two, it is that of a later frame.
    fn take_thermistor(&mut self, index: usize, thermistor: &str, context: &str) {
        let is_that_of =
            |index: usize| thermistor.parse() == Ok(thermistor_c(identifiable(index).thermistor));
        if is_that_of(index) {
            return;
        }
        self.late += 1;
        assert!(
            (index..source_frames()).any(is_that_of),
            "{context}: the thermistor is changed"
        );
    }
}

const CHUNKS: &str = "SELECT boot, first_seq, chunks.last_seq, is_sealed, rows FROM chunks \
     JOIN streams ON streams.id = chunks.stream_id ORDER BY device, sensor, boot, first_seq";
const OVERLAPS: &str = "SELECT count(*) FROM chunks AS one JOIN chunks AS other ON one.stream_id = other.stream_id \
     AND one.first_seq < other.first_seq AND other.first_seq <= one.last_seq";

/// Every run in a recording of everything, each row compared with what the sensor showed.
fn recorded(csv: &str) -> BTreeMap<String, Kept> {
    let mut runs: BTreeMap<String, Kept> = BTreeMap::new();
    let mut lines = csv.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let place = |name: &str| header.iter().position(|column| *column == name).unwrap();
    let columns = [
        "boot",
        "seq",
        "t_boot_ns",
        "missing",
        "thermistor",
        "pixel1",
    ]
    .map(place);
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let [boot, seq, t_boot_ns, missing, thermistor, pixel1] = columns.map(|at| cells[at]);
        let context = format!("run {boot}, row {seq}");
        let run = runs.entry(boot.to_owned()).or_default();
        let (seq, t_boot_ns): (u64, u64) = (seq.parse().unwrap(), t_boot_ns.parse().unwrap());
        let rows_before = u64::try_from(run.seqs.len()).unwrap();
        assert_eq!(
            seq, rows_before,
            "{context}: neither a gap nor a repetition"
        );
        run.seqs.insert(seq);
        if !missing.is_empty() {
            // Its time is that at which it was found missing: the next read, which may be that of the next frame.
            assert!(t_boot_ns >= run.last_ns, "{context}: out of order");
            // A host that stalled has not read it, or has read it so late that nothing told which one it was.
            run.refused += 1;
            continue;
        }
        assert!(t_boot_ns > run.last_ns, "{context}: out of order");
        run.last_ns = t_boot_ns;
        let pixels: Vec<f64> = cells[columns[5]..]
            .iter()
            .map(|cell| cell.parse().unwrap())
            .collect();
        assert_eq!(pixels.first(), pixel1.parse().ok().as_ref());
        // The last frame is the best guess of the next one.
        let guess = run
            .frames
            .last_key_value()
            .map_or(0, |(last, _)| usize::try_from(*last).unwrap());
        let index = (guess..source_frames()).find(|index| {
            let words = identifiable(*index);
            pixels.iter().copied().eq(words.pixels.map(pixel_c))
        });
        let index = index.unwrap_or_else(|| panic!("{context}: torn or changed"));
        run.take_thermistor(index, thermistor, &context);
        let index = u64::try_from(index).unwrap();
        let last = run.frames.last_key_value();
        assert!(
            last.is_none_or(|(last, _)| *last < index),
            "{context}: out of order"
        );
        run.frames.insert(index, seq);
        let here = i128::from(index) - i128::from(seq);
        run.moved += u64::from(*run.distance.get_or_insert(here) != here);
        run.distance = Some(here);
    }
    runs
}

/// How many rows the store has twice, by number or by the measurement; and each row that it keeps plainly, which are
/// those of the last minutes, beside the recording.
fn twice(store: &Path, runs: &BTreeMap<String, Kept>) -> u64 {
    let open = Connection::open_with_flags(store, OpenFlags::SQLITE_OPEN_READ_ONLY);
    let connection = open.unwrap();
    let integrity: String = connection
        .query_row("PRAGMA integrity_check", [], |row| row.get(0))
        .unwrap();
    assert_eq!(integrity, "ok");
    let overlaps = connection.query_row(OVERLAPS, [], |row| Ok(natural(row, 0)));
    let mut statement = connection.prepare(CHUNKS).unwrap();
    let mut chunks = statement.query([]).unwrap();
    while let Some(chunk) = chunks.next().unwrap() {
        if natural(chunk, 3) != 0 {
            continue;
        }
        let boot: String = chunk.get(0).unwrap();
        let bytes: Vec<u8> = chunk.get(4).unwrap();
        let mut rest = bytes.as_slice();
        for seq in natural(chunk, 1)..=natural(chunk, 2) {
            rest = check_row(&runs[&boot], seq, rest, &format!("run {boot}, row {seq}"));
        }
        assert!(rest.is_empty(), "run {boot}: more rows than numbers");
    }
    let frames = runs.values().flat_map(|run| run.frames.keys());
    let different: BTreeSet<&u64> = frames.clone().collect();
    overlaps.unwrap() + u64::try_from(frames.count() - different.len()).unwrap()
}

/// Compares one row, and answers what stands behind it: time of arrival, boot time and wall time, 8 bytes each; a byte whose lower half says
/// whether there is a frame; then thermistor, 2 bytes, and pixels, packed, or a reason behind its length. Low byte first.
fn check_row<'b>(run: &Kept, seq: u64, bytes: &'b [u8], context: &str) -> &'b [u8] {
    let (stamp, behind) = bytes.split_at(25);
    match stamp[24] & 0xF {
        1 => return &behind[1 + usize::from(behind[0])..],
        kind => assert_eq!(kind, 2, "{context}: a frame that is not packed"),
    }
    let (pixels, behind) = unpacked(&behind[2..]);
    let index = shown(&pixels).unwrap_or_else(|| panic!("{context}: torn or changed"));
    assert_eq!(run.frames.get(&index), Some(&seq), "{context}");
    behind
}

/// 64 words as 128 bytes, and what stands behind them: the lowest, a width, and how far each lies above the lowest in so
/// many bits, the lowest bit first.
fn unpacked(bytes: &[u8]) -> (Vec<u8>, &[u8]) {
    let lowest = u16::from_le_bytes([bytes[0], bytes[1]]);
    let width = usize::from(bytes[2]);
    let (packed, behind) = bytes[3..].split_at(8 * width);
    let bit = |at: usize| u16::from(packed[at / 8] >> (at % 8) & 1);
    let above = |pixel: usize| (0..width).map(move |at| bit(pixel * width + at) << at);
    let words = (0..64).map(|pixel| lowest + above(pixel).sum::<u16>());
    (words.flat_map(u16::to_le_bytes).collect(), behind)
}

fn natural(row: &Row<'_>, column: usize) -> u64 {
    u64::try_from(row.get::<_, i64>(column).unwrap()).unwrap()
}

/// The number of the frame that these 128 bytes are, low byte first; nothing if they are no whole frame of the source.
fn shown(bytes: &[u8]) -> Option<u64> {
    let words: Vec<u16> = bytes
        .chunks_exact(2)
        .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
        .collect();
    let quarters = |word: &u16| usize::from((word + 160) & 0xFFF);
    let index = quarters(words.first()?) + 512 * quarters(words.get(1)?);
    (words == identifiable(index).pixels).then(|| u64::try_from(index).unwrap())
}

/// The frames that were read in full from each start of an agent to the next, and when each was read for the first time.
fn given(trace: &Path) -> Vec<BTreeMap<u64, f64>> {
    let text = std::fs::read_to_string(trace).unwrap();
    let mut sessions: Vec<BTreeMap<u64, f64>> = Vec::new();
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let (direction, bytes) = (cells[5], cells[6]);
        // An agent begins with the sensor's initial reset (AMG88 spec §4-11-2).
        if direction == "write" && bytes == "0x01 0x3f" {
            sessions.push(BTreeMap::new());
        }
        let bytes: Vec<u8> = bytes
            .split(' ')
            .filter_map(|byte| u8::from_str_radix(byte.strip_prefix("0x")?, 16).ok())
            .collect();
        // After the reset the pixels are zero until the sensor has measured.
        if direction != "read" || bytes.len() != 128 || bytes.iter().all(|byte| *byte == 0) {
            continue;
        }
        let index = shown(&bytes).unwrap_or_else(|| panic!("no whole frame on the bus: {line}"));
        let session = sessions.last_mut().unwrap();
        session.entry(index).or_insert(cells[0].parse().unwrap());
    }
    sessions
}
