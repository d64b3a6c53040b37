//! The layer against a chip of 256 registers and a caller's memory that is a plain array.

use embedded_hal::i2c::{ErrorKind, ErrorType, I2c};
use proptest::prelude::*;

use super::request::{
    I2C_FUNCS, I2C_PEC, I2C_RDWR, I2C_RETRIES, I2C_SLAVE, I2C_SLAVE_FORCE, I2C_SMBUS, I2C_TENBIT,
    I2C_TIMEOUT,
};
use super::*;
use crate::adapter::{BusFault, Fault, HalAdapter};

const TARGET: u16 = 0x69;
/// Where the array of [`Memory`] begins in the caller's eyes.
const BASE: u64 = 0x7000_1000;
const READ: u16 = message_flag::READ;

/// A caller that has 64 KiB of memory and nothing else.
struct Memory {
    bytes: Vec<u8>,
    width: PointerWidth,
    /// From this address on it is read-only.
    read_only_from: u64,
}

impl Memory {
    fn new(width: PointerWidth) -> Self {
        Self {
            bytes: vec![0xEE; 0x1_0000],
            width,
            read_only_from: u64::MAX,
        }
    }

    fn range(&self, address: u64, length: usize) -> Option<std::ops::Range<usize>> {
        let start = usize::try_from(address.checked_sub(BASE)?).ok()?;
        let end = start.checked_add(length)?;
        (end <= self.bytes.len()).then_some(start..end)
    }

    fn at(&self, address: u64, length: usize) -> &[u8] {
        &self.bytes[self.range(address, length).unwrap()]
    }

    fn put(&mut self, address: u64, bytes: &[u8]) -> u64 {
        let range = self.range(address, bytes.len()).unwrap();
        self.bytes[range].copy_from_slice(bytes);
        address
    }

    fn pointer(&self, address: u64) -> Vec<u8> {
        match self.width {
            PointerWidth::Bits64 => address.to_ne_bytes().to_vec(),
            PointerWidth::Bits32 => u32::try_from(address & 0xFFFF_FFFF)
                .unwrap()
                .to_ne_bytes()
                .to_vec(),
        }
    }

    /// `struct i2c_msg` by the C rules: 16 bytes for 64-bit programs, 12 for 32-bit ones.
    fn put_messages(&mut self, address: u64, messages: &[(u16, u16, u16, u64)]) -> u64 {
        let bytes: Vec<u8> = messages
            .iter()
            .flat_map(|(target, flags, length, buffer)| {
                [
                    target.to_ne_bytes(),
                    flags.to_ne_bytes(),
                    length.to_ne_bytes(),
                    [0; 2],
                ]
                .concat()
                .into_iter()
                .chain(self.pointer(*buffer))
            })
            .collect();
        self.put(address, &bytes)
    }

    /// `struct i2c_rdwr_ioctl_data`.
    fn put_rdwr(&mut self, address: u64, messages: u64, count: u32) -> u64 {
        let bytes = [self.pointer(messages), count.to_ne_bytes().to_vec()].concat();
        let padding = self.width.bytes() - 4;
        self.put(address, &[bytes, vec![0; padding]].concat())
    }

    /// `struct i2c_smbus_ioctl_data`.
    fn put_smbus(
        &mut self,
        address: u64,
        read_write: u8,
        command: u8,
        size: u32,
        data: u64,
    ) -> u64 {
        let front = [
            vec![read_write, command, 0xAA, 0xAA],
            size.to_ne_bytes().to_vec(),
        ]
        .concat();
        self.put(address, &[front, self.pointer(data)].concat())
    }
}

impl CallerMemory for Memory {
    fn read(&mut self, address: u64, into: &mut [u8]) -> Result<(), Errno> {
        let range = self.range(address, into.len()).ok_or(Errno::EFAULT)?;
        into.copy_from_slice(&self.bytes[range]);
        Ok(())
    }

    fn write(&mut self, address: u64, bytes: &[u8]) -> Result<(), Errno> {
        let range = self.range(address, bytes.len()).ok_or(Errno::EFAULT)?;
        if address + u64::try_from(bytes.len()).unwrap() > self.read_only_from {
            return Err(Errno::EFAULT);
        }
        self.bytes[range].copy_from_slice(bytes);
        Ok(())
    }

    fn pointer_width(&self) -> PointerWidth {
        self.width
    }
}

/// 256 registers behind a pointer that moves on; writes down what reaches it, and fails on demand.
struct Chip {
    registers: [u8; 256],
    pointer: u8,
    seen: Vec<String>,
    faults: Vec<Fault>,
}

#[derive(Debug)]
struct ChipError(Fault);

impl embedded_hal::i2c::Error for ChipError {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl BusFault for ChipError {
    fn fault(&self) -> Fault {
        self.0
    }
}

impl ErrorType for Chip {
    type Error = ChipError;
}

impl I2c for Chip {
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), ChipError> {
        let absent = (u16::from(address) != TARGET).then_some(Fault::NackAddress);
        let planned = self.faults.pop();
        self.seen.extend(planned.map(|fault| format!("{fault:?}")));
        if let Some(fault) = planned.or(absent) {
            spoil(operations);
            return Err(ChipError(fault));
        }
        let mut line = Vec::new();
        for operation in operations {
            match operation {
                Operation::Write(bytes) => {
                    line.push(format!(
                        "W{}",
                        bytes
                            .iter()
                            .map(|byte| format!(" {byte:02x}"))
                            .collect::<String>()
                    ));
                    if let [pointer, bytes @ ..] = *bytes {
                        self.pointer = *pointer;
                        for byte in bytes {
                            self.registers[usize::from(self.pointer)] = *byte;
                            self.pointer = self.pointer.wrapping_add(1);
                        }
                    }
                }
                Operation::Read(buffer) => {
                    line.push(format!("R {}", buffer.len()));
                    for byte in buffer.iter_mut() {
                        *byte = self.registers[usize::from(self.pointer)];
                        self.pointer = self.pointer.wrapping_add(1);
                    }
                }
            }
        }
        self.seen.push(line.join(", "));
        Ok(())
    }
}

/// What a bus may have left in the buffers when it fails.
fn spoil(operations: &mut [Operation<'_>]) {
    for operation in operations {
        if let Operation::Read(buffer) = operation {
            buffer.fill(0x99);
        }
    }
}

/// A caller with one open file.
struct Bench {
    file: OpenFile,
    memory: Memory,
    adapter: HalAdapter<Chip, fn(&ChipError) -> Fault>,
}

impl Bench {
    fn new(mode: AdapterMode) -> Self {
        Self::with_width(mode, PointerWidth::Bits64)
    }

    fn with_width(mode: AdapterMode, width: PointerWidth) -> Self {
        let registers = std::array::from_fn(|register| u8::try_from(register).unwrap() ^ 0xFF);
        let chip = Chip {
            registers,
            pointer: 0,
            seen: Vec::new(),
            faults: Vec::new(),
        };
        let mut bench = Self {
            file: OpenFile::new(mode),
            memory: Memory::new(width),
            adapter: HalAdapter::with_bus_faults(chip),
        };
        assert_eq!(bench.call(I2C_SLAVE_FORCE, TARGET.into()), Ok(0));
        bench
    }

    fn call(&mut self, request: u32, argument: u64) -> Result<i32, Errno> {
        self.file
            .ioctl(request, argument, &mut self.memory, &mut self.adapter)
    }

    /// I2C_RDWR of messages given as (target, flags, length, buffer).
    fn rdwr(&mut self, messages: &[(u16, u16, u16, u64)]) -> Result<i32, Errno> {
        let array = self.memory.put_messages(BASE + 0x100, messages);
        let argument = self
            .memory
            .put_rdwr(BASE, array, u32::try_from(messages.len()).unwrap());
        self.call(I2C_RDWR, argument)
    }

    /// I2C_SMBUS with its data at [`DATA`].
    fn smbus(&mut self, read_write: u8, command: u8, size: u32) -> Result<i32, Errno> {
        let argument = self
            .memory
            .put_smbus(BASE + 0x40, read_write, command, size, DATA);
        self.call(I2C_SMBUS, argument)
    }

    fn seen(&mut self) -> Vec<String> {
        std::mem::take(&mut self.adapter.bus().seen)
    }

    fn fail_with(&mut self, faults: &[Fault]) {
        self.adapter.bus().faults = faults.to_vec();
    }
}

const DATA: u64 = BASE + 0x2000;
const BUFFER: u64 = BASE + 0x4000;

#[test]
fn an_address_has_seven_bits_or_ten() {
    let mut bench = Bench::new(AdapterMode::Pi);
    for request in [I2C_SLAVE, I2C_SLAVE_FORCE] {
        assert_eq!(bench.call(request, 0x7F), Ok(0));
        assert_eq!(bench.call(request, 0x80), Err(Errno::EINVAL));
        assert_eq!(bench.call(request, u64::MAX), Err(Errno::EINVAL));
        assert_eq!(bench.call(I2C_TENBIT, 1), Ok(0));
        assert_eq!(bench.call(request, 0x3FF), Ok(0));
        assert_eq!(bench.call(request, 0x400), Err(Errno::EINVAL));
        assert_eq!(bench.call(I2C_TENBIT, 0), Ok(0));
    }
}

#[test]
fn nobody_answers_to_ten_bit_addresses() {
    let mut bench = Bench::new(AdapterMode::Pi);
    bench.call(I2C_TENBIT, 1).unwrap();
    assert_eq!(
        bench.file.write(&[1], &mut bench.adapter),
        Err(Errno::EREMOTEIO)
    );
    bench.call(I2C_TENBIT, 0).unwrap();
    assert_eq!(bench.file.write(&[1], &mut bench.adapter), Ok(1));
    assert_eq!(
        bench.rdwr(&[(TARGET, message_flag::TEN_BIT, 0, 0)]),
        Err(Errno::EREMOTEIO)
    );
    assert_eq!(
        bench.rdwr(&[(TARGET | 0x100, 0, 0, 0)]),
        Err(Errno::EREMOTEIO)
    );
}

#[test]
fn a_busy_address_can_only_be_forced() {
    let mut bench = Bench::new(AdapterMode::Busy);
    assert_eq!(
        bench.call(I2C_SLAVE, 0x80),
        Err(Errno::EINVAL),
        "the range is looked at first"
    );
    assert_eq!(bench.call(I2C_SLAVE, TARGET.into()), Err(Errno::EBUSY));
    assert_eq!(bench.call(I2C_SLAVE_FORCE, TARGET.into()), Ok(0));
    assert_eq!(
        bench.rdwr(&[(TARGET, READ, 1, BUFFER)]),
        Ok(1),
        "I2C_RDWR asks no driver"
    );
}

#[test]
fn an_unknown_request_is_enotty() {
    let known = [
        I2C_RETRIES,
        I2C_TIMEOUT,
        I2C_SLAVE,
        I2C_TENBIT,
        I2C_FUNCS,
        I2C_SLAVE_FORCE,
        I2C_RDWR,
        I2C_PEC,
        I2C_SMBUS,
    ];
    assert_eq!(
        known,
        [
            0x701, 0x702, 0x703, 0x704, 0x705, 0x706, 0x707, 0x708, 0x720
        ]
    );
    let mut bench = Bench::new(AdapterMode::Pi);
    for request in (0x0700..0x0800).chain([0, 0x5401, 0x8004_0700, u32::MAX]) {
        if !known.contains(&request) {
            assert_eq!(
                bench.call(request, BASE),
                Err(Errno::ENOTTY),
                "{request:#x}"
            );
        }
    }
}

#[test]
fn retries_and_timeout_are_not_negative() {
    let mut bench = Bench::new(AdapterMode::Pi);
    let most = u64::try_from(i32::MAX).unwrap();
    for request in [I2C_RETRIES, I2C_TIMEOUT] {
        assert_eq!(bench.call(request, most), Ok(0));
        assert_eq!(bench.call(request, most + 1), Err(Errno::EINVAL));
        assert_eq!(bench.call(request, u64::MAX), Err(Errno::EINVAL));
    }
    assert_eq!(bench.call(I2C_TIMEOUT, 25), Ok(0));
    assert_eq!(
        bench.file.timeout(),
        Duration::from_millis(250),
        "the unit is 10 ms"
    );
}

#[test]
fn functionality_is_as_wide_as_a_long() {
    for (width, expected) in [
        (PointerWidth::Bits64, [0x09, 0, 0xFF, 0x0E, 0, 0, 0, 0]),
        (
            PointerWidth::Bits32,
            [0x09, 0, 0xFF, 0x0E, 0xEE, 0xEE, 0xEE, 0xEE],
        ),
    ] {
        let mut bench = Bench::with_width(AdapterMode::Pi, width);
        assert_eq!(bench.call(I2C_FUNCS, DATA), Ok(0));
        assert_eq!(bench.memory.at(DATA, 8), expected, "{width:?}");
        assert_eq!(bench.call(I2C_FUNCS, 0), Err(Errno::EFAULT));
    }
}

#[test]
fn a_write_and_a_read_are_one_transaction_in_both_layouts() {
    for width in [PointerWidth::Bits64, PointerWidth::Bits32] {
        let mut bench = Bench::with_width(AdapterMode::Pi, width);
        bench.memory.put(DATA, &[0x80]);
        assert_eq!(
            bench.rdwr(&[(TARGET, 0, 1, DATA), (TARGET, READ, 128, BUFFER)]),
            Ok(2)
        );
        assert_eq!(bench.seen(), ["W 80, R 128"]);
        let expected: Vec<u8> = (0..0x80).rev().collect();
        assert_eq!(bench.memory.at(BUFFER, 128), expected, "{width:?}");
        assert_eq!(bench.memory.at(BUFFER + 128, 1), [0xEE], "not a byte more");
    }
}

/// The kernel copies from any address; only what is not there is a fault.
#[test]
fn unaligned_pointers_are_as_good_as_any() {
    let mut bench = Bench::new(AdapterMode::Pi);
    let array = bench
        .memory
        .put_messages(BASE + 0x101, &[(TARGET, READ, 1, BUFFER + 3)]);
    let argument = bench.memory.put_rdwr(BASE + 7, array, 1);
    assert_eq!(bench.call(I2C_RDWR, argument), Ok(1));
    assert_eq!(bench.memory.at(BUFFER + 3, 1), [0xFF]);
}

#[test]
fn a_transfer_has_1_to_42_messages_of_at_most_8192_bytes() {
    let mut bench = Bench::new(AdapterMode::Pi);
    let message = (TARGET, 0, 0, 0);
    assert_eq!(bench.rdwr(&[message; 42]), Ok(42));
    assert_eq!(bench.rdwr(&[message; 43]), Err(Errno::EINVAL));
    assert_eq!(bench.rdwr(&[]), Err(Errno::EINVAL));
    let argument = bench.memory.put_rdwr(BASE, BASE + 0x100, u32::MAX);
    assert_eq!(bench.call(I2C_RDWR, argument), Err(Errno::EINVAL));
    assert_eq!(bench.rdwr(&[(TARGET, READ, 8192, BUFFER)]), Ok(1));
    bench.seen();
    assert_eq!(
        bench.rdwr(&[message, (TARGET, READ, 8193, BUFFER)]),
        Err(Errno::EINVAL)
    );
    assert_eq!(bench.seen(), [""; 0], "nothing of it reaches the bus");
}

#[test]
fn a_pointer_that_leads_nowhere_stops_a_transfer_before_the_bus() {
    let end = BASE + 0x1_0000;
    let mut bench = Bench::new(AdapterMode::Pi);
    for argument in [0, 1, BASE - 1, end, end - 15, u64::MAX, u64::MAX - 8] {
        assert_eq!(
            bench.call(I2C_RDWR, argument),
            Err(Errno::EFAULT),
            "{argument:#x}"
        );
        assert_eq!(
            bench.call(I2C_SMBUS, argument),
            Err(Errno::EFAULT),
            "{argument:#x}"
        );
    }
    let null = bench.memory.put_rdwr(BASE, 0, 1);
    assert_eq!(
        bench.call(I2C_RDWR, null),
        Err(Errno::EINVAL),
        "a null array is a wrong value to the kernel"
    );
    for array in [1, end - 15, u64::MAX] {
        let argument = bench.memory.put_rdwr(BASE, array, 1);
        assert_eq!(
            bench.call(I2C_RDWR, argument),
            Err(Errno::EFAULT),
            "{array:#x}"
        );
    }
    for buffer in [0, end - 1, u64::MAX] {
        assert_eq!(
            bench.rdwr(&[(TARGET, 0, 1, DATA), (TARGET, READ, 2, buffer)]),
            Err(Errno::EFAULT),
            "{buffer:#x}"
        );
    }
    assert_eq!(bench.seen(), [""; 0]);
    assert_eq!(
        bench.rdwr(&[(TARGET, 0, 0, 0)]),
        Ok(1),
        "a message of no bytes needs no buffer"
    );
}

#[test]
fn a_buffer_that_may_not_be_written_is_efault_after_the_transfer() {
    let mut bench = Bench::new(AdapterMode::Pi);
    bench.memory.read_only_from = BUFFER;
    assert_eq!(bench.rdwr(&[(TARGET, READ, 1, BUFFER)]), Err(Errno::EFAULT));
    assert_eq!(bench.seen(), ["R 1"]);
    assert_eq!(
        bench.rdwr(&[(TARGET, 0, 1, BUFFER)]),
        Ok(1),
        "sending from it is no fault"
    );
}

#[test]
fn only_a_raspberry_pi_refuses_a_read_that_is_not_last() {
    let write = (TARGET, 0, 1, DATA);
    let read = (TARGET, READ, 1, BUFFER);
    for (messages, fits_a_pi) in [
        (vec![write], true),
        (vec![read], true),
        (vec![write, read], true),
        (vec![write, write, read], true),
        (vec![read, write], false),
        (vec![read, read], false),
        (vec![write, read, write], false),
        (vec![write, read, write, read], false),
    ] {
        let count = i32::try_from(messages.len()).unwrap();
        for mode in [AdapterMode::Pi, AdapterMode::Busy] {
            let mut bench = Bench::new(mode);
            let expected = if fits_a_pi {
                Ok(count)
            } else {
                Err(Errno::EOPNOTSUPP)
            };
            assert_eq!(bench.rdwr(&messages), expected, "{mode} {messages:?}");
            assert_eq!(
                bench.seen().is_empty(),
                !fits_a_pi,
                "what is refused does not reach the bus"
            );
        }
        for mode in [AdapterMode::Pi5, AdapterMode::Usb, AdapterMode::Virtio] {
            assert_eq!(
                Bench::new(mode).rdwr(&messages),
                Ok(count),
                "{mode} {messages:?}"
            );
        }
    }
}

#[test]
fn a_usb_adapter_refuses_a_read_of_no_bytes() {
    let mut usb = Bench::new(AdapterMode::Usb);
    assert_eq!(usb.rdwr(&[(TARGET, READ, 0, 0)]), Err(Errno::EOPNOTSUPP));
    assert_eq!(usb.smbus(1, 0, smbus_size::QUICK), Err(Errno::EOPNOTSUPP));
    assert_eq!(usb.smbus(0, 0, smbus_size::QUICK), Ok(0));
    assert_eq!(
        Bench::new(AdapterMode::Pi).rdwr(&[(TARGET, READ, 0, 0)]),
        Ok(1)
    );
}

/// Each fault by each of the four ways to the bus. The numbers are those of the kernel's drivers.
#[test]
fn a_fault_has_the_errno_of_the_mode_by_every_way() {
    use Fault::{Bus, Gone, NackAddress, NackData, Timeout};
    for (mode, fault, errno) in [
        (AdapterMode::Pi, NackAddress, 121),
        (AdapterMode::Pi, NackData, 121),
        (AdapterMode::Pi, Timeout, 110),
        (AdapterMode::Pi, Bus, 5),
        (AdapterMode::Pi, Gone, 19),
        (AdapterMode::Pi5, NackAddress, 121),
        (AdapterMode::Usb, NackAddress, 6),
        (AdapterMode::Usb, Timeout, 5),
        (AdapterMode::Gone, NackAddress, 19),
    ] {
        let failing = |way: fn(&mut Bench) -> Result<usize, Errno>| {
            let mut bench = Bench::new(mode);
            bench.fail_with(&[fault; 1]);
            way(&mut bench).map_err(Errno::raw)
        };
        assert_eq!(
            failing(|bench| bench.file.read(&mut [0; 4], &mut bench.adapter)),
            Err(errno),
            "{mode} {fault:?}"
        );
        assert_eq!(
            failing(|bench| bench.file.write(&[0; 4], &mut bench.adapter)),
            Err(errno),
            "{mode} {fault:?}"
        );
        let messages = [(TARGET, 0, 1, DATA), (TARGET, READ, 4, BUFFER)];
        let mut bench = Bench::new(mode);
        bench.fail_with(&[fault]);
        assert_eq!(
            bench.rdwr(&messages).map_err(Errno::raw),
            Err(errno),
            "{mode} {fault:?}"
        );
        assert_eq!(
            bench.memory.at(BUFFER, 4),
            [0xEE; 4],
            "after an errno no buffer is touched"
        );
        bench.fail_with(&[fault]);
        assert_eq!(
            bench
                .smbus(1, 0x10, smbus_size::BYTE_DATA)
                .map_err(Errno::raw),
            Err(errno),
            "{mode} {fault:?}"
        );
        assert_eq!(bench.memory.at(DATA, 1), [0xEE]);
    }
}

#[test]
fn a_working_adapter_that_is_gone_reaches_nothing() {
    let mut bench = Bench::new(AdapterMode::Gone);
    assert_eq!(bench.rdwr(&[(TARGET, READ, 1, BUFFER)]), Err(Errno::ENODEV));
    assert_eq!(bench.seen(), [""; 0]);
}

/// The trap of i2c-virtio: no errno, a smaller count, and the caller's old bytes in the buffer.
#[test]
fn virtio_hides_a_fault_in_the_count() {
    let mut bench = Bench::new(AdapterMode::Virtio);
    let missing = 0x10;
    assert_eq!(
        bench.rdwr(&[(missing, 0, 1, DATA), (missing, READ, 4, BUFFER)]),
        Ok(0)
    );
    assert_eq!(bench.memory.at(BUFFER, 4), [0xEE; 4]);
    assert_eq!(
        bench.rdwr(&[(TARGET, READ, 2, BUFFER), (missing, READ, 2, BUFFER + 2)]),
        Ok(1)
    );
    assert_eq!(
        bench.memory.at(BUFFER, 4),
        [0xFF, 0xFE, 0xEE, 0xEE],
        "what did arrive is handed over"
    );
    bench.call(I2C_SLAVE, missing.into()).unwrap();
    assert_eq!(bench.file.read(&mut [0; 4], &mut bench.adapter), Ok(0));
    assert_eq!(bench.file.write(&[1, 2], &mut bench.adapter), Ok(0));
    assert_eq!(
        bench.smbus(1, 0, smbus_size::BYTE_DATA),
        Err(Errno::EIO),
        "SMBus does count"
    );
}

#[test]
fn an_smbus_only_adapter_has_no_plain_messages() {
    let mut bench = Bench::new(AdapterMode::SmbusOnly);
    assert_eq!(
        bench.rdwr(&[(TARGET, READ, 1, BUFFER)]),
        Err(Errno::EOPNOTSUPP)
    );
    assert_eq!(
        bench.rdwr(&[]),
        Err(Errno::EINVAL),
        "values are looked at first"
    );
    assert_eq!(
        bench.file.read(&mut [0], &mut bench.adapter),
        Err(Errno::EOPNOTSUPP)
    );
    assert_eq!(
        bench.file.write(&[0], &mut bench.adapter),
        Err(Errno::EOPNOTSUPP)
    );
    assert_eq!(bench.seen(), [""; 0]);
    assert_eq!(bench.smbus(1, 0x10, smbus_size::BYTE_DATA), Ok(0));
    assert_eq!(bench.memory.at(DATA, 1), [0xEF]);
}

#[test]
fn lost_arbitration_is_tried_again_where_the_driver_says_so() {
    let lost = Fault::ArbitrationLost;
    let mut bench = Bench::new(AdapterMode::Pi5);
    bench.fail_with(&[lost; 3]);
    assert_eq!(
        bench.rdwr(&[(TARGET, READ, 1, BUFFER)]),
        Ok(1),
        "three retries by default"
    );
    bench.fail_with(&[lost; 4]);
    assert_eq!(bench.rdwr(&[(TARGET, READ, 1, BUFFER)]), Err(Errno::EAGAIN));
    bench.call(I2C_RETRIES, 0).unwrap();
    bench.fail_with(&[lost]);
    assert_eq!(bench.rdwr(&[(TARGET, READ, 1, BUFFER)]), Err(Errno::EAGAIN));

    let mut pi = Bench::new(AdapterMode::Pi);
    pi.call(I2C_RETRIES, 3).unwrap();
    pi.fail_with(&[lost]);
    assert_eq!(
        pi.rdwr(&[(TARGET, READ, 1, BUFFER)]),
        Err(Errno::EIO),
        "a Raspberry Pi knows no arbitration"
    );
}

#[test]
fn retries_are_bounded() {
    let mut bench = Bench::new(AdapterMode::Pi5);
    bench
        .call(I2C_RETRIES, u64::try_from(i32::MAX).unwrap())
        .unwrap();
    bench.fail_with(&[Fault::ArbitrationLost; 5000]);
    assert_eq!(bench.rdwr(&[(TARGET, READ, 1, BUFFER)]), Err(Errno::EAGAIN));
    assert_eq!(
        bench.seen().len(),
        usize::try_from(RETRIES_DONE_MAX).unwrap() + 1
    );
}

#[test]
fn plain_read_and_write_are_one_message_of_at_most_8192_bytes() {
    let mut bench = Bench::new(AdapterMode::Pi);
    assert_eq!(bench.file.write(&[0x20, 1, 2], &mut bench.adapter), Ok(3));
    let mut buffer = [0xEE; 9000];
    assert_eq!(bench.file.read(&mut buffer, &mut bench.adapter), Ok(8192));
    assert_eq!(bench.file.write(&[0; 9000], &mut bench.adapter), Ok(8192));
    assert_eq!(bench.file.read(&mut [], &mut bench.adapter), Ok(0));
    let seen = bench.seen();
    assert_eq!(seen[..2], ["W 20 01 02", "R 8192"]);
    assert_eq!(seen[2].len(), 1 + 3 * 8192);
    assert_eq!(buffer[8192..], [0xEE; 808]);
}

/// A fresh file has the address 0, the general call, to which this chip does not listen.
#[test]
fn a_fresh_file_has_no_target() {
    let mut bench = Bench::new(AdapterMode::Pi);
    bench.file = OpenFile::new(AdapterMode::Pi);
    assert_eq!(
        bench.file.read(&mut [0], &mut bench.adapter),
        Err(Errno::EREMOTEIO)
    );
}

/// Message by message, as the table of SMBus protocols in the kernel's `Documentation/i2c/smbus-protocol.rst` has them.
#[test]
fn each_smbus_call_is_made_of_the_right_messages() {
    let block = [3, 0xA1, 0xA2, 0xA3];
    for (read_write, size, data, expected) in [
        (0, smbus_size::QUICK, &[][..], "W"),
        (1, smbus_size::QUICK, &[], "R 0"),
        (0, smbus_size::BYTE, &[], "W 10"),
        (1, smbus_size::BYTE, &[], "R 1"),
        (0, smbus_size::BYTE_DATA, &[0xA1], "W 10 a1"),
        (1, smbus_size::BYTE_DATA, &[], "W 10, R 1"),
        (0, smbus_size::WORD_DATA, &[0xA1, 0xA2], "W 10 a1 a2"),
        (1, smbus_size::WORD_DATA, &[], "W 10, R 2"),
        (0, smbus_size::PROC_CALL, &[0xA1, 0xA2], "W 10 a1 a2, R 2"),
        (1, smbus_size::PROC_CALL, &[0xA1, 0xA2], "W 10 a1 a2, R 2"),
        (0, smbus_size::BLOCK_DATA, &block, "W 10 03 a1 a2 a3"),
        (0, smbus_size::I2C_BLOCK_DATA, &block, "W 10 a1 a2 a3"),
        (1, smbus_size::I2C_BLOCK_DATA, &[3], "W 10, R 3"),
        (0, smbus_size::I2C_BLOCK_BROKEN, &block, "W 10 a1 a2 a3"),
        (1, smbus_size::I2C_BLOCK_BROKEN, &[], "W 10, R 32"),
    ] {
        for width in [PointerWidth::Bits64, PointerWidth::Bits32] {
            let mut bench = Bench::with_width(AdapterMode::Pi, width);
            bench.memory.put(DATA, data);
            assert_eq!(bench.smbus(read_write, 0x10, size), Ok(0), "{expected}");
            assert_eq!(bench.seen(), [expected], "{width:?}");
        }
    }
}

#[test]
fn smbus_answers_arrive_where_they_belong() {
    let mut bench = Bench::new(AdapterMode::Pi);
    for (size, before, expected) in [
        (smbus_size::BYTE_DATA, &[][..], &[0xEF, 0xEE][..]),
        (smbus_size::WORD_DATA, &[], &[0xEF, 0xEE, 0xEE]),
        (smbus_size::I2C_BLOCK_DATA, &[3], &[3, 0xEF, 0xEE, 0xED]),
    ] {
        bench.memory.put(DATA, &[0xEE; 8]);
        bench.memory.put(DATA, before);
        bench.smbus(1, 0x10, size).unwrap();
        assert_eq!(bench.memory.at(DATA, expected.len()), expected);
    }
    bench.memory.put(DATA, &[7; 8]);
    bench.smbus(0, 0x10, smbus_size::WORD_DATA).unwrap();
    assert_eq!(
        bench.memory.at(DATA, 8),
        [7; 8],
        "a write leaves the caller's data alone"
    );
}

#[test]
fn a_block_that_tells_its_length_needs_an_adapter_that_can() {
    let mut pi = Bench::new(AdapterMode::Pi);
    assert_eq!(
        pi.smbus(1, 0x10, smbus_size::BLOCK_DATA),
        Err(Errno::EOPNOTSUPP)
    );
    assert_eq!(pi.seen(), [""; 0]);
    let mut pi5 = Bench::new(AdapterMode::Pi5);
    pi5.adapter.bus().registers[0x10..0x14].copy_from_slice(&[3, 0xB1, 0xB2, 0xB3]);
    assert_eq!(pi5.smbus(1, 0x10, smbus_size::BLOCK_DATA), Ok(0));
    assert_eq!(pi5.memory.at(DATA, 4), [3, 0xB1, 0xB2, 0xB3]);
    for right in [1, 32] {
        pi5.adapter.bus().registers[0x10] = right;
        assert_eq!(pi5.smbus(1, 0x10, smbus_size::BLOCK_DATA), Ok(0), "{right}");
    }
    for wrong in [0, 33, 255] {
        pi5.adapter.bus().registers[0x10] = wrong;
        assert_eq!(
            pi5.smbus(1, 0x10, smbus_size::BLOCK_DATA),
            Err(Errno::EPROTO),
            "{wrong}"
        );
    }
    pi5.adapter.bus().registers[0x13..0x16].copy_from_slice(&[2, 0xC1, 0xC2]);
    pi5.memory.put(DATA, &[2, 1, 1]);
    assert_eq!(
        pi5.smbus(0, 0x10, smbus_size::BLOCK_PROC_CALL),
        Ok(0),
        "3 bytes there move the pointer to 0x13"
    );
    assert_eq!(pi5.memory.at(DATA, 3), [2, 0xC1, 0xC2]);
}

#[test]
fn rdwr_can_ask_the_target_for_the_length() {
    let length_first = READ | message_flag::LENGTH_FIRST;
    let mut bench = Bench::new(AdapterMode::Pi5);
    bench.adapter.bus().registers[..4].copy_from_slice(&[3, 0xB1, 0xB2, 0xB3]);
    bench.memory.put(BUFFER, &[1]);
    assert_eq!(bench.rdwr(&[(TARGET, length_first, 33, BUFFER)]), Ok(1));
    assert_eq!(bench.memory.at(BUFFER, 5), [3, 0xB1, 0xB2, 0xB3, 0xEE]);
    for (first, length, flags) in [
        (0, 33, length_first),
        (1, 32, length_first),
        (2, 33, length_first),
        (1, 33, message_flag::LENGTH_FIRST),
    ] {
        bench.memory.put(BUFFER, &[first]);
        assert_eq!(
            bench.rdwr(&[(TARGET, flags, length, BUFFER)]),
            Err(Errno::EINVAL),
            "{first} {length}"
        );
    }
    let mut pi = Bench::new(AdapterMode::Pi);
    pi.memory.put(BUFFER, &[1]);
    assert_eq!(
        pi.rdwr(&[(TARGET, length_first, 33, BUFFER)]),
        Err(Errno::EOPNOTSUPP)
    );
}

#[test]
fn smbus_values_out_of_range_are_einval() {
    let mut bench = Bench::new(AdapterMode::Pi);
    for size in [9, 10, u32::MAX] {
        assert_eq!(bench.smbus(1, 0, size), Err(Errno::EINVAL), "{size}");
    }
    for read_write in [2, 255] {
        assert_eq!(
            bench.smbus(read_write, 0, smbus_size::QUICK),
            Err(Errno::EINVAL)
        );
    }
    let null = bench.memory.put_smbus(BASE, 1, 0, smbus_size::BYTE_DATA, 0);
    assert_eq!(
        bench.call(I2C_SMBUS, null),
        Err(Errno::EINVAL),
        "null data is a wrong value to the kernel"
    );
    let quick = bench.memory.put_smbus(BASE, 0, 0, smbus_size::QUICK, 0);
    assert_eq!(bench.call(I2C_SMBUS, quick), Ok(0), "quick has no data");
    let nowhere = bench.memory.put_smbus(BASE, 0, 0, smbus_size::BYTE_DATA, 8);
    assert_eq!(bench.call(I2C_SMBUS, nowhere), Err(Errno::EFAULT));
    bench.seen();
    for size in [
        smbus_size::BLOCK_DATA,
        smbus_size::I2C_BLOCK_DATA,
        smbus_size::I2C_BLOCK_BROKEN,
    ] {
        bench.memory.put(DATA, &[33]);
        assert_eq!(bench.smbus(0, 0, size), Err(Errno::EINVAL), "{size}");
        bench.memory.put(DATA, &[32]);
        assert_eq!(bench.smbus(0, 0, size), Ok(0), "{size}");
    }
    assert_eq!(
        bench.seen().len(),
        3,
        "only what is in range reaches the bus"
    );
}

/// The worked examples of the MLX90614's datasheet (SMBus communication): target 0x5A, read of 0x07 gives 0x3AD2 with
/// the checksum 0x30; a write of 0xC807 to 0x22 carries 0x48.
#[test]
fn checksums_are_those_of_a_printed_example() {
    struct Mlx90614 {
        written: Vec<u8>,
        checksum: u8,
    }
    impl EmulatedAdapter for Mlx90614 {
        fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
            for message in messages {
                assert_eq!(message.address, 0x5A);
                match &mut message.operation {
                    Operation::Write(bytes) => self.written = bytes.to_vec(),
                    Operation::Read(buffer) => buffer.copy_from_slice(&[0xD2, 0x3A, self.checksum]),
                }
            }
            Ok(())
        }
    }
    let mut device = Mlx90614 {
        written: Vec::new(),
        checksum: 0x30,
    };
    let mut memory = Memory::new(PointerWidth::Bits64);
    let mut file = OpenFile::new(AdapterMode::Pi);
    file.ioctl(I2C_SLAVE, 0x5A, &mut memory, &mut device)
        .unwrap();
    file.ioctl(I2C_PEC, 1, &mut memory, &mut device).unwrap();
    let read = memory.put_smbus(BASE, 1, 0x07, smbus_size::WORD_DATA, DATA);
    assert_eq!(file.ioctl(I2C_SMBUS, read, &mut memory, &mut device), Ok(0));
    assert_eq!(memory.at(DATA, 3), [0xD2, 0x3A, 0xEE]);
    device.checksum = 0x31;
    assert_eq!(
        file.ioctl(I2C_SMBUS, read, &mut memory, &mut device),
        Err(Errno::EBADMSG)
    );
    memory.put(DATA, &[0x07, 0xC8]);
    let write = memory.put_smbus(BASE, 0, 0x22, smbus_size::WORD_DATA, DATA);
    assert_eq!(
        file.ioctl(I2C_SMBUS, write, &mut memory, &mut device),
        Ok(0)
    );
    assert_eq!(device.written, [0x22, 0x07, 0xC8, 0x48]);
    file.ioctl(I2C_PEC, 0, &mut memory, &mut device).unwrap();
    file.ioctl(I2C_SMBUS, write, &mut memory, &mut device)
        .unwrap();
    assert_eq!(device.written, [0x22, 0x07, 0xC8]);
}

/// Pointers that lead somewhere more often than not.
fn pointer() -> impl Strategy<Value = u64> {
    prop_oneof![8 => BASE..BASE + 0x1_0000, 1 => any::<u64>(), 1 => Just(0), 1 => BASE + 0xFF00..BASE + 0x1_0100]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Whatever a program asks, and whatever its memory holds: an answer of the documented kind, and no panic.
    #[test]
    fn no_request_can_break_the_layer(
        mode in prop::sample::select(AdapterMode::ALL.to_vec()),
        width in prop::sample::select(vec![PointerWidth::Bits32, PointerWidth::Bits64]),
        faults in prop::collection::vec(prop::sample::select(vec![Fault::NackAddress, Fault::ArbitrationLost, Fault::Timeout]), 0..4),
        calls in prop::collection::vec((prop_oneof![8 => 0x0700..0x0722u32, 1 => any::<u32>()], pointer(), any::<u8>()), 1..12),
        smbus in (0..3u8, any::<u8>(), 0..10u32, pointer()),
        messages in prop::collection::vec((any::<u16>(), any::<u16>(), any::<u16>(), pointer()), 0..5),
        filling in prop::collection::vec(any::<u8>(), 64),
    ) {
        let mut bench = Bench::with_width(mode, width);
        bench.fail_with(&faults);
        bench.memory.put(DATA, &filling);
        let mut outcomes = Vec::new();
        for (request, argument, value) in calls {
            let argument = if value & 1 == 0 { argument } else { u64::from(value) };
            outcomes.push(bench.call(request, argument));
        }
        let argument = bench.memory.put_smbus(BASE + 0x40, smbus.0, smbus.1, smbus.2, smbus.3);
        outcomes.push(bench.call(I2C_SMBUS, argument));
        outcomes.push(bench.rdwr(&messages));
        for outcome in outcomes {
            match outcome {
                Ok(count) => prop_assert!((0..=42).contains(&count)),
                Err(errno) => prop_assert!(
                    [5, 6, 11, 14, 16, 19, 22, 25, 71, 74, 95, 110, 121].contains(&errno.raw()),
                    "errno {errno:?}"
                ),
            }
        }
    }
}
