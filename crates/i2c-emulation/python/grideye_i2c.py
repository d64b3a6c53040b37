"""Emulated I2C buses behind a Unix socket, with the methods of smbus2 and of CircuitPython's busio.I2C.

One file, Python 3.7 or newer, nothing to install. Start the server, then use either class, or run programs that
import smbus2 unchanged:

    grideye emulate --scene SCENE --socket /tmp/grideye.sock

    import grideye_i2c
    bus = grideye_i2c.SMBus(1, socket="/tmp/grideye.sock")           # as smbus2.SMBus(1)
    i2c = grideye_i2c.I2C(bus=1, socket="/tmp/grideye.sock")         # as busio.I2C(board.SCL, board.SDA)
    grideye_i2c.install("/tmp/grideye.sock")                         # from here on `import smbus2` is this module

    python3 grideye_i2c.py /tmp/grideye.sock program.py ARGUMENTS    # an unmodified program, smbus2 or CircuitPython

    time_s, pins = grideye_i2c.pass_time(0.1)                        # also grideye_i2c.wait_for_interrupt()

Without `socket=` and `install`, the environment variable GRIDEYE_I2C_SOCKET names the socket. Failures raise OSError
with the errno of a Raspberry Pi, or of the adapter that the server imitates.
"""

import ctypes
import errno
import os
import re
import runpy
import socket as sockets
import struct
import sys
import threading
from enum import IntFlag

__version__ = "1"
__all__ = ["SMBus", "i2c_msg", "I2cFunc", "I2C", "install", "pass_time", "wait_for_interrupt", "TIMEOUT_SECONDS"]

TIMEOUT_SECONDS = 10.0
"""The longest wait for the server, to connect and for each answer."""

_VERSION = 1
_MAGIC = b"i2ce"
_HELLO, _TRANSFER, _SMBUS, _PASS = 1, 2, 3, 6
_WELCOME, _DONE, _FAULT, _REFUSED, _BYE, _PASSED = 0x81, 0x82, 0x83, 0x84, 0x85, 0x86
_RDWR, _FILE = 1, 2
_READ_FLAG = 0x0001
_FORCE_FLAG, _PEC_FLAG = 0x0001, 0x0004
_WRITE, _READ = 0, 1
_QUICK, _BYTE, _BYTE_DATA, _WORD_DATA, _PROC_CALL, _BLOCK_DATA = 0, 1, 2, 3, 4, 5
_BLOCK_PROC_CALL, _I2C_BLOCK_DATA = 7, 8
_BLOCK_MAX = 32
_MESSAGES_MAX = 42
_MESSAGE_BYTES_MAX = 8192
_PACKET_BYTES_MAX = 8 + _MESSAGES_MAX * (6 + _MESSAGE_BYTES_MAX)

_HEAD = struct.Struct("<IB")
_TRANSFER_HEAD = struct.Struct("<IBH")
_MESSAGE_HEAD = struct.Struct("<HHH")
_SMBUS_CALL = struct.Struct("<IHHBBB34s")
_U16 = struct.Struct("<H")
_PASS_CALL = struct.Struct("<QHB")
_PASS_MAX_SECONDS = 1.0
_NO_PIN = 0xFFFF

_installed_socket = None


class I2cFunc(IntFlag):
    """The abilities of an adapter: the bits of `SMBus.funcs`."""

    I2C = 0x00000001
    ADDR_10BIT = 0x00000002
    PROTOCOL_MANGLING = 0x00000004
    SMBUS_PEC = 0x00000008
    NOSTART = 0x00000010
    SLAVE = 0x00000020
    SMBUS_BLOCK_PROC_CALL = 0x00008000
    SMBUS_QUICK = 0x00010000
    SMBUS_READ_BYTE = 0x00020000
    SMBUS_WRITE_BYTE = 0x00040000
    SMBUS_READ_BYTE_DATA = 0x00080000
    SMBUS_WRITE_BYTE_DATA = 0x00100000
    SMBUS_READ_WORD_DATA = 0x00200000
    SMBUS_WRITE_WORD_DATA = 0x00400000
    SMBUS_PROC_CALL = 0x00800000
    SMBUS_READ_BLOCK_DATA = 0x01000000
    SMBUS_WRITE_BLOCK_DATA = 0x02000000
    SMBUS_READ_I2C_BLOCK = 0x04000000
    SMBUS_WRITE_I2C_BLOCK = 0x08000000
    SMBUS_HOST_NOTIFY = 0x10000000
    SMBUS_BYTE = 0x00060000
    SMBUS_BYTE_DATA = 0x00180000
    SMBUS_WORD_DATA = 0x00600000
    SMBUS_BLOCK_DATA = 0x03000000
    SMBUS_I2C_BLOCK = 0x0C000000
    SMBUS_EMUL = 0x0EFF0008


class i2c_msg:
    """One message of `SMBus.i2c_rdwr`; `list(message)` and `bytes(message)` return the bytes read."""

    def __init__(self, addr=0, flags=0, len=0, buf=None):
        self.addr = addr
        self.flags = flags
        self.len = len
        self.buf = ctypes.create_string_buffer(0) if buf is None else buf

    @staticmethod
    def read(address, length):
        """A message that reads `length` bytes."""
        return i2c_msg(address, _READ_FLAG, length, ctypes.create_string_buffer(length))

    @staticmethod
    def write(address, buf):
        """A message that writes a list of numbers, bytes, or text of characters below 256."""
        sent = bytes(map(ord, buf)) if isinstance(buf, str) else bytes(buf)
        return i2c_msg(address, 0, len(sent), ctypes.create_string_buffer(sent, len(sent)))

    def __bytes__(self):
        return ctypes.string_at(self.buf, self.len)

    def __iter__(self):
        return iter(bytes(self))

    def __len__(self):
        return self.len

    def __repr__(self):
        return "i2c_msg(%d,%d,%r)" % (self.addr, self.flags, bytes(self))

    def __str__(self):
        return bytes(self).decode(errors="ignore")


class SMBus:
    """smbus2's SMBus, on an emulated bus.

    `bus` is a number or a path that ends in one, such as "/dev/i2c-1".
    """

    def __init__(self, bus=None, force=False, socket=None):
        self.fd = None
        self.funcs = I2cFunc(0)
        self.force = force
        self.address = None
        self._socket = socket
        self._pec = 0
        self._link = None
        self._bus = None
        if bus is not None:
            self.open(bus)

    def __enter__(self):
        return self

    def __exit__(self, exc_type, exc_val, exc_tb):
        self.close()

    def open(self, bus):
        """Connects to a bus."""
        number = _bus_number(bus)
        link = _Link(self._socket, number)
        if self._link is not None:
            self._link.close()
        self._link = link
        self._bus = number
        self.fd = link.fileno()
        self.funcs = link.functionality

    def close(self):
        """Ends the connection; closing twice is allowed."""
        if self._link is not None:
            self._link.close()
        self._link = self._bus = self.fd = self.address = None
        self._pec = 0

    def enable_pec(self, enable=True):
        """Switches checksums on or off."""
        if not self.funcs & I2cFunc.SMBUS_PEC:
            raise OSError("SMBUS_PEC is not a feature")
        self._pec = int(enable)

    pec = property(lambda self: self._pec, enable_pec)

    def write_quick(self, i2c_addr, force=None):
        """Sends only the address."""
        self._smbus(i2c_addr, _WRITE, 0, _QUICK, b"", force)

    def read_byte(self, i2c_addr, force=None):
        """Reads a byte, without a register."""
        return self._smbus(i2c_addr, _READ, 0, _BYTE, b"", force)[0]

    def write_byte(self, i2c_addr, value, force=None):
        """Writes a byte, without a register."""
        self._smbus(i2c_addr, _WRITE, value, _BYTE, b"", force)

    def read_byte_data(self, i2c_addr, register, force=None):
        """Reads a byte of a register."""
        return self._smbus(i2c_addr, _READ, register, _BYTE_DATA, b"", force)[0]

    def write_byte_data(self, i2c_addr, register, value, force=None):
        """Writes a byte of a register."""
        self._smbus(i2c_addr, _WRITE, register, _BYTE_DATA, bytes([value & 0xFF]), force)

    def read_word_data(self, i2c_addr, register, force=None):
        """Reads two bytes of a register, the low one first."""
        return _U16.unpack_from(self._smbus(i2c_addr, _READ, register, _WORD_DATA, b"", force))[0]

    def write_word_data(self, i2c_addr, register, value, force=None):
        """Writes two bytes of a register, the low one first."""
        self._smbus(i2c_addr, _WRITE, register, _WORD_DATA, _U16.pack(value & 0xFFFF), force)

    def process_call(self, i2c_addr, register, value, force=None):
        """Writes two bytes and reads two."""
        word = _U16.pack(value & 0xFFFF)
        return _U16.unpack_from(self._smbus(i2c_addr, _WRITE, register, _PROC_CALL, word, force))[0]

    def read_block_data(self, i2c_addr, register, force=None):
        """Reads a block that starts with its length."""
        return _block(self._smbus(i2c_addr, _READ, register, _BLOCK_DATA, b"", force))

    def write_block_data(self, i2c_addr, register, data, force=None):
        """Writes a block after its length."""
        self._smbus(i2c_addr, _WRITE, register, _BLOCK_DATA, _with_length(data), force)

    def block_process_call(self, i2c_addr, register, data, force=None):
        """Writes a block and reads a block."""
        block = _with_length(data)
        return _block(self._smbus(i2c_addr, _WRITE, register, _BLOCK_PROC_CALL, block, force))

    def read_i2c_block_data(self, i2c_addr, register, length, force=None):
        """Reads `length` bytes, at most 32, from a register on."""
        if length > _BLOCK_MAX:
            raise ValueError("Desired block length over %d bytes" % _BLOCK_MAX)
        head = bytes([length & 0xFF])
        return _block(self._smbus(i2c_addr, _READ, register, _I2C_BLOCK_DATA, head, force), length)

    def write_i2c_block_data(self, i2c_addr, register, data, force=None):
        """Writes at most 32 bytes from a register on."""
        self._smbus(i2c_addr, _WRITE, register, _I2C_BLOCK_DATA, _with_length(data), force)

    def i2c_rdwr(self, *i2c_msgs):
        """Carries out messages as one transfer."""
        messages = [(m.addr, m.flags, m.len if m.flags & _READ_FLAG else bytes(m)) for m in i2c_msgs]
        completed, read = self._open_link().transfer(self._bus, _RDWR, messages)
        for message in i2c_msgs[:completed]:
            if message.flags & _READ_FLAG:
                ctypes.memmove(message.buf, read[: message.len], message.len)
                read = read[message.len :]

    def _open_link(self):
        if self._link is None:
            # The message of ioctl() for smbus2's missing descriptor.
            raise TypeError("argument must be an int, or have a fileno() method.")
        return self._link

    def _smbus(self, address, read_write, command, size, block, force):
        force = self.force if force is None else force
        flags = (_FORCE_FLAG if force is True else 0) | (_PEC_FLAG if self._pec else 0)
        link = self._open_link()
        if not 0 <= address <= 0xFFFF:
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        call = (self._bus, address, flags, read_write, command & 0xFF, size, block)
        return link.answer(_SMBUS, _SMBUS_CALL.pack(*call))[1]


class I2C:
    """CircuitPython's busio.I2C on an emulated bus, as in Blinka on a Raspberry Pi.

    Pins and frequency are taken and mean nothing: there are no wires.
    """

    def __init__(self, scl=None, sda=None, *, frequency=100000, timeout=255, bus=1, socket=None):
        self._bus = _bus_number(bus)
        self._link = _Link(socket, self._bus)
        self._lock = threading.Lock()

    def __enter__(self):
        return self

    def __exit__(self, exc_type, exc_val, exc_tb):
        self.deinit()

    def deinit(self):
        """Ends the connection."""
        self._link.close()

    def try_lock(self):
        """Takes the bus; False if it is taken."""
        return self._lock.acquire(False)

    def unlock(self):
        """Releases the bus."""
        if not self._lock.locked():
            raise ValueError("Not locked")
        self._lock.release()

    def scan(self):
        """The addresses from 0x08 to 0x77 that acknowledge their address."""
        return [address for address in range(0x08, 0x78) if self._answers(address)]

    def writeto(self, address, buffer, *, start=0, end=None, stop=True):
        """Writes `buffer[start:end]`."""
        self._message(address, 0, _bytes_of(buffer)[start:end])

    def readfrom_into(self, address, buffer, *, start=0, end=None, stop=True):
        """Fills `buffer[start:end]`."""
        view = memoryview(buffer)[start:end]
        view[:] = self._message(address, _READ_FLAG, len(view))

    def writeto_then_readfrom(
        self,
        address,
        out_buffer,
        in_buffer,
        *,
        out_start=0,
        out_end=None,
        in_start=0,
        in_end=None,
        stop=False
    ):
        """Writes, and reads after a repeated start."""
        view = memoryview(in_buffer)[in_start:in_end]
        sent = _bytes_of(out_buffer)[out_start:out_end]
        messages = [(address, 0, sent), (address, _READ_FLAG, len(view))]
        _, read = self._link.transfer(self._bus, _RDWR, messages)
        # An adapter that hides a fault leaves zeros, as in Blinka's buffer.
        view[:] = read.ljust(len(view), b"\0")

    def _message(self, address, flags, payload):
        completed, read = self._link.transfer(self._bus, _FILE, [(address, flags, payload)])
        if completed != 1:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return read

    def _answers(self, address):
        try:
            self._message(address, 0, b"")
        except OSError as error:
            if error.errno == errno.ENOTCONN:
                raise
            return False
        return True


class SPI:
    """busio.SPI by name only: CircuitPython's libraries use it in annotations. There is no SPI here."""

    def __init__(self, *pins, **named_pins):
        raise NotImplementedError("there is no SPI here, only I2C")


# The contents of `import board`, for programs that name their pins.
SCL = SDA = None
STEMMA_I2C = I2C


def install(socket=None, circuitpython=False):
    """Makes `import smbus2` and `import smbus` find this module, and sets the socket for SMBus(1) and I2C().

    With `circuitpython` also `import busio` and `import board`. It must come before those imports.
    """
    global _installed_socket
    if socket is not None:
        _installed_socket = socket if callable(socket) else os.fspath(socket)
    names = ["smbus2", "smbus"] + (["busio", "board"] if circuitpython else [])
    for name in names:
        sys.modules[name] = sys.modules[__name__]


def pass_time(seconds, socket=None):
    """Lets this much time pass; returns the time since power-on in seconds, and the level of each sensor's INT pin.

    With `--speed 0` the emulator's time moves by this much at once; otherwise it is waited for. Pins are in the order of
    `--sensor`; False is low, an interrupt.
    """
    return _pass(seconds, _NO_PIN, False, socket)


def wait_for_interrupt(seconds, sensor=0, level=False, socket=None):
    """Lets time pass until a sensor's INT pin has this level; returns whether it has, after at most `seconds`.

    `sensor` counts from 0 in the order of `--sensor`; False is low, an interrupt.
    """
    return _pass(seconds, sensor, level, socket)[1][sensor] == level


def _pass(seconds, pin, level, socket):
    link = _Link(socket)
    try:
        while True:
            part = min(seconds, _PASS_MAX_SECONDS)
            body = link.answer(_PASS, _PASS_CALL.pack(round(part * 1e9), pin, level))
            pins = [high != 0 for high in body[10:]]
            if pin != _NO_PIN and pin >= len(pins):
                raise ValueError("no sensor %d; the server has %d" % (pin, len(pins)))
            seconds -= part
            if seconds <= 0 or (pin != _NO_PIN and pins[pin] == level):
                return int.from_bytes(body[:8], "little") / 1e9, pins
    finally:
        link.close()


class _Link:
    """A connection with alternating requests and answers; threads take turns."""

    def __init__(self, path, bus=None):
        self._path = path or _installed_socket or os.environ.get("GRIDEYE_I2C_SOCKET")
        if not self._path:
            raise ValueError(
                "no socket: set it with socket=PATH, grideye_i2c.install(PATH) or GRIDEYE_I2C_SOCKET"
            )
        self._turn = threading.Lock()
        self._connect()
        if bus is not None and bus not in self.buses:
            there = ", ".join(map(str, self.buses))
            self.close()
            raise OSError(errno.ENOENT, "no bus %d; the server has %s" % (bus, there), self._path)

    def fileno(self):
        return self._stream.fileno()

    def close(self):
        if self._stream is not None:
            self._stream.close()
        self._stream = None

    def transfer(self, bus, judge, messages):
        """Messages are (address, flags, bytes to write or number to read); returns messages completed and bytes read."""
        parts = [_TRANSFER_HEAD.pack(bus, judge, min(len(messages), 0xFFFF))]
        for address, flags, payload in messages:
            length = payload if flags & _READ_FLAG else len(payload)
            if not (0 <= address <= 0xFFFF and 0 <= length <= 0xFFFF):
                raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
            parts.append(_MESSAGE_HEAD.pack(address, flags, length))
            if not flags & _READ_FLAG:
                parts.append(payload)
        return self.answer(_TRANSFER, b"".join(parts))

    def answer(self, kind, body):
        """Asks; returns messages completed and bytes read, or what PASSED has."""
        if 1 + len(body) > _PACKET_BYTES_MAX:
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        with self._turn:
            # A connection inherited through fork() belongs to the parent.
            if self._stream is not None and self._process != os.getpid():
                self._connect()
            kind, answer = self._ask(kind, body)
        if kind == _DONE:
            return _U16.unpack_from(answer)[0], answer[2:]
        if kind == _PASSED:
            return answer
        if kind == _FAULT:
            number = _U16.unpack_from(answer, 1)[0] or errno.EIO
            raise OSError(number, os.strerror(number))
        if kind == _REFUSED:
            number = _U16.unpack_from(answer)[0]
            raise OSError(number, os.strerror(number))
        raise self._ended("it sent a packet of kind %d" % kind)

    def _connect(self):
        self._process = os.getpid()
        is_here = callable(self._path)
        self._stream = _Here(self._path) if is_here else sockets.socket(sockets.AF_UNIX, sockets.SOCK_STREAM)
        self._stream.settimeout(TIMEOUT_SECONDS)
        self._arrived = b""
        try:
            self._stream.connect(self._path)
        except OSError as error:
            self.close()
            hint = "is the server running? grideye emulate --scene SCENE --socket %s" % self._path
            raise OSError(error.errno or errno.EIO, "%s; %s" % (error.strerror, hint), self._path) from None
        kind, answer = self._ask(_HELLO, _MAGIC + _U16.pack(_VERSION))
        if kind != _WELCOME or answer[:4] != _MAGIC:
            raise self._ended("it does not speak the protocol of i2c-emulation")
        self.functionality, name_length = struct.unpack_from("<IB", answer, 6)
        self.mode = answer[11 : 11 + name_length].decode()
        count = _U16.unpack_from(answer, 11 + name_length)[0]
        self.buses = struct.unpack_from("<%dI" % count, answer, 13 + name_length)

    def _ask(self, kind, body):
        if self._stream is None:
            raise OSError(errno.ENOTCONN, "the connection to the server has ended", self._path)
        try:
            try:
                self._stream.sendall(_HEAD.pack(1 + len(body), kind) + body)
            except (BrokenPipeError, ConnectionResetError):
                pass  # The server may have sent a reason.
            length, kind = _HEAD.unpack(self._take(5))
            if not 0 < length <= _PACKET_BYTES_MAX:
                raise self._ended("it announced a packet of %d bytes" % length)
            answer = self._take(length - 1)
        except sockets.timeout:
            # A late answer would be taken for the next request's.
            self.close()
            raise OSError(errno.ETIMEDOUT, "no answer within %g s" % TIMEOUT_SECONDS, self._path) from None
        except ConnectionResetError:
            raise self._ended("the connection was reset") from None
        if kind == _BYE:
            raise self._ended(answer[1:].decode(errors="replace"))
        return kind, answer

    def _take(self, length):
        arrived = self._arrived
        while len(arrived) < length:
            more = self._stream.recv(max(4096, length - len(arrived)))
            if not more:
                raise self._ended("it closed the connection")
            arrived += more
        self._arrived = arrived[length:]
        return arrived[:length]

    def _ended(self, why):
        self.close()
        return OSError(errno.ENOTCONN, "the server went away: %s" % why, self._path)


class _Here:
    """Buses in this process in place of a server: a function that takes a packet and returns its answer."""

    def __init__(self, exchange):
        self._exchange = exchange
        self._answer = b""

    def fileno(self):
        return -1

    def settimeout(self, seconds):
        pass

    def connect(self, path):
        pass

    def close(self):
        pass

    def sendall(self, packet):
        self._answer = self._exchange(packet[4:])

    def recv(self, size):
        answer, self._answer = self._answer, b""
        return answer


def _bus_number(bus):
    if isinstance(bus, int):
        return bus
    if not isinstance(bus, str):
        raise TypeError("Unexpected type(bus)={}".format(type(bus)))
    number = re.search(r"(\d+)$", bus)
    if number is None:
        raise FileNotFoundError(errno.ENOENT, "no number at the end; a bus is named as /dev/i2c-1", bus)
    return int(number.group(1))


def _bytes_of(buffer):
    return bytes(map(ord, buffer)) if isinstance(buffer, str) else bytes(buffer)


def _with_length(data):
    if len(data) > _BLOCK_MAX:
        raise ValueError("Data length cannot exceed %d bytes" % _BLOCK_MAX)
    return bytes([len(data)]) + bytes(value & 0xFF for value in data)


def _block(data, length=None):
    length = data[0] if length is None else length
    return list(data[1 : length + 1])


def _main(arguments):
    if len(arguments) < 2 or arguments[0].startswith("-"):
        sys.exit("usage: python3 grideye_i2c.py SOCKET PROGRAM.py [ARGUMENTS]")
    sys.modules["grideye_i2c"] = sys.modules[__name__]
    install(arguments[0], circuitpython=True)
    sys.argv = arguments[1:]
    sys.path[0] = os.path.dirname(os.path.abspath(sys.argv[0]))
    runpy.run_path(sys.argv[0], run_name="__main__")


if __name__ == "__main__":
    _main(sys.argv[1:])
