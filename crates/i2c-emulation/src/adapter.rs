//! The interface below every transport: an adapter that carries out the messages of one transfer.

use embedded_hal::i2c::{Error, ErrorKind, I2c, NoAcknowledgeSource, Operation};

/// The highest 7-bit address.
pub const SEVEN_BIT_ADDRESS_MAX: u16 = 0x7F;

/// A bus fault; [`AdapterMode`](crate::ioctl::AdapterMode) maps it to the errno of each kind of adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fault {
    /// No target acknowledged the address.
    NackAddress,
    /// The target acknowledged its address, but not a byte of data.
    NackData,
    /// A misplaced start or stop, a wrong length, or any other fault.
    Bus,
    /// Another controller won the bus.
    ArbitrationLost,
    /// The bus was held low for longer than the adapter waits.
    Timeout,
    /// The adapter no longer exists.
    Gone,
}

/// A bus error that knows its [`Fault`]; for other errors see [`HalAdapter::with_faults`].
pub trait BusFault {
    /// The fault behind this error.
    fn fault(&self) -> Fault;
}

impl BusFault for Fault {
    fn fault(&self) -> Fault {
        *self
    }
}

impl BusFault for ErrorKind {
    /// embedded-hal has no kind for a timeout or a vanished adapter: those arrive as `Other`, so as [`Fault::Bus`].
    fn fault(&self) -> Fault {
        match self {
            ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data) => Fault::NackData,
            ErrorKind::NoAcknowledge(_) => Fault::NackAddress,
            ErrorKind::ArbitrationLoss => Fault::ArbitrationLost,
            _ => Fault::Bus,
        }
    }
}

/// One message of a transfer: everything from a start or repeated start to the next.
#[derive(Debug)]
pub struct Message<'a> {
    /// Seven bits, or ten if [`ten_bit`](Self::ten_bit) is set. Larger values are allowed, but no target answers them.
    pub address: u16,
    /// Whether the address is sent as a 10-bit address.
    pub ten_bit: bool,
    /// The bytes to send, or the buffer to fill. An empty one sends only the address (SMBus quick).
    pub operation: Operation<'a>,
}

/// A transfer that ended early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TransferError {
    /// Messages completed before the fault.
    pub completed: usize,
    /// The fault that stopped the transfer.
    pub fault: Fault,
}

/// Carries out the next operation of a transaction that is still open; an error says which byte was not acknowledged.
pub type Carry<'a> = &'a mut dyn FnMut(&mut Operation<'_>) -> Result<(), NoAcknowledgeSource>;

/// A bus that carries out each transfer as a whole; every transport uses it.
pub trait EmulatedAdapter {
    /// Carries out all messages in order.
    /// # Errors
    /// [`TransferError`] with the fault and the number of messages completed before it.
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError>;

    /// Runs one transaction whose operations `talk` decides while it is open, as a microcontroller's hardware does; `reads`
    /// is the direction of the first. It stops when `talk` returns. A bus that knows only whole transfers fails with
    /// [`Fault::Bus`].
    /// # Errors
    /// The first byte that was not acknowledged, which `talk` has been told too, or a fault without a call of `talk`.
    fn converse(
        &mut self,
        address: u16,
        reads: bool,
        talk: &mut dyn FnMut(Carry<'_>),
    ) -> Result<(), Fault> {
        let _ = (address, reads, talk);
        Err(Fault::Bus)
    }
}

impl<A: EmulatedAdapter + ?Sized> EmulatedAdapter for &mut A {
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        (**self).transfer(messages)
    }

    fn converse(
        &mut self,
        address: u16,
        reads: bool,
        talk: &mut dyn FnMut(Carry<'_>),
    ) -> Result<(), Fault> {
        (**self).converse(address, reads, talk)
    }
}

#[cfg(test)]
pub(crate) struct ByFunction<F>(pub(crate) F);

#[cfg(test)]
impl<F: FnMut(&mut [Message<'_>]) -> Result<(), TransferError>> EmulatedAdapter for ByFunction<F> {
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        self.0(messages)
    }
}

/// Any [`embedded_hal::i2c::I2c`] as an [`EmulatedAdapter`].
///
/// A write followed by a read of the same target becomes one embedded-hal transaction. embedded-hal merges adjacent
/// operations of one direction into one message, which Linux never does. So two writes or two reads in a row become two
/// transactions, with a stop and a start where a real adapter sends a repeated start.
#[derive(Debug)]
pub struct HalAdapter<B, F> {
    bus: B,
    fault_of: F,
}

impl<B: I2c> HalAdapter<B, fn(&B::Error) -> Fault> {
    /// Tells faults apart by [`embedded_hal::i2c::Error::kind`] alone, so reports neither timeouts nor a vanished
    /// adapter.
    pub fn new(bus: B) -> Self {
        Self::with_faults(bus, |error| error.kind().fault())
    }
}

impl<B: I2c, F: FnMut(&B::Error) -> Fault> HalAdapter<B, F> {
    /// Maps each bus error to a fault with `fault_of`.
    pub fn with_faults(bus: B, fault_of: F) -> Self {
        Self { bus, fault_of }
    }

    /// The bus, for example to read its counters.
    pub fn bus(&mut self) -> &mut B {
        &mut self.bus
    }

    fn transaction(&mut self, messages: &mut [Message<'_>]) -> Result<(), Fault> {
        let address = match messages.first() {
            Some(message) if message.ten_bit || message.address > SEVEN_BIT_ADDRESS_MAX => {
                return Err(Fault::NackAddress);
            }
            Some(message) => u8::try_from(message.address).unwrap_or(u8::MAX),
            None => return Ok(()),
        };
        let operations = messages
            .iter_mut()
            .map(|message| match &mut message.operation {
                Operation::Read(buffer) => Operation::Read(buffer),
                Operation::Write(bytes) => Operation::Write(bytes),
            });
        let mut operations: Vec<Operation<'_>> = operations.collect();
        let outcome = self.bus.transaction(address, &mut operations);
        outcome.map_err(|error| (self.fault_of)(&error))
    }
}

impl<B: I2c, F: FnMut(&B::Error) -> Fault> EmulatedAdapter for HalAdapter<B, F> {
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        let mut completed = 0;
        while completed < messages.len() {
            let rest = &mut messages[completed..];
            let length = transaction_length(rest);
            let outcome = self.transaction(&mut rest[..length]);
            outcome.map_err(|fault| TransferError { completed, fault })?;
            completed += length;
        }
        Ok(())
    }
}

/// How many of the first messages fit one embedded-hal transaction unchanged.
fn transaction_length(messages: &[Message<'_>]) -> usize {
    let joins = |pair: &[Message<'_>]| {
        pair[0].address == pair[1].address
            && pair[0].ten_bit == pair[1].ten_bit
            && is_read(&pair[0].operation) != is_read(&pair[1].operation)
    };
    1 + messages.windows(2).take_while(|pair| joins(pair)).count()
}

pub(crate) fn is_read(operation: &Operation<'_>) -> bool {
    matches!(operation, Operation::Read(_))
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::convert::Infallible;

    #[derive(Default)]
    struct Notebook(Vec<String>);

    impl embedded_hal::i2c::ErrorType for Notebook {
        type Error = Infallible;
    }

    impl I2c for Notebook {
        fn transaction(
            &mut self,
            address: u8,
            operations: &mut [Operation<'_>],
        ) -> Result<(), Infallible> {
            let mut line = format!("{address:02x}");
            for operation in operations {
                match operation {
                    Operation::Write(bytes) => line += &format!(" W{bytes:02x?}"),
                    Operation::Read(buffer) => {
                        buffer.fill(0xA5);
                        line += &format!(" R{}", buffer.len());
                    }
                }
            }
            self.0.push(line);
            Ok(())
        }
    }

    /// The transactions these messages become; a message without bytes to write reads one.
    fn transactions(
        messages: &[(u16, bool, Option<&[u8]>)],
    ) -> (Vec<String>, Option<TransferError>) {
        let mut adapter = HalAdapter::with_faults(Notebook::default(), |error| match *error {});
        let mut buffers = vec![[0]; messages.len()];
        let mut transfer: Vec<Message<'_>> = messages
            .iter()
            .zip(&mut buffers)
            .map(|((address, ten_bit, bytes), buffer)| Message {
                address: *address,
                ten_bit: *ten_bit,
                operation: bytes.map_or(Operation::Read(buffer), Operation::Write),
            })
            .collect();
        let error = adapter.transfer(&mut transfer).err();
        for ((_, _, bytes), buffer) in messages.iter().zip(&buffers) {
            assert!(error.is_some() || bytes.is_some() || *buffer == [0xA5]);
        }
        (std::mem::take(&mut adapter.bus().0), error)
    }

    #[test]
    fn only_a_write_and_a_read_of_one_target_are_one_transaction() {
        let write = |bytes: &'static [u8]| (0x69, false, Some(bytes));
        let read = (0x69, false, None);
        let (one, two) = (write(&[0x2A]), write(&[1, 2]));
        for (messages, expected) in [
            (vec![one, read], "69 W[2a] R1"),
            (vec![two, one, read], "69 W[01, 02]; 69 W[2a] R1"),
            (vec![read, read], "69 R1; 69 R1"),
            (vec![(0x68, false, Some(&[3])), read], "68 W[03]; 69 R1"),
        ] {
            assert_eq!(transactions(&messages).0.join("; "), expected);
        }
    }

    #[test]
    fn nobody_answers_to_ten_bits_or_to_an_address_of_eight() {
        for (address, ten_bit) in [(0x69, true), (0x80, false), (u16::MAX, false)] {
            let (done, error) =
                transactions(&[(0x10, false, Some(&[1])), (address, ten_bit, Some(&[]))]);
            let (completed, fault) = (1, Fault::NackAddress);
            assert_eq!(error, Some(TransferError { completed, fault }));
            assert_eq!(done, ["10 W[01]"]);
        }
    }

    #[test]
    fn kinds_of_embedded_hal_become_faults() {
        use NoAcknowledgeSource::{Address, Data, Unknown};
        for (kind, fault) in [
            (ErrorKind::NoAcknowledge(Address), Fault::NackAddress),
            (ErrorKind::NoAcknowledge(Unknown), Fault::NackAddress),
            (ErrorKind::NoAcknowledge(Data), Fault::NackData),
            (ErrorKind::ArbitrationLoss, Fault::ArbitrationLost),
            (ErrorKind::Bus, Fault::Bus),
            (ErrorKind::Overrun, Fault::Bus),
            (ErrorKind::Other, Fault::Bus),
        ] {
            assert_eq!(kind.fault(), fault, "{kind:?}");
        }
    }
}
