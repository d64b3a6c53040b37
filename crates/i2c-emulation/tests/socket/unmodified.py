"""A program that knows nothing of emulation: smbus2 as melopero's driver uses it, and busio with board's pins."""

import sys

import board
import busio
from smbus2 import SMBus, i2c_msg

with SMBus(1) as bus:
    print(bus.read_byte_data(0x69, int(sys.argv[1])))
with SMBus("/dev/i2c-1") as bus:
    message = i2c_msg.read(0x69, 2)
    bus.i2c_rdwr(i2c_msg.write(0x69, [0x80]), message)
    print(list(message))
i2c = busio.I2C(board.SCL, board.SDA)
answer = bytearray(1)
i2c.writeto_then_readfrom(0x69, b"\x81", answer)
print(answer[0], board.I2C().scan(), __name__)
