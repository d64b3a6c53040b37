"""Scenes without a file, labels, data sets and the other verbs: the numbers of the program."""

import itertools
import json
import tomllib

import numpy as np
import pytest
from conftest import ROOT, SCENES, grideye

import grideye_hil as ge


def test_a_scene_of_dictionaries_is_the_scene_of_its_file():
    for name in ("experiment-1", "people", "living-room"):
        path = SCENES / f"{name}.toml"
        ours = ge.Scene.from_dict(tomllib.loads(path.read_text()), folder=SCENES)
        np.testing.assert_array_equal(ours.simulate(20), ge.Scene.load(path).simulate(20))


def test_a_room_without_a_file():
    room = ge.Scene.room((4, 6, 2.7), ambient_c=20, people=[(2, 3)])
    frames, labels = room.simulate(5, labels=True)
    assert labels["people"].tolist() == [1] * 5 and room.sensors == ["ceiling"]
    assert frames[:, 3:5, 3:5].mean() > frames[:, 0, 0].mean() + 2
    np.testing.assert_allclose(labels["position_m"][0, 0, :2], (2, 3))
    with pytest.raises(ge.InputError, match="size_mm"):
        ge.Scene.room((4, -6, 2.7))


def test_labels_are_of_the_frames_that_simulate_makes():
    scene = ge.Scene.load(SCENES / "living-room.toml")
    frames, labels = scene.simulate(30, seed=4, labels=True)
    np.testing.assert_array_equal(frames, scene.simulate(30, seed=4))
    assert labels["mask"].shape == (30, labels["present"].shape[1], 8, 8) and (labels["time_s"] == np.arange(30) / 10).all()
    seen = labels["mask"].sum(axis=(2, 3)) > 0
    assert (np.isfinite(labels["box_px"]).all(axis=2) == seen).all() and seen.any()


def test_batches_are_the_frames_of_the_data_set(tmp_path):
    grideye("dataset", "--preset", "counting", "--frames", 2300, "--seed", 3, "--format", "npz", "--out", tmp_path / "theirs")
    parts = [np.load(part) for part in sorted((tmp_path / "theirs").glob("*.npz"))]
    theirs = {name: np.concatenate([part[name] for part in parts]) for name in ("excess_c", "people", "mask")}
    excess = theirs["excess_c"] - np.median(theirs["excess_c"], axis=(1, 2), keepdims=True)
    batches = list(ge.frames("counting", batch=700, frames=2300, seed=3))
    assert [len(x) for x, _ in batches] == [700, 700, 700, 200]
    np.testing.assert_array_equal(np.concatenate([x for x, _ in batches]), excess)
    np.testing.assert_array_equal(np.concatenate([y for _, y in batches]), theirs["people"])
    # Without an end, the first ones are the same; and their labels come with them.
    (x, records), (further, _) = itertools.islice(ge.frames("counting", batch=64, seed=3, labels=True), 2)
    np.testing.assert_array_equal(x, excess[:64])
    np.testing.assert_array_equal(further, excess[64:128])
    np.testing.assert_array_equal(records["mask"], theirs["mask"][:64])


def test_a_data_set_is_the_program_s(tmp_path, capsys):
    scene = ge.Scene.load(SCENES / "experiment-1.toml")
    options = {"frames": 60, "seed": 2, "split": "train=0.5,test=0.5", "formats": ["npz"]}
    told = ge.dataset(scene, tmp_path / "ours", vary=["room.ambient_c=18..26"], **options)
    command = ["--frames", 60, "--seed", 2, "--split", "train=0.5,test=0.5", "--format", "npz", "--vary", "room.ambient_c=18..26"]
    grideye("dataset", SCENES / "experiment-1.toml", *command, "--out", tmp_path / "theirs")
    assert told["frames_of_dataset"] == 60
    assert "has no step_c" in capsys.readouterr().err
    files = {folder: {file.name: file.read_bytes() for file in (tmp_path / folder).iterdir()} for folder in ("ours", "theirs")}
    assert files["ours"] == files["theirs"]
    with pytest.raises(ge.InputError) as error:
        ge.dataset("crowds", tmp_path / "none", frames=10)
    assert "counting, falls" in error.value.hint


def test_a_sensor_is_characterized_as_by_the_program(tmp_path):
    still = ge.Scene.room((3, 3, 2.5)).simulate(400, seed=5)
    rec = ge.Recording.from_array(np.round(still * 4) / 4)
    rec.to_csv(tmp_path / "array.csv")
    ours = ge.characterize(rec, empty="yes", profile=tmp_path / "ours.toml")
    theirs = json.loads(grideye("characterize", tmp_path / "array.csv", "--empty", "yes", "--json", "-"))
    assert ours == theirs
    assert ge.compare(ge.Scene.room((3, 3, 2.5)), rec, profile=tmp_path / "ours.toml").verdict is not ge.Verdict.DISAGREES
    with pytest.raises(ge.InputError, match="frames|short|recording"):
        ge.characterize(rec[:5])
    # Too short to tell whether somebody is there: an answer, but no profile.
    assert ge.characterize(rec[:60])["frames"] == 60
    with pytest.raises(ge.InputError, match="cannot tell whether the room is empty"):
        ge.characterize(rec[:60], profile=tmp_path / "none.toml")
    assert not (tmp_path / "none.toml").exists()


def test_a_scene_is_calibrated_as_by_the_program(tmp_path):
    scene, walk = SCENES / "calibration.toml", tmp_path / "walk.csv"
    grideye("simulate", scene, "--seed", 3, "--frames", 60, "--out", walk)
    ours = ge.calibrate(ge.Scene.load(scene), ge.Recording.read(walk), frames=20, starts=1)
    theirs = json.loads(grideye("calibrate", "--scene", scene, "--recording", walk, "--frames", 20, "--starts", 1, "--json", "-", code=None))
    assert ours.found == theirs
    assert ours.scene.sensors == ge.Scene.load(scene).sensors


def test_coverage_and_orientation_are_the_program_s():
    ours = ge.coverage(ge.Scene.load(SCENES / "bedroom.toml"))
    assert ours == json.loads(grideye("coverage", SCENES / "bedroom.toml", "--json"))
    made = ge.coverage(ge.Scene.room((3, 3, 2.5), people=[(1, 1)]))
    assert made.keys() == ours.keys()
    assert isinstance(ge.orient(ge.Recording.from_array(np.full((60, 8, 8), 20.0))), dict)


def test_people_are_counted_as_the_program_counts_them(tmp_path):
    session = ROOT / "recordings/linaige/Session3_2021-07-06_RoomA_v2.csv"
    recording = ge.Recording.read(session)
    counts = ge.count(recording, line=(-0.5, 3.5, 7.5, 3.5))
    lines = [json.loads(line) for line in grideye("count", session, "--json", "-", "--line=-0.5,3.5,7.5,3.5").splitlines()]
    assert counts.people.tolist() == [line["people"] for line in lines]
    np.testing.assert_allclose(counts.p, [line["p"] for line in lines], atol=1e-4)
    assert (counts.entered[-1], counts.left[-1]) == (lines[-1]["entered"], lines[-1]["left"])
    assert (ge.count(recording, live=True).people[:250] == -1).all()
    # Ten frames a second, as the session nearly has.
    ours = ge.count(recording.celsius).people
    assert np.mean(ours == counts.people) > 0.98
    with pytest.raises(ge.InputError, match="X1,Y1,X2,Y2"):
        ge.count(recording, line=(1, 2))
    (tmp_path / "weights.gec").write_bytes(b"something else")
    with pytest.raises(ge.InputError, match="GEC1"):
        ge.count(recording, weights=tmp_path / "weights.gec")
