//! Thin wrappers of system calls and C library functions.

use core::ffi::{CStr, c_char, c_int, c_long, c_void};
use core::sync::atomic::{AtomicBool, Ordering};

pub(super) type Errno = c_int;

pub(super) const EINTR: Errno = 4;
pub(super) const EBADF: Errno = 9;
pub(super) const EACCES: Errno = 13;
pub(super) const EFAULT: Errno = 14;
pub(super) const EEXIST: Errno = 17;
pub(super) const ENOTDIR: Errno = 20;
pub(super) const EINVAL: Errno = 22;
pub(super) const EMFILE: Errno = 24;
pub(super) const ENOSYS: Errno = 38;
pub(super) const EADDRINUSE: Errno = 98;
pub(super) const EOPNOTSUPP: Errno = 95;
pub(super) const ENOTCONN: Errno = 107;
const EPERM: Errno = 1;

const AF_UNIX: u16 = 1;
const SOCK_STREAM: usize = 1;
const SOCK_CLOEXEC: usize = 0o2_000_000;
const MSG_NOSIGNAL: usize = 0x4000;
const F_DUPFD_CLOEXEC: usize = 1030;
const AT_FDCWD: c_int = -100;
const SOCKET_NAME_BYTES: usize = 108;

#[cfg(not(any(
    target_arch = "x86_64",
    target_arch = "aarch64",
    target_arch = "riscv64",
    target_arch = "arm"
)))]
compile_error!("the numbers of this machine's system calls are not known");

/// System call numbers of x86-64, of arm64 and riscv64, and of 32-bit Arm.
mod number {
    const fn one_of(x86_64: i32, arm64: i32, arm: i32) -> i32 {
        if cfg!(target_arch = "x86_64") {
            x86_64
        } else if cfg!(target_arch = "arm") {
            arm
        } else {
            arm64
        }
    }

    pub(super) const SOCKET: i32 = one_of(41, 198, 281);
    pub(super) const BIND: i32 = one_of(49, 200, 282);
    pub(super) const CONNECT: i32 = one_of(42, 203, 283);
    pub(super) const GETSOCKNAME: i32 = one_of(51, 204, 286);
    pub(super) const SENDTO: i32 = one_of(44, 206, 290);
    pub(super) const RECVFROM: i32 = one_of(45, 207, 292);
    pub(super) const FCNTL: i32 = one_of(72, 25, 221);
    pub(super) const CLOSE: i32 = one_of(3, 57, 6);
    pub(super) const GETPID: i32 = one_of(39, 172, 20);
    pub(super) const READLINKAT: i32 = one_of(267, 78, 332);
    pub(super) const SCHED_YIELD: i32 = one_of(24, 124, 158);
    pub(super) const RT_SIGPROCMASK: i32 = one_of(14, 135, 175);
    pub(super) const PROCESS_VM_WRITEV: i32 = one_of(311, 271, 377);
}

// Every C library has these under these names. (Linking the C library itself would tie the library to one of them.)
unsafe extern "C" {
    fn syscall(number: c_long, ...) -> c_long;
    fn __errno_location() -> *mut c_int;
    fn dlsym(handle: *mut c_void, name: *const c_char) -> *mut c_void;
    fn getenv(name: *const c_char) -> *const c_char;
    #[cfg(not(test))]
    #[link_name = "abort"]
    fn abort_process() -> !;
}

#[cfg(not(test))]
pub(crate) fn abort() -> ! {
    // SAFETY: it takes no arguments and does not return.
    unsafe { abort_process() }
}

pub(super) fn errno() -> Errno {
    // SAFETY: the address is valid for the thread's life.
    unsafe { *__errno_location() }
}

pub(super) fn set_errno(errno: Errno) {
    // SAFETY: as above.
    unsafe { *__errno_location() = errno };
}

/// The address of the next function with this name after this library's own, or 0.
pub(super) fn next(name: &CStr) -> usize {
    const RTLD_NEXT: usize = usize::MAX;
    // SAFETY: the handle is the constant RTLD_NEXT, and the name is a C string.
    unsafe { dlsym(core::ptr::without_provenance_mut(RTLD_NEXT), name.as_ptr()) }
        .expose_provenance()
}

/// The value of an environment variable, valid until the program changes it.
pub(super) fn environment<'a>(name: &CStr) -> Option<&'a [u8]> {
    // SAFETY: the name is a C string.
    let value = unsafe { getenv(name.as_ptr()) };
    if value.is_null() {
        return None;
    }
    // SAFETY: getenv returned a C string; it is copied before the program can change it.
    Some(unsafe { CStr::from_ptr(value) }.to_bytes())
}

/// Makes a system call.
/// # Safety
/// Every argument that the kernel takes as an address must be valid for the kernel's access.
unsafe fn call(number: i32, arguments: [usize; 6]) -> Result<usize, Errno> {
    let [a, b, c, d, e, f] = arguments;
    let number = c_long::from(number);
    // SAFETY: the caller guarantees the arguments.
    let result = unsafe { syscall(number, a, b, c, d, e, f) };
    usize::try_from(result).map_err(|_negative| errno())
}

fn argument(number: c_int) -> usize {
    // The kernel reads only the lower half.
    usize::from_ne_bytes(isize::try_from(number).unwrap_or(-1).to_ne_bytes())
}

fn descriptor_of(result: usize) -> Result<c_int, Errno> {
    c_int::try_from(result).map_err(|_too_large| EBADF)
}

/// This process's number, queried each time so that it is right after a fork.
pub(super) fn own_pid() -> i32 {
    // SAFETY: there are no arguments.
    let pid = unsafe { call(number::GETPID, [0; 6]) };
    pid.map_or(-1, |pid| i32::try_from(pid).unwrap_or(-1))
}

pub(super) fn give_way() {
    // SAFETY: there are no arguments.
    let _ = unsafe { call(number::SCHED_YIELD, [0; 6]) };
}

pub(super) fn socket(close_on_exec: bool) -> Result<c_int, Errno> {
    let kind = SOCK_STREAM | if close_on_exec { SOCK_CLOEXEC } else { 0 };
    // SAFETY: no argument is an address.
    let result = unsafe { call(number::SOCKET, [AF_UNIX.into(), kind, 0, 0, 0, 0]) };
    result.and_then(descriptor_of)
}

/// Closes a descriptor; errors do not matter.
pub(super) fn close(descriptor: c_int) {
    // SAFETY: no argument is an address.
    let _ = unsafe { call(number::CLOSE, [argument(descriptor), 0, 0, 0, 0, 0]) };
}

/// Moves a descriptor to a number from `lowest` on, closed on exec; on failure leaves it in place.
pub(super) fn move_up(descriptor: c_int, lowest: usize) -> c_int {
    let arguments = [argument(descriptor), F_DUPFD_CLOEXEC, lowest, 0, 0, 0];
    // SAFETY: no argument is an address.
    match unsafe { call(number::FCNTL, arguments) }.and_then(descriptor_of) {
        Ok(moved) => {
            close(descriptor);
            moved
        }
        Err(_) => descriptor,
    }
}

/// The name of an abstract socket, without its leading zero byte.
#[repr(C)]
pub(super) struct SocketName {
    family: u16,
    bytes: [u8; SOCKET_NAME_BYTES],
    length: usize,
}

impl SocketName {
    /// Joins the parts. Bytes that do not fit are dropped, and the name then leads nowhere.
    pub(super) fn new(parts: &[&[u8]]) -> Self {
        let mut name = Self {
            family: AF_UNIX,
            bytes: [0; SOCKET_NAME_BYTES],
            length: 1,
        };
        let letters = parts.iter().flat_map(|part| part.iter());
        for (to, from) in name.bytes.iter_mut().skip(1).zip(letters) {
            *to = *from;
            name.length += 1;
        }
        name
    }

    fn of_address(address_bytes: usize) -> usize {
        size_of::<u16>() + address_bytes
    }
}

pub(super) fn bind(descriptor: c_int, name: &SocketName) -> Result<(), Errno> {
    with_name(number::BIND, descriptor, name)
}

pub(super) fn connect(descriptor: c_int, name: &SocketName) -> Result<(), Errno> {
    with_name(number::CONNECT, descriptor, name)
}

fn with_name(number: i32, descriptor: c_int, name: &SocketName) -> Result<(), Errno> {
    let at = core::ptr::from_ref(name).expose_provenance();
    let length = SocketName::of_address(name.length);
    let arguments = [argument(descriptor), at, length, 0, 0, 0];
    // SAFETY: both calls only read an address of that length, which `name` has.
    unsafe { call(number, arguments) }.map(drop)
}

/// Calls `with` on a socket's own abstract name, without its leading zero byte.
pub(super) fn with_own_name<T>(
    descriptor: c_int,
    with: impl FnOnce(&[u8]) -> Option<T>,
) -> Option<T> {
    let mut name = SocketName::new(&[]);
    let mut length = u32::try_from(SocketName::of_address(SOCKET_NAME_BYTES)).unwrap_or(0);
    let at = core::ptr::from_mut(&mut name).expose_provenance();
    let length_at = core::ptr::from_mut(&mut length).expose_provenance();
    let arguments = [argument(descriptor), at, length_at, 0, 0, 0];
    // SAFETY: the kernel writes at most `length` bytes of address, and the length; both have room.
    unsafe { call(number::GETSOCKNAME, arguments) }.ok()?;
    let length = usize::try_from(length).ok()?;
    let end = length.checked_sub(size_of::<u16>())?;
    let (first, rest) = name.bytes.get(..end)?.split_first()?;
    let without_path = name.family == AF_UNIX && *first == 0;
    without_path.then(|| with(rest)).flatten()
}

pub(super) fn send(descriptor: c_int, mut bytes: &[u8]) -> Result<(), Errno> {
    while !bytes.is_empty() {
        let at = bytes.as_ptr().expose_provenance();
        let arguments = [argument(descriptor), at, bytes.len(), MSG_NOSIGNAL, 0, 0];
        // SAFETY: the kernel only reads `bytes`.
        match unsafe { call(number::SENDTO, arguments) } {
            Ok(sent) => bytes = bytes.get(sent..).unwrap_or(&[]),
            Err(EINTR) => {}
            Err(errno) => return Err(errno),
        }
    }
    Ok(())
}

/// Receives at least one byte, waiting if needed; the end of the connection is ENOTCONN.
pub(super) fn receive(descriptor: c_int, into: &mut [u8]) -> Result<usize, Errno> {
    let at = into.as_mut_ptr().expose_provenance();
    let arguments = [argument(descriptor), at, into.len(), 0, 0, 0];
    loop {
        // SAFETY: the kernel only writes into `into`.
        match unsafe { call(number::RECVFROM, arguments) } {
            Ok(0) => return Err(ENOTCONN),
            Err(EINTR) => {}
            result => return result,
        }
    }
}

/// The target of a symbolic link, as far as it fits.
pub(super) fn read_link<'a>(path: &CStr, into: &'a mut [u8]) -> Option<&'a [u8]> {
    let text_at = into.as_mut_ptr().expose_provenance();
    let path_at = path.as_ptr().expose_provenance();
    let arguments = [argument(AT_FDCWD), path_at, text_at, into.len(), 0, 0];
    // SAFETY: the kernel reads the path and writes into `into`.
    let length = unsafe { call(number::READLINKAT, arguments) }.ok()?;
    into.get(..length)
}

/// Copies from an address that may be invalid. The kernel checks it first, five times cheaper than process_vm_readv.
pub(super) fn peek(address: u64, into: &mut [u8]) -> Result<(), Errno> {
    const PAGE_BYTES: usize = 4096;
    let start = usize::try_from(address).or(Err(EFAULT))?;
    let Some(last) = into.len().checked_sub(1) else {
        return Ok(());
    };
    let last = start.checked_add(last).ok_or(EFAULT)?;
    let mut page = start;
    while page <= last {
        look_at_word(page)?;
        page = (page - page % PAGE_BYTES)
            .checked_add(PAGE_BYTES)
            .ok_or(EFAULT)?;
    }
    let there = core::ptr::with_exposed_provenance::<u8>(start);
    // SAFETY: the kernel has just read from every page of the source, and `into` has room. A program that unmaps the
    // source at the same time would break any C library function too.
    unsafe { core::ptr::copy(there, into.as_mut_ptr(), into.len()) };
    Ok(())
}

/// EFAULT if the word around an address is not readable; a word never spans two pages.
fn look_at_word(address: usize) -> Result<(), Errno> {
    const SENSELESS: c_int = -1;
    const WORD_BYTES: usize = 8;
    // At address 0 the kernel would read no word.
    let word = (address - address % WORD_BYTES).max(1);
    let arguments = [argument(SENSELESS), word, 0, WORD_BYTES, 0, 0];
    // SAFETY: the kernel checks the word's address and writes nothing, since there is no place for the old mask.
    match unsafe { call(number::RT_SIGPROCMASK, arguments) } {
        Err(EFAULT) => Err(EFAULT),
        _ => Ok(()),
    }
}

/// Copies to an address that may be invalid.
pub(super) fn poke(address: u64, bytes: &[u8]) -> Result<(), Errno> {
    let here = bytes.as_ptr();
    if let Some(outcome) = copy_out(here.expose_provenance(), address, bytes.len()) {
        return outcome;
    }
    let there = usize::try_from(address).or(Err(EFAULT))?;
    let there = core::ptr::with_exposed_provenance_mut::<u8>(there);
    // SAFETY: the program claims that its memory is there, as for any C library function.
    unsafe { core::ptr::copy(here, there, bytes.len()) };
    Ok(())
}

#[repr(C)]
struct Span {
    start: usize,
    length: usize,
}

/// Makes the kernel copy within this process, so that a bad address returns an errno. `None` if the kernel may not do
/// this (a sandbox, qemu-user): there a bad address ends the program, as in any C library function.
fn copy_out(here: usize, there: u64, length: usize) -> Option<Result<(), Errno>> {
    static FORBIDDEN: AtomicBool = AtomicBool::new(false);
    if FORBIDDEN.load(Ordering::Relaxed) {
        return None;
    }
    let Ok(there) = usize::try_from(there) else {
        return Some(Err(EFAULT));
    };
    let spans = [here, there].map(|start| Span { start, length });
    let [here, there] = spans
        .each_ref()
        .map(|span| core::ptr::from_ref(span).expose_provenance());
    let arguments = [argument(own_pid()), here, 1, there, 1, 0];
    // SAFETY: the kernel checks both spans; this side's is a slice of the caller's.
    match unsafe { call(number::PROCESS_VM_WRITEV, arguments) } {
        Ok(copied) if copied == length => Some(Ok(())),
        Err(ENOSYS | EPERM) => {
            FORBIDDEN.store(true, Ordering::Relaxed);
            None
        }
        _ => Some(Err(EFAULT)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE_BYTES: usize = 4096;

    /// The border of two pages; the second has only these rights.
    fn border(rights: c_int) -> usize {
        // SAFETY: the mapping is new, private and never freed.
        unsafe {
            let flags = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS;
            let all = libc::PROT_READ | libc::PROT_WRITE;
            let pages = libc::mmap(core::ptr::null_mut(), 2 * PAGE_BYTES, all, flags, -1, 0);
            assert_ne!(pages, libc::MAP_FAILED);
            let second = pages.byte_add(PAGE_BYTES);
            assert_eq!(libc::mprotect(second, PAGE_BYTES, rights), 0);
            second.expose_provenance()
        }
    }

    #[test]
    fn missing_memory_is_efault_and_not_the_programs_end() {
        let border = u64::try_from(border(libc::PROT_NONE)).unwrap();
        for length in [1, 2, 8, 100] {
            let length_64 = u64::try_from(length).unwrap();
            let mut bytes = vec![7; length];
            assert_eq!(peek(border - length_64, &mut bytes), Ok(()), "{length}");
            assert_eq!(bytes, vec![0; length]);
            let across = border - length_64 + 1;
            assert_eq!(peek(across, &mut bytes), Err(EFAULT), "{length}");
            assert_eq!(poke(border - length_64, &bytes), Ok(()), "{length}");
            assert_eq!(poke(across, &bytes), Err(EFAULT), "{length}");
        }
        let mut long = vec![0; PAGE_BYTES];
        assert_eq!(peek(border - 4095, &mut long), Err(EFAULT));
        for address in [0, 1, 9, u64::MAX, u64::MAX - 3, 1 << 63] {
            assert_eq!(peek(address, &mut [0; 4]), Err(EFAULT), "{address:#x}");
            assert_eq!(poke(address, &[0; 4]), Err(EFAULT), "{address:#x}");
            assert_eq!(peek(address, &mut []), Ok(()), "{address:#x}");
        }
    }

    #[test]
    fn memory_that_may_only_be_read_is_not_written() {
        let border = u64::try_from(border(libc::PROT_READ)).unwrap();
        assert_eq!(peek(border - 2, &mut [0; 4]), Ok(()));
        assert_eq!(poke(border - 2, &[1; 4]), Err(EFAULT));
        assert_eq!(poke(border - 2, &[1; 2]), Ok(()));
    }

    #[test]
    fn only_an_abstract_name_counts() {
        let socket = socket(true).unwrap();
        assert_eq!(with_own_name(socket, |_| Some(())), None, "no name at all");
        let name = SocketName::new(&[b"i2c-emulation-test", b"/t", b"1"]);
        bind(socket, &name).unwrap();
        let own = with_own_name(socket, |name| Some(name.to_vec()));
        assert_eq!(own.as_deref(), Some(&b"i2c-emulation-test/t1"[..]));
        close(socket);
        assert_eq!(with_own_name(socket, |_| Some(())), None);
        assert_eq!(with_own_name(0, |_| Some(())), None, "not a socket");
    }
}
