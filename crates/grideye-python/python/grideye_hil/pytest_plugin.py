"""A pytest plugin: the fixture `amg8833`, an emulated sensor for a driver's tests.

    import pytest

    @pytest.mark.amg8833(scene="room.toml")
    def test_someone_is_seen(amg8833):
        sensor = MyDriver(smbus2.SMBus(1))        # unmodified: reaches the emulated sensor
        amg8833.advance(5)                        # seconds; nobody waits
        assert sensor.warmest() > 25

Arguments of the marker: `scene` or `recording` (a path, or an object of this package) or `constant` (degrees Celsius);
by default 22 degrees. Besides those, what `grideye_hil.emulate` takes, and `sleep=False` if `time.sleep` shall really
wait: by default it moves the emulated clock and returns at once. Transfers take the time of a bus at 100 kHz, so a driver
that reads a frame in parts tears now and then, as on a board; `scl_hz=None` lets them take none.
"""

from __future__ import annotations

import inspect
import sys
import time
from collections.abc import Iterator
from typing import Any, Union

import pytest

from . import _i2c
from ._bus import Bus, emulate
from ._recording import Recording
from ._scene import Scene

_ROOM_C = 22.0
_SOURCES = ("scene", "recording", "constant")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addini(
        "amg8833_circuitpython",
        "make `import board` and `import busio` the emulated ones, from the start",
        type="bool",
        default=False,
    )


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers",
        "amg8833(scene=, recording=, constant=, faults=, sleep=, ...): what the fixture amg8833 shows, and how",
    )
    if config.getini("amg8833_circuitpython"):
        sys.modules["board"] = sys.modules["busio"] = _i2c


def _source(given: dict[str, Any]) -> Union[Scene, Recording, float]:
    named = [name for name in _SOURCES if name in given]
    if len(named) > 1:
        raise pytest.UsageError(f"amg8833: one of {', '.join(_SOURCES)}, not {' and '.join(named)}")
    if not named:
        return _ROOM_C
    source: Any = given.pop(named[0])
    if isinstance(source, (Scene, Recording)):
        return source
    if named[0] == "scene":
        return Scene.load(source)
    if named[0] == "recording":
        return Recording.read(source)
    constant: float = source
    return constant


def _replace_smbus2(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also for whoever has imported the class already: its methods become the emulated bus's."""
    monkeypatch.setitem(sys.modules, "smbus", _i2c)
    try:
        import smbus2
    except ImportError:
        monkeypatch.setitem(sys.modules, "smbus2", _i2c)
        return
    for name, member in vars(_i2c.SMBus).items():
        if inspect.isfunction(member) or isinstance(member, property):
            monkeypatch.setattr(smbus2.SMBus, name, member, raising=False)


def _replace_sleep(monkeypatch: pytest.MonkeyPatch, bus: Bus) -> None:
    """Also for whoever has imported the function; pytest itself goes on to wait."""
    real = time.sleep
    for name, module in list(sys.modules.items()):
        if name.split(".")[0] in ("_pytest", "pytest"):
            continue
        for attribute, value in list(getattr(module, "__dict__", {}).items()):
            if value is real:
                monkeypatch.setattr(module, attribute, bus.advance)


@pytest.fixture
def amg8833(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bus]:
    """An emulated AMG8833 at 0x69 on bus 1, with smbus2's and busio's methods; `advance` moves its clock."""
    given: dict[str, Any] = {}
    for marker in reversed(list(request.node.iter_markers("amg8833"))):
        given.update(marker.kwargs)
    moves_clock = given.pop("sleep", True)
    with emulate(_source(given), **given) as bus:
        monkeypatch.setattr(_i2c, "_installed_socket", bus._machine.exchange)
        _replace_smbus2(monkeypatch)
        if moves_clock:
            _replace_sleep(monkeypatch, bus)
        yield bus
