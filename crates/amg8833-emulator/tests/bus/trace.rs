//! Bus traces: message by message, as a table, and as decoded by a logic analyzer.

use amg8833_emulator::trace::{Acknowledge, CsvTrace, Start, Transfer, VcdTrace};
use amg8833_emulator::{Address, Bus, BusError, Fault, FaultKind, ManualClock};
use core::time::Duration;
use embedded_hal::i2c::{I2c, NoAcknowledgeSource, Operation};
use grideye_frame::{Celsius, Frame};
use std::io::{self, Write};
use std::process::Command;
use std::sync::{Arc, Mutex};

#[expect(
    dead_code,
    unreachable_pub,
    reason = "the tests of the whole share this file"
)]
#[path = "../../../../tests/src/skip.rs"]
mod skip;

const HIGH: u8 = 0x69;

type TestBus = Bus<ManualClock, Frame>;

fn bus() -> TestBus {
    let frame = Frame::uniform(Celsius::new(20.0));
    let mut bus = Bus::with_sensor(ManualClock::new(), Address::High, frame)
        .with_scl_hz(400_000.try_into().unwrap());
    bus.clock().set(Duration::from_millis(150));
    bus.advance();
    bus
}

/// A file with several holders.
#[derive(Debug, Clone, Default)]
struct Paper(Arc<Mutex<Vec<u8>>>);

impl Paper {
    fn text(&self) -> String {
        String::from_utf8(self.0.lock().unwrap().clone()).unwrap()
    }
}

impl Write for Paper {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A session that contains everything a trace can show.
fn session(bus: &mut TestBus) {
    let mut word = [0; 2];
    bus.write_read(HIGH, &[0x80], &mut word).unwrap();
    bus.write(HIGH, &[0x02, 0x01]).unwrap();
    bus.write(HIGH, &[]).unwrap();
    bus.write(0x42, &[0x00]).unwrap_err();
    let (mut one, mut two) = ([0; 1], [0; 1]);
    let mut joined = [
        Operation::Write(&[0x02]),
        Operation::Write(&[0x00]),
        Operation::Read(&mut one),
        Operation::Read(&mut two),
        Operation::Write(&[0x0E]),
    ];
    bus.transaction(HIGH, &mut joined).unwrap();
    bus.set_fault(Address::High, Fault::NackByte(1));
    bus.write(HIGH, &[0x02, 0x01, 0x03]).unwrap_err();
    bus.clear_fault(Address::High);
    bus.set_fault(Address::High, Fault::AllZero);
    bus.set_fault(Address::High, Fault::BrownOut);
    bus.read(HIGH, &mut word).unwrap();
    bus.clear_fault(Address::High);
    bus.set_fault(None::<Address>, Fault::Hang);
    bus.write(HIGH, &[0x80]).unwrap_err();
    bus.clear_fault(None::<Address>);
    bus.set_fault(None::<Address>, Fault::AdapterGone);
    bus.read(HIGH, &mut word).unwrap_err();
    bus.clear_fault(None::<Address>);
}

/// Times calculated by hand: a START, STOP or repeated START takes 2.5 us, a byte with its acknowledge 22.5 us.
const TABLE: &str = "\
time_s,bus,transaction,start,address,direction,bytes,acknowledge,stop,end_s,error,faults
0.150000000,i2c-1,1,S,0x69,write,0x80,ack,,0.150047500,,
0.150047500,i2c-1,1,Sr,0x69,read,0x50 0x00,ack,P,0.150120000,,
0.150120000,i2c-1,2,S,0x69,write,0x02 0x01,ack,P,0.150192500,,
0.150192500,i2c-1,3,S,0x69,write,,ack,P,0.150220000,,
0.150220000,i2c-1,4,S,0x42,write,,nack-address,P,0.150247500,nack,
0.150247500,i2c-1,5,S,0x69,write,0x02 0x00,ack,,0.150317500,,
0.150317500,i2c-1,5,Sr,0x69,read,0x00 0x00,ack,,0.150387500,,
0.150387500,i2c-1,5,Sr,0x69,write,0x0e,ack,P,0.150437500,,
0.150437500,i2c-1,6,S,0x69,write,0x02 0x01,nack-byte,P,0.150510000,nack,nack-byte
0.150510000,i2c-1,7,S,0x69,read,0x00 0x00,ack,P,0.150582500,,all-zero brown-out
0.150582500,i2c-1,8,S,0x69,write,,nack-address,,1.150607500,timeout,hang
1.150607500,i2c-1,0,none,0x69,read,,nack-address,,1.150607500,gone,adapter-gone
";

#[test]
fn a_table_has_one_row_a_message() {
    let paper = Paper::default();
    let trace = CsvTrace::new(paper.clone());
    let mut bus = bus();
    bus.set_trace(trace.observer("i2c-1"));
    session(&mut bus);
    assert_eq!(trace.finish().unwrap().messages, 12);
    assert_eq!(paper.text(), TABLE);
    bus.clear_trace();
    bus.write(HIGH, &[]).unwrap();
    assert_eq!(trace.finish().unwrap().messages, 12);
}

#[test]
fn an_observer_is_told_what_the_table_says() {
    let told = Arc::new(Mutex::new(Vec::new()));
    let notes = Arc::clone(&told);
    let mut bus = bus();
    bus.set_trace(move |transfer: &Transfer<'_>| {
        let bytes = transfer.bytes.to_vec();
        notes.lock().unwrap().push((
            Transfer {
                bytes: &[],
                ..*transfer
            },
            bytes,
        ));
    });
    session(&mut bus);
    let told = told.lock().unwrap();
    let (refused, bytes) = &told[8];
    assert_eq!(
        bytes,
        &[0x02, 0x01],
        "the byte that was not acknowledged is the last"
    );
    assert_eq!(refused.acknowledge, Acknowledge::NotLastByte);
    assert_eq!(
        refused.error,
        Some(BusError::NoAcknowledge {
            address: HIGH,
            source: NoAcknowledgeSource::Data
        })
    );
    assert!(refused.faults.contains(FaultKind::NackByte));
    let (gone, _) = &told[11];
    assert_eq!((gone.start, gone.stop), (Start::Never, false));
    assert!(
        told.windows(2)
            .all(|pair| pair[0].0.ended <= pair[1].0.started)
    );
}

#[test]
fn faults_that_last_are_shown_as_long_as_they_do() {
    let told = Arc::new(Mutex::new(Vec::new()));
    let notes = Arc::clone(&told);
    let mut bus = bus();
    bus.set_trace(move |transfer| notes.lock().unwrap().push(transfer.faults.to_string()));
    let glitch = Fault::PixelGlitch {
        pixel: None,
        word: 0xFFF,
    };
    bus.set_fault(Address::High, Fault::ClockError { ppm: 10 });
    bus.set_fault(Address::High, glitch);
    bus.write(HIGH, &[]).unwrap();
    bus.clock().advance(Duration::from_millis(100));
    bus.write(HIGH, &[]).unwrap();
    bus.clear_fault(Address::High);
    bus.write(HIGH, &[]).unwrap();
    bus.clock().advance(Duration::from_millis(100));
    bus.write(HIGH, &[]).unwrap();
    let expected = [
        "clock-error",
        "pixel-glitch clock-error",
        "pixel-glitch",
        "",
    ];
    assert_eq!(*told.lock().unwrap(), expected);
}

#[test]
fn several_buses_share_one_table() {
    let paper = Paper::default();
    let trace = CsvTrace::new(paper.clone());
    let (mut one, mut two) = (bus(), bus());
    one.set_trace(trace.observer("i2c-1"));
    two.set_trace(trace.observer("=2"));
    one.write(HIGH, &[]).unwrap();
    two.write(HIGH, &[]).unwrap();
    trace.finish().unwrap();
    let text = paper.text();
    let names: Vec<&str> = text
        .lines()
        .skip(1)
        .filter_map(|line| line.split(',').nth(1))
        .collect();
    assert_eq!(names, ["i2c-1", "'=2"]);
}

#[test]
fn a_trace_ends_at_its_limit_and_counts_what_it_leaves_out() {
    let rows: Vec<&str> = TABLE.lines().collect();
    // The header and two rows fit exactly; the empty write after them is shorter than the row that does not fit.
    let length: usize = rows[..3].iter().map(|row| row.len() + 1).sum();
    let paper = Paper::default();
    let trace = CsvTrace::with_bytes_max(paper.clone(), u64::try_from(length).unwrap());
    let mut bus = bus();
    bus.set_trace(trace.observer("i2c-1"));
    session(&mut bus);
    let summary = trace.finish().unwrap();
    assert_eq!((summary.messages, summary.left_out), (2, 10));
    assert_eq!(summary.to_string(), "2 messages, 10 more did not fit");
    assert_eq!(paper.text(), TABLE[..length]);
}

/// A full disk.
struct Full;

impl Write for Full {
    fn write(&mut self, _bytes: &[u8]) -> io::Result<usize> {
        Err(io::Error::other("no space left"))
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn an_error_of_the_file_leaves_the_bus_alone_and_is_told_at_the_end() {
    let trace = VcdTrace::new(Full);
    let mut bus = bus();
    bus.set_trace(trace.observer());
    for _ in 0..1_000 {
        bus.write(HIGH, &[0x02, 0x00]).unwrap();
    }
    assert_eq!(trace.finish().unwrap_err().to_string(), "no space left");
}

fn dump(mut bus: TestBus, act: impl Fn(&mut TestBus)) -> String {
    let paper = Paper::default();
    let trace = VcdTrace::new(paper.clone());
    bus.set_trace(trace.observer());
    act(&mut bus);
    trace.finish().unwrap();
    paper.text()
}

/// The levels in a dump after each of its times: (time, SCL, SDA).
fn levels(dump: &str) -> Vec<(u64, bool, bool)> {
    let (_, body) = dump.split_once("$enddefinitions $end\n").unwrap();
    let mut levels: Vec<(u64, bool, bool)> = vec![(0, true, true)];
    for line in body.lines() {
        let now = levels.last_mut().unwrap();
        match line.split_at(1) {
            ("#", time) => {
                let next = (time.parse().unwrap(), now.1, now.2);
                assert!(next.0 >= now.0, "time runs on");
                levels.push(next);
            }
            (level @ ("0" | "1"), "c") => now.1 = level == "1",
            (level @ ("0" | "1"), "d") => now.2 = level == "1",
            _ => {}
        }
    }
    levels
}

/// An independent decoder, from the I2C specification alone: `S`, `P`, and nine bits at rising edges of SCL.
fn decoded(dump: &str) -> String {
    let mut text = String::new();
    let mut bits = Vec::new();
    for pair in levels(dump).windows(2) {
        let ((_, scl_before, sda_before), (_, scl, sda)) = (pair[0], pair[1]);
        match (scl_before, scl, sda_before, sda) {
            (true, true, true, false) => {
                bits.clear();
                text.push_str(" S");
            }
            (true, true, false, true) => text.push_str(" P"),
            (false, true, _, bit) => bits.push(bit),
            _ => {}
        }
        if let [byte @ .., acknowledge] = &bits[..]
            && byte.len() == 8
        {
            let value = byte
                .iter()
                .fold(0, |value, bit| value << 1 | u8::from(*bit));
            let mark = if *acknowledge { '-' } else { '+' };
            text.push_str(&format!(" {value:02x}{mark}"));
            bits.clear();
        }
    }
    text.trim_start().to_owned()
}

#[test]
fn the_lines_say_what_was_sent() {
    let drawn = dump(bus(), session);
    assert_eq!(
        decoded(&drawn),
        "S d2+ 80+ S d3+ 50+ 00- P S d2+ 02+ 01+ P S d2+ P S 84- P \
         S d2+ 02+ 00+ S d3+ 00+ 00- S d2+ 0e+ P S d2+ 02+ 01- P S d3+ 00+ 00- P S P"
    );
}

#[test]
fn the_lines_keep_the_time_of_the_bus() {
    let drawn = dump(bus(), |bus| bus.write(HIGH, &[0x02, 0x00]).unwrap());
    let levels = levels(&drawn);
    let (first, last) = (levels[2].0, levels[levels.len() - 1].0);
    assert!(
        (1_500_000..=1_500_025).contains(&first),
        "150 ms in 100 ns: {first}"
    );
    // 29 bits of 2.5 us with START and STOP; between the edges of those two are 28, at 25 steps each.
    assert_eq!(last - first, 700);
}

#[test]
fn a_bus_without_a_speed_is_drawn_in_sequence() {
    let frame = Frame::uniform(Celsius::new(20.0));
    let timeless = Bus::with_sensor(ManualClock::new(), Address::High, frame);
    let timeless = timeless.with_instant_transactions();
    let drawn = dump(timeless, |bus| {
        for _ in 0..3 {
            bus.write(HIGH, &[0x02]).unwrap();
        }
    });
    assert_eq!(decoded(&drawn), "S d2+ 02+ P S d2+ 02+ P S d2+ 02+ P");
}

/// A third-party decoder: sigrok's, which PulseView also uses.
#[test]
fn sigrok_decodes_the_lines() {
    if skip::is_left_out("GRIDEYE_WITHOUT_SIGROK", "the i2c decoder of sigrok") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bus.vcd");
    let trace = VcdTrace::new(std::fs::File::create(&path).unwrap());
    let mut bus = bus();
    bus.set_trace(trace.observer());
    session(&mut bus);
    trace.finish().unwrap();
    let output = Command::new("sigrok-cli")
        .args(["-I", "vcd:compress=1000", "-i"])
        .arg(&path)
        .args(["-P", "i2c:scl=SCL:sda=SDA", "-A", "i2c=addr-data"])
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let text = String::from_utf8(output.stdout).unwrap();
    let words: Vec<&str> = text
        .lines()
        .filter_map(|line| line.strip_prefix("i2c-1: "))
        .collect();
    let read = |bytes: &[&str]| {
        let mut words = vec![
            "Start".to_owned(),
            "Address read: 69".to_owned(),
            "ACK".to_owned(),
        ];
        for (place, byte) in bytes.iter().enumerate() {
            let last = place + 1 == bytes.len();
            words.push(format!("Data read: {byte}"));
            words.push(if last { "NACK" } else { "ACK" }.to_owned());
        }
        words
    };
    // The first transaction: the register address, a repeated START, pixel 1 at 20 degrees.
    let mut expected = vec!["Start", "Address write: 69", "ACK", "Data write: 80", "ACK"]
        .into_iter()
        .map(str::to_owned)
        .collect::<Vec<_>>();
    expected.extend(read(&["50", "00"]));
    let filtered: Vec<String> = words
        .iter()
        .filter(|word| !matches!(**word, "Write" | "Read"))
        .map(|word| word.replace("Start repeat", "Start"))
        .collect();
    assert_eq!(filtered[..expected.len()], expected, "{text}");
    let count = |what: &str| words.iter().filter(|word| **word == what).count();
    assert_eq!(count("Start repeat"), 3, "{text}");
    assert_eq!(
        count("NACK"),
        5,
        "two without a target, three at the end of a read: {text}"
    );
    assert_eq!(count("Address write: 42"), 1, "{text}");
}
