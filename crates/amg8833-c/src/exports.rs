//! The functions of the header.
#![expect(unsafe_code, reason = "C calls these functions, with pointers")]

use crate::error::Error;
use crate::fault::{self, Fault};
use crate::memory::{self, Held, Memory};
use crate::scene::{self, Scene};
use crate::source::{Callback, FrameC, Source};
use amg8833_emulator::{Address, Bus, Clock as _, Device, InterruptPin, ManualClock, Options};
use core::ffi::{c_char, c_void};
use core::ops::Range;
use core::time::Duration;
use embedded_hal::i2c::{I2c, Operation};
use grideye_frame::{Celsius, Frame};

/// `amg8833_counts` of the header.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
#[expect(missing_docs, reason = "the header says what they are")]
pub struct Counts {
    pub transactions: u64,
    pub bytes: u64,
    pub bits: u64,
    pub nacks: u64,
    pub frames: u64,
    pub int_falls: u64,
    pub int_releases: u64,
    pub refused_nacks: u64,
    pub refused_asleep: u64,
    pub refused_read_only: u64,
    pub refused_reserved: u64,
    pub refused_without_key: u64,
    pub refused_commands: u64,
}

/// Functions of a bus: what they do with it, alone, with its errors and panics as a number.
macro_rules! exports {
    ($($(#[doc = $text:literal])+
    fn $name:ident($held:ident $(, $argument:ident: $type:ty)*) $body:block)+) => {
        $(
            $(#[doc = $text])+
            ///
            /// # Safety
            /// Pointers are NULL or point to what the header says.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $name(bus: *mut Memory $(, $argument: $type)*) -> Error {
                memory::enter(bus, |$held| $body)
            }
        )+
    };
}

/// Makes a bus in this memory.
///
/// # Safety
/// Pointers are NULL or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn amg8833_init(bus: *mut Memory, size: usize, scl_hz: u32) -> Error {
    memory::init(bus, size, scl_hz)
}

/// Ends the bus.
///
/// # Safety
/// Pointers are NULL or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn amg8833_end(bus: *mut Memory) -> Error {
    memory::end(bus)
}

/// The sentence for an error.
#[unsafe(no_mangle)]
pub extern "C" fn amg8833_error_text(error: i32) -> *const c_char {
    Error::text(error).as_ptr()
}

exports! {
    /// Plugs in a sensor that sees one temperature.
    fn amg8833_plug_celsius(held, address: u8, pixels_c: f32, thermistor_c: f32) {
        let mut frame = Frame::uniform(Celsius::new(pixels_c));
        frame.thermistor = Celsius::new(thermistor_c);
        plug(held, address, Source::Still(frame))
    }

    /// Plugs in a sensor that sees this frame.
    fn amg8833_plug_frame(held, address: u8, frame: *const FrameC) {
        // SAFETY: the header says that a frame is there.
        let frame = unsafe { some(frame)?.read() }.frame();
        plug(held, address, Source::Still(frame))
    }

    /// Plugs in a sensor that sees these frames, one after the other.
    fn amg8833_plug_recording(held, address: u8, frames: *const FrameC, count: usize) {
        let frames = some(frames)?;
        range(frames, count)?;
        if count == 0 || !frames.is_aligned() {
            return Err(Error::Value);
        }
        plug(held, address, Source::Recording { frames, count, shown: 0 })
    }

    /// Plugs in a sensor that sees what a function says.
    fn amg8833_plug_callback(held, address: u8, callback: Option<Callback>, user: *mut c_void) {
        let callback = callback.ok_or(Error::Null)?;
        plug(held, address, Source::Call { callback, user })
    }

    /// Plugs in a sensor that looks into a scene.
    fn amg8833_plug_scene(held, address: u8, scene: *const Scene, message: *mut c_char, size: usize) {
        let scene = some(scene)?;
        // SAFETY: the header says that a scene is there, and room for so many bytes of a message.
        let source = unsafe { scene::source(&scene.read(), (message, size))? };
        plug(held, address, source)
    }

    /// Takes the sensor off the bus.
    fn amg8833_unplug(held, address: u8) {
        let address = place(held, address)?;
        held.bus.unplug(address).map(drop).ok_or(Error::NoSensor)
    }

    /// Writes bytes, in a transaction of its own.
    fn amg8833_write(held, address: u8, bytes: *const u8, count: usize) {
        // SAFETY: the header says that so many bytes are there.
        let bytes = unsafe { given(held, bytes, count)? };
        Ok(held.closed()?.write(seven_bits(address)?, bytes)?)
    }

    /// Reads bytes, in a transaction of its own.
    fn amg8833_read(held, address: u8, bytes: *mut u8, count: usize) {
        // SAFETY: the header says that so many bytes are there.
        let bytes = unsafe { taken(held, bytes, count)? };
        Ok(held.closed()?.read(seven_bits(address)?, bytes)?)
    }

    /// Writes and reads bytes, with a repeated START between.
    fn amg8833_write_read(
        held,
        address: u8,
        written: *const u8,
        written_count: usize,
        read: *mut u8,
        read_count: usize
    ) {
        apart(&range(read, read_count)?, &range(written, written_count)?)?;
        // SAFETY: the header says that so many bytes are there.
        let written = unsafe { given(held, written, written_count)? };
        // SAFETY: as above, and they are apart.
        let read = unsafe { taken(held, read, read_count)? };
        Ok(held.closed()?.write_read(seven_bits(address)?, written, read)?)
    }

    /// START, or repeated START, and the address.
    fn amg8833_start(held, address: u8, reads: i32) {
        let (address, reads) = (seven_bits(address)?, reads != 0);
        if held.open.as_ref().is_some_and(|open| open.address() != address) {
            held.stop();
        }
        let mut open = match held.open.take() {
            Some(open) => open,
            None => held.bus.start(address, reads)?,
        };
        open.restart();
        let first = &mut if reads { Operation::Read(&mut []) } else { Operation::Write(&[]) };
        let answer = held.bus.step(&mut open, first);
        held.open = Some(open);
        held.reads = reads;
        Ok(answer?)
    }

    /// Sends a byte of the open transaction.
    fn amg8833_send(held, byte: u8) {
        held.step(&mut Operation::Write(&[byte]))
    }

    /// Receives a byte of the open transaction.
    fn amg8833_receive(held, byte: *mut u8) {
        let mut received = [0];
        some(byte)?;
        held.step(&mut Operation::Read(&mut received))?;
        // SAFETY: the header says that a byte is there.
        unsafe { byte.write(received[0]) };
        Ok(())
    }

    /// STOP.
    fn amg8833_stop(held) {
        held.open.as_ref().ok_or(Error::NotOpen)?;
        held.stop();
        Ok(())
    }

    /// The time of the bus.
    fn amg8833_now_ns(held, now_ns: *mut u64) {
        // SAFETY: the header says that a number is there.
        unsafe { tell(now_ns, nanoseconds(held.now())) }
    }

    /// Lets time pass.
    fn amg8833_advance_ns(held, by_ns: u64) {
        held.bus.clock().advance(Duration::from_nanos(by_ns));
        held.bus.advance();
        Ok(())
    }

    /// When the next frame reaches the registers.
    fn amg8833_next_frame_ns(held, address: u8, at_ns: *mut u64) {
        let address = place(held, address)?;
        held.bus.advance();
        let device = held.bus.device(address).ok_or(Error::NoSensor)?;
        let at_ns_or_never = device.next_frame_at().map_or(u64::MAX, nanoseconds);
        // SAFETY: the header says that a number is there.
        unsafe { tell(at_ns, at_ns_or_never) }
    }

    /// Whether the sensor pulls its INT pin low.
    fn amg8833_int_is_low(held, address: u8, is_low: *mut bool) {
        let is_low_now = held.int_is_low(sensor(address)?)?;
        // SAFETY: the header says that a truth value is there.
        unsafe { tell(is_low, is_low_now) }
    }

    /// Lets time pass until the INT pin is low or released, at most so long.
    fn amg8833_wait_int(held, address: u8, is_low: i32, most_ns: u64) {
        let address = place(held, address)?;
        let end = held.now().saturating_add(Duration::from_nanos(most_ns));
        loop {
            if held.int_is_low(address)? == (is_low != 0) {
                return Ok(());
            }
            if held.now() >= end {
                return Err(Error::Late);
            }
            let next = held.bus.device(address).and_then(Device::next_frame_at);
            held.bus.clock().set(next.unwrap_or(end).min(end));
        }
    }

    /// Injects a fault.
    fn amg8833_set_fault(held, address: u8, fault: *const Fault) {
        // SAFETY: the header says that a fault is there.
        let (fault, chance) = unsafe { some(fault)?.read() }.emulated()?;
        let address = or_all(held, address)?;
        held.closed()?;
        let is_set = held.bus.set_fault_with_chance(address, fault, chance);
        if is_set { Ok(()) } else { Err(Error::Full) }
    }

    /// Ends all faults of a sensor, or of the whole bus.
    fn amg8833_clear_faults(held, address: u8) {
        let address = or_all(held, address)?;
        held.closed()?.clear_fault(address);
        Ok(())
    }

    /// How often faults of this kind struck.
    fn amg8833_fault_count(held, kind: i32, count: *mut u64) {
        let struck = held.bus.fault_counts().of(fault::kind(kind)?);
        // SAFETY: the header says that a number is there.
        unsafe { tell(count, struck) }
    }

    /// Sets the seed of faults that strike by chance.
    fn amg8833_set_seed(held, seed: u64) {
        held.bus.set_seed(seed);
        Ok(())
    }

    /// The traffic on the bus, and what a sensor did and refused.
    fn amg8833_count(held, address: u8, counts: *mut Counts) {
        let address = or_all(held, address)?;
        let traffic = held.bus.traffic();
        let mut all = Counts {
            transactions: traffic.transactions,
            bytes: traffic.bytes,
            bits: traffic.bits,
            nacks: traffic.nacks,
            ..Counts::default()
        };
        if let Some(device) = address.and_then(|address| held.bus.device(address)) {
            let refused = device.refusals();
            all.frames = device.frames();
            (all.int_falls, all.int_releases) = device.edge_counts();
            all.refused_nacks = refused.nacks;
            all.refused_asleep = refused.asleep;
            all.refused_read_only = refused.read_only;
            all.refused_reserved = refused.reserved;
            all.refused_without_key = refused.without_key;
            all.refused_commands = refused.unknown_commands;
        }
        // SAFETY: the header says that counts are there.
        unsafe { tell(counts, all) }
    }
}

impl Held {
    fn now(&self) -> Duration {
        self.bus.clock().now()
    }

    /// The bus, unless a controller holds a transaction open.
    fn closed(&mut self) -> Result<&mut Bus<ManualClock, Source>, Error> {
        if self.open.is_some() {
            Err(Error::Open)
        } else {
            Ok(&mut self.bus)
        }
    }

    fn step(&mut self, operation: &mut Operation<'_>) -> Result<(), Error> {
        let reads = matches!(operation, Operation::Read(_));
        let open = self.open.as_mut().filter(|_| self.reads == reads);
        Ok(self.bus.step(open.ok_or(Error::NotOpen)?, operation)?)
    }

    /// Each byte's error was returned with it.
    fn stop(&mut self) {
        let _ = self.open.take().map(|open| self.bus.stop(open));
    }

    fn int_is_low(&mut self, address: Address) -> Result<bool, Error> {
        let pin = self.bus.interrupt_pin(address).ok_or(Error::NoSensor)?;
        Ok(pin == InterruptPin::Low)
    }
}

fn plug(held: &mut Held, address: u8, source: Source) -> Result<(), Error> {
    let address = sensor(address)?;
    held.closed()?.plug(address, source, Options::default());
    Ok(())
}

fn sensor(address: u8) -> Result<Address, Error> {
    Address::from_bits(address).ok_or(Error::Address)
}

/// The address of a sensor, with no transaction open.
fn place(held: &mut Held, address: u8) -> Result<Address, Error> {
    held.closed()?;
    sensor(address)
}

/// A sensor that is there, or 0 for the whole bus.
fn or_all(held: &Held, address: u8) -> Result<Option<Address>, Error> {
    if address == 0 {
        return Ok(None);
    }
    let address = sensor(address)?;
    let is_there = held.bus.device(address).is_some();
    if is_there {
        Ok(Some(address))
    } else {
        Err(Error::NoSensor)
    }
}

fn seven_bits(address: u8) -> Result<u8, Error> {
    if address < 0x80 {
        Ok(address)
    } else {
        Err(Error::Value)
    }
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

fn some<T>(pointer: *const T) -> Result<*const T, Error> {
    if pointer.is_null() {
        Err(Error::Null)
    } else {
        Ok(pointer)
    }
}

/// # Safety
/// The pointer is NULL or has room for a value.
unsafe fn tell<T>(to: *mut T, value: T) -> Result<(), Error> {
    some(to)?;
    // SAFETY: as the caller says.
    unsafe { to.write_unaligned(value) };
    Ok(())
}

/// Bytes to write.
///
/// # Safety
/// The pointer is NULL or points to so many bytes, which nobody changes.
unsafe fn given<'a>(held: &Held, bytes: *const u8, count: usize) -> Result<&'a [u8], Error> {
    apart(&range(bytes, count)?, &range(&raw const *held, 1)?)?;
    if count == 0 {
        return Ok(&[]);
    }
    // SAFETY: as the caller says, and they are not in the bus.
    Ok(unsafe { core::slice::from_raw_parts(some(bytes)?, count) })
}

/// Room for bytes to read.
///
/// # Safety
/// The pointer is NULL or points to so many bytes, which nobody else has.
unsafe fn taken<'a>(held: &Held, bytes: *mut u8, count: usize) -> Result<&'a mut [u8], Error> {
    apart(&range(bytes, count)?, &range(&raw const *held, 1)?)?;
    if count == 0 {
        return Ok(&mut []);
    }
    some(bytes)?;
    // SAFETY: as the caller says, and they are not in the bus.
    Ok(unsafe { core::slice::from_raw_parts_mut(bytes, count) })
}

/// Where these values are.
fn range<T>(start: *const T, count: usize) -> Result<Range<usize>, Error> {
    let bytes = count.checked_mul(size_of::<T>());
    let bytes = bytes.filter(|bytes| isize::try_from(*bytes).is_ok());
    let end = bytes.and_then(|bytes| start.addr().checked_add(bytes));
    Ok(start.addr()..end.ok_or(Error::Value)?)
}

fn apart(one: &Range<usize>, other: &Range<usize>) -> Result<(), Error> {
    let overlap = one.start < other.end && other.start < one.end;
    if overlap { Err(Error::Overlap) } else { Ok(()) }
}
