"""Emulated sensors in this process."""

from __future__ import annotations

import os
import threading
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Optional, Union

from . import _i2c, _native
from ._recording import Recording
from ._scene import Scene


class Bus(_i2c.SMBus, _i2c.I2C):
    """Emulated AMG8833 sensors on a bus of this process, with a clock of its own.

    Has the methods of smbus2's SMBus and of CircuitPython's busio.I2C. Failures raise OSError with the errno that Linux
    gives on a Raspberry Pi. Time stands still until `advance` moves it, or the bits of a transfer.
    """

    def __init__(self, machine: _native.Machine, bus: int, faults: str) -> None:
        self._machine = machine
        self._number = bus
        self._faults = faults
        self._lock = threading.Lock()
        _i2c.SMBus.__init__(self, bus, socket=machine.exchange)

    def __enter__(self) -> Bus:
        return self

    def advance(self, seconds: float) -> None:
        """Lets so many emulated seconds pass: sensors measure, people walk. Takes no real waiting."""
        self._machine.advance(seconds)

    @property
    def now(self) -> float:
        """Emulated seconds since the sensors were switched on. Advances with `advance` and with each transfer."""
        return self._machine.now_s()

    @property
    def faults(self) -> str:
        """The faults in force, a script (TOML) as `grideye emulate --faults` takes it; "" for none.

        Setting another starts it now. `counts` tells which of them struck.
        """
        return self._faults

    @faults.setter
    def faults(self, script: str) -> None:
        self._machine.inject(script)
        self._faults = script

    @property
    def counts(self) -> dict[str, int]:
        """Traffic so far: transactions, bytes and nacks."""
        return self._machine.counts()[0]

    @property
    def refused(self) -> dict[str, int]:
        """How many bytes the sensors ignored, by reason, such as "asleep" or "read-only"."""
        return self._machine.counts()[1]

    @property
    def faults_injected(self) -> dict[str, int]:
        """How often each kind of fault struck."""
        return self._machine.counts()[2]

    def connect(self) -> _i2c.SMBus:
        """Another SMBus on the same bus, as a program that opens /dev/i2c-N once more."""
        return _i2c.SMBus(self._number, socket=self._machine.exchange)


def emulate(
    source: Union[Scene, Recording, float],
    *,
    faults: Union[str, os.PathLike[str]] = "",
    sensors: Union[str, Sequence[str]] = (),
    bus: int = 1,
    profile: Union[str, os.PathLike[str], None] = None,
    seed: int = 1,
    at_end: str = "hold",
    replay: str = "times",
    adapter: str = "pi",
    scl_hz: Optional[int] = _native.SCL_HZ,
    clock_error_ppm: Optional[int] = None,
    power_on: bool = False,
) -> Bus:
    """Emulated AMG8833 sensors for this process, as `grideye emulate` for others.

    Args:
        source: what they see: a scene, a recording, or one temperature, -512 to 511.75 degrees Celsius.
        faults: a script of faults: a file's path (os.PathLike), or the TOML text.
        sensors: NAME or NAME=PLACE, one or several. PLACE is BUS:ADDR (1:0x69) or BUS:MUX.CHANNEL:ADDR (1:0x70.3:0x69). By
            default the only one, at 1:0x69.
        bus: the N of /dev/i2c-N that the result is.
        profile: a file, or "ideal", "datasheet" or "linaige": noise, pattern and clock of a real unit.
        seed: of noise and faults.
        at_end: of a walk or recording: "hold" the last frame, "loop", or "end", where the bus disappears (ENODEV).
        replay: a recording's frames at their "times", or one for each of the sensor's "frames".
        adapter: "pi", "pi5", "usb", "smbus-only", "busy", "gone" or "virtio".
        scl_hz: the bus clock, 1000 to 1000000 Hz; by default 100000, as boards have: a frame read takes 12.3 ms of emulated
            time (and none of the host's), and a driver that reads a frame in parts now and then mixes two. With None,
            transfers take no time, and no way of reading mixes frames.
        clock_error_ppm: error of the sensors' clocks, parts per million; -43000 is 4.3 % slow.
        power_on: whether the sensors are switched on this instant. By default they have been on for two frames.

    Raises:
        InputError: what cannot be shown, with file, line and hint.
    """
    script = faults if isinstance(faults, str) else Path(faults).read_text(encoding="utf-8")
    asked = {
        "sensors": [sensors] if isinstance(sensors, str) else list(sensors),
        "profile": profile,
        "clock_error_ppm": clock_error_ppm,
        "at_end": at_end,
        "replay": replay,
        "adapter": adapter,
        "scl_hz": scl_hz,
        "seed": seed,
        "power_on": power_on,
        "faults": script,
    }
    if isinstance(source, Scene):
        machine = _native.Machine.of_scene(source._native, asked)
    elif isinstance(source, Recording):
        machine = _native.Machine.of_recording(source._native, asked)
    else:
        machine = _native.Machine.of_constant(source, asked)
    return Bus(machine, bus, script)
