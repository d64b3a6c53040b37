"""Errors with their place, missing frames, and what other packages get."""

import os
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT, SCENES

import grideye_hil as ge


def test_a_scene_with_a_mistake_says_where_and_what_to_do(tmp_path):
    path = tmp_path / "room.toml"
    path.write_text("[room]\nsize_mm = [4000, 6000, 2700]\nambient_c = 'warm'\n")
    with pytest.raises(ge.InputError) as error:
        ge.Scene.load(path)
    assert (error.value.file, error.value.line) == (str(path), 3)
    assert error.value.hint and str(error.value).endswith(error.value.hint)
    with pytest.raises(ge.InputError) as error:
        ge.Scene.load(tmp_path / "none.toml")
    assert (error.value.file, error.value.line) == (str(tmp_path / "none.toml"), None)


@pytest.mark.parametrize("frames", [2**22 + 1, 2**31, 2**32 - 1])
def test_more_frames_than_memory_holds_are_refused_and_the_interpreter_goes_on(frames):
    code = f"""
import resource
import grideye_hil as ge
resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))
scene = ge.Scene.load({str(SCENES / "experiment-3.toml")!r})
try:
    scene.simulate({frames})
except ge.InputError as error:
    print(error)
print(scene.simulate(3).shape)
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    told, hint, shape = ended.stdout.splitlines()
    assert told == f"{frames} frames of 8 x 8 pixels have {256 * frames} bytes, expected at most 1073741824", ended
    assert hint.startswith("hint: ") and shape == "(3, 8, 8)"


def test_a_pipe_is_no_recording(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(ge.InputError, match="it is a pipe"):
        ge.Recording.read(tmp_path / "pipe.csv")


def test_a_row_that_is_cut_says_where(tmp_path, walk):
    lines = walk.read_text().splitlines()
    path = tmp_path / "cut.csv"
    path.write_text("\n".join([*lines[:4], lines[4][:-30]]) + "\n")
    with pytest.raises(ge.InputError) as error:
        ge.Recording.read(path)
    assert (error.value.file, error.value.line) == (str(path), 5)


def test_a_missing_frame_is_not_a_number_with_its_reason(tmp_path, walk):
    header, first, second, *_ = walk.read_text().splitlines()
    fields = second.split(",")
    names = header.split(",")
    missing = [
        "nack" if name == "missing" else "" if name.startswith(("pixel", "thermistor")) else field
        for name, field in zip(names, fields)
    ]
    path = tmp_path / "gap.csv"
    path.write_text("\n".join([header, first, ",".join(missing)]) + "\n")
    rec = ge.Recording.read(path)
    assert rec.missing.tolist() == [False, True] and rec.missing_reasons == ["", "nack"]
    assert np.isnan(rec.celsius[1]).all() and np.isnan(rec.thermistor[1]) and not rec.raw[1].any()
    frame = rec.to_pandas()
    assert frame["pixel64"].iloc[0] == rec.celsius[0, 7, 7] and np.isnan(frame["pixel1"].iloc[1])
    assert frame["missing"].tolist() == ["", "nack"]
    data = rec.to_xarray()
    assert data.celsius.dims == ("time", "row", "column") and data.celsius.attrs == {"units": "degC"}
    np.testing.assert_array_equal(data.celsius.values, rec.celsius)
    assert (data.time.values == rec.time).all()


def test_several_sensors_are_one_at_a_time(tmp_path, walk):
    header, *rows = walk.read_text().splitlines()
    sensor = rows[0].split(",")[1]
    other = [row.replace(f",{sensor},", ",other,", 1) for row in rows]
    path = tmp_path / "two.csv"
    path.write_text("\n".join([header, *rows, *other]) + "\n")
    with pytest.raises(ge.InputError, match="2 streams"):
        ge.Recording.read(path)
    rec = ge.Recording.read(path, sensor="other")
    assert len(rec) == len(rows) and rec.sensor == "other"


def test_a_workbook_is_a_recording():
    books = ROOT / "crates/grideye-import/tests/workbooks"
    recording = ge.Recording.read(books / "evening.xlsx")
    assert recording.celsius.shape == (6, 8, 8) and recording.account.startswith("read as the sheet Evening of a workbook")
    # As its script wrote it: the pixels of frame 5, and the count of people beside it.
    assert recording.celsius[5].ravel().tolist() == [20 + (13 * pixel + 29 * 5 + 7 * 25) % 41 / 4 for pixel in range(64)]
    assert np.isnan(recording.labels["people"][0]) and recording.labels["people"][1:].tolist() == [1, 2, 3, 4, 5]
    assert abs(recording.time[0] - np.datetime64("2021-07-01T18:14:07.274925")) <= np.timedelta64(1, "us")
    with pytest.raises(ge.InputError, match="2 sheets"):
        ge.Recording.read(books / "two.xlsx")
    assert len(ge.Recording.read(books / "two.xlsx", columns="sheet=2").celsius) == 4


def test_pandas_and_xarray_are_imported_only_when_they_are_asked_for():
    code = "import sys, grideye_hil; print([name for name in ('pandas', 'xarray', 'pytest') if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "[]\n"


@pytest.mark.parametrize(
    "asked, told",
    [
        ({"max_shift": 61}, "max_shift is 61, expected 0 to 60 seconds"),
        ({"max_rate": float("nan")}, "max_rate is NaN, expected 0 to 20 %"),
    ],
)
def test_what_a_comparison_cannot_take_is_named(walk, asked, told):
    with pytest.raises(ge.InputError) as error:
        ge.compare(ge.Scene.load(SCENES / "experiment-3.toml"), ge.Recording.read(walk), **asked)
    assert str(error.value).startswith(told)
