//! The answers, request by request, without a kernel.

use proptest::prelude::*;

use super::*;
use crate::adapter::{Message, TransferError};
use embedded_hal::i2c::Operation;

const UNIQUE: u64 = 77;

/// The first number that is no address of seven bits.
const BEYOND_SEVEN_BITS: u64 = 1 << 7;

/// Reads give 0x42, writes are swallowed.
struct Answering;

impl EmulatedAdapter for Answering {
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        for message in messages {
            if let Operation::Read(buffer) = &mut message.operation {
                buffer.fill(0x42);
            }
        }
        Ok(())
    }
}

/// A caller without any memory, which tells its pointers' width by the errno it gives.
struct NoMemory(PointerWidth);

impl CallerMemory for NoMemory {
    fn read(&mut self, _: u64, _: &mut [u8]) -> Result<(), Errno> {
        Err(if self.0 == PointerWidth::Bits32 {
            Errno::EPERM
        } else {
            Errno::EFAULT
        })
    }

    fn write(&mut self, _: u64, _: &[u8]) -> Result<(), Errno> {
        Err(Errno::EFAULT)
    }
}

fn session() -> Session {
    Session::new(AdapterMode::Pi, 1000, 100)
}

fn request(opcode: u32, body: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    bytes.extend(u32::try_from(40 + body.len()).unwrap().to_ne_bytes());
    bytes.extend(opcode.to_ne_bytes());
    bytes.extend(UNIQUE.to_ne_bytes());
    bytes.extend([0; 24]);
    bytes.extend(body);
    bytes
}

fn ask(session: &mut Session, bytes: &[u8]) -> Reply {
    let mut memory_of = |_pid, width| -> Box<dyn CallerMemory> { Box::new(NoMemory(width)) };
    session.answer(bytes, &mut memory_of, &Mutex::new(Answering))
}

/// The body of an answer, or its errno.
fn outcome(session: &mut Session, opcode: u32, body: &[u8]) -> Result<Vec<u8>, i32> {
    let Reply::Bytes(bytes) = ask(session, &request(opcode, body)) else {
        panic!("opcode {opcode} is not answered");
    };
    let word = |offset: usize| i32::from_ne_bytes(*bytes[offset..].first_chunk().unwrap());
    assert_eq!(usize::try_from(word(0)).unwrap(), bytes.len());
    assert_eq!(bytes[8..16], UNIQUE.to_ne_bytes());
    if word(4) == 0 {
        Ok(bytes[16..].to_vec())
    } else {
        Err(-word(4))
    }
}

fn open(session: &mut Session) -> Result<u64, i32> {
    outcome(session, 14, &[0; 8]).map(|body| u64::from_ne_bytes(*body.first_chunk().unwrap()))
}

/// `struct fuse_read_in` and `struct fuse_write_in` begin alike: handle, offset, size.
fn transfer_body(handle: u64, length: u32, data: &[u8]) -> Vec<u8> {
    [
        &handle.to_ne_bytes()[..],
        &[0; 8],
        &length.to_ne_bytes(),
        &[0; 20],
        data,
    ]
    .concat()
}

fn ioctl_body(handle: u64, flags: u32, command: u32, argument: u64) -> Vec<u8> {
    [
        &handle.to_ne_bytes()[..],
        &flags.to_ne_bytes(),
        &command.to_ne_bytes(),
        &argument.to_ne_bytes(),
        &[0; 8],
    ]
    .concat()
}

fn words(values: &[u32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_ne_bytes())
        .collect()
}

#[test]
fn the_greeting_names_the_version_and_another_protocol_is_refused() {
    let body = outcome(&mut session(), 26, &words(&[7, 38, 4096, 0])).unwrap();
    assert_eq!(body[..8], words(&[7, 28]));
    assert_eq!(body[20..24], words(&[65536]), "max_write");
    for (major, minor) in [(7, 27), (6, 40), (8, 40)] {
        let reply = ask(&mut session(), &request(26, &words(&[major, minor, 0, 0])));
        assert_eq!(reply, Reply::Incompatible { major, minor });
    }
}

#[test]
fn the_file_is_regular_and_belongs_to_whom_it_should() {
    let body = outcome(&mut session(), 3, &[0; 16]).unwrap();
    assert_eq!(
        body[16 + 60..16 + 76],
        words(&[0o100_666, 1, 1000, 100]),
        "mode, links, owner, group"
    );
}

#[test]
fn an_open_file_is_read_written_and_asked_until_it_is_released() {
    let mut session = session();
    let handle = open(&mut session).unwrap();
    assert_eq!(
        outcome(&mut session, 15, &transfer_body(handle, 3, &[])).unwrap(),
        [0x42; 3]
    );
    assert_eq!(
        outcome(&mut session, 15, &transfer_body(handle, 20_000, &[]))
            .unwrap()
            .len(),
        8192
    );
    assert_eq!(
        outcome(&mut session, 16, &transfer_body(handle, 2, &[1, 2])).unwrap(),
        words(&[2, 0])
    );
    assert_eq!(
        outcome(&mut session, 39, &ioctl_body(handle, 0, 0x0703, 0x69)).unwrap(),
        [0; 16]
    );
    assert_eq!(
        outcome(
            &mut session,
            39,
            &ioctl_body(handle, 0, 0x0703, BEYOND_SEVEN_BITS)
        ),
        Err(22)
    );
    assert_eq!(outcome(&mut session, 25, &[0; 24]), Ok(Vec::new()), "flush");
    assert_eq!(
        outcome(&mut session, 18, &transfer_body(handle, 0, &[])),
        Ok(Vec::new()),
        "release"
    );
    assert_eq!(
        outcome(&mut session, 15, &transfer_body(handle, 3, &[])),
        Err(22)
    );
}

#[test]
fn files_have_addresses_of_their_own() {
    let mut session = session();
    let (busy, plain) = (open(&mut session).unwrap(), open(&mut session).unwrap());
    assert_ne!(busy, plain);
    outcome(&mut session, 39, &ioctl_body(busy, 0, 0x0704, 1)).unwrap();
    assert_eq!(
        outcome(&mut session, 39, &ioctl_body(busy, 0, 0x0703, 0x3FF)).unwrap(),
        [0; 16]
    );
    assert_eq!(
        outcome(&mut session, 39, &ioctl_body(plain, 0, 0x0703, 0x3FF)),
        Err(22)
    );
}

/// FUSE_IOCTL_32BIT is bit 3 of the flags.
#[test]
fn a_32_bit_caller_is_told_apart() {
    let mut session = session();
    let handle = open(&mut session).unwrap();
    assert_eq!(
        outcome(&mut session, 39, &ioctl_body(handle, 0, 0x0707, 1)),
        Err(14)
    );
    assert_eq!(
        outcome(&mut session, 39, &ioctl_body(handle, 1 << 3, 0x0707, 1)),
        Err(1)
    );
}

#[test]
fn one_file_too_many_is_enfile_until_one_is_released() {
    let mut session = session();
    let handles: Vec<u64> = (0..OPEN_FILES_MAX)
        .map(|_| open(&mut session).unwrap())
        .collect();
    assert_eq!(open(&mut session), Err(23));
    outcome(&mut session, 18, &transfer_body(handles[5], 0, &[])).unwrap();
    assert!(open(&mut session).is_ok());
    assert_eq!(open(&mut session), Err(23));
}

#[test]
fn everything_else_has_its_errno_or_no_answer() {
    let mut session = session();
    assert_eq!(
        outcome(&mut session, 1, b"name\0"),
        Err(2),
        "lookup: nothing is below a file"
    );
    assert_eq!(outcome(&mut session, 4, &words(&[1, 0])), Err(1), "chmod");
    assert_eq!(
        outcome(&mut session, 4, &words(&[1 << 3, 0]))
            .unwrap()
            .len(),
        104,
        "truncation by open"
    );
    assert_eq!(outcome(&mut session, 17, &[]).unwrap().len(), 80, "statfs");
    assert_eq!(outcome(&mut session, 34, &[0; 8]), Ok(Vec::new()), "access");
    for opcode in [5, 6, 8, 9, 20, 21, 22, 27, 31, 36, 40, 43, 46, 4096] {
        assert_eq!(
            outcome(&mut session, opcode, &[0; 64]),
            Err(38),
            "opcode {opcode}"
        );
    }
    for opcode in [2, 42] {
        assert_eq!(
            ask(&mut session, &request(opcode, &[0; 16])),
            Reply::Nothing
        );
    }
    assert_eq!(
        ask(&mut session, &request(3, &[])[..39]),
        Reply::Nothing,
        "not even a header"
    );
    assert_eq!(
        outcome(&mut session, 39, &[0; 23]),
        Err(22),
        "an ioctl cut short"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn no_request_can_break_the_session(
        opcodes in prop::collection::vec((0..64u32, prop::collection::vec(any::<u8>(), 0..80)), 1..20),
        noise in prop::collection::vec(any::<u8>(), 0..60),
    ) {
        let mut session = session();
        open(&mut session).unwrap();
        for (opcode, mut body) in opcodes {
            // The first handle is 1: half of the requests find their file open.
            if body.len() >= 8 && body[7] & 1 == 0 {
                body[..8].copy_from_slice(&1u64.to_ne_bytes());
            }
            ask(&mut session, &request(opcode, &body));
        }
        ask(&mut session, &noise);
    }
}
