//! The driver, written once and compiled twice: blocking and async.

use crate::address::Address;
use crate::error::Error;
use crate::levels::InterruptLevels;
use crate::pixel_set::PixelSet;
use crate::power::{PowerMode, Standby};
use crate::protocol::{self, Step, Write};
use crate::register::Register;
use crate::settings::{Configuration, FrameRate, InterruptControl, MovingAverage, Settings};
use crate::status::Status;
use grideye_frame::{PIXELS, PixelWord, RawFrame, ThermistorWord};

/// Compiles one body of async methods twice. Each bus or delay call is wrapped in `wait!`: the async driver awaits it,
/// the blocking driver returns its result directly.
macro_rules! faces {
    ($wait:ident, {
        $driver:item
        $owner:item
        impl<I2C: I2c> Amg8833<I2C> {
            $(
                $(#[$attribute:meta])*
                $visibility:vis async fn $method:ident $(<const $count:ident: usize>)? (
                    &mut $this:ident $(, $argument:ident: $kind:ty)* $(,)?
                ) -> $answer:ty $body:block
            )*
        }
    }) => {
        pub(crate) mod blocking {
            use super::*;
            use embedded_hal::{delay::DelayNs, i2c::I2c};

            macro_rules! $wait {
                ($call:expr) => {
                    $call
                };
            }

            $driver
            $owner
            impl<I2C: I2c> Amg8833<I2C> {
                $(
                    $(#[$attribute])*
                    #[doc = "\n# Errors\nThose of [`Error`](crate::Error), the bus's first of all."]
                    $visibility fn $method $(<const $count: usize>)? (
                        &mut $this $(, $argument: $kind)*
                    ) -> $answer $body
                )*
            }
        }

        /// The driver on [`embedded_hal_async`]: the same methods and the same bytes, with `.await`.
        ///
        /// Dropping a future midway leaves a sequence half done: call the method again from the start.
        pub mod asynch {
            use super::*;
            use embedded_hal_async::{delay::DelayNs, i2c::I2c};

            macro_rules! $wait {
                ($call:expr) => {
                    $call.await
                };
            }

            $driver
            $owner
            impl<I2C: I2c> Amg8833<I2C> {
                $(
                    $(#[$attribute])*
                    #[doc = "\n# Errors\nThose of [`Error`](crate::Error), the bus's first of all."]
                    $visibility async fn $method $(<const $count: usize>)? (
                        &mut $this $(, $argument: $kind)*
                    ) -> $answer $body
                )*
            }
        }
    };
}

faces!(wait, {
    /// An AMG8833 on a bus that the driver owns until [`release`](Self::release).
    ///
    /// Every method is safe to repeat after an error. The driver caches no sensor state.
    #[derive(Debug)]
    pub struct Amg8833<I2C> {
        i2c: I2C,
        address: Address,
    }

    impl<I2C> Amg8833<I2C> {
        /// Creates a driver for the sensor at this address. Sends nothing: call [`init`](Self::init) next.
        pub const fn new(i2c: I2C, address: Address) -> Self {
            Self { i2c, address }
        }

        /// Returns the bus and leaves the sensor as it is.
        pub fn release(self) -> I2C {
            self.i2c
        }

        /// The sensor's address.
        pub const fn address(&self) -> Address {
            self.address
        }
    }

    impl<I2C: I2c> Amg8833<I2C> {
        /// Wakes, resets and configures the sensor, whatever its state (AMG88 spec §4-11-1, §4-11-2).
        ///
        /// Takes 52 ms. Then wait for [`FrameRate::settling_time`]: until then pixels may read 0. If something other
        /// than [`sleep`](Self::sleep) put the sensor to sleep, wait
        /// [`timing::SLEEP_ENTRY`](crate::timing::SLEEP_ENTRY) first, or the sensor may freeze.
        pub async fn init(
            &mut self,
            delay: &mut impl DelayNs,
            settings: &Settings,
        ) -> Result<(), Error<I2C::Error>> {
            wait!(self.run(&protocol::WAKE, delay))?;
            wait!(self.write_all(&protocol::settings(settings)))
        }

        /// Returns from sleep or stand-by to normal mode, with the resets this requires (AMG88 spec §4-11-1, §4-11-2).
        ///
        /// The 2016 datasheet says the settings survive; the 2011 one disagrees. Use [`init`](Self::init) to be sure.
        /// Wait afterward as after [`init`](Self::init).
        pub async fn wake(&mut self, delay: &mut impl DelayNs) -> Result<(), Error<I2C::Error>> {
            wait!(self.run(&protocol::WAKE, delay))
        }

        /// Puts the sensor to sleep: 0.2 mA instead of 4.5 mA (AMG88 spec §4-4, §4-11-1). Reads are invalid until
        /// [`wake`](Self::wake) or [`init`](Self::init). Takes [`timing::SLEEP_ENTRY`](crate::timing::SLEEP_ENTRY).
        pub async fn sleep(&mut self, delay: &mut impl DelayNs) -> Result<(), Error<I2C::Error>> {
            wait!(self.run(&protocol::SLEEP, delay))
        }

        /// Switches from normal mode to stand-by (AMG88 spec §4-11-1). No effect in sleep.
        pub async fn standby(&mut self, interval: Standby) -> Result<(), Error<I2C::Error>> {
            wait!(self.write(protocol::power_mode(PowerMode::Standby(interval))))
        }

        /// Reads the power mode (AMG88 spec §4-11-1); unreliable in sleep.
        pub async fn power_mode(&mut self) -> Result<PowerMode, Error<I2C::Error>> {
            let [byte] = wait!(self.read(Register::PowerControl))?;
            Ok(PowerMode::from_byte(byte)?)
        }

        /// Sends an initial reset and waits 2 ms. Use it in normal mode only (AMG88 spec §4-11-2).
        pub async fn initial_reset(
            &mut self,
            delay: &mut impl DelayNs,
        ) -> Result<(), Error<I2C::Error>> {
            wait!(self.run(&protocol::INITIAL_RESET, delay))
        }

        /// Clears the flags and the interrupt table; settings and temperatures stay (AMG88 spec §4-11-2).
        pub async fn flag_reset(&mut self) -> Result<(), Error<I2C::Error>> {
            wait!(self.write(protocol::FLAG_RESET))
        }

        /// Reads the 64 pixels in ONE transaction; two could mix two frames (AMG88 spec §4-11-11). 131 bytes on the
        /// wire.
        ///
        /// [`word`](crate::word) converts the words to degrees.
        pub async fn read_pixels(&mut self) -> Result<[PixelWord; PIXELS], Error<I2C::Error>> {
            let bytes = wait!(self.read(Register::Pixels))?;
            Ok(protocol::pixels(&bytes))
        }

        /// Reads the chip's own temperature (AMG88 spec §4-11-9). 5 bytes on the wire.
        pub async fn read_thermistor(&mut self) -> Result<ThermistorWord, Error<I2C::Error>> {
            let bytes = wait!(self.read(Register::Thermistor))?;
            Ok(protocol::thermistor(bytes))
        }

        /// Reads the pixels, then the thermistor: 136 bytes on the wire, 12.3 ms at 100 kHz and 3.1 ms at 400 kHz.
        ///
        /// Takes two transactions: the Raspberry Pi's controller allows a read only as a transaction's last message,
        /// and one read across both would be 242 bytes.
        pub async fn read_frame(&mut self) -> Result<RawFrame, Error<I2C::Error>> {
            let pixels = wait!(self.read_pixels())?;
            let thermistor = wait!(self.read_thermistor())?;
            Ok(RawFrame { thermistor, pixels })
        }

        /// Reads the flags (AMG88 spec §4-11-5).
        pub async fn status(&mut self) -> Result<Status, Error<I2C::Error>> {
            let [byte] = wait!(self.read(Register::Status))?;
            Ok(Status::from_byte(byte))
        }

        /// Clears only the given flags (AMG88 spec §4-11-6). Contrary to the datasheet's table, parts in the field keep
        /// the interrupt table until [`flag_reset`](Self::flag_reset).
        pub async fn clear_flags(&mut self, flags: Status) -> Result<(), Error<I2C::Error>> {
            wait!(self.write(Register::StatusClear.set(flags.byte())))
        }

        /// Sets the interrupt mode and pin (AMG88 spec §4-11-4). Set the levels first.
        pub async fn set_interrupt(
            &mut self,
            control: InterruptControl,
        ) -> Result<(), Error<I2C::Error>> {
            wait!(self.write(protocol::interrupt(control)))
        }

        /// Reads the interrupt mode and pin (AMG88 spec §4-11-4).
        pub async fn interrupt(&mut self) -> Result<InterruptControl, Error<I2C::Error>> {
            let [byte] = wait!(self.read(Register::InterruptControl))?;
            Ok(InterruptControl::from_byte(byte))
        }

        /// Sets levels and hysteresis byte by byte, so a level may briefly mix old and new (AMG88 spec §4-11-8).
        pub async fn set_interrupt_levels(
            &mut self,
            levels: &InterruptLevels,
        ) -> Result<(), Error<I2C::Error>> {
            wait!(self.write_all(&protocol::levels(levels)))
        }

        /// Reads levels and hysteresis (AMG88 spec §4-11-8).
        pub async fn interrupt_levels(&mut self) -> Result<InterruptLevels, Error<I2C::Error>> {
            let bytes = wait!(self.read(Register::UpperLevelLow))?;
            Ok(protocol::levels_from(bytes))
        }

        /// Reads which pixels are beyond a level (AMG88 spec §4-11-10).
        pub async fn interrupt_table(&mut self) -> Result<PixelSet, Error<I2C::Error>> {
            let bytes = wait!(self.read(Register::InterruptTable))?;
            Ok(PixelSet::from_table(bytes))
        }

        /// Turns the moving average on or off by its key (AMG88 spec §4-11-7). Repeat after an error, or the register
        /// stays unlocked.
        pub async fn set_moving_average(
            &mut self,
            average: MovingAverage,
        ) -> Result<(), Error<I2C::Error>> {
            wait!(self.write_all(&protocol::moving_average(average)))
        }

        /// Reads whether the moving average is on (AMG88 spec §4-11-7). Unreliable: a user saw it always read as off.
        pub async fn moving_average(&mut self) -> Result<MovingAverage, Error<I2C::Error>> {
            let [byte] = wait!(self.read(Register::Average))?;
            Ok(MovingAverage::from_byte(byte))
        }

        /// Sets the frame rate (AMG88 spec §4-11-3).
        pub async fn set_frame_rate(&mut self, rate: FrameRate) -> Result<(), Error<I2C::Error>> {
            wait!(self.write(protocol::frame_rate(rate)))
        }

        /// Reads the frame rate (AMG88 spec §4-11-3).
        pub async fn frame_rate(&mut self) -> Result<FrameRate, Error<I2C::Error>> {
            let [byte] = wait!(self.read(Register::FrameRate))?;
            Ok(FrameRate::from_byte(byte))
        }

        /// Reads every setting in one transaction of 17 bytes on the wire. Compare with your settings every few seconds
        /// ([`Configuration::deviation`]): after a supply dip the sensor continues with its power-on settings.
        pub async fn configuration(&mut self) -> Result<Configuration, Error<I2C::Error>> {
            let bytes = wait!(self.read(Register::PowerControl))?;
            Ok(protocol::configuration(bytes)?)
        }

        async fn write(&mut self, bytes: Write) -> Result<(), Error<I2C::Error>> {
            wait!(self.i2c.write(self.address.get(), &bytes)).map_err(Error::Bus)
        }

        async fn write_all(&mut self, writes: &[Write]) -> Result<(), Error<I2C::Error>> {
            for bytes in writes {
                wait!(self.write(*bytes))?;
            }
            Ok(())
        }

        async fn run(
            &mut self,
            steps: &[Step],
            delay: &mut impl DelayNs,
        ) -> Result<(), Error<I2C::Error>> {
            for step in steps {
                match *step {
                    Step::Write(bytes) => wait!(self.write(bytes))?,
                    Step::WaitMs(milliseconds) => wait!(delay.delay_ms(milliseconds)),
                }
            }
            Ok(())
        }

        /// Reads from register `first` on, in one transaction. Retries once if the buffer looks untouched
        /// ([`protocol::POISONS`]).
        async fn read<const N: usize>(
            &mut self,
            first: Register,
        ) -> Result<[u8; N], Error<I2C::Error>> {
            let mut found = 0;
            for poison in protocol::POISONS {
                let mut bytes = [poison; N];
                let register = [first.address()];
                let read = self
                    .i2c
                    .write_read(self.address.get(), &register, &mut bytes);
                wait!(read).map_err(Error::Bus)?;
                found = protocol::delivered(&bytes, poison);
                if found == N {
                    return Ok(bytes);
                }
            }
            Err(Error::ShortRead {
                register: first.address(),
                expected: N,
                found,
            })
        }
    }
});
