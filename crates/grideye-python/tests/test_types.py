"""The package is clean under mypy --strict, and so is a program that uses it."""

import os
import subprocess
import sys
from pathlib import Path

USE = """
import numpy as np
import numpy.typing as npt
import grideye_hil as ge

frames: npt.NDArray[np.float32] = ge.Scene.load("room.toml").simulate(frames=3)
rec = ge.Recording.read("evening.csv", sensor="ceiling")
verdict: ge.Verdict = ge.compare(ge.Scene.parse(""), rec, profile=None).verdict
pixels, labels = ge.Scene.room().simulate(3, labels=True)
both: tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]] = (frames, pixels)
part: ge.Recording = ge.Recording.from_array(frames, rate_hz=1)[2:]
people: list[int] = [int(y.sum()) for x, y in ge.frames("counting", frames=10)]
with ge.emulate(rec, at_end="loop") as bus:
    bus.advance(0.1)
    word: int = bus.read_word_data(0x69, 0x80)
"""


def mypy(*arguments):
    cache = os.environ.get("GRIDEYE_MYPY_CACHE", ".mypy_cache")
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", cache, *arguments]
    ended = subprocess.run(command, capture_output=True, text=True)
    return ended.stdout


def test_mypy_strict(tmp_path):
    program = tmp_path / "use.py"
    program.write_text(USE)
    for checked in (mypy("-p", "grideye_hil"), mypy(program)):
        assert checked.startswith("Success"), checked
    program.write_text(USE + "bus.advance('soon')\n")
    assert 'has incompatible type "str"' in mypy(program)


def test_help_shows_units_and_shapes():
    import pydoc

    import grideye_hil as ge

    text = pydoc.render_doc(ge.Scene.simulate) + pydoc.render_doc(ge.Recording)
    for words in ("(frames, 8, 8)", "degrees Celsius", "float32 (N, 8, 8)", "datetime64[ns] (N,)"):
        assert words in text


def test_every_public_name_has_a_docstring():
    import inspect

    import grideye_hil as ge

    for name in ge.__all__:
        thing = getattr(ge, name)
        assert inspect.getdoc(thing), name
        for member, value in vars(thing).items() if inspect.isclass(thing) else ():
            if not member.startswith("_"):
                assert inspect.getdoc(value), f"{name}.{member}"
    assert Path(ge.__file__).with_name("py.typed").exists()
