//! The bytes of the USB/IP protocol, version 1.1.1 (Linux, `Documentation/usb/usbip_protocol.rst`).
//!
//! Nothing here reads or writes: a header goes in, its meaning comes out, and the other way round.

/// The version that both sides name in every request and reply of the first phase.
pub(super) const VERSION: u16 = 0x0111;
/// Bytes of every header of the second phase, in which transfers are carried.
pub(super) const HEADER_BYTES: usize = 48;
/// Bytes of the header of a request or reply of the first phase.
pub(super) const OP_BYTES: usize = 8;
/// Bytes of a device's name on the wire.
pub(super) const BUS_ID_BYTES: usize = 32;

/// Most bytes of one transfer: the length field of a control transfer has 16 bits.
pub const TRANSFER_BYTES_MAX: usize = 0xFFFF;

const PATH_BYTES: usize = 256;

const OP_REQ_DEVLIST: u16 = 0x8005;
const OP_REP_DEVLIST: u16 = 0x0005;
const OP_REQ_IMPORT: u16 = 0x8003;
const OP_REP_IMPORT: u16 = 0x0003;

const CMD_SUBMIT: u32 = 1;
const CMD_UNLINK: u32 = 2;
const RET_SUBMIT: u32 = 3;
const RET_UNLINK: u32 = 4;

const DIRECTION_IN: u32 = 1;
/// Bit 7 of bmRequestType (USB 2.0, table 9-2).
const DEVICE_TO_HOST: u8 = 0x80;
const NO_PACKETS: [u32; 2] = [0, u32::MAX];

/// Bytes that no USB/IP client sends. The connection is of no use afterwards: nobody knows where the next header begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Malformed {
    /// Another version of the protocol.
    #[error("version {found:#06x} of USB/IP instead of {VERSION:#06x}")]
    Version {
        /// What was sent.
        found: u16,
    },
    /// A request that is neither for the list of devices nor for one of them.
    #[error("unknown request {found:#06x}")]
    Request {
        /// What was sent.
        found: u16,
    },
    /// Neither a transfer nor the cancelling of one.
    #[error("unknown command {found}")]
    Command {
        /// What was sent.
        found: u32,
    },
    /// A transfer longer than a control transfer can be.
    #[error("a transfer of {found} bytes, at most {TRANSFER_BYTES_MAX} are possible")]
    Length {
        /// What was sent.
        found: u32,
    },
    /// An isochronous transfer, which this device has no endpoint for.
    #[error("an isochronous transfer of {found} packets to a device that has none")]
    Packets {
        /// What was sent.
        found: u32,
    },
}

/// A request of the first phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Request {
    /// Which devices are there?
    DeviceList,
    /// One device, please; its name follows.
    Import,
}

impl Request {
    pub(super) fn parse(bytes: &[u8; OP_BYTES]) -> Result<Self, Malformed> {
        let version = u16::from_be_bytes([bytes[0], bytes[1]]);
        if version != VERSION {
            return Err(Malformed::Version { found: version });
        }
        match u16::from_be_bytes([bytes[2], bytes[3]]) {
            OP_REQ_DEVLIST => Ok(Self::DeviceList),
            OP_REQ_IMPORT => Ok(Self::Import),
            found => Err(Malformed::Request { found }),
        }
    }
}

/// How a request for a device was answered (`usbip_network.h`, ST_*).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// Somebody else has it.
    Busy = 2,
    /// There is no device of that name.
    NoSuchDevice = 4,
}

/// What both replies of the first phase tell of a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Described {
    pub(super) bus_id: String,
    pub(super) bus_number: u16,
    pub(super) device_number: u16,
    pub(super) speed: u32,
    /// The first 18 bytes that the device itself tells on the USB.
    pub(super) descriptor: [u8; 18],
}

impl Described {
    fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(PATH_BYTES + BUS_ID_BYTES + 24);
        bytes.extend(padded::<PATH_BYTES>(&format!("/emulated/{}", self.bus_id)));
        bytes.extend(padded::<BUS_ID_BYTES>(&self.bus_id));
        bytes.extend(u32::from(self.bus_number).to_be_bytes());
        bytes.extend(u32::from(self.device_number).to_be_bytes());
        bytes.extend(self.speed.to_be_bytes());
        // Vendor, product and release lie low byte first in the descriptor and high byte first here.
        for at in [8, 10, 12] {
            bytes.extend([self.descriptor[at + 1], self.descriptor[at]]);
        }
        bytes.extend(&self.descriptor[4..7]);
        bytes.push(CONFIGURATION_VALUE);
        bytes.push(self.descriptor[17]);
        bytes.push(INTERFACES);
        bytes
    }
}

const CONFIGURATION_VALUE: u8 = 1;
const INTERFACES: u8 = 1;

/// Text in a field of a fixed size, with at least one zero behind it.
fn padded<const BYTES: usize>(text: &str) -> [u8; BYTES] {
    let mut field = [0; BYTES];
    for (to, from) in field[..BYTES - 1].iter_mut().zip(text.bytes()) {
        *to = from;
    }
    field
}

/// The name in a field of a fixed size.
pub(super) fn unpadded(field: &[u8]) -> String {
    let length = field
        .iter()
        .position(|byte| *byte == 0)
        .unwrap_or(field.len());
    String::from_utf8_lossy(&field[..length]).into_owned()
}

/// Every device with the class of its one interface.
pub(super) fn device_list(devices: &[Described]) -> Vec<u8> {
    let mut bytes = reply_header(OP_REP_DEVLIST, 0);
    bytes.extend(
        u32::try_from(devices.len())
            .unwrap_or(u32::MAX)
            .to_be_bytes(),
    );
    for device in devices {
        bytes.extend(device.encode());
        bytes.extend(&device.descriptor[4..7]);
        bytes.push(0);
    }
    bytes
}

/// The device that was asked for, or why not.
pub(super) fn imported(answer: Result<&Described, Refusal>) -> Vec<u8> {
    match answer {
        Ok(device) => {
            let mut bytes = reply_header(OP_REP_IMPORT, 0);
            bytes.extend(device.encode());
            bytes
        }
        Err(Refusal::Busy) => reply_header(OP_REP_IMPORT, 2),
        Err(Refusal::NoSuchDevice) => reply_header(OP_REP_IMPORT, 4),
    }
}

fn reply_header(code: u16, status: u32) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(512);
    bytes.extend(VERSION.to_be_bytes());
    bytes.extend(code.to_be_bytes());
    bytes.extend(status.to_be_bytes());
    bytes
}

/// The eight bytes with which every control transfer begins (USB 2.0, 9.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Setup {
    pub(super) request_type: u8,
    pub(super) request: u8,
    pub(super) value: u16,
    pub(super) index: u16,
    pub(super) length: u16,
}

impl Setup {
    fn parse(bytes: [u8; 8]) -> Self {
        let [request_type, request, v0, v1, i0, i1, l0, l1] = bytes;
        Self {
            request_type,
            request,
            value: u16::from_le_bytes([v0, v1]),
            index: u16::from_le_bytes([i0, i1]),
            length: u16::from_le_bytes([l0, l1]),
        }
    }

    /// Whether the device sends.
    pub(super) const fn is_in(&self) -> bool {
        self.request_type & DEVICE_TO_HOST != 0
    }
}

/// A command of the second phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Command {
    /// One transfer.
    Submit(Submit),
    /// Never mind the transfer that was submitted earlier.
    Unlink { sequence: u32 },
}

/// One transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Submit {
    pub(super) sequence: u32,
    pub(super) endpoint: u32,
    /// Whether the device sends.
    pub(super) is_in: bool,
    /// Bytes that follow the header, or bytes that the client has room for.
    pub(super) length: usize,
    pub(super) setup: Setup,
}

impl Command {
    pub(super) fn parse(header: &[u8; HEADER_BYTES]) -> Result<Self, Malformed> {
        let sequence = field(header, 4);
        match field(header, 0) {
            CMD_SUBMIT => {}
            CMD_UNLINK => return Ok(Self::Unlink { sequence }),
            found => return Err(Malformed::Command { found }),
        }
        let length = field(header, 24);
        let packets = field(header, 32);
        if !NO_PACKETS.contains(&packets) {
            return Err(Malformed::Packets { found: packets });
        }
        let length = usize::try_from(length)
            .ok()
            .filter(|length| *length <= TRANSFER_BYTES_MAX)
            .ok_or(Malformed::Length { found: length })?;
        let mut setup = [0; 8];
        setup.copy_from_slice(&header[40..]);
        Ok(Self::Submit(Submit {
            sequence,
            endpoint: field(header, 16),
            is_in: field(header, 12) == DIRECTION_IN,
            length,
            setup: Setup::parse(setup),
        }))
    }
}

/// The reply to a transfer: `status` is 0 or a negative errno. `data` is sent only if the device is the one that sends.
pub(super) fn submitted(sequence: u32, status: i32, actual_length: usize, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER_BYTES + data.len());
    for word in [RET_SUBMIT, sequence, 0, 0, 0] {
        bytes.extend(word.to_be_bytes());
    }
    bytes.extend(status.to_be_bytes());
    let actual_length = u32::try_from(actual_length).unwrap_or(u32::MAX);
    for word in [actual_length, 0, 0, 0, 0, 0] {
        bytes.extend(word.to_be_bytes());
    }
    bytes.extend(data);
    bytes
}

/// The reply to a cancelled transfer that had been answered already.
pub(super) fn unlinked_too_late(sequence: u32) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER_BYTES);
    for word in [RET_UNLINK, sequence, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0] {
        bytes.extend(word.to_be_bytes());
    }
    bytes
}

fn field(header: &[u8; HEADER_BYTES], at: usize) -> u32 {
    let mut bytes = [0; 4];
    bytes.copy_from_slice(&header[at..at + 4]);
    u32::from_be_bytes(bytes)
}
