"""The README's programs do what it says."""

import shutil

import numpy as np
import pytest
from conftest import ROOT, SCENES

import grideye_hil as ge

README = ROOT / "crates/grideye-python/README.md"


def programs():
    return [block.split("```")[0] for block in README.read_text().split("```python\n")[1:]]


def test_from_frames_to_a_verdict(tmp_path, monkeypatch, walk):
    shutil.copy(SCENES / "experiment-1.toml", tmp_path / "room.toml")
    monkeypatch.chdir(tmp_path)
    own = np.round(ge.Scene.load("room.toml").simulate(100, seed=3) * 4) / 4
    exec(programs()[0], {"celsius": own})
    with pytest.raises(AssertionError):
        exec(programs()[0], {"celsius": ge.Recording.read(walk).celsius})


def test_from_a_scene_to_frames_and_a_sensor(tmp_path, monkeypatch, walk):
    shutil.copy(walk, tmp_path / "evening.csv")
    monkeypatch.chdir(tmp_path)
    seen = {}
    exec(programs()[1], seen)
    assert seen["frames"].shape == (100, 8, 8) and seen["labels"]["people"].tolist() == [1] * 100
    assert len(ge.Recording.read("evening.parquet")) == 51
    assert seen["result"].verdict == "disagrees"
    assert seen["x"].shape == (256, 8, 8) and seen["y"].max() >= 2
    assert seen["bus"].now == pytest.approx(5.25 + 318 / 100_000)


@pytest.mark.parametrize(("sign", "outcomes"), [("- (word >> 11 << 12)", {"passed": 2}), ("", {"passed": 1, "failed": 1})])
def test_the_fixture(pytester, sign, outcomes):
    shutil.copy(SCENES / "experiment-1.toml", pytester.path / "room.toml")
    pytester.makepyfile(
        my_driver=f"""
        class Camera:
            def __init__(self, bus):
                self.bus = bus

            def pixels(self):
                words = [self.bus.read_word_data(0x69, 0x80 + 2 * pixel) for pixel in range(64)]
                return [(word {sign}) / 4 for word in words]

        class Presence(Camera):
            def is_present(self):
                return max(self.pixels()) > 24
        """
    )
    pytester.makepyfile(programs()[2])
    pytester.runpytest_subprocess().assert_outcomes(**outcomes)


CAMERA = """
class Camera:
    def __init__(self, bus):
        self.bus = bus

    def pixels(self):
        return [word for at in range(0, 128, {part}) for word in self.words(at, {part})]

    def words(self, at, part):
        message = smbus2.i2c_msg.read(0x69, part)
        self.bus.i2c_rdwr(smbus2.i2c_msg.write(0x69, [0x80 + at]), message)
        data = bytes(message)
        return [data[n : n + 2] for n in range(0, part, 2)]
"""


@pytest.mark.parametrize(
    ("part", "options", "outcome"),
    [(32, "", "failed"), (128, "", "passed"), (32, ", scl_hz=None", "passed"), (32, ", scl_hz=0", "errors")],
)
def test_the_fixture_shows_who_mixes_two_frames(pytester, part, options, outcome):
    pytester.makepyfile(my_driver="import smbus2\n" + CAMERA.format(part=part))
    pytester.makepyfile(programs()[3].replace('"steps.csv")\ndef', f'"steps.csv"{options})\ndef'))
    pytester.runpytest_subprocess().assert_outcomes(**{outcome: 1})
