//! Transfers that no kernel sends: malformed, almost right, and arbitrary.

use super::host::*;
use crate::usbip::{SessionError, session, wire};
use proptest::prelude::*;

/// Each possible error in a header ends the session with its own message.
#[test]
fn malformed_headers_end_the_session() {
    let good = submit_bytes([1, OUT, 0, 0], [0; 8]);
    let with = |at: usize, word: u32| {
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&word.to_be_bytes());
        bytes
    };
    let too_long = "a transfer of 65536 bytes, at most 65535 are possible";
    let packets = "an isochronous transfer of 1 packets to a device that has none";
    for (at, word, expected) in [
        (0, 5, "unknown command 5"),
        (24, 65_536, too_long),
        (32, 1, packets),
    ] {
        let (outcome, answered) = serve(&with(at, word));
        assert_eq!(outcome.unwrap_err().to_string(), expected);
        assert!(answered.is_empty());
    }
    for length in [0, 1, 47] {
        let (outcome, _) = serve(&good[..length]);
        assert_eq!(outcome.is_ok(), length == 0, "{length} bytes and the end");
    }
}

fn serve(bytes: &[u8]) -> (Result<(), SessionError>, Vec<u8>) {
    let mut answered = Vec::new();
    let mut device = device_on(Registers::default());
    (session::serve(bytes, &mut answered, &mut device), answered)
}

/// Almost valid transfers: known commands and requests, arbitrary everything else.
fn almost_a_transfer() -> impl Strategy<Value = Vec<u8>> {
    let request_type =
        prop::sample::select(vec![0x00, 0x01, 0x40, 0x41, 0x80, 0x81, 0xA1, 0xC0, 0xC1]);
    let (command, direction) = (1_u32..4, 0_u32..3);
    let asked = (request_type, 0_u8..12, any::<u16>(), any::<u16>());
    let lengths = (0_u16..40, any::<bool>());
    (command, direction, asked, lengths).prop_map(
        |(command, direction, (request_type, request, value, index), (length, agrees))| {
            let told = u32::from(length) + u32::from(!agrees);
            let setup = setup(request_type, request, value & 0x0311, index & 0x1FF, length);
            let mut bytes = submit_bytes([3, direction, 0, told], setup);
            bytes[3] = u8::try_from(command).unwrap();
            if direction != IN && command == 1 {
                bytes.resize(bytes.len() + usize::try_from(told).unwrap(), 0x55);
            }
            bytes
        },
    )
}

proptest! {
    #[test]
    fn arbitrary_bytes_end_in_an_error_and_never_in_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let (outcome, _) = serve(&bytes);
        prop_assert!(outcome.is_err() || bytes.is_empty() || bytes[3] == 1 || bytes[3] == 2);
        let mut start = [0; 8];
        start.iter_mut().zip(&bytes).for_each(|(to, from)| *to = *from);
        let is_request = start[..2] == VERSION && [OP_REQ_IMPORT, OP_REQ_DEVLIST].iter().any(|code| start[2..4] == *code);
        prop_assert_eq!(wire::Request::parse(&start).is_ok(), is_request);
    }

    #[test]
    fn every_transfer_is_answered_once_whatever_it_asks(
        transfers in prop::collection::vec(almost_a_transfer(), 0..30)
    ) {
        let known = transfers.iter().take_while(|bytes| bytes[3] != 3).count();
        let (outcome, answered) = serve(&transfers.concat());
        prop_assert_eq!(outcome.is_ok(), known == transfers.len());
        let mut in_order = transfers[..known].iter();
        let mut answered = answered.as_slice();
        let mut answers = 0;
        while !answered.is_empty() {
            let asked = in_order.next().unwrap();
            let sends = asked[3] == 1 && asked[15] == 1;
            let actual = u32::from_be_bytes(answered[24..28].try_into().unwrap());
            let data = if sends { usize::try_from(actual).unwrap() } else { 0 };
            answered = &answered[48 + data..];
            answers += 1;
        }
        prop_assert_eq!(answers, known);
    }
}
