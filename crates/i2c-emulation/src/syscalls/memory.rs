//! The calling program's memory, accessed from outside with process_vm_readv and process_vm_writev.
#![expect(
    unsafe_code,
    reason = "only these two system calls reach another process's memory, and std has no wrapper for them"
)]

use crate::ioctl::{CallerMemory, Errno, PointerWidth};
use std::io;

/// Bytes that are read at once, and of which none lies in another page.
const BLOCK_BYTES: usize = 1024;

/// One process's memory for the time of one call, in which it waits. A call's structures mostly lie side by side, so that
/// one read of a block has them all.
pub(super) struct ProcessMemory {
    pid: libc::pid_t,
    width: PointerWidth,
    /// The address of the block that was read last; none is 1.
    block_at: u64,
    block: [u8; BLOCK_BYTES],
}

impl ProcessMemory {
    /// A number that no process can have reaches nothing: every access returns EFAULT.
    pub(super) fn new(pid: u32, width: PointerWidth) -> Self {
        Self {
            pid: libc::pid_t::try_from(pid).unwrap_or(0),
            width,
            block_at: 1,
            block: [0; BLOCK_BYTES],
        }
    }

    /// The bytes at an address, if they lie in one block that is there.
    fn in_block(&mut self, address: u64, length: usize) -> Option<&[u8]> {
        let offset = usize::try_from(address).ok()? % BLOCK_BYTES;
        let block_at = address - u64::try_from(offset).ok()?;
        let end = Some(offset.checked_add(length)?).filter(|end| *end <= BLOCK_BYTES)?;
        if self.block_at != block_at {
            self.block_at = 1;
            let here = self.block.as_mut_ptr().cast();
            // SAFETY: the block is borrowed for the whole call and writable.
            unsafe { self.copy(libc::process_vm_readv, here, block_at, BLOCK_BYTES) }.ok()?;
            self.block_at = block_at;
        }
        Some(&self.block[offset..end])
    }

    /// Reads until the caller's memory ends; returns how many bytes came.
    pub(super) fn read_some(&self, address: u64, into: &mut [u8]) -> usize {
        let here = into.as_mut_ptr().cast();
        // SAFETY: `into` is borrowed for the whole call and writable.
        let copied = unsafe { self.copied(libc::process_vm_readv, here, address, into.len()) };
        copied.map_or(0, |copied| usize::try_from(copied).unwrap_or(0))
    }

    pub(super) fn of_this_process() -> Self {
        Self::new(std::process::id(), PointerWidth::Bits64)
    }
}

type Copy = unsafe extern "C" fn(
    libc::pid_t,
    *const libc::iovec,
    libc::c_ulong,
    *const libc::iovec,
    libc::c_ulong,
    libc::c_ulong,
) -> libc::ssize_t;

impl ProcessMemory {
    /// # Safety
    /// `here` must be valid for the `length` bytes that `copy` reads or writes there.
    unsafe fn copy(
        &self,
        copy: Copy,
        here: *mut libc::c_void,
        address: u64,
        length: usize,
    ) -> Result<(), Errno> {
        // SAFETY: the caller guarantees `here`.
        let copied = unsafe { self.copied(copy, here, address, length) }?;
        match usize::try_from(copied) {
            Ok(copied) if copied == length => Ok(()),
            // The copy reached the end of the caller's memory.
            Ok(_) => Err(Errno::FAULT),
            Err(_) => match Errno::from_io_error(&io::Error::last_os_error()) {
                Some(errno @ (Errno::PERM | Errno::NOSYS)) => Err(errno),
                _ => Err(Errno::FAULT),
            },
        }
    }
}

impl ProcessMemory {
    /// # Safety
    /// As [`copy`](Self::copy).
    unsafe fn copied(
        &self,
        copy: Copy,
        here: *mut libc::c_void,
        address: u64,
        length: usize,
    ) -> Result<libc::ssize_t, Errno> {
        let address = usize::try_from(address).or(Err(Errno::FAULT))?;
        let there = std::ptr::without_provenance_mut(address);
        let [here, there] = [here, there].map(|iov_base| libc::iovec {
            iov_base,
            iov_len: length,
        });
        // SAFETY: the caller guarantees `here`; the kernel checks `there`, which is in another process.
        Ok(unsafe { copy(self.pid, &raw const here, 1, &raw const there, 1, 0) })
    }
}

impl CallerMemory for ProcessMemory {
    fn read(&mut self, address: u64, into: &mut [u8]) -> Result<(), Errno> {
        if let Some(bytes) = self.in_block(address, into.len()) {
            into.copy_from_slice(bytes);
            return Ok(());
        }
        let here = into.as_mut_ptr().cast();
        // SAFETY: `into` is borrowed for the whole call and writable.
        unsafe { self.copy(libc::process_vm_readv, here, address, into.len()) }
    }

    fn write(&mut self, address: u64, bytes: &[u8]) -> Result<(), Errno> {
        self.block_at = 1;
        let here = bytes.as_ptr().cast_mut().cast();
        // SAFETY: `bytes` is borrowed for the whole call and only read.
        unsafe { self.copy(libc::process_vm_writev, here, address, bytes.len()) }
    }

    fn pointer_width(&self) -> PointerWidth {
        self.width
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
    fn missing_memory_is_efault() {
        let mut memory = ProcessMemory::of_this_process();
        for address in [0, 1, u64::MAX, u64::MAX - 1, 1 << 63] {
            let read = memory.read(address, &mut [0; 4]);
            let written = memory.write(address, &[0; 4]);
            assert_eq!([read, written], [Err(Errno::FAULT); 2], "{address:#x}");
        }
        let text = "read only";
        let address = u64::try_from(text.as_ptr().expose_provenance()).unwrap();
        assert_eq!(memory.write(address, b"R"), Err(Errno::FAULT));
        for pid in [0, u32::MAX] {
            let mut nobodys = ProcessMemory::new(pid, PointerWidth::Bits64);
            assert_eq!(nobodys.read(address, &mut [0]), Err(Errno::FAULT), "{pid}");
        }
    }

    /// Two pages, the second inaccessible: a buffer across their border is only partly there.
    #[test]
    fn a_buffer_that_is_there_only_in_part_is_efault() {
        const PAGE_BYTES: usize = 4096;
        // SAFETY: the mapping is new and private, and only its address is used.
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
        assert_eq!(memory.read(border - 2, &mut [0; 3]), Err(Errno::FAULT));
        assert_eq!(memory.write(border - 2, &[0; 3]), Err(Errno::FAULT));
    }
}
