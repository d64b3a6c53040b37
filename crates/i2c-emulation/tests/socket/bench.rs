//! A bus and server to test against.

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use embedded_hal::i2c::{NoAcknowledgeSource, Operation};
use i2c_emulation::adapter::{Carry, EmulatedAdapter, Fault, Message, TransferError};
use i2c_emulation::rack::{Awaited, Rack, SharedAdapter, Surroundings};
use i2c_emulation::socket::{Options, Server, StopHandle};

pub(crate) const TARGET: u16 = 0x69;
/// Targets that always fail, each in its own way.
pub(crate) const FAILING: [(u16, Fault); 6] = [
    (0x30, Fault::NackAddress),
    (0x31, Fault::NackData),
    (0x32, Fault::Bus),
    (0x33, Fault::ArbitrationLost),
    (0x34, Fault::Timeout),
    (0x35, Fault::Gone),
];
/// An address that makes the bus panic.
pub(crate) const PANICKING: u16 = 0x336;
/// A target at a 10-bit address, with the same registers.
pub(crate) const TEN_BIT_TARGET: u16 = 0x2A5;

/// 256 registers with an address pointer that advances by itself; register n starts as n times 7 plus 3.
///
/// Records each transfer, and carries messages out one by one, so that a fault can come after some.
pub(crate) struct RegisterFile {
    registers: [u8; 256],
    pointer: u8,
    log: Log,
}

/// The transfers that reached the bus, one per line.
pub(crate) type Log = Arc<Mutex<Vec<String>>>;

pub(crate) fn first_value(register: usize) -> u8 {
    (register * 7 + 3).to_le_bytes()[0]
}

impl RegisterFile {
    pub(crate) fn new(log: Log) -> Self {
        Self {
            registers: std::array::from_fn(first_value),
            pointer: 0,
            log,
        }
    }

    fn carry_out(&mut self, message: &mut Message<'_>) -> Result<(), Fault> {
        let fault = FAILING
            .iter()
            .find(|(address, _)| *address == message.address);
        if let Some((_, fault)) = fault {
            return Err(*fault);
        }
        assert_ne!(message.address, PANICKING, "a bus with a defect");
        let answers = (message.address, message.ten_bit);
        if ![(TARGET, false), (TEN_BIT_TARGET, true)].contains(&answers) {
            return Err(Fault::NackAddress);
        }
        match &mut message.operation {
            Operation::Write([]) => {}
            Operation::Write([pointer, bytes @ ..]) => {
                self.pointer = *pointer;
                for byte in bytes.iter() {
                    self.registers[usize::from(self.pointer)] = *byte;
                    self.pointer = self.pointer.wrapping_add(1);
                }
            }
            Operation::Read(buffer) => {
                for byte in buffer.iter_mut() {
                    *byte = self.registers[usize::from(self.pointer)];
                    self.pointer = self.pointer.wrapping_add(1);
                }
            }
        }
        Ok(())
    }
}

impl EmulatedAdapter for RegisterFile {
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        let line: Vec<String> = messages.iter().map(text_of).collect();
        self.log.lock().unwrap().push(line.join(" "));
        for (completed, message) in messages.iter_mut().enumerate() {
            self.carry_out(message)
                .map_err(|fault| TransferError { completed, fault })?;
        }
        Ok(())
    }

    fn converse(
        &mut self,
        address: u16,
        reads: bool,
        talk: &mut dyn FnMut(Carry<'_>),
    ) -> Result<(), Fault> {
        self.log
            .lock()
            .unwrap()
            .push(format!("{address:02x} opens, reads: {reads}"));
        let failing = FAILING.iter().find(|(failing, _)| *failing == address);
        let nack = match failing {
            Some((_, Fault::NackAddress)) => Some(NoAcknowledgeSource::Address),
            Some((_, Fault::NackData)) => Some(NoAcknowledgeSource::Data),
            Some((_, fault)) => return Err(*fault),
            None => None,
        };
        let mut has_pointer = false;
        talk(&mut |operation| {
            match operation {
                _ if nack.is_some() => return nack.map_or(Ok(()), Err),
                Operation::Write([byte]) if has_pointer => {
                    self.registers[usize::from(self.pointer)] = *byte;
                    self.pointer = self.pointer.wrapping_add(1);
                }
                Operation::Write(bytes) => {
                    has_pointer |= !bytes.is_empty();
                    self.pointer = bytes.first().copied().unwrap_or(self.pointer);
                }
                Operation::Read(buffer) => {
                    for byte in buffer.iter_mut() {
                        *byte = self.registers[usize::from(self.pointer)];
                        self.pointer = self.pointer.wrapping_add(1);
                    }
                }
            }
            Ok(())
        });
        self.log
            .lock()
            .unwrap()
            .push(format!("{address:02x} stops"));
        Ok(())
    }
}

/// A machine whose time is moved by hand; its second pin is low from 250 ms on.
#[derive(Default)]
pub(crate) struct ByHand(AtomicU64);

impl Surroundings for ByHand {
    fn pass(&self, most: Duration, awaited: Option<Awaited>) -> Duration {
        let low_at = Duration::from_millis(250);
        let now = Duration::from_nanos(self.0.load(Ordering::SeqCst));
        let until = match awaited {
            Some(Awaited {
                pin: 1,
                high: false,
            }) => low_at.clamp(now, now + most),
            _ => now + most,
        };
        let until_ns = u64::try_from(until.as_nanos()).unwrap();
        self.0.store(until_ns, Ordering::SeqCst);
        until
    }

    fn pins(&self) -> Vec<bool> {
        vec![true, self.0.load(Ordering::SeqCst) < 250_000_000]
    }
}

fn text_of(message: &Message<'_>) -> String {
    match &message.operation {
        Operation::Write(bytes) => format!("{:02x}W{bytes:02x?}", message.address),
        Operation::Read(buffer) => format!("{:02x}R{}", message.address, buffer.len()),
    }
}

/// A server in a thread of this process, in its own folder.
pub(crate) struct Bench {
    pub(crate) path: PathBuf,
    pub(crate) log: Log,
    pub(crate) stop: StopHandle,
    serving: Option<JoinHandle<()>>,
    _folder: tempfile::TempDir,
}

impl Bench {
    /// Buses 1 and 7, each a register file; transfers on bus 1 are logged.
    pub(crate) fn new(options: Options) -> Self {
        let log = Log::default();
        let mut rack = Rack::new();
        rack.insert(1, SharedAdapter::new(RegisterFile::new(Arc::clone(&log))));
        rack.insert(7, SharedAdapter::new(RegisterFile::new(Log::default())));
        Self::with_rack(rack, options, log)
    }

    pub(crate) fn with_rack(rack: Rack, options: Options, log: Log) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bus.sock");
        let server = Server::bind(&path, rack, options).unwrap();
        let stop = server.stop_handle();
        let serving = Some(std::thread::spawn(move || server.serve()));
        Self {
            path,
            log,
            stop,
            serving,
            _folder: folder,
        }
    }

    pub(crate) fn raw(&self) -> Raw {
        Raw::connect(&self.path)
    }

    /// A raw client after its hello. Retries, because on a busy machine the hello may miss a short wait.
    pub(crate) fn greeted(&self) -> Raw {
        loop {
            let mut raw = self.raw();
            match raw.ask(&hello(1))[..2] {
                [0x81, _] => return raw,
                [0x85, 4] => {}
                ref other => panic!("{other:?}"),
            }
        }
    }

    /// Stops the server and waits for its end.
    pub(crate) fn end(&mut self) {
        self.stop.stop();
        if let Some(serving) = self.serving.take() {
            serving.join().unwrap();
        }
    }

    pub(crate) fn transfers(&self) -> Vec<String> {
        self.log.lock().unwrap().clone()
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.end();
    }
}

/// Hand-made packets, independent of the library.
pub(crate) struct Raw(pub(crate) UnixStream);

impl Raw {
    pub(crate) fn connect(path: &Path) -> Self {
        let stream = UnixStream::connect(path).unwrap();
        // If the answer never comes, the test must fail, not hang.
        stream
            .set_read_timeout(Some(Duration::from_secs(30)))
            .unwrap();
        Self(stream)
    }

    pub(crate) fn send(&mut self, body: &[u8]) {
        let length = u32::try_from(body.len()).unwrap();
        self.0
            .write_all(&[&length.to_le_bytes(), body].concat())
            .unwrap();
    }

    pub(crate) fn receive(&mut self) -> Vec<u8> {
        let mut head = [0; 4];
        self.0.read_exact(&mut head).unwrap();
        let mut body = vec![0; usize::try_from(u32::from_le_bytes(head)).unwrap()];
        self.0.read_exact(&mut body).unwrap();
        body
    }

    pub(crate) fn ask(&mut self, body: &[u8]) -> Vec<u8> {
        self.send(body);
        self.receive()
    }

    /// The reason and text of a BYE, which must be the last packet.
    pub(crate) fn farewell(&mut self) -> (u8, String) {
        let packet = self.receive();
        assert_eq!(packet[0], 0x85, "{packet:?}");
        let mut rest = Vec::new();
        // A connection closed with unread bytes is reset.
        let _ = self.0.read_to_end(&mut rest);
        assert!(rest.is_empty(), "{rest:?} after the farewell");
        (packet[1], String::from_utf8(packet[2..].to_vec()).unwrap())
    }
}

pub(crate) fn hello(version: u16) -> Vec<u8> {
    [&[1][..], b"i2ce", &version.to_le_bytes()].concat()
}

/// A TRANSFER for one bus and judge, with packed messages.
pub(crate) fn transfer(bus: u32, judge: u8, messages: &[Vec<u8>]) -> Vec<u8> {
    let count = u16::try_from(messages.len()).unwrap();
    [
        &[2][..],
        &bus.to_le_bytes(),
        &[judge],
        &count.to_le_bytes(),
        &messages.concat(),
    ]
    .concat()
}

pub(crate) fn write(address: u16, bytes: &[u8]) -> Vec<u8> {
    let length = u16::try_from(bytes.len()).unwrap();
    [&words([address, 0, length])[..], bytes].concat()
}

pub(crate) fn read(address: u16, length: u16) -> Vec<u8> {
    words([address, 1, length])
}

/// A STEP with a packed message.
pub(crate) fn step(bus: u32, message: &[u8]) -> Vec<u8> {
    [&[4][..], &bus.to_le_bytes(), message].concat()
}

fn words(words: [u16; 3]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}
