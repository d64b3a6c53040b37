//! The emulated bus and its time as the agent takes them.

use crate::paced_clock::PacedClock;
use crate::sensor::Source;
use amg8833_emulator::{Bus, BusError};
use embedded_hal::i2c::{ErrorType, I2c, Operation};
use grideye_agent::bus::{OpenBus, OpenError, by_kind};
use grideye_frame::NoData;
use grideye_recording::ClockState;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Emulated boot time; its wall clock started right when the program did, and is synchronised.
#[derive(Debug)]
pub struct AgentClock {
    paced: Arc<PacedClock>,
    started_utc: Duration,
}

impl AgentClock {
    /// A wall clock around emulated time.
    #[must_use]
    pub fn new(paced: Arc<PacedClock>) -> Self {
        let started_utc = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default();
        Self { paced, started_utc }
    }
}

impl grideye_agent::clock::Clock for AgentClock {
    fn boot(&self) -> Duration {
        self.paced.now()
    }

    fn utc(&self) -> (i64, ClockState) {
        let utc = self.started_utc + self.paced.now();
        (
            i64::try_from(utc.as_nanos()).unwrap_or(i64::MAX),
            ClockState::Synced,
        )
    }

    fn sleep_until(&self, boot: Duration) {
        self.paced.sleep_until(boot);
    }
}

/// The emulated bus as the agent's thread takes it: opened again and again, it stays the same bus.
#[derive(Clone)]
pub struct SharedBus(Arc<Mutex<Bus<Arc<PacedClock>, Source>>>);

impl SharedBus {
    /// Shares one bus.
    #[must_use]
    pub fn new(bus: Bus<Arc<PacedClock>, Source>) -> Self {
        Self(Arc::new(Mutex::new(bus)))
    }

    /// Looks at the bus, for its counters.
    pub fn with<T>(&self, look: impl FnOnce(&Bus<Arc<PacedClock>, Source>) -> T) -> T {
        look(&self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl ErrorType for SharedBus {
    type Error = BusError;
}

impl I2c for SharedBus {
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .transaction(address, operations)
    }
}

impl OpenBus for SharedBus {
    type Bus = Self;

    fn open(&mut self) -> Result<Self, OpenError> {
        Ok(self.clone())
    }

    fn classify(&self, error: &BusError) -> NoData {
        match error {
            BusError::Timeout => NoData::BusTimeout,
            BusError::Gone => NoData::Unplugged,
            other => by_kind(embedded_hal::i2c::Error::kind(other)),
        }
    }
}
