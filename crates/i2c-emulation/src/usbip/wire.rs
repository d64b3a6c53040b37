//! The bytes of the USB/IP protocol, version 1.1.1 (Linux, `Documentation/usb/usbip_protocol.rst`).

/// The version in every request and reply of the first phase.
pub(super) const VERSION: u16 = 0x0111;
/// The header size of the second phase, which carries transfers.
pub(super) const HEADER_BYTES: usize = 48;
/// The header size of a request or reply in the first phase.
pub(super) const OP_BYTES: usize = 8;
/// The size of a device's name on the wire.
pub(super) const BUS_ID_BYTES: usize = 32;

/// The most bytes of one transfer: a control transfer's length field has 16 bits.
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

/// USB_SPEED_LOW of `linux/usb/ch9.h`, as in the original. vhci-hcd logs a complaint about full speed.
pub(super) const SPEED_LOW: u32 = 1;
pub(super) const BUS_NUMBER: u16 = 1;
/// USB 2.0, table 9-8: USB 1.1, its own class, eight bytes at a time, vendor 0403, product c631 (the first in the
/// kernel's i2c-tiny-usb), release 2.00, three strings, one configuration.
pub(super) const DESCRIPTOR: [u8; 18] = [
    18, 1, 0x10, 0x01, 0xFF, 0, 0, 8, 0x03, 0x04, 0x31, 0xC6, 0x00, 0x02, 1, 2, 3, 1,
];

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Identity {
    pub(super) bus_id: String,
    pub(super) device_number: u16,
}

impl Identity {
    /// The adapter of one bus. `index` counts the buses of the rack from 0.
    pub(super) fn new(bus: u32, index: usize) -> Self {
        Self {
            bus_id: bus_id(bus),
            device_number: u16::try_from(index + 1).unwrap_or(u16::MAX),
        }
    }
}

/// The name of a bus for `usbip attach -b`: `1-N` for bus N of the rack.
#[must_use]
pub fn bus_id(bus: u32) -> String {
    format!("1-{bus}")
}

/// Bytes that no USB/IP client sends. The connection is then unusable, since the next header's position is unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what each is")]
pub enum Malformed {
    #[error("version {0:#06x} of USB/IP instead of {VERSION:#06x}")]
    Version(u16),
    #[error("unknown request {0:#06x}")]
    Request(u16),
    #[error("unknown command {0}")]
    Command(u32),
    #[error("a transfer of {0} bytes, at most {TRANSFER_BYTES_MAX} are possible")]
    Length(u32),
    #[error("an isochronous transfer of {0} packets to a device that has none")]
    Packets(u32),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Request {
    DeviceList,
    /// Attaches one device; its name follows.
    Import,
}

impl Request {
    pub(super) fn parse(bytes: &[u8; OP_BYTES]) -> Result<Self, Malformed> {
        let version = u16::from_be_bytes([bytes[0], bytes[1]]);
        if version != VERSION {
            return Err(Malformed::Version(version));
        }
        match u16::from_be_bytes([bytes[2], bytes[3]]) {
            OP_REQ_DEVLIST => Ok(Self::DeviceList),
            OP_REQ_IMPORT => Ok(Self::Import),
            found => Err(Malformed::Request(found)),
        }
    }
}

/// Status of a reply (`usbip_network.h`, ST_*): the device is in use.
pub(super) const BUSY: u32 = 2;
/// Status of a reply: there is no device with that name.
pub(super) const NO_SUCH_DEVICE: u32 = 4;

/// The description of a device in both replies of the first phase.
fn described(device: &Identity) -> Vec<u8> {
    const CONFIGURATION_VALUE: u8 = 1;
    const INTERFACES: u8 = 1;
    let mut bytes = Vec::with_capacity(PATH_BYTES + BUS_ID_BYTES + 24);
    let path = format!("/emulated/{}", device.bus_id);
    bytes.extend(padded::<PATH_BYTES>(&path));
    bytes.extend(padded::<BUS_ID_BYTES>(&device.bus_id));
    for number in [BUS_NUMBER.into(), device.device_number.into(), SPEED_LOW] {
        bytes.extend(number.to_be_bytes());
    }
    // Vendor, product and release are little-endian in the descriptor and big-endian here.
    for at in [8, 10, 12] {
        bytes.extend([DESCRIPTOR[at + 1], DESCRIPTOR[at]]);
    }
    bytes.extend(&DESCRIPTOR[4..7]);
    bytes.extend([CONFIGURATION_VALUE, DESCRIPTOR[17], INTERFACES]);
    bytes
}

/// Text in a fixed-size field, followed by at least one zero.
fn padded<const BYTES: usize>(text: &str) -> [u8; BYTES] {
    let mut bytes = text.bytes().take(BYTES - 1);
    [0; BYTES].map(|zero| bytes.next().unwrap_or(zero))
}

pub(super) fn unpadded(field: &[u8]) -> String {
    let text = field.split(|byte| *byte == 0).next().unwrap_or_default();
    String::from_utf8_lossy(text).into_owned()
}

/// Every device with the class of its only interface.
pub(super) fn device_list<'a>(devices: impl ExactSizeIterator<Item = &'a Identity>) -> Vec<u8> {
    let mut bytes = reply_header(OP_REP_DEVLIST, 0);
    let count = u32::try_from(devices.len()).unwrap_or(u32::MAX);
    bytes.extend(count.to_be_bytes());
    for device in devices {
        bytes.extend(described(device));
        bytes.extend(&DESCRIPTOR[4..7]);
        bytes.push(0);
    }
    bytes
}

pub(super) fn imported(answer: Result<&Identity, u32>) -> Vec<u8> {
    match answer {
        Ok(device) => [reply_header(OP_REP_IMPORT, 0), described(device)].concat(),
        Err(status) => reply_header(OP_REP_IMPORT, status),
    }
}

fn reply_header(code: u16, status: u32) -> Vec<u8> {
    let [version, code] = [VERSION, code].map(u16::to_be_bytes);
    [&version[..], &code, &status.to_be_bytes()].concat()
}

/// The eight bytes at the start of every control transfer (USB 2.0, 9.3).
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

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Command {
    Submit(Submit),
    Unlink { sequence: u32 },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Submit {
    pub(super) sequence: u32,
    pub(super) endpoint: u32,
    /// Whether the device sends.
    pub(super) is_in: bool,
    /// The bytes after the header, or the client's room for bytes.
    pub(super) length: usize,
    pub(super) setup: Setup,
}

impl Command {
    pub(super) fn parse(header: &[u8; HEADER_BYTES]) -> Result<Self, Malformed> {
        let sequence = field(header, 4);
        match field(header, 0) {
            CMD_SUBMIT => {}
            CMD_UNLINK => return Ok(Self::Unlink { sequence }),
            found => return Err(Malformed::Command(found)),
        }
        let length = field(header, 24);
        let packets = field(header, 32);
        if !NO_PACKETS.contains(&packets) {
            return Err(Malformed::Packets(packets));
        }
        let length = usize::try_from(length)
            .ok()
            .filter(|length| *length <= TRANSFER_BYTES_MAX)
            .ok_or(Malformed::Length(length))?;
        Ok(Self::Submit(Submit {
            sequence,
            endpoint: field(header, 16),
            is_in: field(header, 12) == DIRECTION_IN,
            length,
            setup: Setup::parse(header.last_chunk().map_or([0; 8], |setup| *setup)),
        }))
    }
}

/// The reply to a transfer: `status` is 0 or a negative errno. `data` is empty unless the device sends.
pub(super) fn submitted(sequence: u32, status: i32, actual_length: usize, data: &[u8]) -> Vec<u8> {
    let status = u32::from_ne_bytes(status.to_ne_bytes());
    let actual_length = u32::try_from(actual_length).unwrap_or(u32::MAX);
    let words = [RET_SUBMIT, sequence, 0, 0, 0, status, actual_length];
    let words = words.map(u32::to_be_bytes);
    [words.as_flattened(), &[0; 20], data].concat()
}

/// The reply to a cancelled transfer that was already answered.
pub(super) fn unlinked_too_late(sequence: u32) -> Vec<u8> {
    let header = [RET_UNLINK, sequence, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    header.map(u32::to_be_bytes).as_flattened().to_vec()
}

fn field(header: &[u8; HEADER_BYTES], at: usize) -> u32 {
    u32::from_be_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]])
}
