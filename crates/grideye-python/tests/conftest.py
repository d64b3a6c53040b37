"""What the tests share. They run on the installed package: the wheel, with the program `grideye` that came with it."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

ROOT = Path(__file__).resolve().parents[3]
SCENES = ROOT / "scenes"
PROGRAM = Path(sys.executable).parent / "grideye"


def grideye(*arguments, code=0):
    """The program's standard output."""
    ended = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)
    assert code is None or ended.returncode == code, ended
    return ended.stdout


@pytest.fixture(scope="session")
def walk(tmp_path_factory):
    """A recording of scenes/experiment-3.toml, by the program."""
    path = tmp_path_factory.mktemp("walk") / "walk.csv"
    grideye("simulate", SCENES / "experiment-3.toml", "--seed", 7, "--out", path)
    return path
