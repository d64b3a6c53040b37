//! The answers to each request, without a kernel.

use super::*;
use crate::adapter::{ByFunction, Message};
use embedded_hal::i2c::Operation;
use proptest::prelude::*;

const UNIQUE: u64 = 77;

const BEYOND_SEVEN_BITS: u64 = 1 << 7;

/// A caller without memory; its errno reveals the pointer width.
struct NoMemory(PointerWidth);

impl CallerMemory for NoMemory {
    fn read(&mut self, _: u64, _: &mut [u8]) -> Result<(), Errno> {
        Err(match self.0 {
            PointerWidth::Bits32 => Errno::PERM,
            PointerWidth::Bits64 => Errno::FAULT,
        })
    }

    fn write(&mut self, _: u64, _: &[u8]) -> Result<(), Errno> {
        Err(Errno::FAULT)
    }
}

/// The kernel's side: requests with the numbers and layouts of `linux/fuse.h`.
struct Kernel(Session);

type Outcome = Result<Vec<u8>, i32>;

impl Kernel {
    fn new() -> Self {
        Self(Session::new(AdapterMode::Pi, (1000, 100)))
    }

    fn send(&mut self, bytes: &[u8]) -> Reply {
        let bus = ByFunction(|messages: &mut [Message<'_>]| {
            for message in messages {
                if let Operation::Read(buffer) = &mut message.operation {
                    buffer.fill(0x42);
                }
            }
            Ok(())
        });
        let memory_of = |_pid, width| NoMemory(width);
        self.0.answer(bytes, memory_of, &Mutex::new(bus))
    }

    /// The body of an answer, or its errno.
    fn ask(&mut self, opcode: u32, body: &[u8]) -> Outcome {
        let Reply::Bytes(bytes) = self.send(&request(opcode, body)) else {
            panic!("opcode {opcode} is not answered");
        };
        let word = |offset: usize| i32::from_ne_bytes(*bytes[offset..].first_chunk().unwrap());
        assert_eq!(usize::try_from(word(0)).unwrap(), bytes.len());
        assert_eq!(bytes[8..16], UNIQUE.to_ne_bytes());
        match word(4) {
            0 => Ok(bytes[16..].to_vec()),
            errno => Err(-errno),
        }
    }

    fn open(&mut self) -> Result<u64, i32> {
        self.ask(14, &[0; 8])
            .map(|body| u64::from_ne_bytes(*body.first_chunk().unwrap()))
    }

    /// `struct fuse_read_in`, `fuse_write_in` and `fuse_release_in` begin alike: handle, offset, size.
    fn transfer(&mut self, opcode: u32, handle: u64, length: u32, data: &[u8]) -> Outcome {
        let (handle, length) = (handle.to_ne_bytes(), length.to_ne_bytes());
        let body = [&handle[..], &[0; 8], &length, &[0; 20], data].concat();
        self.ask(opcode, &body)
    }

    fn read(&mut self, handle: u64, length: u32) -> Outcome {
        self.transfer(15, handle, length, &[])
    }

    fn release(&mut self, handle: u64) -> Outcome {
        self.transfer(18, handle, 0, &[])
    }

    fn ioctl(&mut self, handle: u64, flags: u32, command: u32, argument: u64) -> Outcome {
        let front = [&handle.to_ne_bytes()[..], &words(&[flags, command])].concat();
        self.ask(39, &[&front[..], &argument.to_ne_bytes(), &[0; 8]].concat())
    }
}

fn request(opcode: u32, body: &[u8]) -> Vec<u8> {
    let front = words(&[u32::try_from(40 + body.len()).unwrap(), opcode]);
    [&front[..], &UNIQUE.to_ne_bytes(), &[0; 24], body].concat()
}

fn words(values: &[u32]) -> Vec<u8> {
    let bytes = values.iter().map(|value| value.to_ne_bytes());
    bytes.flatten().collect()
}

#[test]
fn the_greeting_names_the_version_and_another_protocol_is_refused() {
    let body = Kernel::new().ask(26, &words(&[7, 38, 4096, 0])).unwrap();
    assert_eq!(body[..8], words(&[7, 28]));
    assert_eq!(body[20..24], words(&[65536]), "max_write");
    for (major, minor) in [(7, 27), (6, 40), (8, 40)] {
        let reply = Kernel::new().send(&request(26, &words(&[major, minor, 0, 0])));
        assert_eq!(reply, Reply::Incompatible { major, minor });
    }
}

#[test]
fn the_file_is_regular_and_has_the_right_owner() {
    let body = Kernel::new().ask(3, &[0; 16]).unwrap();
    let mode_links_owner_group = words(&[0o100_666, 1, 1000, 100]);
    assert_eq!(body[16 + 60..16 + 76], mode_links_owner_group);
}

#[test]
fn an_open_file_is_read_written_and_asked_until_it_is_released() {
    let mut kernel = Kernel::new();
    let handle = kernel.open().unwrap();
    assert_eq!(kernel.read(handle, 3).unwrap(), [0x42; 3]);
    assert_eq!(kernel.read(handle, 20_000).unwrap().len(), 8192);
    assert_eq!(kernel.transfer(16, handle, 2, &[1, 2]), Ok(words(&[2, 0])));
    assert_eq!(kernel.transfer(16, handle, 4, &[1, 2, 3]), Err(22), "short");
    assert_eq!(kernel.ioctl(handle, 0, 0x0703, 0x69).unwrap(), [0; 16]);
    assert_eq!(kernel.ioctl(handle, 0, 0x0703, BEYOND_SEVEN_BITS), Err(22));
    assert_eq!(kernel.ask(25, &[0; 24]), Ok(Vec::new()), "flush");
    assert_eq!(kernel.release(handle), Ok(Vec::new()));
    assert_eq!(kernel.read(handle, 3), Err(22));
}

#[test]
fn files_have_addresses_of_their_own() {
    let mut kernel = Kernel::new();
    let (busy, plain) = (kernel.open().unwrap(), kernel.open().unwrap());
    assert_ne!(busy, plain);
    kernel.ioctl(busy, 0, 0x0704, 1).unwrap();
    assert_eq!(kernel.ioctl(busy, 0, 0x0703, 0x3FF).unwrap(), [0; 16]);
    assert_eq!(kernel.ioctl(plain, 0, 0x0703, 0x3FF), Err(22));
}

/// FUSE_IOCTL_32BIT is bit 3 of the flags.
#[test]
fn a_32_bit_caller_is_told_apart() {
    let mut kernel = Kernel::new();
    let handle = kernel.open().unwrap();
    assert_eq!(kernel.ioctl(handle, 0, 0x0707, 1), Err(14));
    assert_eq!(kernel.ioctl(handle, 1 << 3, 0x0707, 1), Err(1));
}

#[test]
fn one_file_too_many_is_enfile_until_one_is_released() {
    let mut kernel = Kernel::new();
    let handles = [(); OPEN_FILES_MAX].map(|()| kernel.open().unwrap());
    assert_eq!(kernel.open(), Err(23));
    kernel.release(handles[5]).unwrap();
    assert!(kernel.open().is_ok());
    assert_eq!(kernel.open(), Err(23));
}

#[test]
fn everything_else_has_its_errno_or_no_answer() {
    let mut kernel = Kernel::new();
    assert_eq!(kernel.ask(1, b"name\0"), Err(2), "nothing is below a file");
    assert_eq!(kernel.ask(4, &words(&[1, 0])), Err(1), "chmod");
    let truncated = kernel.ask(4, &words(&[1 << 3, 0])).unwrap();
    assert_eq!(truncated.len(), 104, "truncation by open");
    assert_eq!(kernel.ask(17, &[]).unwrap().len(), 80, "statfs");
    assert_eq!(kernel.ask(34, &[0; 8]), Ok(Vec::new()), "access");
    for opcode in [5, 6, 8, 9, 20, 21, 22, 27, 31, 36, 40, 43, 46, 4096] {
        assert_eq!(kernel.ask(opcode, &[0; 64]), Err(38), "opcode {opcode}");
    }
    for opcode in [2, 42] {
        assert_eq!(kernel.send(&request(opcode, &[0; 16])), Reply::Nothing);
    }
    let headless = kernel.send(&request(3, &[])[..39]);
    assert_eq!(headless, Reply::Nothing, "no complete header");
    assert_eq!(kernel.ask(39, &[0; 23]), Err(22), "an ioctl cut short");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn no_request_can_break_the_session(
        opcodes in prop::collection::vec((0..64u32, prop::collection::vec(any::<u8>(), 0..80)), 1..20),
        noise in prop::collection::vec(any::<u8>(), 0..60),
    ) {
        let mut kernel = Kernel::new();
        kernel.open().unwrap();
        for (opcode, mut body) in opcodes {
            // The first handle is 1, so half of the requests find their file open.
            if body.len() >= 8 && body[7] & 1 == 0 {
                body[..8].copy_from_slice(&1u64.to_ne_bytes());
            }
            kernel.send(&request(opcode, &body));
        }
        kernel.send(&noise);
    }
}
