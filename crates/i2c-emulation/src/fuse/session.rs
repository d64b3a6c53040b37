//! The answers: from one request of the kernel to the bytes that go back, without any system call.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use super::wire::{self, Question, Request};
use crate::adapter::EmulatedAdapter;
use crate::ioctl::{AdapterMode, CallerMemory, Errno, MESSAGE_BYTES_MAX, OpenFile, PointerWidth};

/// Most files that may be open at once; one more is ENFILE.
pub const OPEN_FILES_MAX: usize = 1024;

/// Finds the memory of a caller by its process number.
pub(super) type MemoryOf<'a> = dyn FnMut(u32, PointerWidth) -> Box<dyn CallerMemory> + 'a;

/// The bus of one device, which the caller of `run` may use meanwhile.
pub(super) type SharedBus<'a> = Mutex<dyn EmulatedAdapter + Send + 'a>;

/// What to do after a request.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Reply {
    /// Send these bytes.
    Bytes(Vec<u8>),
    /// The kernel expects no answer.
    Nothing,
    /// The kernel speaks a protocol that this server does not.
    Incompatible { major: u32, minor: u32 },
}

/// All open files of one mounted device.
pub(super) struct Session {
    mode: AdapterMode,
    owner: u32,
    group: u32,
    files: HashMap<u64, OpenFile>,
    handle_next: u64,
}

impl Session {
    /// A device that nobody has opened, shown as belonging to `owner` and `group`.
    pub(super) fn new(mode: AdapterMode, owner: u32, group: u32) -> Self {
        Self {
            mode,
            owner,
            group,
            files: HashMap::new(),
            handle_next: 1,
        }
    }

    /// Answers one request. The adapter is held for the length of one transfer, never longer.
    pub(super) fn answer(
        &mut self,
        request: &[u8],
        memory_of: &mut MemoryOf<'_>,
        adapter: &SharedBus<'_>,
    ) -> Reply {
        let Some(Request {
            unique,
            pid,
            question,
        }) = Request::parse(request)
        else {
            return Reply::Nothing;
        };
        let outcome = match question {
            Err(errno) => Err(errno),
            Ok(Question::Forget) => return Reply::Nothing,
            Ok(Question::Init { major, minor, .. })
                if major != wire::MAJOR || minor < wire::MINOR =>
            {
                return Reply::Incompatible { major, minor };
            }
            Ok(Question::Read { handle, length }) => self.read(handle, length, adapter),
            Ok(Question::Write { handle, bytes }) => self.write(handle, bytes, adapter),
            Ok(Question::Ioctl {
                handle,
                request,
                argument,
                from_32_bit,
            }) => {
                let width = if from_32_bit {
                    PointerWidth::Bits32
                } else {
                    PointerWidth::Bits64
                };
                let mut memory = memory_of(pid, width);
                self.ioctl(handle, request, argument, memory.as_mut(), adapter)
            }
            Ok(question) => self.housekeeping(&question),
        };
        Reply::Bytes(wire::answer(unique, outcome))
    }

    fn read(
        &mut self,
        handle: u64,
        length: usize,
        adapter: &SharedBus<'_>,
    ) -> Result<Vec<u8>, Errno> {
        let file = self.file(handle)?;
        let mut buffer = vec![0; length.min(MESSAGE_BYTES_MAX)];
        let arrived = with(adapter, |bus| file.read(&mut buffer, bus))?;
        buffer.truncate(arrived);
        Ok(buffer)
    }

    fn write(
        &mut self,
        handle: u64,
        bytes: &[u8],
        adapter: &SharedBus<'_>,
    ) -> Result<Vec<u8>, Errno> {
        let file = self.file(handle)?;
        with(adapter, |bus| file.write(bytes, bus)).map(wire::written)
    }

    fn ioctl(
        &mut self,
        handle: u64,
        request: u32,
        argument: u64,
        memory: &mut dyn CallerMemory,
        adapter: &SharedBus<'_>,
    ) -> Result<Vec<u8>, Errno> {
        let file = self.file(handle)?;
        with(adapter, |bus| file.ioctl(request, argument, memory, bus)).map(wire::ioctl_done)
    }

    /// Everything that does not reach the bus.
    fn housekeeping(&mut self, question: &Question<'_>) -> Result<Vec<u8>, Errno> {
        match *question {
            Question::Init { read_ahead, .. } => Ok(wire::init(read_ahead)),
            Question::Lookup => Err(Errno::ENOENT),
            Question::SetAttributes {
                of_mode_or_owner: true,
            } => Err(Errno::EPERM),
            Question::GetAttributes | Question::SetAttributes { .. } => {
                Ok(wire::attributes(self.owner, self.group))
            }
            Question::Open => self.open().map(wire::opened),
            Question::Release { handle } => {
                self.files.remove(&handle);
                Ok(Vec::new())
            }
            Question::Flush | Question::Access | Question::Destroy => Ok(Vec::new()),
            Question::Statistics => Ok(wire::statistics()),
            _ => Err(Errno::ENOSYS),
        }
    }

    /// How often the device has been opened.
    pub(super) fn opens(&self) -> u64 {
        self.handle_next - 1
    }

    fn open(&mut self) -> Result<u64, Errno> {
        if self.files.len() >= OPEN_FILES_MAX {
            return Err(Errno::ENFILE);
        }
        let handle = self.handle_next;
        self.handle_next += 1;
        self.files.insert(handle, OpenFile::new(self.mode));
        Ok(handle)
    }

    fn file(&mut self, handle: u64) -> Result<&mut OpenFile, Errno> {
        self.files.get_mut(&handle).ok_or(Errno::EINVAL)
    }
}

/// Holds the adapter for one transfer. A panic elsewhere while it was held is no reason to hang the program as well.
fn with<T>(adapter: &SharedBus<'_>, transfer: impl FnOnce(&mut dyn EmulatedAdapter) -> T) -> T {
    transfer(&mut *adapter.lock().unwrap_or_else(PoisonError::into_inner))
}

#[cfg(test)]
mod tests;
