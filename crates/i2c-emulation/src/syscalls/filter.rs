//! The filter: a program of the kernel's packet machine that decides by a call's numbers whether to ask the supervisor.
#![expect(unsafe_code, reason = "no safe wrapper installs a filter")]

use super::call::{Call, Machine};
use rustix::io::Errno;
use rustix::thread::set_no_new_privs;
use std::io;
use std::mem::offset_of;
use std::os::fd::{FromRawFd, OwnedFd};

/// Calls on descriptors from here on are the supervisor's to look at, except ioctls, which are so on every descriptor.
pub const ASKED_FROM: u32 = 64;

pub(super) const REQUESTS_OF_I2C: u32 = 0x0700;

const TYPE_MASK: u32 = 0xFFFF_FF00;
const F_DUPFD: u32 = 0;
const F_GETFL: u32 = 3;
const F_DUPFD_CLOEXEC: u32 = 1030;

// `linux/bpf_common.h`
const LOAD: u16 = 0x20;
const AND: u16 = 0x54;
const JUMP: u16 = 0x05;
const IF_EQUAL: u16 = 0x15;
const IF_AT_LEAST: u16 = 0x35;
const RETURN: u16 = 0x06;

pub(super) struct Filter(Vec<libc::sock_filter>);

impl Filter {
    /// The filter of the calls in [`Call`].
    pub(super) fn new() -> Self {
        let mut filter = Self(vec![load(offset_of!(libc::seccomp_data, arch))]);
        let sections: Vec<Vec<libc::sock_filter>> = Machine::ALL
            .into_iter()
            .map(|(machine, _)| section(machine))
            .collect();
        // A test and a jump for each instruction set, and the end; then their sections.
        let mut ahead = 2 * sections.len() + 1;
        for ((_, audit), section) in Machine::ALL.into_iter().zip(&sections) {
            ahead -= 2;
            filter.0.push(step(IF_EQUAL, 0, 1, audit));
            filter.0.push(step(JUMP, 0, 0, distance(ahead)));
            ahead += section.len();
        }
        filter.0.push(allow());
        filter.0.extend(sections.into_iter().flatten());
        filter
    }

    /// A filter that lets everything pass.
    pub(super) fn open() -> Self {
        Self(vec![allow()])
    }

    /// Installs it for this thread and what it starts. Makes only system calls, as is needed between fork and exec.
    /// Returns the listener, and whether programs that gain rights keep them.
    pub(super) fn install(&self) -> io::Result<(OwnedFd, bool)> {
        let program = libc::sock_fprog {
            len: u16::try_from(self.0.len()).unwrap_or(u16::MAX),
            filter: self.0.as_ptr().cast_mut(),
        };
        // So that a signal does not break off a transfer and start it again: Linux 5.19.
        let mut flags =
            libc::SECCOMP_FILTER_FLAG_NEW_LISTENER | libc::SECCOMP_FILTER_FLAG_WAIT_KILLABLE_RECV;
        let mut keeps_rights = true;
        loop {
            // SAFETY: `program` and its instructions outlive the call.
            let made = unsafe {
                let operation = libc::SECCOMP_SET_MODE_FILTER;
                libc::syscall(libc::SYS_seccomp, operation, flags, &raw const program)
            };
            if let Ok(number @ 0..) = i32::try_from(made) {
                // SAFETY: the kernel has just made this descriptor.
                return Ok((unsafe { OwnedFd::from_raw_fd(number) }, keeps_rights));
            }
            let error = io::Error::last_os_error();
            match Errno::from_io_error(&error) {
                Some(Errno::INVAL) if flags & libc::SECCOMP_FILTER_FLAG_WAIT_KILLABLE_RECV != 0 => {
                    flags = libc::SECCOMP_FILTER_FLAG_NEW_LISTENER;
                }
                Some(Errno::ACCESS) if keeps_rights => {
                    set_no_new_privs(true)?;
                    keeps_rights = false;
                }
                _ => return Err(error),
            }
        }
    }
}

/// The decisions on one instruction set.
fn section(machine: Machine) -> Vec<libc::sock_filter> {
    let mut section = vec![load(offset_of!(libc::seccomp_data, nr))];
    for (call, number) in Call::all(machine) {
        let decision = decision(call);
        // A decision has fewer than ten steps.
        let over = u8::try_from(decision.len()).unwrap_or(u8::MAX);
        section.push(step(IF_EQUAL, 0, over, number));
        section.extend(decision);
    }
    section.push(allow());
    section
}

/// Ends in every case.
fn decision(call: Call) -> Vec<libc::sock_filter> {
    match call {
        Call::Open(_)
        | Call::Create
        | Call::OpenHow
        | Call::Stat(_)
        | Call::StatMore
        | Call::Access(_) => vec![ask()],
        Call::Transfer(_) | Call::StatOpen | Call::Duplicate | Call::Seek => vec![
            argument(0),
            step(IF_AT_LEAST, 0, 1, ASKED_FROM),
            ask(),
            allow(),
        ],
        Call::Ioctl => vec![
            argument(1),
            step(AND, 0, 0, TYPE_MASK),
            step(IF_EQUAL, 0, 1, REQUESTS_OF_I2C),
            ask(),
            allow(),
        ],
        // A copy that may come to lie below needs another number; others are the kernel's.
        Call::Control => vec![
            argument(0),
            step(IF_AT_LEAST, 0, 6, ASKED_FROM),
            argument(1),
            step(IF_EQUAL, 5, 0, F_GETFL),
            step(IF_EQUAL, 1, 0, F_DUPFD),
            step(IF_EQUAL, 0, 2, F_DUPFD_CLOEXEC),
            argument(2),
            step(IF_AT_LEAST, 0, 1, ASKED_FROM),
            allow(),
            ask(),
        ],
    }
}

/// The low half of an argument: descriptors, requests and commands have 32 bits.
fn argument(index: usize) -> libc::sock_filter {
    let low = match cfg!(target_endian = "big") {
        true => 4,
        false => 0,
    };
    load(offset_of!(libc::seccomp_data, args) + index * size_of::<u64>() + low)
}

fn load(offset: usize) -> libc::sock_filter {
    step(LOAD, 0, 0, distance(offset))
}

fn allow() -> libc::sock_filter {
    step(RETURN, 0, 0, libc::SECCOMP_RET_ALLOW)
}

fn ask() -> libc::sock_filter {
    step(RETURN, 0, 0, libc::SECCOMP_RET_USER_NOTIF)
}

const fn step(code: u16, jt: u8, jf: u8, k: u32) -> libc::sock_filter {
    libc::sock_filter { code, jt, jf, k }
}

fn distance(steps: usize) -> u32 {
    u32::try_from(steps).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a filter as the kernel's machine would: whether the supervisor is asked.
    fn asks(audit: u32, number: u32, arguments: [u32; 3]) -> bool {
        let Filter(steps) = Filter::new();
        let (mut at, mut value) = (0, 0);
        loop {
            let libc::sock_filter { code, jt, jf, k } = steps[at];
            at += 1;
            let branch = |holds: bool| usize::from(if holds { jt } else { jf });
            match code {
                LOAD => {
                    value = match k {
                        0 => number,
                        4 => audit,
                        _ => arguments[usize::try_from(k).unwrap() / 8 - 2],
                    }
                }
                AND => value &= k,
                JUMP => at += usize::try_from(k).unwrap(),
                IF_EQUAL => at += branch(value == k),
                IF_AT_LEAST => at += branch(value >= k),
                RETURN => return k == libc::SECCOMP_RET_USER_NOTIF,
                other => panic!("{other:#x} is no step of ours"),
            }
        }
    }

    #[test]
    fn only_calls_that_may_concern_a_device_are_asked_for() {
        for (machine, audit) in Machine::ALL {
            for (call, number) in Call::all(machine) {
                let asked = |arguments| asks(audit, number, arguments);
                match call {
                    Call::Ioctl => {
                        assert!(asked([3, 0x0707, 0]) && asked([3, 0x0720, 0]));
                        assert!(!asked([3, 0x5401, 0]) && !asked([900, 0x8107, 0]));
                        assert!(!asked([3, 0x8001_0707, 0]));
                    }
                    Call::Control => {
                        assert!(asked([900, F_DUPFD, 3]) && asked([64, F_DUPFD_CLOEXEC, 63]));
                        assert!(asked([900, F_GETFL, 0]));
                        assert!(!asked([63, F_DUPFD, 3]) && !asked([63, F_GETFL, 0]));
                        assert!(!asked([900, F_DUPFD, 64]) && !asked([900, 1, 0]));
                    }
                    Call::Transfer(_) | Call::StatOpen | Call::Duplicate | Call::Seek => {
                        assert!(asked([64, 0, 0]) && asked([1023, 0, 0]), "{call:?}");
                        assert!(!asked([63, 0, 0]) && !asked([0, 900, 900]), "{call:?}");
                    }
                    _ => assert!(asked([0, 0, 0]), "{call:?}"),
                }
            }
            assert!(!asks(audit, 9999, [900, 0x0707, 0]), "{machine:?}");
        }
        assert!(!asks(0xC000_00F3, 56, [0, 0, 0]), "riscv64");
    }
}
