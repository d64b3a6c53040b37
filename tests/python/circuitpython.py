"""adafruit-circuitpython-amg88xx. Arguments: extended | board, then frame | walk SECONDS | rows FRAMES.

`extended` is adafruit-extended-bus, which takes any /dev/i2c-N; `board` is Blinka's own board.I2C() as on a
Raspberry Pi 4, whose detection is told what it stands on, since it looks at /proc/device-tree.
"""

import os
import sys
import time
import warnings

import bus

# Blinka warns that Linux decides the bus clock.
warnings.simplefilter("ignore", RuntimeWarning)


def open_bus(how):
    if how == "board":
        os.environ["BLINKA_FORCEBOARD"] = "RASPBERRY_PI_4B"
        os.environ["BLINKA_FORCECHIP"] = "BCM2XXX"
        import board

        return board.I2C()
    from adafruit_extended_bus import ExtendedI2C

    return ExtendedI2C(1)


i2c = open_bus(sys.argv[1])
while not i2c.try_lock():
    pass
scan = i2c.scan()
i2c.unlock()

import adafruit_amg88xx

sensor = adafruit_amg88xx.AMG88XX(i2c)
# The driver waits for nothing after its reset; the specification wants two frames.
time.sleep(0.25)
if sys.argv[2] == "walk":
    bus.answer(frames=bus.watch(lambda: sensor.pixels, float(sys.argv[3])))
elif sys.argv[2] == "rows":
    # As scripts around the library keep what they see: 64 numbers a line.
    for _ in range(int(sys.argv[3])):
        print(*(celsius for row in sensor.pixels for celsius in row))
        time.sleep(0.1)
else:
    bus.answer(scan=scan, thermistor=sensor.temperature, frame=sensor.pixels)
