//! The wires of one bus: alone, or with a multiplexer on it.

use crate::clock::BusClock;
use crate::show::Show;
use amg8833_emulator::script::{Rule, Script};
use amg8833_emulator::{Bus, BusError, CHANNELS, Mux, MuxAddress, Traffic};
use embedded_hal::i2c::{ErrorType, I2c, Operation};
use std::iter;
use std::num::NonZeroU32;
use std::sync::Arc;

/// A bus, or one channel of a multiplexer, with up to two sensors.
pub(crate) type SensorBus = Bus<Arc<BusClock>, Show>;

/// Everything that hangs on one pair of wires.
pub(crate) enum Wires {
    Plain(Box<SensorBus>),
    Branched(Box<Mux<Arc<BusClock>, Show>>),
}

impl Wires {
    /// Wires without sensors; with a multiplexer, if there is an address for one.
    pub(crate) fn new(clock: &Arc<BusClock>, mux: Option<u8>, scl_hz: Option<NonZeroU32>) -> Self {
        let mut trunk = Bus::new(Arc::clone(clock));
        if let Some(scl_hz) = scl_hz {
            trunk = trunk.with_scl_hz(scl_hz);
        }
        match mux.and_then(MuxAddress::from_bits) {
            None => Self::Plain(Box::new(trunk)),
            Some(address) => {
                let channels: [_; CHANNELS] = std::array::from_fn(|_| Bus::new(Arc::clone(clock)));
                Self::Branched(Box::new(Mux::new(trunk, address, channels)))
            }
        }
    }

    /// The bus before the multiplexer, or the whole of it.
    pub(crate) fn trunk(&mut self) -> &mut SensorBus {
        match self {
            Self::Plain(bus) => bus,
            Self::Branched(mux) => mux.trunk_mut(),
        }
    }

    /// The trunk, or one channel of the multiplexer.
    pub(crate) fn segment(&mut self, channel: Option<u8>) -> Option<&mut SensorBus> {
        match (self, channel) {
            (wires, None) => Some(wires.trunk()),
            (Self::Plain(_), Some(_)) => None,
            (Self::Branched(mux), Some(channel)) => mux.channel_mut(usize::from(channel)),
        }
    }

    /// The trunk and all channels.
    pub(crate) fn segments(&self) -> Box<dyn Iterator<Item = &SensorBus> + '_> {
        match self {
            Self::Plain(bus) => Box::new(iter::once(&**bus)),
            Self::Branched(mux) => Box::new(mux.buses()),
        }
    }

    /// What went over the trunk, and with it everything.
    pub(crate) fn traffic(&self) -> Traffic {
        match self {
            Self::Plain(bus) => bus.traffic(),
            Self::Branched(mux) => mux.trunk().traffic(),
        }
    }

    /// Lets everything happen that is due by now.
    pub(crate) fn advance(&mut self) {
        match self {
            Self::Plain(bus) => bus.advance(),
            Self::Branched(mux) => mux.advance(),
        }
    }

    /// Runs the script of this bus from now on. Rules for the whole bus are the trunk's; those for an address are also
    /// for the sensors of that address behind the multiplexer, each with luck of its own.
    pub(crate) fn set_script(&mut self, script: &Script) {
        if let Self::Branched(mux) = self {
            let rules: Vec<Rule> = script
                .rules()
                .filter(|rule| rule.address.is_some())
                .copied()
                .collect();
            for (seed, channel) in (script.seed().wrapping_add(1)..).zip(0..CHANNELS) {
                // They are no more, and no others, than those of a script that is one.
                let Ok(of_the_channel) = Script::new(seed, rules.clone()) else {
                    continue;
                };
                if let Some(bus) = mux.channel_mut(channel) {
                    bus.set_script(of_the_channel);
                }
            }
        }
        self.trunk().set_script(script.clone());
    }
}

impl ErrorType for Wires {
    type Error = BusError;
}

impl I2c for Wires {
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        match self {
            Self::Plain(bus) => bus.transaction(address, operations),
            Self::Branched(mux) => mux.transaction(address, operations),
        }
    }
}
