//! Why a program could not be run with a device by FUSE, and what to do about it.

use std::io;
use std::path::PathBuf;

/// Why the program could not be run with an emulated device, or not to its end.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The kernel's FUSE device is missing.
    #[error(
        "cannot open {}: {source}\nhint: load the kernel module with `modprobe fuse`, or hand the device to the container with `--device /dev/fuse`",
        path.display()
    )]
    NoFuse {
        /// The path that was tried.
        path: PathBuf,
        /// What the kernel said.
        source: io::Error,
    },
    /// The machine could do it, but not for this user.
    #[error(
        "not permitted: {step}: {source}\nhint: run as root, or allow user namespaces (user.max_user_namespaces above 0) and /dev/fuse for everyone (chmod 0666 /dev/fuse); a container needs --cap-add SYS_ADMIN --device /dev/fuse --security-opt apparmor=unconfined"
    )]
    NotPermitted {
        /// What was being done.
        step: String,
        /// What the kernel said.
        source: io::Error,
    },
    /// A step of the preparation failed for another reason than permission.
    #[error(
        "{step}: {source}\nhint: this needs Linux 5.6 or newer with FUSE, tmpfs and a mounted /proc"
    )]
    Setup {
        /// What was being done.
        step: String,
        /// What the kernel said.
        source: io::Error,
    },
    /// The device's file is missing, and outside `/dev` none is made.
    #[error("there is no {}\nhint: name a device directly in /dev, such as /dev/i2c-1, or make an empty file at this path first", device.display())]
    DeviceMissing {
        /// The path that was asked for.
        device: PathBuf,
    },
    /// A folder stands where the device should appear.
    #[error("{} is a folder\nhint: name a file, such as /dev/i2c-1", device.display())]
    DeviceIsFolder {
        /// The path that was asked for.
        device: PathBuf,
    },
    /// A path holds a byte 0.
    #[error("a path with a zero byte in it: {}\nhint: name a file, such as /dev/i2c-1", path.display())]
    PathWithZero {
        /// The path.
        path: PathBuf,
    },
    /// `/dev` has more entries than are copied.
    #[error(
        "/dev has more than {entries_max} entries\nhint: make an empty file at the device's path, then /dev is left as it is"
    )]
    DevTooFull {
        /// The limit, [`DEV_ENTRIES_MAX`](super::DEV_ENTRIES_MAX).
        entries_max: usize,
    },
    /// There is no such program.
    #[error(
        "program not found: {program}\nhint: check the spelling and PATH, and that the working directory it is to start in exists; a file that is there names an interpreter or a loader that is not"
    )]
    ProgramNotFound {
        /// The program's name.
        program: String,
    },
    /// The program is there but does not start.
    #[error(
        "cannot start {program}: {source}\nhint: is the file executable, and made for this machine?"
    )]
    ProgramNotStarted {
        /// The program's name.
        program: String,
        /// What the kernel said.
        source: io::Error,
    },
    /// The kernel speaks another version of the FUSE protocol.
    #[error(
        "the kernel speaks FUSE {major}.{minor}, needed is 7.28 or newer\nhint: Linux 4.20 or newer"
    )]
    FuseTooOld {
        /// The kernel's major version of the protocol.
        major: u32,
        /// The kernel's minor version of the protocol.
        minor: u32,
    },
    /// The connection to the kernel failed while the program ran; the program has found its device dead.
    #[error("the emulated device failed: {source}\nhint: see the kernel's log (dmesg)")]
    Serve {
        /// What the kernel said.
        source: io::Error,
    },
    /// The end of the program could not be waited for.
    #[error(
        "cannot wait for {program}: {source}\nhint: does something else in this process collect its children?"
    )]
    Wait {
        /// The program's name.
        program: String,
        /// What the kernel said.
        source: io::Error,
    },
}
