//! A TCA9548A according to its datasheet (TI SCPS207), with sensors on its channels.

use amg8833_emulator::{
    Address, Bus, BusError, CHANNELS, Clock, Fault, FaultKind, HANG_TIMEOUT, ManualClock, Mux,
    MuxAddress, Options,
};
use core::time::Duration;
use embedded_hal::i2c::{I2c, NoAcknowledgeSource, Operation};
use grideye_frame::{Celsius, Frame};
use proptest::prelude::*;
use std::sync::{Arc, Mutex};

const MUX: u8 = 0x70;
const HIGH: u8 = 0x69;
const LOW: u8 = 0x68;

type Source = Box<dyn FnMut(Duration) -> Frame + Send>;
type TestMux<'a> = Mux<&'a ManualClock, Source>;

fn source(celsius: f32) -> Source {
    Box::new(move |_| Frame::uniform(Celsius::new(celsius)))
}

const fn nobody(address: u8) -> BusError {
    BusError::NoAcknowledge {
        address,
        source: NoAcknowledgeSource::Address,
    }
}

/// Channel n has a sensor at 0x69 that sees n degrees; the trunk has one at 0x68 that sees 40. Each has measured once.
fn mux(clock: &ManualClock) -> TestMux<'_> {
    let hz = 400_000.try_into().unwrap();
    let mut trunk = Bus::new(clock).with_scl_hz(hz);
    trunk.plug(Address::Low, source(40.0), Options::default());
    let mut channels = [const { 0_u8 }; CHANNELS].map(|_| Bus::new(clock));
    for (number, channel) in (0_u8..).zip(&mut channels) {
        channel.plug(Address::High, source(number.into()), Options::default());
    }
    clock.set(Duration::from_millis(150));
    Mux::new(trunk, MuxAddress::FIRST, channels)
}

fn pixel(mux: &mut TestMux<'_>, address: u8) -> Result<u16, BusError> {
    let mut bytes = [0xA5; 2];
    mux.write_read(address, &[0x80], &mut bytes)?;
    Ok(u16::from_le_bytes(bytes))
}

fn control(mux: &mut TestMux<'_>) -> u8 {
    let mut byte = [0xA5];
    mux.read(MUX, &mut byte).unwrap();
    byte[0]
}

/// "Device Address": 1 1 1 0 A2 A1 A0.
#[test]
fn the_pins_give_eight_addresses() {
    let clock = ManualClock::new();
    for bits in 0..=0xFF {
        let address = MuxAddress::from_bits(bits);
        assert_eq!(address.is_some(), bits >> 3 == 0b1110);
        let Some(address) = address else { continue };
        let channels = core::array::from_fn(|_| Bus::new(&clock));
        let mut mux: TestMux<'_> = Mux::new(Bus::new(&clock), address, channels);
        assert_eq!(mux.write(bits, &[0xFF]), Ok(()));
        assert_eq!(mux.write(bits ^ 1, &[]), Err(nobody(bits ^ 1)));
        assert_eq!(mux.selected(), 0xFF);
        assert_eq!(address.to_string(), format!("0x{bits:02x}"));
    }
}

/// "Control Register", the table of the command byte: one bit per channel, all zero after power-up.
#[test]
fn each_bit_selects_its_channel() {
    let clock = ManualClock::new();
    let mut mux = mux(&clock);
    assert_eq!(control(&mut mux), 0x00);
    assert_eq!(pixel(&mut mux, HIGH), Err(nobody(HIGH)));
    assert_eq!(pixel(&mut mux, LOW), Ok(160), "the trunk is always there");
    for channel in 0_u8..8 {
        mux.write(MUX, &[1 << channel]).unwrap();
        assert_eq!(control(&mut mux), 1 << channel);
        assert_eq!(pixel(&mut mux, HIGH), Ok(u16::from(channel) * 4));
    }
    mux.write(MUX, &[0]).unwrap();
    assert_eq!(pixel(&mut mux, HIGH), Err(nobody(HIGH)));
}

/// "If multiple bytes are received, the last"; a read repeats the same byte.
#[test]
fn the_last_byte_counts_and_reads_repeat() {
    let clock = ManualClock::new();
    let mut mux = mux(&clock);
    mux.write(MUX, &[0x01, 0xFF, 0x20]).unwrap();
    let mut bytes = [0; 3];
    mux.read(MUX, &mut bytes).unwrap();
    assert_eq!(bytes, [0x20; 3]);
    mux.write(MUX, &[]).unwrap();
    assert_eq!(control(&mut mux), 0x20, "an address alone selects nothing");
}

/// "A channel becomes active after a STOP", not after a repeated START.
#[test]
fn a_selection_waits_for_the_stop() {
    let clock = ManualClock::new();
    let mut mux = mux(&clock);
    let mut read = [0; 1];
    mux.transaction(
        MUX,
        &mut [Operation::Write(&[0x04]), Operation::Read(&mut read)],
    )
    .unwrap();
    assert_eq!(
        read,
        [0x00],
        "the old selection holds within the transaction"
    );
    assert_eq!(control(&mut mux), 0x04);
}

#[test]
fn the_reset_pin_deselects_and_silences_while_it_is_low() {
    let clock = ManualClock::new();
    let mut mux = mux(&clock);
    mux.write(MUX, &[0x02]).unwrap();
    mux.reset();
    assert_eq!(control(&mut mux), 0);
    mux.write(MUX, &[0x02]).unwrap();
    mux.hold_in_reset(true);
    assert_eq!(mux.write(MUX, &[0x02]), Err(nobody(MUX)));
    assert_eq!(pixel(&mut mux, HIGH), Err(nobody(HIGH)));
    assert_eq!(pixel(&mut mux, LOW), Ok(160));
    mux.hold_in_reset(false);
    assert_eq!(control(&mut mux), 0);
    mux.write(MUX, &[0x80]).unwrap();
    mux.power_cycle();
    assert_eq!(control(&mut mux), 0);
}

/// Two sensors with the same address on active channels: SDA is low if either pulls it.
#[test]
fn two_devices_of_one_address_are_heard_as_and() {
    let clock = ManualClock::new();
    let mut mux = mux(&clock);
    mux.write(MUX, &[0b0110_0000]).unwrap();
    // Channels 5 and 6: 20 and 24 quarter degrees.
    assert_eq!(pixel(&mut mux, HIGH), Ok(20 & 24));
    mux.write(HIGH, &[0x02, 0x01]).unwrap();
    for channel in [5, 6] {
        mux.write(MUX, &[1 << channel]).unwrap();
        let mut rate = [0];
        mux.write_read(HIGH, &[0x02], &mut rate).unwrap();
        assert_eq!(rate, [0x01], "both heard it");
    }
    mux.trunk_mut()
        .plug(Address::High, source(-0.25), Options::default());
    clock.advance(Duration::from_secs(1));
    mux.write(MUX, &[0x08]).unwrap();
    assert_eq!(pixel(&mut mux, HIGH), Ok(0xFFF & 12), "the trunk's too");
}

#[test]
fn a_silent_sensor_does_not_keep_the_other_from_acknowledging() {
    let clock = ManualClock::new();
    let mut mux = mux(&clock);
    mux.write(MUX, &[0b0110_0000]).unwrap();
    let five = mux.channel_mut(5).unwrap();
    five.set_fault(Address::High, Fault::NackAddress);
    assert_eq!(
        pixel(&mut mux, HIGH),
        Ok(24),
        "a released line does not count"
    );
    let counts = mux.channel(5).unwrap().fault_counts();
    assert_eq!(counts.of(FaultKind::NackAddress), 1, "once a transaction");
    let six = mux.channel_mut(6).unwrap();
    six.set_fault(Address::High, Fault::NackAddress);
    assert_eq!(pixel(&mut mux, HIGH), Err(nobody(HIGH)));
}

/// RESET exists "to recover should a bus be held low" on a channel.
#[test]
fn a_channel_that_is_held_low_holds_the_trunk_until_reset() {
    let clock = ManualClock::new();
    let mut mux = mux(&clock);
    mux.channel_mut(3)
        .unwrap()
        .set_fault(None::<Address>, Fault::Hang);
    assert_eq!(pixel(&mut mux, LOW), Ok(160), "not connected");
    mux.write(MUX, &[0x08]).unwrap();
    let before = clock.now();
    assert_eq!(pixel(&mut mux, LOW), Err(BusError::Timeout));
    assert!(clock.now() - before >= HANG_TIMEOUT);
    assert_eq!(
        mux.write(MUX, &[0x00]),
        Err(BusError::Timeout),
        "the control register is out of reach"
    );
    mux.reset();
    assert_eq!(pixel(&mut mux, LOW), Ok(160));
    assert_eq!(mux.trunk().fault_counts().total(), 0);
    let counts = mux.channel(3).unwrap().fault_counts();
    assert_eq!(counts.of(FaultKind::Hang), 2);
}

#[test]
fn a_missing_adapter_is_missing_for_all() {
    let clock = ManualClock::new();
    let mut mux = mux(&clock);
    mux.trunk_mut()
        .set_fault(None::<Address>, Fault::AdapterGone);
    assert_eq!(mux.write(MUX, &[0x01]), Err(BusError::Gone));
    assert_eq!(mux.transaction(MUX, &mut []), Err(BusError::Gone));
    assert_eq!(mux.selected(), 0);
    mux.trunk_mut().clear_fault(None::<Address>);
    assert_eq!(mux.transaction(MUX, &mut []), Ok(()));
}

#[test]
fn time_traffic_and_trace_run_through() {
    let clock = ManualClock::new();
    let mut mux = mux(&clock);
    let notes = Arc::new(Mutex::new(Vec::new()));
    for (name, bus) in ["trunk", "0", "1"].into_iter().zip(mux.buses_mut()) {
        let notes = Arc::clone(&notes);
        bus.set_trace(move |transfer| {
            let bytes = transfer.bytes.len();
            notes.lock().unwrap().push((name, transfer.address, bytes));
        });
    }
    let before = clock.now();
    mux.write(MUX, &[0x02]).unwrap();
    assert_eq!(clock.now() - before, Duration::from_nanos(20 * 2_500));
    let before = clock.now();
    pixel(&mut mux, HIGH).unwrap();
    assert_eq!(
        clock.now() - before,
        Duration::from_nanos(48 * 2_500),
        "counted once, on however many buses"
    );
    assert_eq!(
        *notes.lock().unwrap(),
        [
            ("trunk", MUX, 1),
            ("trunk", HIGH, 1),
            ("trunk", HIGH, 2),
            ("1", HIGH, 1),
            ("1", HIGH, 2),
        ]
    );
    let transactions: Vec<u64> = mux.buses().map(|bus| bus.traffic().transactions).collect();
    assert_eq!(transactions, [2, 0, 1, 0, 0, 0, 0, 0, 0]);
    assert_eq!(mux.channel(1).unwrap().traffic().bits, 48);
    assert!(mux.channel(CHANNELS).is_none() && mux.channel_mut(CHANNELS).is_none());
}

/// Sensors on a deselected channel keep measuring.
#[test]
fn sensors_measure_whether_or_not_they_are_heard() {
    let clock = ManualClock::new();
    let mut mux = mux(&clock);
    clock.set(Duration::from_secs(10));
    mux.advance();
    let frames: Vec<u64> = mux
        .buses()
        .filter_map(|bus| bus.device(Address::High))
        .map(amg8833_emulator::Device::frames)
        .collect();
    assert_eq!(frames, [100; 8]);
}

/// Of several faults, the first in the wires' order counts, whichever bus has it.
#[test]
fn the_strongest_fault_on_any_connected_bus_is_reported() {
    let clock = ManualClock::new();
    let mut mux = mux(&clock);
    mux.write(MUX, &[0x03]).unwrap();
    mux.trunk_mut().set_fault(None::<Address>, Fault::BusError);
    mux.channel_mut(0)
        .unwrap()
        .set_fault(None::<Address>, Fault::ArbitrationLoss);
    assert_eq!(pixel(&mut mux, HIGH), Err(BusError::ArbitrationLoss));
    assert_eq!(mux.trunk().fault_counts().total(), 0, "hidden");
    mux.channel_mut(0).unwrap().clear_fault(None::<Address>);
    assert_eq!(pixel(&mut mux, HIGH), Err(BusError::Bus));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    /// Whatever is sent to any address, nothing panics, and the pixels are those of the selected channels.
    #[test]
    fn whatever_is_selected_is_what_is_heard(
        acts in prop::collection::vec((any::<u8>(), prop::collection::vec(any::<u8>(), 0..4), 0_usize..5), 1..40),
        selection in any::<u8>(),
    ) {
        let clock = ManualClock::new();
        let mut mux = mux(&clock);
        for (to, bytes, count) in acts {
            let to = if to < 128 { [MUX, HIGH, LOW][usize::from(to % 3)] } else { to };
            let mut read = vec![0; count];
            // 0x00 and 0x01 would put sensors to sleep or reset them, which is not the subject here.
            if bytes.first().is_none_or(|register| (2..0xFC).contains(register)) || to == MUX {
                let _ = mux.write_read(to, &bytes, &mut read);
            }
        }
        if mux.write(MUX, &[selection]).is_ok() {
            let expected = (0_u16..8)
                .filter(|channel| selection >> channel & 1 != 0)
                .map(|channel| channel * 4)
                .reduce(|one, other| one & other);
            match expected {
                Some(word) => prop_assert_eq!(pixel(&mut mux, HIGH), Ok(word)),
                None => prop_assert_eq!(pixel(&mut mux, HIGH), Err(nobody(HIGH))),
            }
        }
    }
}
