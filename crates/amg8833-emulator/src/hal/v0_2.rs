//! The bus and the INT pin on the traits of `embedded-hal` 0.2, by way of 1.0.

use crate::bus::Bus;
use crate::clock::Clock;
use crate::mux::Mux;
use crate::shared::{IntPin, PinError, SharedBus};
use crate::signal::{BusError, Outcome};
use crate::source::FrameSource;
use alloc::vec::Vec;
use embedded_hal::digital::InputPin as Present;
use embedded_hal::i2c::{I2c, Operation};
use embedded_hal_02::blocking::i2c::{
    self, Read, Transactional, TransactionalIter, Write, WriteIter, WriteIterRead, WriteRead,
};
use embedded_hal_02::digital::v2::InputPin;

macro_rules! as_in_0_2 {
    ($bus:ty) => {
        impl<C: Clock, S: FrameSource> Read for $bus {
            type Error = BusError;

            fn read(&mut self, address: u8, buffer: &mut [u8]) -> Outcome {
                I2c::read(self, address, buffer)
            }
        }

        impl<C: Clock, S: FrameSource> Write for $bus {
            type Error = BusError;

            fn write(&mut self, address: u8, bytes: &[u8]) -> Outcome {
                I2c::write(self, address, bytes)
            }
        }

        impl<C: Clock, S: FrameSource> WriteRead for $bus {
            type Error = BusError;

            fn write_read(&mut self, address: u8, bytes: &[u8], buffer: &mut [u8]) -> Outcome {
                I2c::write_read(self, address, bytes, buffer)
            }
        }

        impl<C: Clock, S: FrameSource> WriteIter for $bus {
            type Error = BusError;

            fn write<B: IntoIterator<Item = u8>>(&mut self, address: u8, bytes: B) -> Outcome {
                I2c::write(self, address, &bytes.into_iter().collect::<Vec<u8>>())
            }
        }

        impl<C: Clock, S: FrameSource> WriteIterRead for $bus {
            type Error = BusError;

            fn write_iter_read<B: IntoIterator<Item = u8>>(
                &mut self,
                address: u8,
                bytes: B,
                buffer: &mut [u8],
            ) -> Outcome {
                let bytes: Vec<u8> = bytes.into_iter().collect();
                I2c::write_read(self, address, &bytes, buffer)
            }
        }

        impl<C: Clock, S: FrameSource> Transactional for $bus {
            type Error = BusError;

            fn exec(&mut self, address: u8, operations: &mut [i2c::Operation<'_>]) -> Outcome {
                let mut operations: Vec<Operation<'_>> =
                    operations.iter_mut().map(operation).collect();
                I2c::transaction(self, address, &mut operations)
            }
        }

        impl<C: Clock, S: FrameSource> TransactionalIter for $bus {
            type Error = BusError;

            fn exec_iter<'a, O: IntoIterator<Item = i2c::Operation<'a>>>(
                &mut self,
                address: u8,
                operations: O,
            ) -> Outcome {
                let mut operations: Vec<i2c::Operation<'a>> = operations.into_iter().collect();
                Transactional::exec(self, address, &mut operations)
            }
        }
    };
}

as_in_0_2!(Bus<C, S>);
as_in_0_2!(SharedBus<'_, C, S>);
as_in_0_2!(Mux<C, S>);

fn operation<'a>(operation: &'a mut i2c::Operation<'_>) -> Operation<'a> {
    match operation {
        i2c::Operation::Read(buffer) => Operation::Read(buffer),
        i2c::Operation::Write(bytes) => Operation::Write(bytes),
    }
}

impl<C: Clock, S: FrameSource> InputPin for IntPin<'_, C, S> {
    type Error = PinError;

    fn is_high(&self) -> Result<bool, PinError> {
        Present::is_high(&mut { *self })
    }

    fn is_low(&self) -> Result<bool, PinError> {
        Present::is_low(&mut { *self })
    }
}
