//! The Rust client against the served bus.

use std::sync::mpsc;
use std::time::Duration;

use embedded_hal::i2c::{Error as _, ErrorKind, I2c, NoAcknowledgeSource, Operation};
use i2c_emulation::adapter::{BusFault, EmulatedAdapter, Fault, Message, TransferError};
use i2c_emulation::ioctl::{AdapterMode, Errno};
use i2c_emulation::rack::{Rack, SharedAdapter};
use i2c_emulation::socket::{ByeReason, Client, ClientError, ClientOptions, Options};
use proptest::prelude::*;

use crate::bench::{
    Bench, FAILING, Log, PANICKING, RegisterFile, TARGET, TEN_BIT_TARGET, first_value,
};

#[test]
fn a_frame_is_read_in_one_transfer() {
    let bench = Bench::new(Options::default());
    let mut bus = Client::connect(&bench.path, 1).unwrap();
    let mut frame = [0; 128];
    bus.write_read(0x69, &[0x80], &mut frame).unwrap();
    assert_eq!(frame, std::array::from_fn(|n| first_value(0x80 + n)));
    assert_eq!(bench.transfers(), ["69W[80] 69R128"]);
}

#[test]
fn what_one_client_writes_another_reads_and_other_buses_stay_apart() {
    let bench = Bench::new(Options::default());
    let register_5 = |bus: u32| {
        let mut client = Client::connect(&bench.path, bus).unwrap();
        let mut value = [0];
        client.write_read(0x69, &[5], &mut value).unwrap();
        value[0]
    };
    let mut writer = Client::connect(&bench.path, 7).unwrap();
    writer.write(0x69, &[5, 0xEE]).unwrap();
    assert_eq!([register_5(7), register_5(1)], [0xEE, first_value(5)]);
}

#[test]
fn the_server_tells_its_buses_and_its_adapter() {
    let bench = Bench::new(Options {
        mode: AdapterMode::Pi5,
        ..Options::default()
    });
    let client = Client::connect(&bench.path, 7).unwrap();
    assert_eq!(client.buses(), [1, 7]);
    assert_eq!(client.mode(), "pi5");
    assert_eq!(client.functionality(), AdapterMode::Pi5.functionality());
}

/// embedded-hal merges adjacent operations of one direction into one message.
#[test]
fn a_transaction_is_cut_into_messages_as_embedded_hal_has_it() {
    let bench = Bench::new(Options::default());
    let mut bus = Client::connect(&bench.path, 1).unwrap();
    let (mut first, mut second, mut third) = ([0; 2], [0; 3], [0; 1]);
    bus.transaction(
        0x69,
        &mut [
            Operation::Write(&[0x10]),
            Operation::Write(&[0xAA, 0xBB]),
            Operation::Read(&mut first),
            Operation::Read(&mut []),
            Operation::Read(&mut second),
            Operation::Write(&[0x10]),
            Operation::Read(&mut third),
        ],
    )
    .unwrap();
    assert_eq!(bench.transfers(), ["69W[10, aa, bb] 69R5 69W[10] 69R1"]);
    let expected: [u8; 5] = std::array::from_fn(|n| first_value(0x12 + n));
    assert_eq!(
        ([first[0], first[1]], second.as_slice(), third),
        ([expected[0], expected[1]], &expected[2..], [0xAA])
    );
    bus.transaction(0x69, &mut []).unwrap();
    assert_eq!(
        bench.transfers()[1],
        "",
        "an empty transaction is no message"
    );
}

#[test]
fn bytes_read_before_a_fault_are_there() {
    let bench = Bench::new(Options::default());
    let mut bus = Client::connect(&bench.path, 1).unwrap();
    let mut before = [0; 2];
    let outcome = bus.transfer(&mut [
        message(TARGET, Operation::Read(&mut before)),
        message(0x32, Operation::Write(&[1])),
    ]);
    assert_eq!(
        outcome,
        Err(TransferError {
            completed: 1,
            fault: Fault::Bus
        })
    );
    assert_eq!(before, [first_value(0), first_value(1)]);
}

#[test]
fn each_fault_keeps_its_name_and_gets_the_errno_of_the_mode() {
    for mode in AdapterMode::ALL {
        let bench = Bench::new(Options {
            mode,
            ..Options::default()
        });
        let mut bus = Client::connect(&bench.path, 1).unwrap();
        for (address, expected) in FAILING {
            let error = bus
                .transfer_messages(&mut [message(address, Operation::Write(&[1]))])
                .unwrap_err();
            let ClientError::Fault { fault, errno, .. } = &error else {
                panic!("{error}");
            };
            let named = mode.errno(expected).map(Errno::raw_os_error);
            assert_eq!((*fault, *errno), (expected, named), "{mode}");
            assert_eq!(error.fault(), expected);
        }
    }
}

#[test]
fn faults_are_kinds_of_embedded_hal() {
    let bench = Bench::new(Options::default());
    let mut bus = Client::connect(&bench.path, 1).unwrap();
    let kinds = FAILING.map(|(address, _)| {
        bus.write(u8::try_from(address).unwrap(), &[1])
            .unwrap_err()
            .kind()
    });
    assert_eq!(
        kinds,
        [
            ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address),
            ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data),
            ErrorKind::Bus,
            ErrorKind::ArbitrationLoss,
            ErrorKind::Other,
            ErrorKind::Other,
        ]
    );
}

/// The reference says that a Raspberry Pi's adapter rejects a read that is not the last message.
#[test]
fn the_adapter_refuses_what_the_bare_bus_carries_out() {
    let bench = Bench::new(Options::default());
    let strict = ClientOptions {
        as_adapter: true,
        ..ClientOptions::default()
    };
    let mut adapter = Client::connect_with(&bench.path, 1, strict).unwrap();
    let mut bare = Client::connect(&bench.path, 1).unwrap();
    let read_first = |client: &mut Client| {
        let mut byte = [0];
        client.transaction(
            0x69,
            &mut [Operation::Read(&mut byte), Operation::Write(&[0])],
        )
    };
    let error = read_first(&mut adapter).unwrap_err();
    assert!(
        matches!(error, ClientError::Refused { errno: 95, .. }),
        "{error}"
    );
    assert!(bench.transfers().is_empty(), "it never reached the bus");
    read_first(&mut bare).unwrap();
    let mut byte = [0];
    adapter.write_read(0x69, &[4], &mut byte).unwrap();
    assert_eq!(byte, [first_value(4)]);
}

#[test]
fn a_count_that_is_too_short_is_an_error_here() {
    let bench = Bench::new(Options {
        mode: AdapterMode::Virtio,
        ..Options::default()
    });
    let strict = ClientOptions {
        as_adapter: true,
        ..ClientOptions::default()
    };
    let mut adapter = Client::connect_with(&bench.path, 1, strict).unwrap();
    let mut stale = [0x55];
    let error = adapter.write_read(0x30, &[4], &mut stale).unwrap_err();
    assert!(
        matches!(
            error,
            ClientError::Short {
                completed: 0,
                messages: 2
            }
        ),
        "{error}"
    );
    assert_eq!(stale, [0x55]);
}

#[test]
fn transfers_beyond_the_limits_are_refused_before_they_are_sent() {
    let bench = Bench::new(Options::default());
    let mut bus = Client::connect(&bench.path, 1).unwrap();
    let mut longest = vec![0; 8192];
    bus.read(0x69, &mut longest).unwrap();
    assert_eq!(longest[8191], first_value(8191 % 256));
    let error = bus.read(0x69, &mut [0; 8193]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "8193 bytes in a message, at most 8192 are possible\n\
         hint: cut the transfer into several, if the target allows it"
    );
    let many = |count| -> Vec<Message<'_>> {
        (0..count)
            .map(|_| message(TARGET, Operation::Write(&[0])))
            .collect()
    };
    bus.transfer_messages(&mut many(42)).unwrap();
    let error = bus.transfer_messages(&mut many(43)).unwrap_err();
    assert!(
        matches!(
            error,
            ClientError::TooLong {
                found: 43,
                most: 42,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn a_server_that_went_away_is_named_now_and_later() {
    let mut bench = Bench::new(Options::default());
    let mut bus = Client::connect(&bench.path, 1).unwrap();
    bench.end();
    let error = bus.write(0x69, &[0]).unwrap_err();
    let expected = format!(
        "the server at {} went away: the server is stopping\nhint: start it again, and connect again",
        bench.path.display()
    );
    assert_eq!(error.to_string(), expected);
    assert_eq!(error.fault(), Fault::Gone);
    let error = bus.write(0x69, &[0]).unwrap_err();
    assert!(matches!(error, ClientError::ServerGone { .. }), "{error}");
    let error = Client::connect(&bench.path, 1).unwrap_err();
    assert!(
        error.to_string().starts_with("cannot connect to")
            && error.to_string().contains("hint: start the server first"),
        "{error}"
    );
}

#[test]
fn a_missing_bus_is_refused_with_a_list_of_buses() {
    let bench = Bench::new(Options::default());
    let error = Client::connect(&bench.path, 2).unwrap_err();
    let expected = format!(
        "the server at {} has no bus 2\nhint: it has bus 1, bus 7",
        bench.path.display()
    );
    assert_eq!(error.to_string(), expected);
}

#[test]
fn one_client_too_many_is_told_so() {
    let bench = Bench::new(Options {
        clients_max: 1,
        ..Options::default()
    });
    let _first = Client::connect(&bench.path, 1).unwrap();
    let error = Client::connect(&bench.path, 1).unwrap_err();
    let ClientError::TurnedAway { reason, .. } = &error else {
        panic!("{error}");
    };
    assert_eq!(*reason, ByeReason::TooManyClients);
}

/// A bus that reports when a transfer begins, and waits for permission to end it.
struct Held {
    begun: mpsc::Sender<()>,
    release: mpsc::Receiver<()>,
}

impl EmulatedAdapter for Held {
    fn transfer(&mut self, _messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        // A test that has ended does not need the report.
        let _ = self.begun.send(());
        let _ = self.release.recv();
        Ok(())
    }
}

#[test]
fn an_answer_that_does_not_come_ends_the_wait_and_the_connection() {
    let (begun, _when_begun) = mpsc::channel();
    let (let_go, release) = mpsc::channel();
    let mut rack = Rack::new();
    rack.insert(1, SharedAdapter::new(Held { begun, release }));
    let bench = Bench::with_rack(rack, Options::default(), Log::default());
    let impatient = ClientOptions {
        wait_max: Duration::from_millis(20),
        ..ClientOptions::default()
    };
    let mut bus = Client::connect_with(&bench.path, 1, impatient).unwrap();
    let error = bus.write(0x69, &[1]).unwrap_err();
    assert!(error.to_string().contains("within 20ms\nhint:"), "{error}");
    assert_eq!(error.fault(), Fault::Timeout);
    // The late answer must not be taken for that of the next request.
    let_go.send(()).unwrap();
    let error = bus.write(0x69, &[1]).unwrap_err();
    assert!(matches!(error, ClientError::ServerGone { .. }), "{error}");
}

#[test]
fn a_bus_that_hangs_holds_neither_other_buses_nor_the_stop_up() {
    let (begun, when_begun) = mpsc::channel();
    let (let_go, release) = mpsc::channel();
    let mut rack = Rack::new();
    rack.insert(1, SharedAdapter::new(Held { begun, release }));
    rack.insert(2, SharedAdapter::new(RegisterFile::new(Log::default())));
    let mut bench = Bench::with_rack(rack, Options::default(), Log::default());
    let path = bench.path.clone();
    let hanging = std::thread::spawn(move || Client::connect(path, 1).unwrap().write(0x69, &[1]));
    when_begun.recv().unwrap();
    let mut other = Client::connect(&bench.path, 2).unwrap();
    other.write(0x69, &[1]).unwrap();
    bench.end();
    assert!(!bench.path.exists());
    let_go.send(()).unwrap();
    hanging
        .join()
        .unwrap()
        .expect("the transfer under way is answered, also after the stop");
}

fn message(address: u16, operation: Operation<'_>) -> Message<'_> {
    Message {
        address,
        ten_bit: false,
        operation,
    }
}

/// One message of a random transfer: address, ten-bit, and bytes to write or to read.
type Asked = (u16, bool, Result<Vec<u8>, usize>);

fn asked() -> impl Strategy<Value = Asked> {
    let address = prop_oneof![
        4 => Just((TARGET, false)),
        1 => Just((TEN_BIT_TARGET, true)),
        1 => (0x30_u16..0x36).prop_map(|address| (address, false)),
        1 => any::<(u16, bool)>().prop_filter("would panic", |(address, _)| *address != PANICKING),
    ];
    let payload = prop_oneof![
        proptest::collection::vec(any::<u8>(), 0..40).prop_map(Ok),
        (0_usize..300).prop_map(Err),
    ];
    (address, payload).prop_map(|((address, ten_bit), payload)| (address, ten_bit, payload))
}

/// Carries out one transfer; returns its outcome and the contents of all buffers.
fn carry_out(
    bus: &mut dyn EmulatedAdapter,
    transfer: &[Asked],
) -> (Result<(), TransferError>, Vec<Vec<u8>>) {
    let mut buffers: Vec<Vec<u8>> = transfer
        .iter()
        .map(|(_, _, payload)| vec![0xA5; *payload.as_ref().err().unwrap_or(&0)])
        .collect();
    let mut messages: Vec<Message<'_>> = transfer
        .iter()
        .zip(&mut buffers)
        .map(|((address, ten_bit, payload), buffer)| Message {
            address: *address,
            ten_bit: *ten_bit,
            operation: match payload {
                Ok(bytes) => Operation::Write(bytes),
                Err(_) => Operation::Read(buffer),
            },
        })
        .collect();
    let outcome = bus.transfer(&mut messages);
    (outcome, buffers)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// A bus over the socket behaves exactly like one in the same process.
    #[test]
    fn the_socket_changes_nothing(
        transfers in proptest::collection::vec(proptest::collection::vec(asked(), 0..6), 1..12)
    ) {
        let bench = Bench::new(Options::default());
        let mut near = RegisterFile::new(Log::default());
        let mut far = Client::connect(&bench.path, 1).unwrap();
        for transfer in &transfers {
            prop_assert_eq!(carry_out(&mut far, transfer), carry_out(&mut near, transfer));
        }
    }
}
