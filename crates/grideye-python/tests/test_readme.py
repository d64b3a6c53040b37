"""The README's programs do what it says."""

import shutil

import pytest
from conftest import ROOT, SCENES

README = ROOT / "crates/grideye-python/README.md"


def programs():
    return [block.split("```")[0] for block in README.read_text().split("```python\n")[1:]]


def test_the_first_program(tmp_path, monkeypatch, walk):
    shutil.copy(SCENES / "experiment-1.toml", tmp_path / "room.toml")
    shutil.copy(walk, tmp_path / "evening.csv")
    monkeypatch.chdir(tmp_path)
    seen = {}
    exec(programs()[0], seen)
    assert seen["frames"].shape == (100, 8, 8)
    assert seen["result"].verdict == "disagrees"
    assert seen["bus"].now == pytest.approx(5.25)


def test_the_fixture(pytester):
    shutil.copy(SCENES / "experiment-1.toml", pytester.path / "room.toml")
    pytester.makepyfile(
        my_driver="""
        class Presence:
            def __init__(self, bus):
                self.bus = bus

            def is_present(self):
                return max(self.bus.read_word_data(0x69, 0x80 + 2 * pixel) for pixel in range(64)) > 24 * 4
        """
    )
    pytester.makepyfile(programs()[1])
    pytester.runpytest_subprocess().assert_outcomes(passed=1)
