//! The emulator's side: open files, and one thread per channel.

use super::protocol::{
    Answer, BUSES_MAX, CHUNK_BYTES_MAX, Call, HELLO_BYTES, Hello, Purpose, REGION_BYTES,
    REQUEST_BYTES, REQUEST_BYTES_MAX, Request, TOKEN_MARK, number_of, u64_at,
};
use crate::guests::{Guests, lock};
use crate::ioctl::{AdapterMode, CallerMemory, Errno, MESSAGE_BYTES_MAX, OpenFile, PointerWidth};
use crate::rack::{Rack, SharedAdapter};
use crate::run::{PRELOAD_NEEDS, RunError, setup_failed};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::retry_on_intr;
use rustix::net::Shutdown;
use std::cmp::Ordering;
use std::collections::HashMap;
use std::fs;
use std::io::{self, Read, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener, UnixStream};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex};
use std::thread::Scope;

/// The most files open at once, over all processes; one more returns ENFILE.
pub const OPEN_FILES_MAX: usize = 512;
/// The most connections that carry calls, over all processes. Each process has one per call in progress, at most 8. A
/// call without a connection returns ENFILE.
pub const CHANNELS_MAX: usize = 256;
/// The most connections without a hello; one more drops the oldest.
pub const STRANGERS_MAX: usize = 64;

/// How long to stop accepting when descriptors have run out.
const PAUSE: Timespec = Timespec {
    tv_sec: 0,
    tv_nsec: 50_000_000,
};

pub(super) struct Server {
    mode: AdapterMode,
    buses: HashMap<u32, SharedAdapter>,
    name: String,
    secret: u128,
    listener: UnixListener,
    files: Mutex<HashMap<u64, Arc<Mutex<File>>>>,
    channels: Arc<Guests<UnixStream>>,
    opens: AtomicU64,
}

struct File {
    open: OpenFile,
    bus: SharedAdapter,
    access: u32,
}

/// A connection without a thread: a token, or a stranger before its hello.
struct Guest {
    stream: UnixStream,
    /// A stranger's bytes so far.
    said: Vec<u8>,
    /// A token's file, where only its end can still come; `None` for a stranger.
    file: Option<u64>,
}

impl Server {
    pub(super) fn new(rack: &Rack, mode: AdapterMode) -> Result<Self, RunError> {
        let buses: HashMap<u32, SharedAdapter> = rack.iter().collect();
        if buses.len() > BUSES_MAX {
            return Err(RunError::TooManyBuses {
                found: buses.len(),
                max: BUSES_MAX,
            });
        }
        let failed = |source| setup_failed("reading /dev/urandom", source, PRELOAD_NEEDS);
        let number = u64::from_ne_bytes(random().map_err(failed)?);
        let secret = u128::from_ne_bytes(random().map_err(failed)?);
        let name = format!("i2c-emulation-{number:016x}");
        let listener = SocketAddr::from_abstract_name(&name)
            .and_then(|address| UnixListener::bind_addr(&address))
            .and_then(|listener| listener.set_nonblocking(true).map(|()| listener))
            .map_err(|source| {
                setup_failed("making a socket without a path", source, PRELOAD_NEEDS)
            })?;
        Ok(Self {
            mode,
            buses,
            name,
            secret,
            listener,
            files: Mutex::default(),
            channels: Guests::new(),
            opens: AtomicU64::new(0),
        })
    }

    /// The library's settings, as the value of its environment variable.
    pub(super) fn address(&self) -> String {
        let mut numbers: Vec<u32> = self.buses.keys().copied().collect();
        numbers.sort_unstable();
        let numbers: Vec<String> = numbers.iter().map(u32::to_string).collect();
        format!("{}:{:032x}:{}", self.name, self.secret, numbers.join(","))
    }

    pub(super) fn opens(&self) -> u64 {
        self.opens.load(Relaxed)
    }

    /// Admits connections until `wake` is closed, then ends them all.
    pub(super) fn serve<'scope>(
        &'scope self,
        wake: BorrowedFd<'_>,
        scope: &'scope Scope<'scope, '_>,
    ) {
        let mut guests: Vec<Guest> = Vec::new();
        let mut full = false;
        loop {
            let streams = guests.iter().map(|guest| guest.stream.as_fd());
            let listener = (!full).then_some(self.listener.as_fd());
            let streams = [wake].into_iter().chain(streams).chain(listener);
            let waited_for = |stream| PollFd::from_borrowed_fd(stream, PollFlags::IN);
            let mut waited_for: Vec<PollFd<'_>> = streams.map(waited_for).collect();
            let pause = full.then_some(&PAUSE);
            let failed = retry_on_intr(|| poll(&mut waited_for, pause)).is_err();
            let awake = waited_for.iter().map(|entry| !entry.revents().is_empty());
            let awake: Vec<bool> = awake.collect();
            if failed || awake.first() == Some(&true) {
                break;
            }
            let pairs = guests.into_iter().zip(awake.into_iter().skip(1));
            let stay = pairs.filter_map(|(guest, awake)| match awake {
                true => self.attend(guest, scope),
                false => Some(guest),
            });
            guests = stay.collect();
            full = self.let_in(&mut guests);
        }
        self.channels.stop(Shutdown::Both);
    }

    /// Accepts waiting connections; returns whether descriptors ran out.
    fn let_in(&self, guests: &mut Vec<Guest>) -> bool {
        loop {
            match self.listener.accept() {
                Ok((stream, _)) => {
                    let is_stranger = |guest: &Guest| guest.file.is_none();
                    let strangers = guests.iter().filter(|guest| is_stranger(guest)).count();
                    let oldest = guests.iter().position(is_stranger);
                    if let Some(oldest) = oldest.filter(|_| strangers >= STRANGERS_MAX) {
                        guests.remove(oldest);
                    }
                    if stream.set_nonblocking(true).is_ok() {
                        let (said, file) = (Vec::with_capacity(HELLO_BYTES), None);
                        guests.push(Guest { stream, said, file });
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return false,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(_) => return true,
            }
        }
    }

    /// Reads from a guest; `None` if it is no longer one.
    fn attend<'scope>(
        &'scope self,
        mut guest: Guest,
        scope: &'scope Scope<'scope, '_>,
    ) -> Option<Guest> {
        if let Some(file) = guest.file {
            lock(&self.files).remove(&file);
            return None;
        }
        let mut bytes = [0; HELLO_BYTES];
        let room = bytes.len() - guest.said.len();
        match guest.stream.read(&mut bytes[..room]) {
            Ok(0) => return None,
            Ok(length) => guest.said.extend_from_slice(&bytes[..length]),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(_) => return None,
        }
        match guest.said.first_chunk() {
            None => Some(guest),
            Some(hello) => self.welcome(Hello::parse(hello)?, guest.stream, scope),
        }
    }

    /// Drops a connection that does not know the secret, without an answer.
    fn welcome<'scope>(
        &'scope self,
        hello: Hello,
        stream: UnixStream,
        scope: &'scope Scope<'scope, '_>,
    ) -> Option<Guest> {
        if hello.secret != self.secret {
            return None;
        }
        match hello.purpose {
            Purpose::Token { bus, flags } => {
                let file = token_number(&stream, &self.name)?;
                let outcome = self.open(file, bus, flags);
                tell(&stream, outcome).ok()?;
                outcome.ok()?;
                // A reader that bypasses the library sees the token's end instead of waiting forever.
                rustix::net::shutdown(&stream, Shutdown::Write).ok()?;
                let (said, file) = (Vec::new(), Some(file));
                Some(Guest { stream, said, file })
            }
            Purpose::Channel => {
                stream.set_nonblocking(false).ok()?;
                let stream = Arc::new(stream);
                let admitted = self.channels.admit(&stream, CHANNELS_MAX);
                tell(&stream, admitted.as_ref().map(|_| ()).or(Err(Errno::NFILE))).ok()?;
                let admitted = admitted.ok()?;
                let width = match hello.pointer_bytes {
                    4 => PointerWidth::Bits32,
                    _ => PointerWidth::Bits64,
                };
                scope.spawn(move || {
                    // When the thread ends, even by a panic of the bus, the program must not wait for an answer.
                    let _admitted = admitted;
                    // The error of a broken connection does not matter.
                    let _ = self.converse(&stream, width);
                });
                None
            }
        }
    }

    fn open(&self, number: u64, bus: u32, access: u32) -> Result<(), Errno> {
        let bus = self.buses.get(&bus).cloned().ok_or(Errno::NODEV)?;
        let mut files = lock(&self.files);
        if files.len() >= OPEN_FILES_MAX {
            return Err(Errno::NFILE);
        }
        let open = OpenFile::new(self.mode);
        let file = Arc::new(Mutex::new(File { open, bus, access }));
        files.insert(number, file);
        self.opens.fetch_add(1, Relaxed);
        Ok(())
    }

    fn converse(&self, stream: &UnixStream, width: PointerWidth) -> io::Result<()> {
        let mut buffer = [0; REQUEST_BYTES_MAX];
        let mut answers = Vec::with_capacity(REQUEST_BYTES_MAX);
        let mut filled = 0;
        loop {
            let request = loop {
                if let Some(front) = buffer[..filled].first_chunk::<REQUEST_BYTES>() {
                    let request = Request::parse(front).ok_or(io::ErrorKind::InvalidData)?;
                    let length = usize::try_from(request.memory_bytes).map_err(io::Error::other)?;
                    // A caller waits for its answer, so nothing can follow its request.
                    match filled.cmp(&(REQUEST_BYTES + length)) {
                        Ordering::Less => {}
                        Ordering::Equal => break request,
                        Ordering::Greater => return Err(io::ErrorKind::InvalidData.into()),
                    }
                }
                match { stream }.read(&mut buffer[filled..]) {
                    Ok(0) => return Ok(()),
                    Ok(length) => filled += length,
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    Err(error) => return Err(error),
                }
            };
            let mut caller = Caller {
                stream,
                regions: &buffer[REQUEST_BYTES..filled],
                answers: &mut answers,
                width,
            };
            let outcome = self.perform(request, &mut caller);
            let result = outcome.unwrap_or_else(|errno| -i64::from(errno.raw_os_error()));
            answers.extend(Answer::Done(result).to_bytes());
            { stream }.write_all(&answers)?;
            answers.clear();
            filled = 0;
        }
    }

    fn perform(&self, request: Request, caller: &mut Caller<'_>) -> Result<i64, Errno> {
        let file = lock(&self.files).get(&request.file).map(Arc::clone);
        let file = file.ok_or(Errno::BADF)?;
        let File { open, bus, access } = &mut *lock(&file);
        match request.call {
            Call::Ioctl { request, argument } => {
                open.ioctl(request, argument, caller, bus).map(i64::from)
            }
            Call::Read { .. } if *access == WRITE_ONLY => Err(Errno::BADF),
            Call::Write { .. } if *access == READ_ONLY => Err(Errno::BADF),
            Call::Read { buffer, length } => {
                let mut bytes = vec![0; transfer_length(length)];
                let arrived = open.read(&mut bytes, bus)?;
                caller.write(buffer, &bytes[..arrived])?;
                count(arrived)
            }
            Call::Write { buffer, length } => {
                let mut bytes = vec![0; transfer_length(length)];
                caller.read(buffer, &mut bytes)?;
                open.write(&bytes, bus).and_then(count)
            }
        }
    }
}

/// O_RDONLY and O_WRONLY.
const READ_ONLY: u32 = 0;
const WRITE_ONLY: u32 = 1;

/// The memory of the process at the other end of a channel: the part sent with its request; the rest is fetched by
/// Peek.
struct Caller<'a> {
    stream: &'a UnixStream,
    regions: &'a [u8],
    answers: &'a mut Vec<u8>,
    width: PointerWidth,
}

impl Caller<'_> {
    /// The bytes at an address, if the request carried them.
    fn sent_along(&self, address: u64, length: usize) -> Option<&[u8]> {
        let mut rest = self.regions;
        while rest.len() >= REGION_BYTES {
            let (start, size) = (u64_at(rest, 0), usize::try_from(u64_at(rest, 8)).ok()?);
            let bytes = rest.get(REGION_BYTES..REGION_BYTES.checked_add(size)?)?;
            let found = address.checked_sub(start).and_then(|offset| {
                let offset = usize::try_from(offset).ok()?;
                bytes.get(offset..offset.checked_add(length)?)
            });
            if found.is_some() {
                return found;
            }
            rest = rest.get(REGION_BYTES + size..)?;
        }
        None
    }

    fn ask(&mut self, address: u64, into: &mut [u8]) -> io::Result<bool> {
        let length = u32::try_from(into.len()).map_err(io::Error::other)?;
        self.answers
            .extend(Answer::Peek { address, length }.to_bytes());
        self.stream.write_all(self.answers)?;
        self.answers.clear();
        let mut there = [0];
        self.stream.read_exact(&mut there)?;
        if there == [0] {
            return Ok(false);
        }
        self.stream.read_exact(into).map(|()| true)
    }
}

impl CallerMemory for Caller<'_> {
    fn read(&mut self, address: u64, into: &mut [u8]) -> Result<(), Errno> {
        if let Some(bytes) = self.sent_along(address, into.len()) {
            into.copy_from_slice(bytes);
            return Ok(());
        }
        let mut at = address;
        for piece in into.chunks_mut(CHUNK_BYTES_MAX) {
            if !matches!(self.ask(at, piece), Ok(true)) {
                return Err(Errno::FAULT);
            }
            at = at.wrapping_add(u64::try_from(piece.len()).unwrap_or(u64::MAX));
        }
        Ok(())
    }

    /// The library does the write; if it fails, it turns the call's result into EFAULT.
    fn write(&mut self, address: u64, bytes: &[u8]) -> Result<(), Errno> {
        let mut address = address;
        for piece in bytes.chunks(CHUNK_BYTES_MAX) {
            let length = u32::try_from(piece.len()).or(Err(Errno::FAULT))?;
            self.answers
                .extend(Answer::Poke { address, length }.to_bytes());
            self.answers.extend_from_slice(piece);
            address = address.wrapping_add(length.into());
        }
        Ok(())
    }

    fn pointer_width(&self) -> PointerWidth {
        self.width
    }
}

fn transfer_length(asked: u64) -> usize {
    usize::try_from(asked).map_or(MESSAGE_BYTES_MAX, |asked| asked.min(MESSAGE_BYTES_MAX))
}

fn count(bytes: usize) -> Result<i64, Errno> {
    i64::try_from(bytes).or(Err(Errno::INVAL))
}

/// The number in a token's own name.
fn token_number(stream: &UnixStream, socket: &str) -> Option<u64> {
    let address = stream.peer_addr().ok()?;
    number_of(address.as_abstract_name()?, socket.as_bytes(), TOKEN_MARK)
}

fn tell(mut stream: &UnixStream, outcome: Result<(), Errno>) -> io::Result<()> {
    let errno = outcome.map_or_else(Errno::raw_os_error, |()| 0);
    stream.write_all(&errno.to_ne_bytes())
}

fn random<const N: usize>() -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    fs::File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests;
