//! The system calls that concern a device, and their numbers on each instruction set.

/// An instruction set, as the kernel names the one of a call (`AUDIT_ARCH_…`); the numbers' columns are in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Machine {
    X86,
    Arm64,
    X86Of32Bits,
    ArmOf32Bits,
}

impl Machine {
    pub(super) const ALL: [(Self, u32); 4] = [
        (Self::X86, 0xC000_003E),
        (Self::Arm64, 0xC000_00B7),
        (Self::X86Of32Bits, 0x4000_0003),
        (Self::ArmOf32Bits, 0x4000_0028),
    ];

    pub(super) fn from_audit(number: u32) -> Option<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|(_, audit)| *audit == number)
            .map(|(machine, _)| machine)
    }

    pub(super) const fn column(self) -> usize {
        match self {
            Self::X86 => 0,
            Self::Arm64 => 1,
            Self::X86Of32Bits => 2,
            Self::ArmOf32Bits => 3,
        }
    }
}

/// Whether the path is the first argument, or follows an open folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Path {
    First,
    InFolder,
}

/// Where the position of a transfer is, if it has one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Position {
    Current,
    /// As an argument of 64 bits.
    Given,
    /// As two halves of a `long`.
    Halves,
    /// The same, and flags after them; -1 is the current position.
    HalvesAndFlags,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Transfer {
    pub(super) writes: bool,
    /// A list of buffers (`struct iovec`) in place of one.
    pub(super) pieces: bool,
    pub(super) position: Position,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Call {
    Open(Path),
    /// creat
    Create,
    /// openat2, with its flags in memory
    OpenHow,
    Stat(Path),
    /// fstat
    StatOpen,
    /// statx
    StatMore,
    Access(Path),
    Transfer(Transfer),
    Ioctl,
    /// fcntl
    Control,
    Duplicate,
    Seek,
}

const fn reads(pieces: bool, position: Position) -> Call {
    let writes = false;
    Call::Transfer(Transfer {
        writes,
        pieces,
        position,
    })
}

const fn writes(pieces: bool, position: Position) -> Call {
    let writes = true;
    Call::Transfer(Transfer {
        writes,
        pieces,
        position,
    })
}

const NONE: u32 = u32::MAX;
const ONE: bool = false;
const MANY: bool = true;

/// The kernel's tables (`arch/*/…/syscall*.tbl`). What is missing on 32 bits is the old ways to stat, each with its own
/// layout; statx is there.
#[rustfmt::skip]
const NUMBERS: [(Call, [u32; 4]); 28] = [
    // x86-64, arm64, x86, ARM
    (reads(ONE, Position::Current),          [0, 63, 3, 3]),
    (writes(ONE, Position::Current),         [1, 64, 4, 4]),
    (Call::Ioctl,                            [16, 29, 54, 54]),
    (Call::Control,                          [72, 25, 55, 55]),
    (Call::Control,                          [NONE, NONE, 221, 221]),
    (Call::Open(Path::InFolder),             [257, 56, 295, 322]),
    (Call::Open(Path::First),                [2, NONE, 5, 5]),
    (Call::Stat(Path::InFolder),             [262, 79, NONE, NONE]),
    (Call::Stat(Path::First),                [4, NONE, NONE, NONE]),
    // lstat: the device is no link.
    (Call::Stat(Path::First),                [6, NONE, NONE, NONE]),
    (Call::StatOpen,                         [5, 80, NONE, NONE]),
    (Call::StatMore,                         [332, 291, 383, 397]),
    (Call::Seek,                             [8, 62, 19, 19]),
    (Call::Seek,                             [NONE, NONE, 140, 140]),
    (reads(MANY, Position::Current),         [19, 65, 145, 145]),
    (writes(MANY, Position::Current),        [20, 66, 146, 146]),
    (reads(ONE, Position::Given),            [17, 67, 180, 180]),
    (writes(ONE, Position::Given),           [18, 68, 181, 181]),
    (reads(MANY, Position::Halves),          [295, 69, 333, 361]),
    (writes(MANY, Position::Halves),         [296, 70, 334, 362]),
    (reads(MANY, Position::HalvesAndFlags),  [327, 286, 378, 392]),
    (writes(MANY, Position::HalvesAndFlags), [328, 287, 379, 393]),
    (Call::Access(Path::First),              [21, NONE, 33, 33]),
    (Call::Access(Path::InFolder),           [269, 48, 307, 334]),
    // faccessat2
    (Call::Access(Path::InFolder),           [439, 439, 439, 439]),
    (Call::OpenHow,                          [437, 437, 437, 437]),
    (Call::Create,                           [85, NONE, 8, 8]),
    (Call::Duplicate,                        [32, 23, 41, 41]),
];

impl Call {
    /// The calls of this instruction set with their numbers, the frequent ones first.
    pub(super) fn all(machine: Machine) -> impl Iterator<Item = (Self, u32)> {
        let column = machine.column();
        NUMBERS.iter().filter_map(move |(call, numbers)| {
            let number = numbers.get(column).copied()?;
            (number != NONE).then_some((*call, number))
        })
    }

    pub(super) fn from_number(machine: Machine, number: u32) -> Option<Self> {
        let mut all = Self::all(machine);
        all.find(|(_, its)| *its == number).map(|(call, _)| call)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The C library's table of this machine is another transcription of the kernel's.
    #[test]
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    fn the_numbers_are_those_of_the_c_library() {
        let machine = match cfg!(target_arch = "x86_64") {
            true => Machine::X86,
            false => Machine::Arm64,
        };
        let given = Position::Given;
        let flagged = Position::HalvesAndFlags;
        for (call, number) in [
            (reads(ONE, Position::Current), libc::SYS_read),
            (writes(ONE, Position::Current), libc::SYS_write),
            (reads(MANY, Position::Current), libc::SYS_readv),
            (writes(MANY, Position::Current), libc::SYS_writev),
            (reads(ONE, given), libc::SYS_pread64),
            (writes(ONE, given), libc::SYS_pwrite64),
            (reads(MANY, Position::Halves), libc::SYS_preadv),
            (writes(MANY, Position::Halves), libc::SYS_pwritev),
            (reads(MANY, flagged), libc::SYS_preadv2),
            (writes(MANY, flagged), libc::SYS_pwritev2),
            (Call::Ioctl, libc::SYS_ioctl),
            (Call::Control, libc::SYS_fcntl),
            (Call::Duplicate, libc::SYS_dup),
            (Call::Seek, libc::SYS_lseek),
            (Call::Open(Path::InFolder), libc::SYS_openat),
            (Call::OpenHow, libc::SYS_openat2),
            (Call::Stat(Path::InFolder), libc::SYS_newfstatat),
            (Call::StatOpen, libc::SYS_fstat),
            (Call::StatMore, libc::SYS_statx),
            (Call::Access(Path::InFolder), libc::SYS_faccessat),
            (Call::Access(Path::InFolder), libc::SYS_faccessat2),
        ] {
            let number = u32::try_from(number).unwrap();
            assert_eq!(Call::from_number(machine, number), Some(call), "{number}");
        }
    }

    #[test]
    fn no_number_means_two_calls() {
        for (machine, audit) in Machine::ALL {
            assert_eq!(Machine::from_audit(audit), Some(machine));
            let mut numbers: Vec<u32> = Call::all(machine).map(|(_, number)| number).collect();
            let count = numbers.len();
            numbers.sort_unstable();
            numbers.dedup();
            assert_eq!(numbers.len(), count, "{machine:?}");
        }
    }
}
