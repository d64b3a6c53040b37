//! Answers the program's calls: which concern a device, and what i2c-dev would do.

use super::attributes;
use super::call::{Call, Machine, Path, Position, Transfer};
use super::file;
use super::listener::{Answer, Listener, Question};
use super::memory::ProcessMemory;
use super::subject::{Devices, FileName, Subject};
use crate::guests::lock;
use crate::ioctl::{AdapterMode, CallerMemory, Errno, MESSAGE_BYTES_MAX, OpenFile, PointerWidth};
use crate::rack::{Rack, SharedAdapter};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// The most files of devices that are open at once; one more returns ENFILE.
pub const OPEN_FILES_MAX: usize = 1024;

/// The most buffers of one call (UIO_MAXIOV).
const PIECES_MAX: usize = 1024;
/// The only flag that the kernel takes for a device with just read() and write().
const RWF_HIPRI: u32 = 1;
const X_OK: u32 = 1;

const O_ACCMODE: u32 = 3;
const O_WRONLY: u32 = 1;
const O_CREAT: u32 = 0o100;
const O_EXCL: u32 = 0o200;
const O_CLOEXEC: u32 = 0o2_000_000;
/// What F_GETFL does not tell: O_CREAT, O_EXCL, O_NOCTTY, O_TRUNC and O_CLOEXEC.
const O_NOT_KEPT: u32 = 0o2_001_700;

pub(super) struct Session<'a> {
    rack: &'a Rack,
    mode: AdapterMode,
    pub(super) devices: Devices,
    files: Mutex<HashMap<FileName, Arc<Opened>>>,
    opens: AtomicU64,
}

struct Opened {
    bus: SharedAdapter,
    flags: u32,
    state: Mutex<OpenFile>,
}

impl<'a> Session<'a> {
    pub(super) fn new(rack: &'a Rack, mode: AdapterMode) -> Self {
        Self {
            rack,
            mode,
            devices: Devices {
                server: std::process::id(),
                buses: rack.iter().map(|(number, _)| number).collect(),
            },
            files: Mutex::default(),
            opens: AtomicU64::new(0),
        }
    }

    pub(super) fn opens(&self) -> u64 {
        self.opens.load(Ordering::Relaxed)
    }

    /// Answers one call.
    pub(super) fn answer(&self, question: &Question, listener: &Listener) -> Answer {
        let Some(subject) = self.devices.subject_of(question) else {
            return Answer::AsEver;
        };
        // The thread's number may have been another's since.
        if !listener.waits(question.id) {
            return Answer::Nothing;
        }
        let answered = match subject {
            Subject::Path(bus) => self.answer_path(question, bus, listener),
            Subject::File(name) => self.answer_file(question, name, listener),
        };
        answered.unwrap_or_else(Answer::Failed)
    }

    fn answer_path(
        &self,
        question: &Question,
        bus: u32,
        listener: &Listener,
    ) -> Result<Answer, Errno> {
        match question.call {
            Call::Open(_) | Call::Create | Call::OpenHow => {
                self.open(question, bus, listener).map(Answer::Done)
            }
            Call::Access(at) => {
                let wanted = question.word(match at {
                    Path::First => 1,
                    Path::InFolder => 2,
                });
                match wanted & X_OK {
                    0 => Ok(Answer::Done(0)),
                    _ => Err(Errno::ACCESS),
                }
            }
            _ => tell_attributes(question, bus),
        }
    }

    fn open(&self, question: &Question, bus: u32, listener: &Listener) -> Result<i64, Errno> {
        let flags = open_flags(question)?;
        if flags & (O_CREAT | O_EXCL) == O_CREAT | O_EXCL {
            return Err(Errno::EXIST);
        }
        if flags & o_directory(question.machine) != 0 {
            return Err(Errno::NOTDIR);
        }
        if lock(&self.files).len() >= OPEN_FILES_MAX {
            let used = file::in_use(|process, number| self.devices.file(process, number));
            lock(&self.files).retain(|name, _| used.contains(name));
        }
        let mut files = lock(&self.files);
        if files.len() >= OPEN_FILES_MAX {
            return Err(Errno::NFILE);
        }
        let (name, made) = file::make(self.devices.server, bus)?;
        files.insert(name, self.opened(name, flags & !O_NOT_KEPT)?);
        drop(files);
        let close_on_exec = flags & O_CLOEXEC != 0;
        let given = file::give(listener, question.id, question.thread, &made, close_on_exec);
        match given {
            Ok(_) => self.opens.fetch_add(1, Ordering::Relaxed),
            Err(errno) => {
                lock(&self.files).remove(&name);
                return Err(errno);
            }
        };
        given
    }

    fn opened(&self, name: FileName, flags: u32) -> Result<Arc<Opened>, Errno> {
        Ok(Arc::new(Opened {
            bus: self.rack.get(name.bus).ok_or(Errno::NODEV)?,
            flags,
            state: Mutex::new(OpenFile::new(self.mode)),
        }))
    }

    fn answer_file(
        &self,
        question: &Question,
        name: FileName,
        listener: &Listener,
    ) -> Result<Answer, Errno> {
        const F_GETFL: u32 = 3;
        const F_DUPFD_CLOEXEC: u32 = 1030;
        const O_RDWR: u32 = 2;
        let opened = match lock(&self.files).entry(name) {
            Entry::Occupied(entry) => Arc::clone(entry.get()),
            // It was on its way to another process as the files were counted.
            Entry::Vacant(entry) => Arc::clone(entry.insert(self.opened(name, O_RDWR)?)),
        };
        let duplicate = |close_on_exec| {
            let copy = file::copy(question.thread, question.word(0))?;
            file::give(listener, question.id, question.thread, &copy, close_on_exec)
        };
        let done = match question.call {
            Call::Transfer(transfer) => opened.transfer(question, transfer)?,
            Call::Ioctl => {
                let mut memory = ProcessMemory::new(question.thread, question.width());
                let (request, argument) = (question.word(1), question.arguments[2]);
                let mut bus = opened.bus.clone();
                let mut state = lock(&opened.state);
                state
                    .ioctl(request, argument, &mut memory, &mut bus)?
                    .into()
            }
            Call::Control if question.word(1) == F_GETFL => opened.flags.into(),
            Call::Control => duplicate(question.word(1) == F_DUPFD_CLOEXEC)?,
            Call::Duplicate => duplicate(false)?,
            Call::Seek => return Err(Errno::SPIPE),
            _ => return tell_attributes(question, name.bus),
        };
        Ok(Answer::Done(done))
    }
}

impl Opened {
    fn transfer(&self, question: &Question, transfer: Transfer) -> Result<i64, Errno> {
        let access = self.flags & O_ACCMODE;
        let allowed = match transfer.writes {
            true => access != 0,
            false => access != O_WRONLY,
        };
        if !allowed {
            return Err(Errno::BADF);
        }
        check_position(question, transfer.position)?;
        let mut memory = ProcessMemory::new(question.thread, question.width());
        let [_, address, length, ..] = question.arguments;
        let done = if transfer.pieces {
            self.each_piece(&mut memory, transfer.writes, address, question.word(2))
        } else {
            self.one(&mut memory, transfer.writes, address, length)
        };
        done.map(|bytes| i64::try_from(bytes).unwrap_or(i64::MAX))
    }

    fn one(
        &self,
        memory: &mut ProcessMemory,
        writes: bool,
        address: u64,
        length: u64,
    ) -> Result<usize, Errno> {
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        let mut bytes = vec![0; length.min(MESSAGE_BYTES_MAX)];
        let mut bus = self.bus.clone();
        if writes {
            if !bytes.is_empty() {
                memory.read(address, &mut bytes)?;
            }
            return lock(&self.state).write(&bytes, &mut bus);
        }
        let arrived = lock(&self.state).read(&mut bytes, &mut bus)?;
        if arrived > 0 {
            memory.write(address, &bytes[..arrived])?;
        }
        Ok(arrived)
    }

    /// One transfer a piece, as the kernel does for a device with just read() and write().
    fn each_piece(
        &self,
        memory: &mut ProcessMemory,
        writes: bool,
        list: u64,
        count: u32,
    ) -> Result<usize, Errno> {
        let count = usize::try_from(count).unwrap_or(usize::MAX);
        if count > PIECES_MAX {
            return Err(Errno::INVAL);
        }
        // `struct iovec`: a pointer and a length.
        let width = memory.pointer_width();
        let mut bytes = vec![0; count * 2 * width.bytes()];
        if count > 0 {
            memory.read(list, &mut bytes)?;
        }
        let mut total = 0;
        for piece in bytes.chunks_exact(2 * width.bytes()) {
            let (address, length) = piece.split_at(width.bytes());
            let (address, length) = (word(address, width), word(length, width));
            match self.one(memory, writes, address, length) {
                Ok(done) => {
                    total += done;
                    if u64::try_from(done).unwrap_or(u64::MAX) < length {
                        break;
                    }
                }
                Err(errno) if total == 0 => return Err(errno),
                Err(_) => break,
            }
        }
        Ok(total)
    }
}

fn tell_attributes(question: &Question, bus: u32) -> Result<Answer, Errno> {
    let (at, attributes) = match question.call {
        Call::StatMore => (4, Some(attributes::statx(bus))),
        Call::Stat(Path::InFolder) => (2, attributes::stat(question.machine, bus)),
        _ => (1, attributes::stat(question.machine, bus)),
    };
    let Some(attributes) = attributes else {
        return Ok(Answer::AsEver);
    };
    let mut memory = ProcessMemory::new(question.thread, question.width());
    memory.write(question.arguments[at], &attributes)?;
    Ok(Answer::Done(0))
}

fn open_flags(question: &Question) -> Result<u32, Errno> {
    const O_TRUNC: u32 = 0o1_000;
    Ok(match question.call {
        Call::Create => O_WRONLY | O_CREAT | O_TRUNC,
        Call::OpenHow => {
            // `struct open_how` begins with the flags, in 64 bits everywhere.
            let mut flags = [0; 8];
            let mut memory = ProcessMemory::new(question.thread, question.width());
            memory.read(question.arguments[2], &mut flags)?;
            u32::try_from(u64::from_ne_bytes(flags)).or(Err(Errno::INVAL))?
        }
        Call::Open(Path::InFolder) => question.word(2),
        _ => question.word(1),
    })
}

const fn o_directory(machine: Machine) -> u32 {
    match machine {
        Machine::X86 | Machine::X86Of32Bits => 0o200_000,
        Machine::Arm64 | Machine::ArmOf32Bits => 0o40_000,
    }
}

/// i2c-dev ignores the position, and the kernel rejects a negative one.
fn check_position(question: &Question, position: Position) -> Result<(), Errno> {
    let (low, high) = match (position, question.width()) {
        (Position::Current, _) => return Ok(()),
        (_, PointerWidth::Bits64) => {
            let [a, b, c, d, e, f, g, h] = question.arguments[3].to_le_bytes();
            (
                u32::from_le_bytes([a, b, c, d]),
                u32::from_le_bytes([e, f, g, h]),
            )
        }
        // A pair of registers begins with an even one.
        (Position::Given, _) if question.machine == Machine::ArmOf32Bits => {
            (question.word(4), question.word(5))
        }
        _ => (question.word(3), question.word(4)),
    };
    let is_negative = high >> 31 == 1;
    let is_current = high == u32::MAX && low == u32::MAX;
    let flagged = position == Position::HalvesAndFlags;
    if is_negative && !(flagged && is_current) {
        return Err(Errno::INVAL);
    }
    if flagged && question.word(5) & !RWF_HIPRI != 0 {
        return Err(Errno::OPNOTSUPP);
    }
    Ok(())
}

fn word(bytes: &[u8], width: PointerWidth) -> u64 {
    let number = match width {
        PointerWidth::Bits32 => bytes.first_chunk().map(|b| u32::from_ne_bytes(*b).into()),
        PointerWidth::Bits64 => bytes.first_chunk().map(|b| u64::from_ne_bytes(*b)),
    };
    number.unwrap_or(0)
}
