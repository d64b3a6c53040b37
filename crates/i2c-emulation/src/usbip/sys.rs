//! The one system call that std has no wrapper for.
#![expect(unsafe_code, reason = "socket options have no wrapper in std")]

use std::io;
use std::net::TcpStream;
use std::os::fd::AsRawFd as _;

/// Seconds without a byte after which the kernel asks the other side whether it is still there.
const SILENCE_S: libc::c_int = 5;
/// Seconds between two such questions.
const ASK_EVERY_S: libc::c_int = 5;
/// Unanswered questions after which the connection is dead.
const ASK_MAX: libc::c_int = 3;

/// Lets the kernel end a connection whose other side has vanished without a word, after twenty seconds.
pub(super) fn keep_alive(stream: &TcpStream) -> io::Result<()> {
    set(stream, libc::SOL_SOCKET, libc::SO_KEEPALIVE, 1)?;
    set(stream, libc::IPPROTO_TCP, libc::TCP_KEEPIDLE, SILENCE_S)?;
    set(stream, libc::IPPROTO_TCP, libc::TCP_KEEPINTVL, ASK_EVERY_S)?;
    set(stream, libc::IPPROTO_TCP, libc::TCP_KEEPCNT, ASK_MAX)
}

fn set(
    stream: &TcpStream,
    level: libc::c_int,
    name: libc::c_int,
    value: libc::c_int,
) -> io::Result<()> {
    let bytes = libc::socklen_t::try_from(size_of::<libc::c_int>()).map_err(io::Error::other)?;
    // SAFETY: pointer and length describe `value`, which outlives the call; the descriptor is open.
    let result = unsafe {
        libc::setsockopt(
            stream.as_raw_fd(),
            level,
            name,
            (&raw const value).cast(),
            bytes,
        )
    };
    if result < 0 {
        Err(io::Error::last_os_error())
    } else {
        Ok(())
    }
}
