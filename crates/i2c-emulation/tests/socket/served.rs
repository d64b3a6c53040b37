//! What the socket serves, beside the same bus in this process.

use std::sync::mpsc;

use embedded_hal::i2c::{I2c, Operation};
use i2c_emulation::adapter::{EmulatedAdapter, Message, TransferError};
use i2c_emulation::ioctl::{AdapterMode, Errno};
use i2c_emulation::rack::{Rack, SharedAdapter};
use i2c_emulation::socket::Options;
use proptest::prelude::*;

use crate::bench::{
    Bench, FAILING, Log, PANICKING, RegisterFile, TARGET, TEN_BIT_TARGET, first_value,
};
use crate::client::{Client, Failure};

/// Who judges a transfer, besides the bus alone; and the flag of a ten-bit address.
const AS_ADAPTER: u8 = 1;
const TEN_BIT: u16 = 0x10;

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
fn bytes_read_before_a_fault_are_there() {
    let bench = Bench::new(Options::default());
    let mut bus = Client::connect(&bench.path, 1).unwrap();
    let mut before = [0; 2];
    let mut messages = [
        (TARGET, 0, Operation::Read(&mut before)),
        (0x32, 0, Operation::Write(&[1])),
    ];
    let outcome = bus.transfer(&mut messages);
    assert!(
        matches!(
            outcome,
            Err(Failure::Fault {
                fault: 3,
                completed: 1,
                ..
            })
        ),
        "{outcome:?}"
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
        for (number, (address, expected)) in (1..).zip(FAILING) {
            let errno = mode.errno(expected).map_or(0, Errno::raw_os_error);
            let expected = Failure::Fault {
                fault: number,
                errno: errno.try_into().unwrap(),
                completed: 0,
            };
            let outcome = bus.transfer(&mut [(address, 0, Operation::Write(&[1]))]);
            assert_eq!(outcome, Err(expected), "{mode}");
        }
    }
}

/// The reference says that a Raspberry Pi's adapter rejects a read that is not the last message.
#[test]
fn the_adapter_refuses_what_the_bare_bus_carries_out() {
    let bench = Bench::new(Options::default());
    let mut adapter = Client::connect(&bench.path, 1).unwrap();
    adapter.judge = AS_ADAPTER;
    let mut bare = Client::connect(&bench.path, 1).unwrap();
    let read_first = |client: &mut Client| {
        let mut byte = [0];
        client.transaction(
            0x69,
            &mut [Operation::Read(&mut byte), Operation::Write(&[0])],
        )
    };
    let error = read_first(&mut adapter).unwrap_err();
    assert!(matches!(error, Failure::Refused(95, _)), "{error:?}");
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
    let mut adapter = Client::connect(&bench.path, 1).unwrap();
    adapter.judge = AS_ADAPTER;
    let mut stale = [0x55];
    let error = adapter.write_read(0x30, &[4], &mut stale).unwrap_err();
    assert_eq!(error, Failure::Short(0));
    assert_eq!(stale, [0x55]);
}

#[test]
fn a_server_that_stops_says_so() {
    let mut bench = Bench::new(Options::default());
    let mut bus = Client::connect(&bench.path, 1).unwrap();
    bench.end();
    let stopping = Failure::Bye(5, "the server is stopping".to_owned());
    assert_eq!(bus.write(0x69, &[0]), Err(stopping));
    let error = Client::connect(&bench.path, 1).unwrap_err();
    assert_eq!(error, Failure::Lost(std::io::ErrorKind::NotFound));
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

impl EmulatedAdapter for Client {
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        let mut sent: Vec<_> = messages
            .iter_mut()
            .map(|message| {
                let operation = match &mut message.operation {
                    Operation::Read(buffer) => Operation::Read(buffer),
                    Operation::Write(bytes) => Operation::Write(bytes),
                };
                (
                    message.address,
                    TEN_BIT * u16::from(message.ten_bit),
                    operation,
                )
            })
            .collect();
        match Client::transfer(self, &mut sent) {
            Ok(()) => Ok(()),
            Err(Failure::Fault {
                fault, completed, ..
            }) => Err(TransferError {
                completed: completed.into(),
                fault: FAILING[usize::from(fault) - 1].1,
            }),
            Err(other) => panic!("{other:?}"),
        }
    }
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
