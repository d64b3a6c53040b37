"""Arrays become recordings and come back, and files of a recording are those of the program."""

import os
import sys

import numpy as np
import pytest
from conftest import SCENES, grideye

import grideye_hil as ge


@pytest.fixture(scope="module")
def rec(walk):
    return ge.Recording.read(walk)


def test_from_array_to_verdict_in_four_lines():
    scene = ge.Scene.load(SCENES / "experiment-3.toml")
    frames = scene.simulate(seed=7)
    rec = ge.Recording.from_array(np.round(frames * 4) / 4, rate_hz=10)
    assert ge.compare(scene, rec).agrees


@pytest.mark.parametrize("shape", [(-1, 8, 8), (-1, 64)])
def test_what_is_put_in_comes_out(rec, shape):
    again = ge.Recording.from_array(
        rec.celsius.reshape(shape), time=rec.time, thermistor=rec.thermistor, labels={"people": np.arange(len(rec)), "who": ["anna"] * len(rec)}
    )
    for name in ("celsius", "raw", "thermistor", "time", "missing"):
        np.testing.assert_array_equal(getattr(again, name), getattr(rec, name))
    assert again.labels["people"].dtype == np.int64 and again.labels["people"].tolist() == list(range(len(rec)))
    assert set(again.labels["who"]) == {"anna"}


def test_pandas_and_xarray_and_back(rec):
    pixels = rec.celsius.copy()
    pixels[3] = np.nan
    with_gap = ge.Recording.from_array(pixels, time=rec.time, missing=["nack" if at == 3 else "" for at in range(len(rec))], labels={"n": range(len(rec))})
    table = ge.Recording.from_pandas(with_gap.to_pandas())
    data = ge.Recording.from_xarray(with_gap.to_xarray())
    for again in (table, data):
        np.testing.assert_array_equal(again.celsius, pixels)
        np.testing.assert_array_equal(again.time, rec.time)
        assert again.missing_reasons[3] == "nack" and again.missing.sum() == 1
    assert table.labels["n"].tolist() == list(range(len(rec)))


@pytest.mark.parametrize(
    "asked, told",
    [
        ({"celsius": np.zeros((3, 8, 7))}, "celsius has the shape (3, 8, 7)"),
        ({"celsius": np.zeros((0, 8, 8))}, "celsius has the shape (0, 8, 8)"),
        ({"celsius": "warm"}, "celsius: "),
        ({"celsius": np.full((2, 8, 8), 2000.0)}, "frame 0: "),
        ({"time": [1.0, 0.5]}, "time goes back at frame 1"),
        ({"time": [1.0]}, "time has the shape (1,) for 2 frames"),
        ({"rate_hz": 0}, "rate_hz is 0"),
        ({"labels": {"people": [1, 2, 3]}}, "people has 3 values for 2 frames"),
        ({"sensor": "a b"}, ""),
    ],
)
def test_what_is_no_recording_is_named(asked, told):
    with pytest.raises(ge.InputError) as error:
        ge.Recording.from_array(**{"celsius": np.zeros((2, 8, 8)), **asked})
    assert str(error.value).startswith(told) and (error.value.hint or "sensor" in asked or told == "frame 0: ")


def test_between_steps_is_rounded_with_a_warning():
    with pytest.warns(UserWarning, match="2 pixels lie between"):
        rec = ge.Recording.from_array([[20.1, 20.2, *[20.25] * 62]])
    assert rec.celsius.ravel()[:3].tolist() == [20.0, 20.25, 20.25]


def test_slices_by_number_and_by_time(rec):
    part = rec[10:30:2]
    np.testing.assert_array_equal(part.celsius, rec.celsius[10:30:2])
    np.testing.assert_array_equal(part.boot_time, rec.boot_time[10:30:2])
    np.testing.assert_array_equal(rec[-5:].celsius, rec.celsius[-5:])
    start = rec.boot_time[0]
    three_s = rec[np.timedelta64(1, "s") : np.timedelta64(4, "s")]
    assert three_s.boot_time[0] - start == np.timedelta64(1, "s") and len(three_s) == 30
    noon = np.datetime64("2026-11-30T12:00:00", "ns")
    dated = ge.Recording.from_array(rec.celsius, time=noon + np.arange(len(rec)) * np.timedelta64(100, "ms"))
    assert len(dated["2026-11-30T12:00:01":"2026-11-30T12:00:03"]) == 20
    assert "[10:30:2]" in repr(part)
    with pytest.raises(ge.InputError):
        rec[::-1]
    with pytest.raises(TypeError, match=r"rec\.celsius\[10\]"):
        rec[10]


def test_a_slice_is_compared_as_its_file_would_be(tmp_path, rec):
    scene = ge.Scene.load(SCENES / "experiment-3.toml")
    rec[20:80].to_csv(tmp_path / "part.csv")
    ours, theirs = (ge.compare(scene, one, start=2.0).to_dict() for one in (rec[20:80], ge.Recording.read(tmp_path / "part.csv")))
    for one in (ours, theirs):
        one.pop("context")
    assert ours == theirs


@pytest.mark.parametrize("end", ["csv", "npz", "parquet", "mcap"])
def test_files_are_those_of_convert(tmp_path, walk, rec, end):
    theirs, ours = tmp_path / f"theirs.{end}", tmp_path / f"ours.{end}"
    grideye("convert", walk, theirs)
    getattr(rec, f"to_{end}")(ours)
    assert ours.read_bytes() == theirs.read_bytes()
    assert sorted(os.listdir(tmp_path)) == sorted([theirs.name, ours.name])


def test_rerun_gets_every_frame_that_is_there(monkeypatch, rec):
    """Rerun's wheel is larger than all others together, so its three functions are stood in for."""
    logged = []

    class Rerun:
        Tensor = staticmethod(lambda frame, dim_names: frame)
        set_time = staticmethod(lambda timeline, **when: logged.append((timeline, when)))
        log = staticmethod(lambda entity, frame: logged.append((entity, frame)))

    monkeypatch.setitem(sys.modules, "rerun", Rerun)
    rec[:5].to_rerun()
    assert [name for name, _ in logged] == ["time", f"{rec.device}/{rec.sensor}"] * 5
    np.testing.assert_array_equal(logged[-1][1], rec.celsius[4])


def test_a_notebook_shows_scene_recording_and_frame(rec):
    import matplotlib

    matplotlib.use("Agg")
    svg = ge.Scene.load(SCENES / "experiment-3.toml")._repr_svg_()
    assert svg.startswith("<svg") and svg.rstrip().endswith("</svg>")
    assert 'src="data:image/png;base64,iVBOR' in rec._repr_html_()
    image = rec.plot(-1).images[0]
    np.testing.assert_array_equal(image.get_array(), rec.celsius[-1])
    result = ge.compare(ge.Scene.load(SCENES / "experiment-3.toml"), rec)
    shown = [axis.images[0].get_array() for axis in result.plot().axes if axis.images]
    film = result.to_dict()["film"]
    assert len(shown) == 3 * len(film)
    np.testing.assert_allclose(shown[len(film)].ravel(), film[0]["simulated_c"])
    np.testing.assert_allclose(shown[-1], shown[len(film) - 1] - shown[2 * len(film) - 1])
    matplotlib.pyplot.close("all")
