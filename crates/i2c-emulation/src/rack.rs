//! The buses of one emulated machine, by number.

use crate::adapter::{Carry, EmulatedAdapter, Fault, Message, TransferError};
use crate::guests::lock;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// One bus with several users; each transfer is carried out as a whole.
#[derive(Clone)]
pub struct SharedAdapter(pub(crate) Arc<Mutex<dyn EmulatedAdapter + Send>>);

impl SharedAdapter {
    /// Shares one adapter.
    pub fn new(adapter: impl EmulatedAdapter + Send + 'static) -> Self {
        Self(Arc::new(Mutex::new(adapter)))
    }
}

impl EmulatedAdapter for SharedAdapter {
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        // A transfer that panicked leaves the bus between two messages, like a real bus after a reset.
        lock(&self.0).transfer(messages)
    }

    fn converse(
        &mut self,
        address: u16,
        reads: bool,
        talk: &mut dyn FnMut(Carry<'_>),
    ) -> Result<(), Fault> {
        lock(&self.0).converse(address, reads, talk)
    }
}

/// What there is of an emulated machine beside its buses: its time, and the interrupt pins of its targets.
pub trait Surroundings: Send + Sync {
    /// Lets time pass: this long, or until the pin of `awaited` has its level. Time that is moved by hand moves; other time
    /// is waited for. Returns the time since power-on.
    fn pass(&self, most: Duration, awaited: Option<Awaited>) -> Duration;

    /// The level of each target's interrupt pin, in the machine's order; `true` is high. Waits for buses that are held.
    fn pins(&self) -> Vec<bool>;
}

/// An interrupt pin, by its place in [`Surroundings::pins`], and the level it shall have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Awaited {
    /// The place, from 0 on.
    pub pin: usize,
    /// Whether it shall be high.
    pub high: bool,
}

/// The buses of one emulated machine: bus 1 is a program's `/dev/i2c-1`.
#[derive(Clone, Default)]
pub struct Rack {
    buses: BTreeMap<u32, SharedAdapter>,
    pub(crate) surroundings: Option<Arc<dyn Surroundings>>,
}

impl Rack {
    /// A machine without buses.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Inserts a bus at this number; returns the one it replaces.
    pub fn insert(&mut self, number: u32, adapter: SharedAdapter) -> Option<SharedAdapter> {
        self.buses.insert(number, adapter)
    }

    /// Gives the clients of a socket the machine's time and pins.
    #[must_use]
    pub fn within(mut self, surroundings: Arc<dyn Surroundings>) -> Self {
        self.surroundings = Some(surroundings);
        self
    }

    /// The bus with this number.
    #[must_use]
    pub fn get(&self, number: u32) -> Option<SharedAdapter> {
        self.buses.get(&number).cloned()
    }

    /// The buses in order of their numbers.
    pub fn iter(&self) -> impl Iterator<Item = (u32, SharedAdapter)> + '_ {
        self.buses
            .iter()
            .map(|(number, bus)| (*number, bus.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adapter::{ByFunction, Fault};

    /// Fails with one more completed message each transfer, which reveals sharing.
    fn counting(mut completed: usize) -> SharedAdapter {
        SharedAdapter::new(ByFunction(move |_: &mut [Message<'_>]| {
            completed += 1;
            let fault = Fault::NackAddress;
            Err(TransferError { completed, fault })
        }))
    }

    #[test]
    fn every_request_for_a_number_returns_the_same_bus() {
        let mut rack = Rack::new();
        assert!(rack.insert(1, counting(0)).is_none(), "nothing was there");
        rack.insert(3, counting(10));
        let completed = |number| {
            let mut bus = rack.get(number).unwrap();
            bus.transfer(&mut []).unwrap_err().completed
        };
        assert_eq!([completed(1), completed(1), completed(3)], [1, 2, 11]);
        assert!(rack.iter().map(|(number, _)| number).eq([1, 3]));
        assert!(rack.get(2).is_none());
    }
}
