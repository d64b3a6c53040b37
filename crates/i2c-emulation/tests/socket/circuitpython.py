"""The methods of busio.I2C, each asserted: `circuitpython.py SOCKET`."""

import errno
import sys

import grideye_i2c

i2c = grideye_i2c.I2C(bus=1, socket=sys.argv[1])


def first_value(register):
    return (register * 7 + 3) % 256


def errno_of(call):
    try:
        call()
    except OSError as error:
        return error.errno
    raise AssertionError("no error")


assert i2c.scan() == [0x69], i2c.scan()
assert i2c.try_lock() and not i2c.try_lock()
i2c.unlock()
try:
    i2c.unlock()
    raise AssertionError("unlocked twice")
except ValueError:
    pass

i2c.writeto(0x69, bytes([0xFF, 0x80, 0x11, 0xFF]), start=1, end=3)
i2c.writeto(0x69, b"\x80")
answer = bytearray(4)
i2c.readfrom_into(0x69, answer)
assert list(answer) == [0x11] + [first_value(r) for r in (0x81, 0x82, 0x83)], list(answer)

answer = bytearray(b"....")
i2c.readfrom_into(0x69, answer, start=1, end=3)
assert bytes(answer) == b"." + bytes([first_value(0x84), first_value(0x85)]) + b".", answer

answer = bytearray(b"......")
i2c.writeto_then_readfrom(0x69, bytes([7, 0x90, 7]), answer, out_start=1, out_end=2, in_start=2, in_end=5)
assert bytes(answer) == b".." + bytes(first_value(r) for r in (0x90, 0x91, 0x92)) + b".", answer

# adafruit_register hands one buffer over for both ways.
both = bytearray([0x90, 0, 0])
i2c.writeto_then_readfrom(0x69, both, both, out_end=1, in_start=1)
assert list(both) == [0x90, first_value(0x90), first_value(0x91)], list(both)

i2c.writeto(0x69, b"")
i2c.writeto(0x69, "\x10\x22")
assert errno_of(lambda: i2c.writeto(0x23, b"")) == errno.EREMOTEIO
assert errno_of(lambda: i2c.readfrom_into(0x23, bytearray(1))) == errno.EREMOTEIO
assert errno_of(lambda: i2c.writeto_then_readfrom(0x23, b"\0", bytearray(1))) == errno.EREMOTEIO
assert errno_of(lambda: i2c.readfrom_into(0x34, bytearray(1))) == errno.ETIMEDOUT
i2c.deinit()
assert errno_of(lambda: i2c.writeto(0x69, b"")) == errno.ENOTCONN
with grideye_i2c.I2C(None, None, frequency=400000, socket=sys.argv[1]) as i2c:
    i2c.writeto(0x69, b"\x10")
    i2c.readfrom_into(0x69, answer, end=1)
assert answer[0] == 0x22
print("done")
