"""The pytest plugin: unmodified drivers of other authors on the fixture, without a device or root."""

import time

import adafruit_amg88xx
import pytest
from conftest import ROOT, SCENES
from grideye import GridEye
from melopero_amg8833 import AMGGridEye
from smbus2 import SMBus, i2c_msg

import grideye_hil as ge


@pytest.mark.amg8833(scene=SCENES / "experiment-1.toml", seed=9)
def test_adafruits_driver(amg8833):
    sensor = adafruit_amg88xx.AMG88XX(amg8833)
    amg8833.advance(0.25)
    frame = bytearray(128)
    amg8833.writeto_then_readfrom(0x69, b"\x80", frame)
    words = [int.from_bytes(frame[at : at + 2], "little") for at in range(0, 128, 2)]
    assert [celsius for row in sensor.pixels for celsius in row] == [word / 4 for word in words]
    assert max(map(max, sensor.pixels)) > 24


@pytest.mark.amg8833(constant=27.5)
def test_meloperos_driver(amg8833):
    sensor = AMGGridEye(0x69, 1)
    sensor.set_fps_mode(AMGGridEye.FPS_1_MODE)
    assert sensor.get_fps() == 1
    sensor.update_pixel_temperature_matrix()
    assert sensor.get_pixel_temperature_matrix() == [[27.5] * 8] * 8


@pytest.mark.amg8833(constant=-2.25)
def test_grideye_driver(amg8833):
    # It wakes the sensor and waits by the `sleep` that it imported.
    with SMBus(1) as bus, GridEye(bus) as sensor:
        assert sensor.image == [[-2.25] * 8] * 8


@pytest.mark.amg8833(constant=31.0, faults='[[fault]]\nkind = "nack-address"\nfrom = "1 s"\n')
def test_a_script_on_smbus2(amg8833):
    with SMBus("/dev/i2c-1") as bus:
        words = i2c_msg.read(0x69, 128)
        bus.i2c_rdwr(i2c_msg.write(0x69, [0x80]), words)
        assert set(list(words)[::2]) == {31 * 4}
        started = time.monotonic()
        time.sleep(60)
        assert time.monotonic() - started < 60, "the emulated clock went on, and nobody waited"
        with pytest.raises(OSError):
            bus.read_byte(0x69)
    assert amg8833.faults_injected == {"nack-address": 1}


@pytest.mark.amg8833(sleep=False)
def test_sleep_waits_if_asked(amg8833):
    started = time.monotonic()
    time.sleep(0.05)
    assert time.monotonic() - started >= 0.05
    assert amg8833.read_word_data(0x69, 0x80) == 22 * 4


def test_a_recording_is_shown_too(amg8833, walk):
    rec = ge.Recording.read(walk)
    with ge.emulate(rec, replay="frames") as bus:
        assert bus.read_word_data(0x69, 0x80) == rec.raw[0, 0, 0]
    with pytest.raises(ge.InputError, match="unknown replay"):
        ge.emulate(rec, replay="backwards")


def test_after_a_test_smbus2_is_what_it_was(pytester):
    pytester.makeini("[pytest]\namg8833_circuitpython = true\n")
    pytester.makepyfile(
        """
        import board, busio, pytest, smbus2

        METHODS = dict(vars(smbus2.SMBus))

        @pytest.mark.amg8833(constant=25)
        def test_one(amg8833):
            assert vars(smbus2.SMBus)["read_byte"] is not METHODS["read_byte"]
            i2c = busio.I2C(board.SCL, board.SDA)
            assert i2c.scan() == [0x69]

        def test_two():
            assert dict(vars(smbus2.SMBus)) == METHODS

        @pytest.mark.amg8833(constant=25, scene="room.toml")
        def test_three(amg8833):
            pass
        """
    )
    result = pytester.runpytest_subprocess()
    result.assert_outcomes(passed=2, errors=1)
    result.stdout.fnmatch_lines(["*one of scene, recording, constant, not scene and constant*"])


def test_no_device_is_there(amg8833):
    assert (ROOT / "tests").exists()
    assert SMBus(1).read_word_data(0x69, 0x80) == 22 * 4
