"""grideye-driver from PyPI and presence.py on an emulated sensor, which shows room.toml.

The fixture amg8833 is grideye-hil's. The driver does not know that its sensor is emulated; `time.sleep` moves the sensor's
clock, and nobody waits.
"""

import time
from pathlib import Path

import pytest
from grideye import GridEye, InterruptConfig
from presence import room_c, somebody
from smbus2 import SMBus

ROOM_C = 19.5
# In the specification's order these are rows 2 and 3, columns 0 and 1. This driver rotates its image by 180°.
PERSON = {(5, 7), (5, 6), (4, 7), (4, 6)}
pytestmark = pytest.mark.amg8833(scene=Path(__file__).parents[1] / "room.toml")


@pytest.fixture
def sensor(amg8833):
    with SMBus(1) as bus, GridEye(bus) as woken:
        yield woken


def test_the_room_has_its_temperature(sensor):
    assert room_c(sensor.image) == pytest.approx(ROOM_C, abs=0.5)


def test_the_person_is_where_the_scene_has_them(sensor):
    assert somebody(sensor.image) == PERSON


def test_the_chip_is_a_little_warmer_than_the_room(sensor):
    assert ROOM_C < sensor.device_temperature < ROOM_C + 10


def test_the_interrupt_marks_the_person(sensor):
    sensor.interrupt_config = InterruptConfig(upper_limit=ROOM_C + 5, lower_limit=0, hysteresis=0.5)
    time.sleep(0.25)  # two frames
    assert sensor.interrupt
    marked = sensor.pixel_interrupt
    assert {(row, column) for row in range(8) for column in range(8) if marked[row][column]} == PERSON


def test_images_keep_coming(sensor):
    first = sensor.image
    time.sleep(0.25)
    assert sensor.image != first, "two frames of a sensor differ by its noise"


def test_no_image_in_sleep(sensor):
    sensor.sleep()
    assert sensor.asleep
    sensor.wake()
    assert somebody(sensor.image) == PERSON
