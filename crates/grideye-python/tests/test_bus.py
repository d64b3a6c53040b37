"""The bus in this process: smbus2's and busio's methods, faults, and a clock that only the test moves."""

import errno
import inspect
import time

import pytest
import smbus2
from conftest import SCENES

import grideye_hil as ge

SENSOR = 0x69
PIXELS = 0x80
UNPLUGGED = '[[fault]]\nkind = "unplugged"\nfrom = "1 s"\nuntil = "2 s"\n'


def word(celsius):
    return round(celsius * 4) & 0xFFF


def test_it_has_every_method_of_smbus2():
    for name, method in inspect.getmembers(smbus2.SMBus, inspect.isfunction):
        if not name.startswith("_"):
            ours = inspect.signature(getattr(ge.Bus, name))
            assert list(ours.parameters) == list(inspect.signature(method).parameters), name


def test_both_kinds_of_methods_read_the_same_registers():
    with ge.emulate(-3.5) as bus:
        expected = word(-3.5)
        assert bus.read_word_data(SENSOR, PIXELS) == expected
        assert bus.read_byte_data(SENSOR, PIXELS) == expected & 0xFF
        assert bus.read_i2c_block_data(SENSOR, PIXELS, 4) == [*expected.to_bytes(2, "little")] * 2
        message = smbus2.i2c_msg.read(SENSOR, 128)
        bus.i2c_rdwr(smbus2.i2c_msg.write(SENSOR, [PIXELS]), message)
        assert bytes(message) == expected.to_bytes(2, "little") * 64
        frame = bytearray(128)
        assert bus.try_lock() and not bus.try_lock()
        bus.writeto_then_readfrom(SENSOR, bytes([PIXELS]), frame)
        bus.unlock()
        assert frame == bytes(message)
        assert bus.scan() == [SENSOR]
        bus.write_byte_data(SENSOR, 0x02, 0x01)
        bus.writeto(SENSOR, b"\x02")
        bus.readfrom_into(SENSOR, frame, end=1)
        assert frame[0] == 0x01
        assert bus.counts["transactions"] > 110
    with pytest.raises(TypeError):
        bus.read_byte_data(SENSOR, PIXELS)


def test_errors_are_those_of_a_raspberry_pi():
    with ge.emulate(20.0) as bus, pytest.raises(OSError) as error:
        bus.read_byte_data(0x23, 0)
    assert error.value.errno == errno.EREMOTEIO


def test_time_stands_until_it_is_moved():
    scene = ge.Scene.load(SCENES / "experiment-3.toml")
    with ge.emulate(scene, seed=2) as bus:
        first = bus.read_i2c_block_data(SENSOR, PIXELS, 32)
        time.sleep(0.15)
        assert bus.read_i2c_block_data(SENSOR, PIXELS, 32) == first
        started = time.monotonic()
        bus.advance(3600)
        assert time.monotonic() - started < 3600
        # And two reads of 318 bits: 35 bytes of nine, START, repeated START and STOP.
        assert bus.now == pytest.approx(3600.25 + 2 * 318 / 100_000, abs=1e-6)
        assert bus.read_i2c_block_data(SENSOR, PIXELS, 32) != first


def test_a_sensor_that_was_switched_on_this_instant_reads_zero():
    with ge.emulate(25.0, power_on=True) as bus:
        assert bus.read_word_data(SENSOR, PIXELS) == 0
        bus.advance(0.25)
        assert bus.read_word_data(SENSOR, PIXELS) == word(25.0)


def test_faults_from_the_start_and_later(tmp_path):
    script = tmp_path / "faults.toml"
    script.write_text(UNPLUGGED)
    with ge.emulate(20.0, faults=script) as bus:
        assert bus.faults == UNPLUGGED
        bus.read_byte(SENSOR)
        bus.advance(1.5)
        with pytest.raises(OSError):
            bus.read_byte(SENSOR)
        bus.advance(1.0)
        bus.read_byte(SENSOR)
        bus.faults = '[[fault]]\nkind = "stuck-high"\n'
        assert bus.read_byte_data(SENSOR, PIXELS) == 0xFF
        bus.faults = ""
        bus.advance(0.2)
        assert bus.read_word_data(SENSOR, PIXELS) == word(20.0)
    assert bus.faults_injected == {"unplugged": 1, "stuck-high": 1}
    with pytest.raises(ge.InputError) as error:
        ge.emulate(20.0, faults='[[fault]]\nkind = "nothing"\n')
    assert (error.value.file, error.value.line) == ("faults", 2)
    with pytest.raises(ge.InputError, match="without a sensor"):
        ge.emulate(20.0, faults=UNPLUGGED + "address = 0x68\n")


def test_what_was_refused_is_counted_and_the_end_is_an_end(walk):
    with ge.emulate(ge.Recording.read(walk), at_end="end") as bus:
        bus.write_byte_data(SENSOR, PIXELS, 1)
        assert bus.refused == {"read-only": 1}
        bus.advance(60)
        with pytest.raises(OSError) as error:
            bus.read_byte(SENSOR)
            bus.read_byte(SENSOR)
    assert error.value.errno == errno.ENODEV


def test_several_sensors_on_a_multiplexer():
    places = ["a=1:0x68", "b=1:0x70.3:0x69"]
    with ge.emulate(21.0, sensors=places) as bus:
        assert bus.scan() == [0x68, 0x70]
        bus.write_byte(0x70, 1 << 3)
        assert bus.scan() == [0x68, 0x69, 0x70]
