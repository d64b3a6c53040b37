//! What `stat` tells of a device, in the kernel's layouts: a character device, as i2c-dev makes it.

use super::call::Machine;

/// The number of i2c-dev (`Documentation/admin-guide/devices.txt`).
const MAJOR: u32 = 89;
/// A character device for everyone to read and write, of user and group 0.
const MODE: u32 = 0o020_666;
const BLOCK_BYTES: u32 = 4096;

/// `struct stat`; none where statx is the only way.
pub(super) fn stat(machine: Machine, bus: u32) -> Option<Vec<u8>> {
    // As in `new_encode_dev`.
    let device = u64::from(MAJOR << 8 | bus & 0xFF) | u64::from(bus & !0xFF) << 12;
    let mut fields = Fields::new(match machine {
        Machine::X86 => 144,
        Machine::Arm64 => 128,
        Machine::X86Of32Bits | Machine::ArmOf32Bits => return None,
    });
    // The device's number in the file system, so that no two are the same file.
    fields.put(8, u64::from(bus).to_ne_bytes());
    if machine == Machine::X86 {
        fields.put(16, 1u64.to_ne_bytes());
        fields.put(24, MODE.to_ne_bytes());
        fields.put(40, device.to_ne_bytes());
    } else {
        fields.put(16, MODE.to_ne_bytes());
        fields.put(20, 1u32.to_ne_bytes());
        fields.put(32, device.to_ne_bytes());
    }
    fields.put(56, BLOCK_BYTES.to_ne_bytes());
    Some(fields.0)
}

/// `struct statx`.
pub(super) fn statx(bus: u32) -> Vec<u8> {
    const BASIC: u32 = 0x7FF;
    let mut fields = Fields::new(256);
    fields.put(0, BASIC.to_ne_bytes());
    fields.put(4, BLOCK_BYTES.to_ne_bytes());
    fields.put(16, 1u32.to_ne_bytes());
    let [low, high, ..] = MODE.to_le_bytes();
    fields.put(28, u16::from_le_bytes([low, high]).to_ne_bytes());
    fields.put(32, u64::from(bus).to_ne_bytes());
    fields.put(128, MAJOR.to_ne_bytes());
    fields.put(132, bus.to_ne_bytes());
    fields.0
}

struct Fields(Vec<u8>);

impl Fields {
    fn new(bytes: usize) -> Self {
        Self(vec![0; bytes])
    }

    fn put<const N: usize>(&mut self, at: usize, field: [u8; N]) {
        self.0[at..at + N].copy_from_slice(&field);
    }
}

#[cfg(test)]
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
mod tests {
    use super::*;
    use std::mem::offset_of;

    /// The C library's structures are another transcription of the kernel's.
    #[test]
    fn the_layouts_are_those_of_the_c_library() {
        let machine = match cfg!(target_arch = "x86_64") {
            true => Machine::X86,
            false => Machine::Arm64,
        };
        let bus = 0x1_2345;
        let told = stat(machine, bus).unwrap();
        assert_eq!(told.len(), size_of::<libc::stat>());
        let word =
            |bytes: &[u8], at: usize| u32::from_ne_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!(word(&told, offset_of!(libc::stat, st_mode)), MODE);
        assert_eq!(word(&told, offset_of!(libc::stat, st_nlink)), 1);
        assert_eq!(word(&told, offset_of!(libc::stat, st_ino)), bus);
        assert_eq!(word(&told, offset_of!(libc::stat, st_blksize)), 4096);
        let at = offset_of!(libc::stat, st_rdev);
        let device = u64::from_ne_bytes(told[at..at + 8].try_into().unwrap());
        assert_eq!((libc::major(device), libc::minor(device)), (89, bus));

        let told = statx(bus);
        assert_eq!(told.len(), size_of::<libc::statx>());
        assert_eq!(word(&told, offset_of!(libc::statx, stx_nlink)), 1);
        let mode = offset_of!(libc::statx, stx_mode);
        assert_eq!(told[mode..mode + 2], 0o020_666u16.to_ne_bytes());
        assert_eq!(word(&told, offset_of!(libc::statx, stx_rdev_major)), 89);
        assert_eq!(word(&told, offset_of!(libc::statx, stx_rdev_minor)), bus);
    }
}
