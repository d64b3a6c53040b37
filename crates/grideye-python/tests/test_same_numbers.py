"""The package's numbers are the program's, bit for bit."""

import json
import re
import subprocess
import time

import numpy as np
import pytest
from conftest import PROGRAM, SCENES, grideye

import grideye_hil as ge
from grideye_hil import _i2c


@pytest.mark.parametrize(
    "name, sensor",
    [("experiment-1", None), ("experiment-3", None), ("scenario-a-3x2", "s1"), ("clothed-walk", None)],
)
def test_simulated_frames(tmp_path, name, sensor):
    scene = ge.Scene.load(SCENES / f"{name}.toml")
    sensor = sensor and scene.sensors[0]
    named = ["--sensor", sensor] if sensor else []
    out = tmp_path / "frames.npz"
    grideye("simulate", SCENES / f"{name}.toml", "--seed", 5, "--out", out, *named)
    theirs = np.load(out)["frames"]
    ours = scene.simulate(seed=5, sensor=sensor)
    assert ours.dtype == np.float32
    np.testing.assert_array_equal(ours, theirs)
    assert (scene.simulate(3, seed=6, sensor=sensor) != theirs[:3]).any()


def test_a_recording_is_what_convert_makes_of_it(tmp_path, walk):
    out = tmp_path / "walk.npz"
    grideye("convert", walk, out)
    theirs, ours = np.load(out), ge.Recording.read(walk)
    assert ours.celsius.dtype == np.float32 and ours.raw.dtype == np.uint16
    assert ours.time.dtype == "datetime64[ns]" and ours.boot_time.dtype == "timedelta64[ns]"
    np.testing.assert_array_equal(ours.celsius, theirs["frames"])
    np.testing.assert_array_equal(ours.thermistor, theirs["thermistor_c"])
    np.testing.assert_array_equal(ours.time.astype(np.int64), theirs["t_utc_ns"])
    np.testing.assert_array_equal(ours.boot_time.astype(np.uint64), theirs["t_boot_ns"])
    # A quarter of a degree a step, 12 bits in two's complement (AMG88 spec §4-11-11).
    signed = ours.raw.astype(np.int32)
    np.testing.assert_array_equal(np.where(signed >= 2048, signed - 4096, signed) / 4, ours.celsius)


@pytest.mark.parametrize(
    "name, more, asked, code",
    [
        ("experiment-3", [], {}, 0),
        ("experiment-1", ["--seed", 4, "--align", "shift,orientation"], {"seed": 4, "align": "shift,orientation"}, 1),
        (
            "experiment-3",
            ["--max-shift", 0.2, "--max-rate", 1],
            {"max_shift": 0.2, "max_rate": 1},
            0,
        ),
        ("experiment-3", ["--profile", SCENES / "profiles/linaige.toml"], {"profile": SCENES / "profiles/linaige.toml"}, None),
    ],
)
def test_verdict_and_report(tmp_path, walk, name, more, asked, code):
    scene = SCENES / f"{name}.toml"
    page, cases = tmp_path / "theirs.html", tmp_path / "theirs.xml"
    command = [PROGRAM, "compare", "--scene", scene, "--recording", walk, "--json", "-", "--report", page, "--junit", cases, *map(str, more)]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert code is None or ended.returncode == code, ended
    theirs, result = json.loads(ended.stdout), ge.compare(ge.Scene.load(scene), ge.Recording.read(walk), **asked)
    ours = result.to_dict()
    # How to repeat it differs, and nothing else.
    assert ours["context"].pop("command").startswith("grideye_hil.compare(")
    assert theirs["context"].pop("command").startswith("grideye compare")
    assert ours == theirs
    assert result.verdict == {0: "agrees", 1: "disagrees", 3: "cannot tell"}[ended.returncode]
    assert result.reasons == theirs["reasons"]
    assert result.scores.loc["correlation", "value"] == theirs["scores"]["correlation"]["value"]
    assert result.scores.loc["correlation", "shuffled"] == theirs["scores"]["correlation"]["shuffled"]["mean"]
    result.report(tmp_path / "ours.html")
    result.junit(tmp_path / "ours.xml")
    for file in (page, cases):
        texts = [file.read_text(), (tmp_path / f"ours{file.suffix}").read_text()]
        assert len({re.sub(r"(grideye compare|grideye_hil\.compare).*", "COMMAND", text) for text in texts}) == 1
    assert result.headline.split(":")[0] in result._repr_html_()


def served(tmp_path, *arguments, frames=1):
    """The bytes that a client of `grideye emulate` reads, a tick apart: time stands but for what the client moves."""
    socket = tmp_path / "bus.sock"
    command = [PROGRAM, "emulate", *map(str, arguments), "--socket", socket, "--speed", "0", "--quiet"]
    server = subprocess.Popen(command)
    try:
        while not socket.exists():
            assert server.poll() is None
            time.sleep(0.01)
        with _i2c.SMBus(1, socket=str(socket)) as bus:
            return bursts(bus, frames, lambda: _i2c.pass_time(0.1, socket=str(socket)))
    finally:
        server.terminate()
        server.wait()


def bursts(bus, frames, tick):
    read = []
    for _ in range(frames):
        read.append(burst(bus))
        tick()
    return read


def burst(bus):
    messages = [_i2c.i2c_msg.write(0x69, [0x0E]), _i2c.i2c_msg.read(0x69, 2)]
    bus.i2c_rdwr(*messages)
    pixels = [_i2c.i2c_msg.write(0x69, [0x80]), _i2c.i2c_msg.read(0x69, 128)]
    bus.i2c_rdwr(*pixels)
    return bytes(messages[1]) + bytes(pixels[1])


@pytest.mark.parametrize(
    "arguments, source, asked",
    [
        (["--scene", SCENES / "experiment-1.toml", "--seed", 3], "experiment-1", {"seed": 3}),
        (["--constant", 31.25, "--profile", "linaige"], 31.25, {"profile": "linaige"}),
    ],
)
def test_the_first_frame_of_an_emulated_sensor(tmp_path, arguments, source, asked):
    source = ge.Scene.load(SCENES / f"{source}.toml") if isinstance(source, str) else source
    with ge.emulate(source, **asked) as bus:
        assert burst(bus) == served(tmp_path, *arguments)[0]


def test_the_frames_of_a_replay(tmp_path, walk):
    theirs = served(tmp_path, "--recording", walk, "--replay", "frames", frames=20)
    with ge.emulate(ge.Recording.read(walk), replay="frames") as bus:
        ours = bursts(bus, 20, lambda: bus.advance(0.1))
    assert len(set(theirs)) > 15
    assert ours == theirs
