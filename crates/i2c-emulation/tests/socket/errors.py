"""What goes wrong around the bus: `errors.py SOCKET`. Asks for a stop of the server by a line on standard output."""

import errno
import os
import sys
import threading

import grideye_i2c
from grideye_i2c import SMBus

SOCKET = sys.argv[1]


def error_of(call):
    try:
        call()
    except Exception as error:
        return error
    raise AssertionError("no error")


os.environ.pop("GRIDEYE_I2C_SOCKET", None)
error = error_of(lambda: SMBus(1))
assert isinstance(error, ValueError) and "GRIDEYE_I2C_SOCKET" in str(error), error
os.environ["GRIDEYE_I2C_SOCKET"] = SOCKET
SMBus(1).close()

error = error_of(lambda: SMBus(1, socket=SOCKET + ".not"))
assert isinstance(error, FileNotFoundError) and "is the server running?" in str(error), error
error = error_of(lambda: SMBus(3))
assert isinstance(error, FileNotFoundError) and "no bus 3; the server has 1, 7" in str(error), error

bus = SMBus(1)
# A fork inherits the connection but must not share it.
child = os.fork()
if child == 0:
    for _ in range(200):
        assert bus.read_word_data(0x69, 0x10) == 0x7A73
    os._exit(0)
for _ in range(200):
    assert bus.read_word_data(0x69, 0x20) == 0xEAE3
assert os.waitpid(child, 0)[1] == 0

wrong = []


def hammer(register):
    for _ in range(200):
        if bus.read_byte_data(0x69, register) != (register * 7 + 3) % 256:
            wrong.append(register)


threads = [threading.Thread(target=hammer, args=(register,)) for register in (1, 90, 200)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
assert not wrong, wrong

print("stop", flush=True)
sys.stdin.readline()
error = error_of(lambda: bus.read_byte(0x69))
assert error.errno == errno.ENOTCONN and "the server is stopping" in str(error), error
error = error_of(lambda: bus.read_byte(0x69))
assert error.errno == errno.ENOTCONN, error
print("done")
