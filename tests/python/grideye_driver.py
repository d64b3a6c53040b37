"""grideye-driver. Arguments: frame | walk SECONDS | interrupts HIGH LOW HYSTERESIS SECONDS | sleep | average."""

import sys
import time

import bus
from grideye import GridEye, InterruptConfig
from smbus2 import SMBus


def frame(sensor):
    with sensor:
        bus.answer(thermistor=sensor.device_temperature, frame=sensor.image)


def walk(sensor, seconds):
    with sensor:
        bus.answer(frames=bus.watch(lambda: sensor.image, float(seconds)))


def interrupts(sensor, high, low, hysteresis, seconds):
    with sensor:
        sensor.interrupt_config = InterruptConfig(
            upper_limit=float(high), lower_limit=float(low), hysteresis=float(hysteresis)
        )
        kept = sensor.interrupt_config
        time.sleep(0.2)
        seen = bus.watch(lambda: [sensor.interrupt, sensor.pixel_interrupt, sensor.image], float(seconds), 0.05)
        sensor.reset_flags()
        config = [kept.upper_limit, kept.lower_limit, kept.hysteresis, kept.absolute, kept.enabled]
        bus.answer(config=config, seen=seen)


def sleep(sensor):
    """The constructor sends the sensor to sleep; `with` wakes it and lets it sleep again."""
    states = [sensor.asleep]
    asleep = sensor.image
    with sensor:
        states.append(sensor.asleep)
        awake = sensor.image
    states.append(sensor.asleep)
    sensor.wake()
    states.append(sensor.asleep)
    again = sensor.image
    sensor.sleep()
    bus.answer(states=states, asleep=asleep, awake=awake, again=again)


def average(sensor):
    with sensor:
        sensor.frame_rate = "high"
        sensor.moving_average = True
        bus.answer(moving_average=sensor.moving_average, frame_rate=sensor.frame_rate.name)


task = {"frame": frame, "walk": walk, "interrupts": interrupts, "sleep": sleep, "average": average}[sys.argv[1]]
with SMBus(1) as smbus:
    task(GridEye(smbus), *sys.argv[2:])
