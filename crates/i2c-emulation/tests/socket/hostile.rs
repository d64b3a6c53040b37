//! Reaches every limit; a client that breaks the protocol harms only itself.

use std::io::{ErrorKind, Read, Write};
use std::time::Duration;

use embedded_hal::i2c::I2c;
use i2c_emulation::ioctl::{AdapterMode, MESSAGE_BYTES_MAX, RDWR_MESSAGES_MAX};
use i2c_emulation::rack::Rack;
use i2c_emulation::socket::{
    CLIENTS_MAX, IDLE_WAIT_MAX, Options, PACKET_BYTES_MAX, PACKET_WAIT_MAX, PATH_BYTES_MAX,
    STOP_WAIT_MAX, Server, SocketError, VERSION,
};
use proptest::prelude::*;

use crate::bench::{Bench, FAILING, PANICKING, first_value, hello, read, transfer, write};
use crate::client::Client;

const EINVAL: u8 = 22;
const REFUSED: u8 = 0x84;

/// A well-behaved client is still served.
fn assert_served(bench: &Bench) {
    let mut value = [0];
    let mut client = Client::connect(&bench.path, 1).unwrap();
    client.write_read(0x69, &[0x42], &mut value).unwrap();
    assert_eq!(value, [first_value(0x42)]);
}

#[test]
fn a_transfer_by_hand_is_as_the_document_has_it() {
    let bench = Bench::new(Options::default());
    let mut raw = bench.greeted();
    let answer = raw.ask(&transfer(1, 0, &[write(0x69, &[0x80]), read(0x69, 3)]));
    let expected = [
        0x82,
        2,
        0,
        first_value(0x80),
        first_value(0x81),
        first_value(0x82),
    ];
    assert_eq!(answer, expected);
    // Several requests may be sent before the first answer is read.
    raw.send(&transfer(1, 0, &[write(0x69, &[1])]));
    raw.send(&transfer(1, 0, &[read(0x69, 1)]));
    assert_eq!(raw.receive(), [0x82, 1, 0]);
    assert_eq!(raw.receive(), [0x82, 1, 0, first_value(1)]);
    let [(nobody, _), ..] = FAILING;
    let answer = raw.ask(&transfer(
        7,
        0,
        &[write(0x69, &[1]), read(0x69, 1), read(nobody, 1)],
    ));
    assert_eq!(answer, [0x83, 1, 121, 0, 2, 0, first_value(1)]);
    let answer = raw.ask(&transfer(7, 1, &[write(0x69, &[1]), read(nobody, 1)]));
    assert_eq!(answer, [0x83, 1, 121, 0, 1, 0]);
}

#[test]
fn the_welcome_is_as_the_document_has_it() {
    let bench = Bench::new(Options::default());
    let expected = [
        &[0x81][..],
        b"i2ce",
        &[1, 0],
        &0x0EFF_0009_u32.to_le_bytes(),
        &[2],
        b"pi",
        &[2, 0, 1, 0, 0, 0, 7, 0, 0, 0],
    ]
    .concat();
    assert_eq!(bench.raw().ask(&hello(1)), expected);
}

#[test]
fn a_transfer_has_at_most_42_messages() {
    let bench = Bench::new(Options::default());
    let mut raw = bench.greeted();
    let ask = |count| transfer(1, 0, &vec![write(0x69, &[0]); count]);
    assert_eq!(raw.ask(&ask(RDWR_MESSAGES_MAX)), [0x82, 42, 0]);
    let answer = raw.ask(&ask(RDWR_MESSAGES_MAX + 1));
    assert_eq!(answer[..3], [REFUSED, EINVAL, 0]);
    assert_eq!(&answer[3..], b"a transfer has at most 42 messages");
    assert_eq!(bench.transfers().len(), 1);
}

#[test]
fn a_message_has_at_most_8192_bytes() {
    let bench = Bench::new(Options::default());
    let mut raw = bench.greeted();
    let most = u16::try_from(MESSAGE_BYTES_MAX).unwrap();
    assert_eq!(
        raw.ask(&transfer(1, 0, &[read(0x69, most)])).len(),
        3 + MESSAGE_BYTES_MAX
    );
    let answer = raw.ask(&transfer(1, 0, &[write(0x69, &[0; MESSAGE_BYTES_MAX])]));
    assert_eq!(answer, [0x82, 1, 0]);
    let too_long = [
        read(0x69, most + 1),
        read(0x69, u16::MAX),
        write(0x69, &[0; MESSAGE_BYTES_MAX + 1]),
    ];
    for message in too_long {
        let answer = raw.ask(&transfer(1, 0, std::slice::from_ref(&message)));
        assert_eq!(answer[..3], [REFUSED, EINVAL, 0]);
        assert_eq!(&answer[3..], b"a message has at most 8192 bytes");
        let answer = raw.ask(&transfer(1, 1, &[message]));
        assert_eq!(answer[..3], [REFUSED, EINVAL, 0]);
    }
    assert_eq!(bench.transfers().len(), 2);
    // read() and write() transfer what is possible.
    let answer = raw.ask(&transfer(1, 2, &[read(0x69, most + 1)]));
    assert_eq!(answer.len(), 3 + MESSAGE_BYTES_MAX);
    let answer = raw.ask(&transfer(1, 2, &[write(0x69, &[0; MESSAGE_BYTES_MAX + 1])]));
    assert_eq!(answer, [0x82, 1, 0]);
}

#[test]
fn the_largest_transfer_fits_into_a_packet_both_ways() {
    let bench = Bench::new(Options::default());
    let mut raw = bench.greeted();
    let longest = write(0x69, &[0; MESSAGE_BYTES_MAX]);
    let question = transfer(1, 0, &vec![longest; RDWR_MESSAGES_MAX]);
    assert_eq!(question.len(), PACKET_BYTES_MAX);
    assert_eq!(raw.ask(&question), [0x82, 42, 0]);
    let most = u16::try_from(MESSAGE_BYTES_MAX).unwrap();
    let answer = raw.ask(&transfer(1, 0, &vec![read(0x69, most); RDWR_MESSAGES_MAX]));
    assert_eq!(answer.len(), 3 + RDWR_MESSAGES_MAX * MESSAGE_BYTES_MAX);
}

#[test]
fn a_packet_beyond_the_limit_ends_the_connection_before_it_is_read() {
    let bench = Bench::new(Options::default());
    let mut raw = bench.greeted();
    let announced = u32::try_from(PACKET_BYTES_MAX + 1).unwrap();
    raw.0.write_all(&announced.to_le_bytes()).unwrap();
    let expected = "a packet of 344325 bytes, at most 344324 are taken";
    assert_eq!(raw.farewell(), (1, expected.to_owned()));
    let mut raw = bench.raw();
    raw.0.write_all(&u32::MAX.to_le_bytes()).unwrap();
    assert_eq!(raw.farewell().0, 1);
    assert_served(&bench);
}

#[test]
fn an_unknown_request_ends_the_connection() {
    let good = transfer(1, 0, &[read(0x69, 1)]);
    let with = |place: usize, value: u8| {
        let mut packet = good.clone();
        packet[place] = value;
        packet
    };
    let smbus = [&[3, 1, 0, 0, 0, 0x69, 0, 0, 0, 1, 0, 0][..], &[0; 34]].concat();
    let mut odd_smbus = smbus.clone();
    odd_smbus[7] = 2;
    for (packet, expected) in [
        (Vec::new(), "an empty packet"),
        (vec![9], "no request of kind 9"),
        (vec![0x82, 0, 0], "no request of kind 130"),
        (with(5, 3), "no such judge: 3"),
        (with(10, 0x11 | 0x02), "no such flags: 0x0002"),
        (with(11, 0x04), "no such flags: 0x0400"),
        (with(6, 2), "the packet ends before its address"),
        (good[..12].to_vec(), "the packet ends before its length"),
        (
            [&good[..], &[0, 0]].concat(),
            "2 bytes after the end of the request",
        ),
        (
            transfer(1, 0, &[write(0x69, &[0; 4])])[..17].to_vec(),
            "the packet ends before its bytes to write",
        ),
        (odd_smbus, "no such flags: 0x0002"),
        (smbus[..45].to_vec(), "the packet ends before its data"),
        (
            b"\x01nope\x01\0".to_vec(),
            "a hello that does not begin with \"i2ce\"",
        ),
    ] {
        let bench = Bench::new(Options::default());
        let mut raw = bench.greeted();
        raw.send(&packet);
        assert_eq!(raw.farewell(), (1, expected.to_owned()), "{packet:02x?}");
        assert!(bench.transfers().is_empty(), "{expected}");
    }
}

#[test]
fn a_request_before_the_hello_ends_the_connection() {
    let bench = Bench::new(Options::default());
    let mut raw = bench.raw();
    raw.send(&transfer(1, 0, &[read(0x69, 1)]));
    assert_eq!(raw.farewell(), (1, "a request before the hello".to_owned()));
    assert!(bench.transfers().is_empty());
}

#[test]
fn another_version_is_told_which_one_is_spoken_here() {
    assert_eq!(VERSION, 1);
    let bench = Bench::new(Options::default());
    for version in [0, 2, u16::MAX] {
        let mut raw = bench.raw();
        // The rest of a later version's hello does not matter.
        raw.send(&[hello(version), b"and more".to_vec()].concat());
        let expected = format!("this server speaks version 1, not {version}");
        assert_eq!(raw.farewell(), (2, expected));
    }
}

#[test]
fn a_bus_that_is_not_there_is_refused_and_the_connection_goes_on() {
    let bench = Bench::new(Options::default());
    let mut raw = bench.greeted();
    for judge in 0..3 {
        let answer = raw.ask(&transfer(2, judge, &[read(0x69, 1)]));
        assert_eq!(
            answer,
            [&[REFUSED, 19, 0][..], b"there is no bus 2"].concat()
        );
    }
    let smbus = [&[3, 2, 0, 0, 0, 0x69, 0, 0, 0, 1, 0, 0][..], &[0; 34]].concat();
    assert_eq!(
        raw.ask(&smbus),
        [&[REFUSED, 19, 0][..], b"there is no bus 2"].concat()
    );
    assert_eq!(raw.ask(&transfer(1, 0, &[read(0x69, 1)]))[0], 0x82);
}

/// read() and write() on a file with an address that a kernel driver owns: I2C_SLAVE returns EBUSY, I2C_RDWR does not
/// check.
#[test]
fn a_file_meets_the_driver_that_owns_the_address() {
    let bench = Bench::new(Options {
        mode: AdapterMode::Busy,
        ..Options::default()
    });
    let mut raw = bench.greeted();
    assert_eq!(
        raw.ask(&transfer(1, 2, &[read(0x69, 1)]))[..3],
        [REFUSED, 16, 0]
    );
    assert_eq!(raw.ask(&transfer(1, 1, &[read(0x69, 1)]))[0], 0x82);
    let bench = Bench::new(Options::default());
    let mut raw = bench.greeted();
    assert_eq!(
        raw.ask(&transfer(1, 2, &[write(0x69, &[0x80])])),
        [0x82, 1, 0]
    );
    assert_eq!(
        raw.ask(&transfer(1, 2, &[read(0x69, 1)])),
        [0x82, 1, 0, first_value(0x80)]
    );
    let answer = raw.ask(&transfer(1, 2, &[read(0x80, 1)]));
    assert_eq!(
        answer[..3],
        [REFUSED, EINVAL, 0],
        "an address of eight bits"
    );
    let answer = raw.ask(&transfer(1, 2, &[read(0x69, 1), read(0x69, 1)]));
    assert_eq!(&answer[3..], b"read() and write() are one message each");
}

/// As in the kernel, each message has its own buffer: the bytes that one reads are not those that the next writes.
#[test]
fn each_message_has_its_own_bytes_also_behind_a_read() {
    let bench = Bench::new(Options {
        mode: AdapterMode::Pi5,
        ..Options::default()
    });
    let mut raw = bench.greeted();
    let messages = [
        read(0x69, 2),
        write(0x69, &[0x80]),
        read(0x69, 1),
        write(0x69, &[0x10, 7]),
    ];
    let expected = [
        0x82,
        4,
        0,
        first_value(0),
        first_value(1),
        first_value(0x80),
    ];
    assert_eq!(raw.ask(&transfer(1, 1, &messages)), expected);
    assert_eq!(bench.transfers(), ["69R2 69W[80] 69R1 69W[10, 07]"]);
}

/// i2c-virtio reveals a fault only by its count.
#[test]
fn a_mode_that_hides_faults_hides_them_here_too() {
    let bench = Bench::new(Options {
        mode: AdapterMode::Virtio,
        ..Options::default()
    });
    let [(nobody, _), ..] = FAILING;
    let mut raw = bench.greeted();
    for (judge, messages, expected) in [
        (0, vec![read(nobody, 1)], &[0x83, 1, 0, 0, 0, 0][..]),
        (1, vec![read(nobody, 1)], &[0x82, 0, 0]),
        (2, vec![read(nobody, 1)], &[0x82, 0, 0]),
        (2, vec![write(nobody, &[1])], &[0x82, 0, 0]),
        (
            1,
            vec![read(0x69, 1), read(nobody, 1)],
            &[0x82, 1, 0, first_value(0)],
        ),
    ] {
        let answer = raw.ask(&transfer(1, judge, &messages));
        assert_eq!(answer, expected, "judge {judge}");
    }
}

#[test]
fn a_client_too_many_is_turned_away_and_may_come_again() {
    assert_eq!(Options::default().clients_max, CLIENTS_MAX);
    let bench = Bench::new(Options::default());
    let mut guests: Vec<_> = (0..CLIENTS_MAX).map(|_| bench.greeted()).collect();
    let expected = "32 clients are connected, the limit";
    assert_eq!(bench.raw().farewell(), (3, expected.to_owned()));
    let mut leaving = guests.pop().unwrap();
    leaving.send(&[]);
    leaving.farewell();
    // The end of the connection may be visible before its slot is free.
    while bench.raw().ask(&hello(1))[0] == 0x85 {
        std::thread::yield_now();
    }
}

#[test]
fn every_wait_has_a_limit() {
    assert_eq!(Options::default().packet_wait_max, PACKET_WAIT_MAX);
    assert_eq!(Options::default().idle_wait_max, IDLE_WAIT_MAX);
    let short = Duration::from_millis(30);
    let bench = Bench::new(Options {
        packet_wait_max: short,
        idle_wait_max: 4 * short,
        ..Options::default()
    });
    let mut stranger = bench.raw();
    assert_eq!(stranger.farewell(), (4, "nothing came for 30ms".to_owned()));
    let mut silent = bench.greeted();
    assert_eq!(silent.farewell(), (4, "nothing came for 120ms".to_owned()));
    let bench = Bench::new(Options {
        packet_wait_max: short,
        ..Options::default()
    });
    let mut slow = bench.greeted();
    slow.0.write_all(&[20, 0, 0, 0, 2]).unwrap();
    let expected = "a packet was not complete after 30ms";
    assert_eq!(slow.farewell(), (1, expected.to_owned()));
    let bench = Bench::new(Options::default());
    let mut cut = bench.greeted();
    cut.0.write_all(&[20, 0, 0]).unwrap();
    cut.0.shutdown(std::net::Shutdown::Write).unwrap();
    assert_eq!(
        cut.farewell(),
        (1, "the stream ends within a packet".to_owned())
    );
    assert_served(&bench);
}

/// A byte now and then does not extend the time for a packet.
#[test]
fn a_trickle_is_too_slow_as_well() {
    let bench = Bench::new(Options {
        packet_wait_max: Duration::from_millis(60),
        ..Options::default()
    });
    let mut slow = bench.greeted();
    let announced = 2000_u32;
    slow.0.write_all(&announced.to_le_bytes()).unwrap();
    let mut sent = 0;
    while sent < announced && slow.0.write_all(&[1]).is_ok() {
        sent += 1;
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(sent < announced, "the server took all bytes one by one");
    let expected = "a packet was not complete after 60ms";
    assert_eq!(slow.farewell(), (1, expected.to_owned()));
}

/// The server drops a client with a full socket, and serves the others in the meantime.
#[test]
fn a_client_that_reads_no_answers_is_dropped() {
    let bench = Bench::new(Options {
        packet_wait_max: Duration::from_millis(400),
        ..Options::default()
    });
    let mut glutton = bench.greeted();
    let question = transfer(1, 0, &vec![read(0x69, 8192); 42]);
    for _ in 0..4 {
        glutton.send(&question);
    }
    assert_served(&bench);
    // The part of the first answer that fits is there; then comes the end.
    let mut taken = Vec::new();
    std::thread::sleep(Duration::from_millis(1200));
    let end = glutton.0.read_to_end(&mut taken);
    assert!(
        end.as_ref().is_ok()
            || end
                .as_ref()
                .is_err_and(|error| error.kind() == ErrorKind::ConnectionReset),
        "{end:?}"
    );
    assert!(taken.len() < 4 * 42 * 8192, "all was answered");
}

/// A client that reads a little now and then gets no more time than one that reads nothing.
#[test]
fn a_client_that_reads_answers_too_slowly_is_dropped() {
    let bench = Bench::new(Options {
        packet_wait_max: Duration::from_millis(100),
        ..Options::default()
    });
    let mut sipper = bench.greeted();
    let question = transfer(1, 0, &vec![read(0x69, 8192); 42]);
    // More than the socket's buffer holds.
    sipper.send(&question);
    sipper.send(&question);
    let mut taken = 0;
    let mut sip = [0; 4096];
    while let Ok(bytes @ 1..) = sipper.0.read(&mut sip) {
        taken += bytes;
        std::thread::sleep(Duration::from_millis(10));
    }
    let all = 2 * (4 + 3 + 42 * 8192);
    assert!((1..all).contains(&taken), "{taken} of {all} bytes");
}

#[test]
fn a_bus_that_panics_costs_its_caller_the_connection_and_nobody_else() {
    let bench = Bench::new(Options {
        clients_max: 2,
        ..Options::default()
    });
    let mut other = Client::connect(&bench.path, 1).unwrap();
    for _ in 0..3 {
        let mut raw = loop {
            let mut raw = bench.raw();
            if raw.ask(&hello(1))[0] == 0x81 {
                break raw;
            }
        };
        raw.send(&transfer(1, 0, &[read(PANICKING, 1)]));
        let mut rest = Vec::new();
        raw.0.read_to_end(&mut rest).unwrap();
        assert!(rest.is_empty());
    }
    other.write(0x69, &[1]).unwrap();
}

#[test]
fn a_rack_without_a_bus_is_not_served() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bus.sock");
    let error = Server::bind(&path, Rack::new(), Options::default()).unwrap_err();
    assert!(matches!(error, SocketError::NoBus), "{error}");
    assert!(!path.exists());
}

/// The document's limits equal the library's.
#[test]
fn the_document_names_each_limit_with_its_value() {
    let document = include_str!("../../src/socket/PROTOCOL.md");
    let group = |number: usize| {
        let digits = number.to_string();
        match digits.len() {
            0..=4 => digits,
            length => format!("{},{}", &digits[..length - 3], &digits[length - 3..]),
        }
    };
    for (name, value) in [
        ("RDWR_MESSAGES_MAX", group(RDWR_MESSAGES_MAX)),
        ("MESSAGE_BYTES_MAX", group(MESSAGE_BYTES_MAX)),
        ("PACKET_BYTES_MAX", group(PACKET_BYTES_MAX)),
        ("CLIENTS_MAX", group(CLIENTS_MAX)),
        (
            "PACKET_WAIT_MAX",
            format!("{} s", PACKET_WAIT_MAX.as_secs()),
        ),
        (
            "IDLE_WAIT_MAX",
            format!("{} h", IDLE_WAIT_MAX.as_secs() / 3600),
        ),
        ("STOP_WAIT_MAX", format!("{} s", STOP_WAIT_MAX.as_secs())),
        ("PATH_BYTES_MAX", format!("{PATH_BYTES_MAX} bytes")),
    ] {
        let row = document
            .lines()
            .find(|line| line.contains(&format!("::{name}`")))
            .unwrap_or_else(|| panic!("{name} is not in the document"));
        assert!(row.contains(&format!("| {value} |")), "{row}");
    }
}

/// Almost valid packets: cut, extended, or with bytes replaced.
fn nearly_packets() -> impl Strategy<Value = Vec<u8>> {
    let body = prop_oneof![
        proptest::collection::vec(any::<u8>(), 0..60),
        Just(hello(1)),
        (0_u32..9, 0_u8..4, 0_u16..4, 0_u16..9000).prop_map(|(bus, judge, address, length)| {
            transfer(
                bus,
                judge,
                &[write(0x69, &[1]), read(0x68 + address, length)],
            )
        }),
        (0_u32..9, any::<[u8; 7]>(), any::<[u8; 34]>()).prop_map(|(bus, head, data)| {
            [&[3][..], &bus.to_le_bytes(), &head, &data].concat()
        }),
    ];
    let packet = (body, -2_i64..3).prop_map(|(body, off)| {
        let length = (i64::try_from(body.len()).unwrap() + off).max(0);
        let length = u32::try_from(length).unwrap();
        [&length.to_le_bytes()[..], &body].concat()
    });
    let spoiled = (packet, any::<Option<(u8, u8)>>()).prop_map(|(mut packet, spoil)| {
        if let Some((place, value)) = spoil {
            let place = usize::from(place) % packet.len();
            packet[place] = value;
        }
        packet
    });
    proptest::collection::vec(spoiled, 0..8).prop_map(|packets| packets.concat())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Whatever arrives, all answers are whole packets of known kinds, and other clients are still served.
    #[test]
    fn arbitrary_bytes_harm_nobody(greeted in any::<bool>(), bytes in nearly_packets()) {
        let bench = Bench::new(Options::default());
        let mut raw = if greeted { bench.greeted() } else { bench.raw() };
        // The server may have closed the connection already.
        let _ = raw.0.write_all(&bytes);
        let _ = raw.0.shutdown(std::net::Shutdown::Write);
        let mut answers = Vec::new();
        let _ = raw.0.read_to_end(&mut answers);
        let mut rest = answers.as_slice();
        while let Some((head, after)) = rest.split_first_chunk::<4>() {
            let length = usize::try_from(u32::from_le_bytes(*head)).unwrap();
            prop_assert!((1..=after.len()).contains(&length), "{answers:02x?}");
            prop_assert!((0x81..=0x85).contains(&after[0]), "{answers:02x?}");
            rest = &after[length..];
        }
        prop_assert!(rest.is_empty(), "{answers:02x?}");
        let mut client = Client::connect(&bench.path, 1).unwrap();
        client.write(0x69, &[1]).unwrap();
    }
}
