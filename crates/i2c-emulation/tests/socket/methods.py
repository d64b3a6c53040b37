"""Calls every method of smbus2's SMBus on a bus and prints what each gives: `methods.py MODULE BUS [SOCKET]`.

Run once with the real smbus2 on an emulated /dev/i2c-N and once with grideye_i2c on a socket, it must print the same.
"""

import importlib
import inspect
import sys
import zlib

module = importlib.import_module(sys.argv[1])
SMBus, i2c_msg, I2cFunc = module.SMBus, module.i2c_msg, module.I2cFunc
BUS = int(sys.argv[2])
TARGET, NOBODY = 0x69, 0x23
if len(sys.argv) > 3:
    module.install(sys.argv[3])


def show(text, call):
    try:
        outcome = repr(call())
        if len(outcome) > 200:
            outcome = "%d characters, CRC-32 %08x" % (len(outcome), zlib.crc32(outcome.encode()))
    except OSError as error:
        outcome = "OSError errno %s" % error.errno
    except Exception as error:
        outcome = "%s: %s" % (type(error).__name__, error)
    print("%-52s %s" % (text, outcome))


def both_ways(*messages):
    bus.i2c_rdwr(*messages)
    return [list(message) for message in messages]


def read_into_old_bytes(address):
    message = i2c_msg.read(address, 2)
    message.buf[0], message.buf[1] = b"U", b"V"
    bus.i2c_rdwr(i2c_msg.write(TARGET, [0]), message)
    return list(message)


bus = SMBus(BUS)
show("funcs", lambda: hex(bus.funcs))
show("funcs & I2C", lambda: bool(bus.funcs & I2cFunc.I2C))
for name in [n for n, _ in inspect.getmembers(SMBus, inspect.isfunction) if not n.startswith("_")]:
    show("signature of " + name, lambda: [p.name for p in inspect.signature(getattr(SMBus, name)).parameters.values()])

CALLS = """
bus.write_quick(T)
bus.read_byte(T)
bus.read_byte(T)
bus.write_byte(T, 0x10)
bus.read_byte(T)
bus.read_byte_data(T, 0x80)
bus.read_byte_data(i2c_addr=T, register=0xFF)
bus.write_byte_data(T, 0x20, 0xAB)
bus.write_byte_data(i2c_addr=T, register=0x21, value=0x1CD)
bus.read_byte_data(T, 0x20)
bus.read_byte_data(T, 0x121)
bus.read_word_data(T, 0x20)
bus.read_word_data(i2c_addr=T, register=0x0E)
bus.write_word_data(T, 0x30, 0xBEEF)
bus.write_word_data(i2c_addr=T, register=0x32, value=0x1CAFE)
bus.read_i2c_block_data(T, 0x30, 4)
bus.read_i2c_block_data(T, register=0x80, length=32)
bus.read_i2c_block_data(T, 0x80, 0)
bus.read_i2c_block_data(T, 0x80, 33)
bus.write_i2c_block_data(T, 0x40, [1, 2, 3, 260])
bus.write_i2c_block_data(T, register=0x50, data=list(range(32)))
bus.write_i2c_block_data(T, 0x40, list(range(33)))
bus.write_i2c_block_data(T, 0x44, [])
bus.read_i2c_block_data(T, 0x40, 6)
bus.read_i2c_block_data(T, 0x50, 32)
bus.process_call(T, 0x60, 0x1234)
bus.read_word_data(T, 0x60)
bus.write_block_data(T, 0x90, [9, 8, 7])
bus.write_block_data(T, 0x90, list(range(33)))
bus.read_i2c_block_data(T, 0x90, 5)
bus.read_block_data(T, 0x90)
bus.read_block_data(T, 0x12)
bus.block_process_call(T, 0x90, [3, 2, 1])
bus.write_quick(N)
bus.read_byte(N)
bus.write_byte(N, 1)
bus.read_byte_data(N, 1)
bus.write_byte_data(N, 1, 1)
bus.read_word_data(N, 1)
bus.write_word_data(N, 1, 1)
bus.process_call(N, 1, 1)
bus.read_i2c_block_data(N, 1, 4)
bus.write_i2c_block_data(N, 1, [1])
bus.read_block_data(N, 1)
bus.read_byte_data(0x80, 1)
bus.read_byte_data(0x30, 1)
bus.read_byte_data(0x31, 1)
bus.read_byte_data(0x32, 1)
bus.read_byte_data(0x33, 1)
bus.read_byte_data(0x34, 1)
bus.read_byte_data(0x35, 1)
bus.read_byte_data(T, 1, force=True)
bus.read_byte_data(T, 1, force=False)
both_ways(i2c_msg.write(T, [0x80]), i2c_msg.read(T, 128))
both_ways(i2c_msg.write(T, [0x70, 1, 2, 3]))
both_ways(i2c_msg.write(T, "\\x70"), i2c_msg.read(T, 3))
both_ways(i2c_msg.write(T, b"\\x70\\x09"), i2c_msg.write(T, [0x70]), i2c_msg.read(T, 1))
both_ways(i2c_msg.read(T, 2), i2c_msg.write(T, [0]))
both_ways(i2c_msg.read(T, 0))
both_ways(i2c_msg.write(T, []))
both_ways(i2c_msg.write(T, [1]), i2c_msg.read(N, 2))
both_ways(i2c_msg.write(N, [1]), i2c_msg.read(N, 2))
read_into_old_bytes(N)
read_into_old_bytes(T)
both_ways(*[i2c_msg.write(T, [0])] * 42)
both_ways(*[i2c_msg.write(T, [0])] * 43)
both_ways(i2c_msg.write(T, [0]), i2c_msg.read(T, 8192))
both_ways(i2c_msg.read(T, 8193))
both_ways()
both_ways(i2c_msg.read(0x34, 1))
bytes(i2c_msg.write(T, [1, 2]))
len(i2c_msg.read(T, 5))
i2c_msg.write(T, [65, 66])
str(i2c_msg.write(T, [65, 66, 200]))
i2c_msg.write(T, [65, 66]).buf[1]
i2c_msg.read(T, 5).flags, i2c_msg.read(T, 5).addr, i2c_msg.read(T, 5).len
bus.enable_pec()
bus.pec
bus.read_byte_data(T, 0x80)
bus.write_byte_data(T, 0xA0, 0x77)
bus.read_i2c_block_data(T, 0xA0, 2)
bus.enable_pec(False)
bus.read_byte_data(T, 0xA1)
bus.open("text without a number")
bus.open(1.5)
bus.open(BUS + 1)
bus.read_byte_data(T, 0x80)
bus.close()
bus.close()
bus.fd
bus.read_byte_data(T, 0x80)
bus.open("/dev/i2c-%d" % BUS)
bus.read_byte_data(T, 0x80)
"""
names = {"bus": bus, "T": TARGET, "N": NOBODY, "i2c_msg": i2c_msg, "both_ways": both_ways, "read_into_old_bytes": read_into_old_bytes, "BUS": BUS}
for line in CALLS.strip().splitlines():
    show(line, lambda: eval(line, names))
bus.close()
with SMBus(BUS, force=True) as bus:
    names["bus"] = bus
    show("forced: bus.read_byte_data(T, 0x80)", lambda: eval("bus.read_byte_data(T, 0x80)", names))
    show("forced: bus.read_byte_data(T, 0x80, force=False)", lambda: eval("bus.read_byte_data(T, 0x80, force=False)", names))
show("fd after with", lambda: bus.fd)
bus = SMBus()
show("not opened yet", lambda: bus.fd)
bus.open(BUS)
names["bus"] = bus
show("opened later", lambda: eval("bus.read_byte_data(T, 0x80)", names))
