//! The kernel's side of a supervisor: what it asks, and what it is answered.
#![expect(unsafe_code, reason = "no safe wrapper makes these ioctls")]

use super::call::{Call, Machine};
use crate::ioctl::PointerWidth;
use rustix::io::Errno;
use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd, RawFd};

/// Room for what later kernels add.
const ROOM_WORDS: usize = 16;

pub(super) struct Listener(OwnedFd);

/// One system call that waits for its answer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Question {
    pub(super) id: u64,
    /// The calling thread.
    pub(super) thread: u32,
    pub(super) machine: Machine,
    pub(super) call: Call,
    pub(super) arguments: [u64; 6],
}

impl Question {
    pub(super) const fn width(&self) -> PointerWidth {
        match self.machine {
            Machine::X86 | Machine::Arm64 => PointerWidth::Bits64,
            Machine::X86Of32Bits | Machine::ArmOf32Bits => PointerWidth::Bits32,
        }
    }

    /// An argument that the kernel takes as an `int` or an `unsigned int`.
    pub(super) fn word(&self, index: usize) -> u32 {
        let [a, b, c, d, ..] = self.arguments[index].to_le_bytes();
        u32::from_le_bytes([a, b, c, d])
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    /// The call returns this.
    Done(i64),
    Failed(Errno),
    /// The kernel carries it out.
    AsEver,
    /// Somebody has answered, or nobody waits any more.
    Nothing,
}

#[repr(C)]
struct Room {
    question: libc::seccomp_notif,
    rest: [u64; ROOM_WORDS],
}

impl Listener {
    /// Prepares a listener that [`Filter::install`](super::filter::Filter::install) has made.
    pub(super) fn new(listener: OwnedFd) -> Self {
        const SYNC_WAKE_UP: libc::c_ulong = 1;
        // Whoever waits is woken on this processor, which has nothing else to do: Linux 6.6. Older ones refuse.
        // SAFETY: this request takes a number.
        let _ = unsafe {
            let request = libc::SECCOMP_IOCTL_NOTIF_SET_FLAGS;
            libc::ioctl(listener.as_raw_fd(), request, SYNC_WAKE_UP)
        };
        Self(listener)
    }

    /// Waits for a question. None came if the caller has gone meanwhile, or if it is no call of [`Call`].
    pub(super) fn receive(&self) -> io::Result<Option<Question>> {
        // SAFETY: all of its fields may be zero, and the kernel wants them so.
        let mut room: Room = unsafe { std::mem::zeroed() };
        match listener_ioctl(&self.0, libc::SECCOMP_IOCTL_NOTIF_RECV, &mut room) {
            Ok(_) => {}
            Err(error) => {
                return match Errno::from_io_error(&error) {
                    Some(Errno::NOENT | Errno::INTR | Errno::AGAIN) => Ok(None),
                    _ => Err(error),
                };
            }
        }
        let libc::seccomp_notif { id, pid, data, .. } = room.question;
        let known = || {
            let machine = Machine::from_audit(data.arch)?;
            let call = Call::from_number(machine, u32::try_from(data.nr).ok()?)?;
            Some(Question {
                id,
                thread: pid,
                machine,
                call,
                arguments: data.args,
            })
        };
        let question = known();
        if question.is_none() {
            self.answer(id, Answer::AsEver);
        }
        Ok(question)
    }

    /// Nobody may wait for it any more.
    pub(super) fn answer(&self, id: u64, answer: Answer) {
        let mut response = libc::seccomp_notif_resp {
            id,
            val: 0,
            error: 0,
            flags: 0,
        };
        match answer {
            Answer::Done(value) => response.val = value,
            Answer::Failed(errno) => response.error = -errno.raw_os_error(),
            Answer::AsEver => response.flags = 1,
            Answer::Nothing => return,
        }
        let _ = listener_ioctl(&self.0, libc::SECCOMP_IOCTL_NOTIF_SEND, &mut response);
    }

    /// Whether the caller still waits, so that its number is still its own.
    pub(super) fn waits(&self, mut id: u64) -> bool {
        listener_ioctl(&self.0, libc::SECCOMP_IOCTL_NOTIF_ID_VALID, &mut id).is_ok()
    }

    /// Gives the caller a descriptor with this number, in the place of what may be there.
    pub(super) fn add(
        &self,
        id: u64,
        file: BorrowedFd<'_>,
        number: u32,
        close_on_exec: bool,
    ) -> Result<i64, Errno> {
        let mut added = libc::seccomp_notif_addfd {
            id,
            flags: 1, // SECCOMP_ADDFD_FLAG_SETFD
            srcfd: u32::try_from(file.as_raw_fd()).or(Err(Errno::BADF))?,
            newfd: number,
            newfd_flags: match close_on_exec {
                true => rustix::fs::OFlags::CLOEXEC.bits(),
                false => 0,
            },
        };
        listener_ioctl(&self.0, libc::SECCOMP_IOCTL_NOTIF_ADDFD, &mut added)
            .map(i64::from)
            .map_err(|error| Errno::from_io_error(&error).unwrap_or(Errno::IO))
    }
}

impl AsFd for Listener {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.0.as_fd()
    }
}

impl AsRawFd for Listener {
    fn as_raw_fd(&self) -> RawFd {
        self.0.as_raw_fd()
    }
}

/// Whether the kernel's questions fit.
pub(super) fn fits() -> bool {
    // SAFETY: all of its fields may be zero.
    let mut sizes: libc::seccomp_notif_sizes = unsafe { std::mem::zeroed() };
    // SAFETY: the kernel fills `sizes`.
    let told = unsafe {
        let operation = libc::SECCOMP_GET_NOTIF_SIZES;
        libc::syscall(libc::SYS_seccomp, operation, 0, &raw mut sizes)
    };
    told == 0
        && usize::from(sizes.seccomp_notif) <= size_of::<Room>()
        && usize::from(sizes.seccomp_notif_resp) == size_of::<libc::seccomp_notif_resp>()
}

fn listener_ioctl<T>(
    listener: &OwnedFd,
    request: libc::Ioctl,
    argument: &mut T,
) -> io::Result<i32> {
    // SAFETY: each request above reads and writes at most its own structure, or the room around it.
    let done = unsafe { libc::ioctl(listener.as_raw_fd(), request, &raw mut *argument) };
    match done {
        0.. => Ok(done),
        _ => Err(io::Error::last_os_error()),
    }
}
