//! I2C_SMBUS made from plain messages, like the kernel's `i2c_smbus_xfer_emulated`.

use super::open_file::OpenFile;
use super::segment::Segment;
use super::uapi::{
    CallerMemory, SMBUS_BLOCK_MAX, SMBUS_DATA_BYTES, SmbusArgument, functionality,
    smbus_size as size,
};
use crate::adapter::EmulatedAdapter;
use rustix::io::Errno;

const WRITE: u8 = 0;
const READ: u8 = 1;

/// `union i2c_smbus_data`: a byte, a word with its low byte first, or a block after its length.
type Data = [u8; SMBUS_DATA_BYTES];

impl OpenFile {
    pub(super) fn smbus(
        &self,
        argument: u64,
        memory: &mut dyn CallerMemory,
        bus: &mut dyn EmulatedAdapter,
    ) -> Result<i32, Errno> {
        let width = memory.pointer_width();
        let mut bytes = vec![0; SmbusArgument::bytes(width)];
        memory.read(argument, &mut bytes)?;
        let call = SmbusArgument::parse(&bytes, width);
        check_ranges(&call)?;
        if uses_data(&call) && call.data == 0 {
            return Err(Errno::INVAL);
        }
        let mut data: Data = [0; SMBUS_DATA_BYTES];
        let copied = &mut data[..data_length(call.size)];
        if goes_in(&call) {
            memory.read(call.data, copied)?;
        }
        self.smbus_transfer(&call, &mut data, bus)?;
        if comes_back(&call) {
            memory.write(call.data, &data[..data_length(call.size)])?;
        }
        Ok(0)
    }

    /// I2C_SMBUS with a union that was already fetched.
    pub(crate) fn smbus_call(
        &self,
        call: &SmbusArgument,
        union: &mut Data,
        bus: &mut dyn EmulatedAdapter,
    ) -> Result<(), Errno> {
        check_ranges(call)?;
        let mut data: Data = [0; SMBUS_DATA_BYTES];
        let copied = ..data_length(call.size);
        if goes_in(call) {
            data[copied].copy_from_slice(&union[copied]);
        }
        self.smbus_transfer(call, &mut data, bus)?;
        if comes_back(call) {
            union[copied].copy_from_slice(&data[copied]);
        }
        Ok(())
    }

    fn smbus_transfer(
        &self,
        call: &SmbusArgument,
        data: &mut Data,
        bus: &mut dyn EmulatedAdapter,
    ) -> Result<(), Errno> {
        let mut kind = call.size;
        if kind == size::I2C_BLOCK_BROKEN {
            kind = size::I2C_BLOCK_DATA;
            if call.read_write == READ {
                data[0] = 32;
            }
        }
        let checksum = self.pec && !matches!(kind, size::QUICK | size::I2C_BLOCK_DATA);
        let mut segments = self.smbus_messages(kind, call, data)?;
        if checksum {
            add_checksum(&mut segments);
        }
        if self.transfer_segments(&mut segments, bus)? != segments.len() {
            return Err(Errno::IO);
        }
        if checksum {
            check_checksum(&mut segments)?;
        }
        if let Some(last) = segments.last().filter(|last| last.read) {
            take_answer(kind, last, data)?;
        }
        Ok(())
    }

    fn smbus_messages(
        &self,
        kind: u32,
        call: &SmbusArgument,
        data: &Data,
    ) -> Result<Vec<Segment>, Errno> {
        let block = usize::from(data[0]);
        let with_payload = |length: usize| [&[call.command], &data[..length]].concat();
        let is_read = call.read_write == READ;
        Ok(match (kind, is_read) {
            (size::QUICK, _) => vec![self.segment(is_read, Vec::new())],
            (size::BYTE, true) => vec![self.segment(true, vec![0])],
            (size::BYTE, false) => vec![self.segment(false, vec![call.command])],
            (size::BYTE_DATA, true) => self.ask(vec![call.command], 1),
            (size::BYTE_DATA, false) => vec![self.segment(false, with_payload(1))],
            (size::WORD_DATA, true) => self.ask(vec![call.command], 2),
            (size::WORD_DATA, false) => vec![self.segment(false, with_payload(2))],
            (size::PROC_CALL, _) => self.ask(with_payload(2), 2),
            (size::BLOCK_DATA, true) => self.ask_for_block(vec![call.command])?,
            (size::BLOCK_DATA, false) => {
                vec![self.segment(false, with_payload(1 + checked(block)?))]
            }
            (size::BLOCK_PROC_CALL, _) => self.ask_for_block(with_payload(1 + checked(block)?))?,
            (size::I2C_BLOCK_DATA, true) => self.ask(vec![call.command], checked(block)?),
            (size::I2C_BLOCK_DATA, false) => {
                let payload = [&[call.command], &data[1..=checked(block)?]].concat();
                vec![self.segment(false, payload)]
            }
            _ => return Err(Errno::OPNOTSUPP),
        })
    }

    fn ask(&self, question: Vec<u8>, length: usize) -> Vec<Segment> {
        vec![
            self.segment(false, question),
            self.segment(true, vec![0; length]),
        ]
    }

    fn ask_for_block(&self, question: Vec<u8>) -> Result<Vec<Segment>, Errno> {
        if !self.mode.offers(functionality::SMBUS_READ_BLOCK) {
            return Err(Errno::OPNOTSUPP);
        }
        let mut segments = self.ask(question, 1 + SMBUS_BLOCK_MAX);
        if let Some(answer) = segments.last_mut() {
            answer.length_first = Some(1);
        }
        Ok(segments)
    }

    fn segment(&self, read: bool, bytes: Vec<u8>) -> Segment {
        Segment::new(self.address, self.ten_bit, read, bytes)
    }
}

fn check_ranges(call: &SmbusArgument) -> Result<(), Errno> {
    let known = call.size <= size::I2C_BLOCK_DATA && matches!(call.read_write, READ | WRITE);
    known.then_some(()).ok_or(Errno::INVAL)
}

fn uses_data(call: &SmbusArgument) -> bool {
    call.size != size::QUICK && !(call.size == size::BYTE && call.read_write == WRITE)
}

fn goes_in(call: &SmbusArgument) -> bool {
    let both_ways = matches!(
        call.size,
        size::PROC_CALL | size::BLOCK_PROC_CALL | size::I2C_BLOCK_DATA
    );
    both_ways || call.read_write == WRITE && uses_data(call)
}

fn comes_back(call: &SmbusArgument) -> bool {
    let both_ways = matches!(call.size, size::PROC_CALL | size::BLOCK_PROC_CALL);
    both_ways || call.read_write == READ && uses_data(call)
}

/// How much of the union the kernel copies.
fn data_length(kind: u32) -> usize {
    match kind {
        size::BYTE | size::BYTE_DATA => 1,
        size::WORD_DATA | size::PROC_CALL => 2,
        _ => SMBUS_DATA_BYTES,
    }
}

fn checked(block: usize) -> Result<usize, Errno> {
    let fits = block <= SMBUS_BLOCK_MAX;
    fits.then_some(block).ok_or(Errno::INVAL)
}

fn take_answer(kind: u32, answer: &Segment, data: &mut Data) -> Result<(), Errno> {
    let arrived = answer.arrived()?;
    let offset = usize::from(kind == size::I2C_BLOCK_DATA);
    for (to, from) in data.iter_mut().skip(offset).zip(arrived) {
        *to = *from;
    }
    Ok(())
}

/// Appends the checksum to a lone write, or makes room for the target's checksum.
fn add_checksum(segments: &mut [Segment]) {
    let checksum = segments.iter().fold(0, checksum_of_message);
    if let Some(last) = segments.last_mut() {
        if last.read {
            last.length_first = last.length_first.map(|extra| extra + 1);
            last.bytes.push(0);
        } else {
            last.bytes.push(checksum);
        }
    }
}

/// Removes the target's checksum from the last message and compares it.
fn check_checksum(segments: &mut [Segment]) -> Result<(), Errno> {
    let Some((last, before)) = segments.split_last_mut() else {
        return Ok(());
    };
    if !last.read {
        return Ok(());
    }
    let mut arrived = last.arrived()?.to_vec();
    let found = arrived.pop().ok_or(Errno::IO)?;
    last.bytes = arrived;
    last.length_first = last.length_first.map(|extra| extra - 1);
    let expected = checksum_of_message(before.iter().fold(0, checksum_of_message), last);
    (found == expected).then_some(()).ok_or(Errno::BADMSG)
}

/// Packet error code (SMBus 2.0, section 5.4) over the address byte and the data of a message.
fn checksum_of_message(checksum: u8, segment: &Segment) -> u8 {
    let [_, address] = (segment.address << 1 | u16::from(segment.read)).to_be_bytes();
    let step = |checksum, byte: &u8| checksum_of_byte(checksum, *byte);
    let begin = checksum_of_byte(checksum, address);
    segment.bytes.iter().fold(begin, step)
}

/// CRC-8 with the polynomial x^8 + x^2 + x + 1.
fn checksum_of_byte(checksum: u8, byte: u8) -> u8 {
    (0..8).fold(checksum ^ byte, |crc, _| match crc & 0x80 {
        0 => crc << 1,
        _ => crc << 1 ^ 0x07,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// "123456789" gives 0xF4: the standard check value of this CRC-8.
    #[test]
    fn checksum_has_the_known_check_value() {
        let step = |crc, byte: &u8| checksum_of_byte(crc, *byte);
        assert_eq!(b"123456789".iter().fold(0, step), 0xF4);
    }
}
