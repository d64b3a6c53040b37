//! The calling program's memory, reached from outside with process_vm_readv and process_vm_writev.
#![expect(
    unsafe_code,
    reason = "only these two system calls reach another process's memory, and std has no wrapper for them"
)]

use std::io;

use crate::ioctl::{CallerMemory, Errno, PointerWidth};

/// The memory of one process (or one of its threads).
pub(super) struct ProcessMemory {
    pid: libc::pid_t,
    width: PointerWidth,
}

impl ProcessMemory {
    /// A process number that no process can have reaches nothing: every access is then EFAULT.
    pub(super) fn new(pid: u32, width: PointerWidth) -> Self {
        Self {
            pid: libc::pid_t::try_from(pid).unwrap_or(0),
            width,
        }
    }

    /// The process that asks.
    pub(super) fn of_this_process() -> Self {
        Self::new(std::process::id(), PointerWidth::Bits64)
    }
}

impl CallerMemory for ProcessMemory {
    fn read(&mut self, address: u64, into: &mut [u8]) -> Result<(), Errno> {
        let here = libc::iovec {
            iov_base: into.as_mut_ptr().cast(),
            iov_len: into.len(),
        };
        let there = remote(address, into.len())?;
        // SAFETY: `here` describes `into`, which is borrowed for the whole call and may be written to. `there` is an
        // address in another process that the kernel checks; nothing of this process is reached through it.
        let copied =
            unsafe { libc::process_vm_readv(self.pid, &raw const here, 1, &raw const there, 1, 0) };
        whole(copied, into.len())
    }

    fn write(&mut self, address: u64, bytes: &[u8]) -> Result<(), Errno> {
        let here = libc::iovec {
            iov_base: bytes.as_ptr().cast_mut().cast(),
            iov_len: bytes.len(),
        };
        let there = remote(address, bytes.len())?;
        // SAFETY: `here` describes `bytes`, which is borrowed for the whole call and only read from, so the pointer
        // that was made mutable is never written through. `there` is an address in another process that the kernel checks.
        let copied = unsafe {
            libc::process_vm_writev(self.pid, &raw const here, 1, &raw const there, 1, 0)
        };
        whole(copied, bytes.len())
    }

    fn pointer_width(&self) -> PointerWidth {
        self.width
    }
}

fn remote(address: u64, length: usize) -> Result<libc::iovec, Errno> {
    let address = usize::try_from(address).or(Err(Errno::EFAULT))?;
    Ok(libc::iovec {
        iov_base: std::ptr::without_provenance_mut(address),
        iov_len: length,
    })
}

/// A copy that ends early met the end of the caller's memory.
fn whole(copied: libc::ssize_t, length: usize) -> Result<(), Errno> {
    match usize::try_from(copied) {
        Ok(copied) if copied == length => Ok(()),
        Ok(_) => Err(Errno::EFAULT),
        Err(_) => Err(match io::Error::last_os_error().raw_os_error() {
            Some(libc::EPERM) => Errno::EPERM,
            Some(libc::ENOSYS) => Errno::ENOSYS,
            _ => Errno::EFAULT,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_of_this_process_are_read_and_written() {
        let mut memory = ProcessMemory::of_this_process();
        let mut target = [1u8, 2, 3];
        let address = u64::try_from(target.as_mut_ptr().expose_provenance()).unwrap();
        let mut copy = [0; 3];
        memory.read(address, &mut copy).unwrap();
        assert_eq!(copy, [1, 2, 3]);
        memory.write(address + 1, &[9]).unwrap();
        assert_eq!(std::hint::black_box(target), [1, 9, 3]);
    }

    #[test]
    fn what_is_not_there_is_efault() {
        let mut memory = ProcessMemory::of_this_process();
        for address in [0, 1, u64::MAX, u64::MAX - 1, 1 << 63] {
            assert_eq!(
                memory.read(address, &mut [0; 4]),
                Err(Errno::EFAULT),
                "{address:#x}"
            );
            assert_eq!(
                memory.write(address, &[0; 4]),
                Err(Errno::EFAULT),
                "{address:#x}"
            );
        }
        let text = "read only";
        let address = u64::try_from(text.as_ptr().expose_provenance()).unwrap();
        assert_eq!(memory.write(address, b"R"), Err(Errno::EFAULT));
        assert_eq!(
            ProcessMemory::new(0, PointerWidth::Bits64).read(address, &mut [0]),
            Err(Errno::EFAULT)
        );
        assert_eq!(
            ProcessMemory::new(u32::MAX, PointerWidth::Bits64).read(address, &mut [0]),
            Err(Errno::EFAULT)
        );
    }

    /// Two pages of which the second may not be touched: a buffer across their border is there only in part.
    #[test]
    fn a_buffer_that_is_there_only_in_part_is_efault() {
        const PAGE_BYTES: usize = 4096;
        // SAFETY: the mapping is new, private, and nothing but its address is used.
        let (pages, protected) = unsafe {
            let flags = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS;
            let rights = libc::PROT_READ | libc::PROT_WRITE;
            let pages = libc::mmap(std::ptr::null_mut(), 2 * PAGE_BYTES, rights, flags, -1, 0);
            (
                pages,
                libc::mprotect(pages.byte_add(PAGE_BYTES), PAGE_BYTES, libc::PROT_NONE),
            )
        };
        assert_ne!(pages, libc::MAP_FAILED);
        assert_eq!(protected, 0);
        let border = u64::try_from(pages.expose_provenance() + PAGE_BYTES).unwrap();
        let mut memory = ProcessMemory::of_this_process();
        assert_eq!(memory.read(border - 2, &mut [0; 2]), Ok(()));
        assert_eq!(memory.read(border - 2, &mut [0; 3]), Err(Errno::EFAULT));
        assert_eq!(memory.write(border - 2, &[0; 3]), Err(Errno::EFAULT));
    }
}
