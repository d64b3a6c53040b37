//! A test caller with one open file, its memory, and a chip.

use crate::adapter::{Fault, HalAdapter};
use crate::ioctl::request::{I2C_RDWR, I2C_SLAVE_FORCE, I2C_SMBUS};
use crate::ioctl::{AdapterMode, CallerMemory, Errno, OpenFile, PointerWidth, message_flag};
use embedded_hal::i2c::{ErrorKind, ErrorType, I2c, Operation};

pub(super) const TARGET: u16 = 0x69;
/// The caller's address of the [`Memory`] array.
pub(super) const BASE: u64 = 0x7000_1000;
pub(super) const READ: u16 = message_flag::READ;

/// A caller with 64 KiB of memory and nothing else.
pub(super) struct Memory {
    pub(super) bytes: Vec<u8>,
    pub(super) width: PointerWidth,
    /// Memory from this address on is read-only.
    pub(super) read_only_from: u64,
}

impl Memory {
    pub(super) fn new(width: PointerWidth) -> Self {
        Self {
            bytes: vec![0xEE; 0x1_0000],
            width,
            read_only_from: u64::MAX,
        }
    }

    pub(super) fn range(&self, address: u64, length: usize) -> Option<std::ops::Range<usize>> {
        let start = usize::try_from(address.checked_sub(BASE)?).ok()?;
        let end = start.checked_add(length)?;
        (end <= self.bytes.len()).then_some(start..end)
    }

    pub(super) fn at(&self, address: u64, length: usize) -> &[u8] {
        &self.bytes[self.range(address, length).unwrap()]
    }

    pub(super) fn put(&mut self, address: u64, bytes: &[u8]) -> u64 {
        let range = self.range(address, bytes.len()).unwrap();
        self.bytes[range].copy_from_slice(bytes);
        address
    }

    pub(super) fn pointer(&self, address: u64) -> Vec<u8> {
        let low = u32::try_from(address & 0xFFFF_FFFF).unwrap();
        match self.width {
            PointerWidth::Bits64 => address.to_ne_bytes().to_vec(),
            PointerWidth::Bits32 => low.to_ne_bytes().to_vec(),
        }
    }

    /// `struct i2c_msg` by the C rules: 16 bytes for 64-bit programs, 12 for 32-bit ones.
    pub(super) fn put_messages(&mut self, address: u64, messages: &[(u16, u16, u16, u64)]) -> u64 {
        let message = |(target, flags, length, buffer): &(u16, u16, u16, u64)| {
            let front = [*target, *flags, *length, 0].map(u16::to_ne_bytes);
            [front.as_flattened(), &self.pointer(*buffer)].concat()
        };
        let bytes: Vec<u8> = messages.iter().flat_map(message).collect();
        self.put(address, &bytes)
    }

    /// `struct i2c_rdwr_ioctl_data`.
    pub(super) fn put_rdwr(&mut self, address: u64, messages: u64, count: u32) -> u64 {
        let bytes = [self.pointer(messages), count.to_ne_bytes().to_vec()].concat();
        let padding = self.width.bytes() - 4;
        self.put(address, &[bytes, vec![0; padding]].concat())
    }

    /// `struct i2c_smbus_ioctl_data`.
    pub(super) fn put_smbus(
        &mut self,
        address: u64,
        read_write: u8,
        command: u8,
        size: u32,
        data: u64,
    ) -> u64 {
        let front = [[read_write, command, 0xAA, 0xAA], size.to_ne_bytes()];
        let bytes = [front.as_flattened(), &self.pointer(data)].concat();
        self.put(address, &bytes)
    }
}

impl CallerMemory for Memory {
    fn read(&mut self, address: u64, into: &mut [u8]) -> Result<(), Errno> {
        let range = self.range(address, into.len()).ok_or(Errno::FAULT)?;
        into.copy_from_slice(&self.bytes[range]);
        Ok(())
    }

    fn write(&mut self, address: u64, bytes: &[u8]) -> Result<(), Errno> {
        let range = self.range(address, bytes.len()).ok_or(Errno::FAULT)?;
        if address + u64::try_from(bytes.len()).unwrap() > self.read_only_from {
            return Err(Errno::FAULT);
        }
        self.bytes[range].copy_from_slice(bytes);
        Ok(())
    }

    fn pointer_width(&self) -> PointerWidth {
        self.width
    }
}

/// 256 registers behind a pointer that advances. Records every message, and fails on demand.
pub(super) struct Chip {
    pub(super) registers: [u8; 256],
    pub(super) pointer: u8,
    pub(super) seen: Vec<String>,
    pub(super) faults: Vec<Fault>,
}

/// An error that carries its fault, because [`ErrorKind`] has no name for some.
#[derive(Debug)]
pub(super) struct ChipError(pub(super) Fault);

impl embedded_hal::i2c::Error for ChipError {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
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
            for operation in operations {
                if let Operation::Read(buffer) = operation {
                    buffer.fill(0x99);
                }
            }
            return Err(ChipError(fault));
        }
        let mut line = Vec::new();
        for operation in operations {
            match operation {
                Operation::Write(bytes) => {
                    let bytes_text = bytes.iter().map(|byte| format!(" {byte:02x}"));
                    line.push("W".to_owned() + &bytes_text.collect::<String>());
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

pub(super) struct Bench {
    pub(super) file: OpenFile,
    pub(super) memory: Memory,
    pub(super) adapter: HalAdapter<Chip, fn(&ChipError) -> Fault>,
}

impl Bench {
    pub(super) fn new(mode: AdapterMode) -> Self {
        Self::with_width(mode, PointerWidth::Bits64)
    }

    pub(super) fn with_width(mode: AdapterMode, width: PointerWidth) -> Self {
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
            adapter: HalAdapter::with_faults(chip, |error| error.0),
        };
        assert_eq!(bench.call(I2C_SLAVE_FORCE, TARGET.into()), Ok(0));
        bench
    }

    pub(super) fn call(&mut self, request: u32, argument: u64) -> Result<i32, Errno> {
        self.file
            .ioctl(request, argument, &mut self.memory, &mut self.adapter)
    }

    pub(super) fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Errno> {
        self.file.read(buffer, &mut self.adapter)
    }

    pub(super) fn write(&mut self, bytes: &[u8]) -> Result<usize, Errno> {
        self.file.write(bytes, &mut self.adapter)
    }

    /// I2C_RDWR of messages given as (target, flags, length, buffer).
    pub(super) fn rdwr(&mut self, messages: &[(u16, u16, u16, u64)]) -> Result<i32, Errno> {
        let array = self.memory.put_messages(BASE + 0x100, messages);
        let count = u32::try_from(messages.len()).unwrap();
        let argument = self.memory.put_rdwr(BASE, array, count);
        self.call(I2C_RDWR, argument)
    }

    /// I2C_SMBUS with its data at [`DATA`].
    pub(super) fn smbus(&mut self, read_write: u8, command: u8, size: u32) -> Result<i32, Errno> {
        let at = BASE + 0x40;
        let argument = self.memory.put_smbus(at, read_write, command, size, DATA);
        self.call(I2C_SMBUS, argument)
    }

    pub(super) fn seen(&mut self) -> Vec<String> {
        std::mem::take(&mut self.adapter.bus().seen)
    }

    pub(super) fn fail_with(&mut self, faults: &[Fault]) {
        self.adapter.bus().faults = faults.to_vec();
    }
}

pub(super) const DATA: u64 = BASE + 0x2000;
pub(super) const BUFFER: u64 = BASE + 0x4000;
