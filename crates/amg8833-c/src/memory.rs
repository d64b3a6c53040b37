//! A bus in memory of the caller: whether it is one, and who is in it.
#![expect(unsafe_code, reason = "the memory is the caller's")]

use crate::error::Error;
use crate::source::Source;
use amg8833_emulator::{Bus, ManualClock, Open};
use core::cell::UnsafeCell;
use core::num::NonZeroU32;
use core::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The words of `amg8833_bus` in the header.
pub const BUS_WORDS: usize = 1024;

/// `amg8833_bus` of the header.
#[derive(Debug)]
#[repr(C)]
pub struct Memory([u64; BUS_WORDS]);

/// The bus, and the transaction that a controller holds open.
pub(crate) struct Held {
    pub(crate) bus: Bus<ManualClock, Source>,
    pub(crate) open: Option<Open>,
    /// Whether it reads.
    pub(crate) reads: bool,
}

#[repr(C)]
struct Place {
    /// Its own address, mixed: a bus that was copied or moved is none.
    tag: AtomicUsize,
    is_busy: AtomicBool,
    held: UnsafeCell<Held>,
}

// Wherever it begins in there.
const _: () = assert!(size_of::<Place>() + align_of::<Place>() <= size_of::<Memory>());

/// Any bits that memory seldom holds.
const MARK: usize = 0x5EED_8833;
/// Of a bus that a panic left in an unknown state.
const BROKEN: usize = !MARK;

/// Makes a bus in this memory, whatever it held.
pub(crate) fn init(memory: *mut Memory, size: usize, scl_hz: u32) -> Error {
    if memory.is_null() {
        return Error::Null;
    }
    if size != size_of::<Memory>() {
        return Error::Size;
    }
    let bus = Bus::new(ManualClock::new());
    let bus = match NonZeroU32::new(scl_hz) {
        Some(hz) => bus.with_scl_hz(hz),
        None => bus.with_instant_transactions(),
    };
    let made = Place {
        tag: AtomicUsize::new(memory.addr() ^ MARK),
        is_busy: AtomicBool::new(false),
        held: UnsafeCell::new(Held {
            bus,
            open: None,
            reads: false,
        }),
    };
    // SAFETY: the header says that so many bytes are there, and the assertion above that they are enough.
    unsafe { within(memory).write(made) };
    Error::Ok
}

/// Does this with the bus in this memory, alone.
pub(crate) fn enter(
    memory: *const Memory,
    work: impl FnOnce(&mut Held) -> Result<(), Error>,
) -> Error {
    let place = match find(memory) {
        Ok(place) => place,
        Err(error) => return error,
    };
    if place.is_busy.swap(true, Ordering::Acquire) {
        return Error::Busy;
    }
    // SAFETY: `is_busy` was false, so nobody else has it until it is false again.
    let held = unsafe { &mut *place.held.get() };
    let done = catch_unwind(AssertUnwindSafe(|| work(held)));
    if done.is_err() {
        place.tag.store(memory.addr() ^ BROKEN, Ordering::Relaxed);
    }
    place.is_busy.store(false, Ordering::Release);
    match done {
        Ok(Ok(())) => Error::Ok,
        Ok(Err(error)) => error,
        Err(_) => Error::Panic,
    }
}

/// Ends the bus: what it allocated is free, and its memory holds no bus any more.
pub(crate) fn end(memory: *mut Memory) -> Error {
    let place = match find(memory) {
        Ok(place) => place,
        Err(error) => return error,
    };
    if place.is_busy.swap(true, Ordering::Acquire) {
        return Error::Busy;
    }
    place.tag.store(0, Ordering::Relaxed);
    // SAFETY: it is a bus by its tag, which is gone, so that nobody drops it again.
    unsafe { within(memory).drop_in_place() };
    Error::Ok
}

fn find<'a>(memory: *const Memory) -> Result<&'a Place, Error> {
    if memory.is_null() {
        return Err(Error::Null);
    }
    let place = within(memory);
    // SAFETY: the header says that so many bytes are there, and any bits are a number.
    let tag = unsafe { &*place.cast::<AtomicUsize>() };
    match tag.load(Ordering::Relaxed) ^ memory.addr() {
        // SAFETY: only `init` writes this, together with all of a bus.
        MARK => Ok(unsafe { &*place }),
        BROKEN => Err(Error::Panic),
        _ => Err(Error::NotABus),
    }
}

/// Where the bus is in this memory: C99 cannot ask for its alignment.
fn within(memory: *const Memory) -> *mut Place {
    let aligned = |address: usize| {
        address.saturating_add(align_of::<Place>() - 1) & !(align_of::<Place>() - 1)
    };
    memory.cast_mut().map_addr(aligned).cast()
}
