"""A dataset as numpy, pandas, pyarrow, Polars, DuckDB and Hugging Face's datasets read it, beside what `grideye simulate` makes of the same frames.

Arguments: the program, a folder to write into.
"""

import contextlib
import json
import os
import subprocess
import sys
import tomllib
import types
import zipfile
from pathlib import Path

os.environ["HF_HUB_OFFLINE"] = "1"  # before the library is there, or it asks the Hub
import datasets
import duckdb
import numpy
import pandas
import polars
import pyarrow.parquet

program, folder = sys.argv[1], Path(sys.argv[2])
SCENE = "scenes/two-people.toml"
FRAMES, PER_PART = 70, 30
IMAGES = ["celsius", "truth_c", "empty_c", "excess_c"]


def grideye(*arguments):
    subprocess.run([program, *arguments], check=True, stdout=subprocess.DEVNULL)


def dataset(out, *more):
    out = folder / out
    grideye("dataset", SCENE, "--frames", str(FRAMES), "--frames-per-part", str(PER_PART), "--seed", "3", *more, "--out", out)
    return out


def columns_of(parts):
    """The columns of the Parquet files by each reader, each as plain lists."""
    table = pyarrow.concat_tables([pyarrow.parquet.read_table(part) for part in parts])
    frame = pandas.concat([pandas.read_parquet(part) for part in parts])
    pola = polars.concat([polars.read_parquet(part) for part in parts])
    duck = duckdb.sql(f"select * from read_parquet('{parts[0].parent}/part-*.parquet') order by frame").fetchall()
    names = table.column_names
    plain = {
        "pyarrow": {name: table[name].to_pylist() for name in names},
        "polars": {name: pola[name].to_list() for name in names},
        "duckdb": {name: [row[at] for row in duck] for at, name in enumerate(names)},
        "pandas": {
            name: [None if numpy.ndim(value) == 0 and pandas.isna(value) else plainly(value) for value in frame[name]]
            for name in names
        },
    }
    assert list(pola.columns) == names and list(frame.columns) == names
    return names, plain


def plainly(value):
    """Lists for arrays, and for arrays of arrays."""
    return [plainly(one) for one in value] if isinstance(value, numpy.ndarray) else value


def check_hub(out, splits):
    """The folder by `datasets.load_dataset`, which the data card's heading tells splits, columns and shapes."""
    found = datasets.load_dataset(str(out), cache_dir=str(folder / "hub"))
    assert {name: len(split) for name, split in found.items()} == splits, found
    archives = {name: [numpy.load(part) for part in sorted(out.glob(f"{'part' if len(splits) == 1 else name}-*.npz"))] for name in splits}
    for name, split in found.items():
        rows = split.with_format("numpy")[:]
        for column in ["frame", "clip", "people", *IMAGES, "clear"]:
            assert same(rows[column], numpy.concatenate([archive[column] for archive in archives[name]])), (name, column)
        assert rows["celsius"].shape[1:] == (8, 8) and rows["celsius"].dtype == "float32"
        agent = next(column for column in split.column_names if column.endswith(".mask"))
        assert rows[agent].shape[1:] == (8, 8)
    clips = [set(split["clip"]) for split in found.values()]
    assert sum(map(len, clips)) == len(set.union(*clips)), "a clip is in two splits"


def same(one, other):
    one = numpy.array([numpy.nan if value is None else value for value in one]) if not isinstance(one, numpy.ndarray) else one
    return numpy.array_equal(one, other, equal_nan=one.dtype.kind == "f")


def check_readers(out, agents, varied, texts):
    plan = json.loads((out / "dataset.json").read_text())
    parts = sorted(out.glob("part-*.parquet"))
    archives = [numpy.load(part) for part in sorted(out.glob("part-*.npz"))]
    assert len(parts) == len(archives) == -(-FRAMES // PER_PART)
    arrays = {
        name: numpy.concatenate([archive[name] for archive in archives])
        for name in archives[0].files
        if archives[0][name].ndim > 0 and not name.endswith("names") and name != "agents"
    }
    for archive in archives:
        about = json.loads(str(archive["metadata"]))
        assert about == plan, about
    assert list(archives[0]["agents"]) == agents == plan["agents"]
    assert list(archives[0]["vary_names"]) == varied and list(archives[0]["vary_text_names"]) == texts
    names, readers = columns_of(parts)
    kinds = {"frame": "u8", "clip": "u8", "time_s": "f8", "noise_seed": "u8", "people": "u8"}
    for reader, columns in readers.items():
        for name, kind in kinds.items():
            assert same(numpy.array(columns[name], kind), arrays[name]), (reader, name)
        assert same(numpy.array(columns["clear"], bool), arrays["clear"]), reader
        for name in IMAGES:
            assert same(numpy.array(columns[name], "f4"), arrays[name]), (reader, name)
        for at, agent in enumerate(agents):
            label = lambda what: columns[f"agent.{agent}.{what}"]
            assert same(numpy.array(label("present"), bool), arrays["present"][:, at]), reader
            for axis, name in enumerate(["x_m", "y_m", "z_m"]):
                assert same(label(name), arrays["position_m"][:, at, axis]), (reader, name)
            assert same(label("visibility"), arrays["visibility"][:, at]), reader
            assert same(label("pixels"), arrays["pixels"][:, at]), reader
            assert same(label("contrast_c"), arrays["contrast_c"][:, at]), reader
            assert same(numpy.array(label("counts"), bool), arrays["counts"][:, at]), reader
            for axis, name in enumerate(["column", "row"]):
                assert same(label(name), arrays["center_px"][:, at, axis]), (reader, name)
            for edge, name in enumerate(["left", "top", "right", "bottom"]):
                assert same(label(name), arrays["box_px"][:, at, edge]), (reader, name)
            for name in ["posture", "doing"]:
                assert [word or "" for word in label(name)] == list(arrays[name][:, at]), (reader, name)
            assert same(numpy.array(label("mask"), "f4"), arrays["mask"][:, at]), reader
        for at, name in enumerate(varied):
            assert same(columns[f"vary.{name}"], arrays["vary"][:, at]), (reader, name)
        for at, name in enumerate(texts):
            assert list(columns[f"vary.{name}"]) == list(arrays["vary_text"][:, at]), (reader, name)
    assert list(arrays["frame"]) == list(range(FRAMES)), "none lost, none twice"
    assert len(set(arrays["noise_seed"])) == FRAMES
    assert len(names) == 10 + 17 * len(agents) + len(varied) + len(texts)
    return arrays


def check_labels(arrays):
    """Boxes, middles and counts from the masks, by numpy."""
    mask, (rows, columns) = arrays["mask"].astype("f8"), arrays["mask"].shape[2:]
    sums = mask.sum(axis=(2, 3))
    seen = sums > 0
    assert numpy.array_equal(numpy.isnan(arrays["center_px"]).any(axis=2), ~seen) and seen.any()
    row, column = numpy.mgrid[:rows, :columns]
    for axis, place in enumerate([column, row]):
        middle = (mask * place).sum(axis=(2, 3))[seen] / sums[seen]
        assert numpy.abs(middle - arrays["center_px"][..., axis][seen]).max() < 1e-4
    for frame, agent in zip(*numpy.nonzero(seen)):
        share = mask[frame, agent]
        from_share = min(0.25, share.max())
        # The masks are in single precision: what is about as much as the limit may be either.
        if (numpy.abs(share - from_share) < 1e-6).sum() <= (from_share < 0.25):
            inside = share >= from_share
            y, x = numpy.nonzero(inside)
            assert list(arrays["box_px"][frame, agent]) == [x.min(), y.min(), x.max() + 1, y.max() + 1]
    # 2.5 pixels and 0.5 °C are the defaults of the help.
    counts = (sums >= 2.5) & (numpy.nan_to_num(arrays["contrast_c"]) >= 0.5)
    sure = numpy.abs(sums - 2.5) > 1e-5
    unclear = ((sums >= 1) & (sums < 2.5)).any(axis=1)
    steady = (sure & (numpy.abs(sums - 1) > 1e-5)).all(axis=1)
    assert numpy.array_equal(~unclear[steady], arrays["clear"][steady])
    assert numpy.array_equal(counts[sure], arrays["counts"][sure])
    assert numpy.array_equal(arrays["people"], arrays["counts"].sum(axis=1))


def loader():
    """The loader of the document, with its library's base class alone."""
    text = Path("crates/grideye/DATASET.md").read_text()
    base = type("Base", (), {"__init__": lambda self, **more: None})
    sys.modules["keras"] = types.SimpleNamespace(utils=types.SimpleNamespace(PyDataset=base))
    (block,) = [block.split("```")[0] for block in text.split("```python\n")[1:] if "import datasets" not in block]
    names = {}
    exec(block, names)
    return names["Batches"]


# Without anything that varies, each frame is what `simulate` makes of its moment with its seed.
plain = dataset("plain")
agents = json.loads((plain / "dataset.json").read_text())["agents"]
arrays = check_readers(plain, agents, [], [])
moments, at = [], 0
for index in [0, 1, 29, 30, 31, 69]:
    out = folder / "again.npz"
    # The frame's number in its turn through the scene.
    turn = int(round(arrays["time_s"][index] * 10))
    grideye("simulate", SCENE, "--seed", str(arrays["noise_seed"][index]), "--frames", str(turn + 1), "--out", out)
    again = numpy.load(out)
    assert again["time_s"][turn] == arrays["time_s"][index]
    assert numpy.array_equal(again["frames"][turn], arrays["celsius"][index]), index
residual = arrays["celsius"].astype("f8") - arrays["truth_c"]
print(f"noise {residual.std():.4f} K about {residual.mean():+.5f} K in {residual.size} pixels")
assert abs(residual.mean()) < 5 * 0.2 / residual.size**0.5 and abs(residual.std() - 0.2) < 0.2 * 5 / (2 * residual.size) ** 0.5

# The records, mapped into memory, are the arrays; and so are the documented loader's.
records = dataset("records", "--format", "npy")
mapped = [numpy.load(part, mmap_mode="r") for part in sorted(records.glob("part-*.npy"))]
assert all(isinstance(part, numpy.memmap) and part.itemsize % 8 == 0 for part in mapped)
for name in mapped[0].dtype.names:
    found = numpy.concatenate([part[name] for part in mapped])
    assert same(found, arrays[name]) and found.dtype.kind == arrays[name].dtype.kind, name
assert set(arrays) - set(mapped[0].dtype.names) <= {"vary", "vary_text"}
excess = arrays["excess_c"] - numpy.median(arrays["excess_c"], axis=(1, 2), keepdims=True)
batches = loader()(records, size=PER_PART)
pairs = [batches[number] for number in range(len(batches))]
assert numpy.array_equal(numpy.concatenate([pair[0] for pair in pairs])[..., 0], excess)
assert numpy.array_equal(numpy.concatenate([pair[1] for pair in pairs]), arrays["people"])
assert numpy.array_equal(numpy.concatenate([pair[2] for pair in pairs]), arrays["clear"])
check_labels(arrays)

del sys.modules["keras"]  # which it would take for the real one

# As Hugging Face's library loads the folder: without and with splits, in clips and of both built-in scenes.
check_hub(plain, {"train": FRAMES})
for preset, clip in [("counting", 1), ("falls", 10)]:
    divided = folder / preset
    options = ["--frames", "200", "--clip", str(clip), "--frames-per-part", "50", "--split", "train=0.7,validation=0.15,test=0.15"]
    grideye("dataset", "--preset", preset, *options, "--out", divided)
    check_hub(divided, {"train": 140, "validation": 30, "test": 30})
    # What is taken off is the empty room with the unit's pattern, on the steps of the sensor.
    pattern = numpy.reshape(tomllib.loads(Path("scenes/profiles/linaige.toml").read_text())["fixed_pattern"]["offset_c"], (8, 8))
    for part in (numpy.load(file) for file in divided.glob("*.npz")):
        assert (part["excess_c"] * 4 % 1 == 0).all()
        assert numpy.abs(part["celsius"] - part["excess_c"] - part["empty_c"] - pattern).max() <= 0.125 + 1e-4
        nobody = ~part["present"].any(axis=1)
        assert numpy.array_equal(part["empty_c"][nobody], part["truth_c"][nobody])
        assert not numpy.array_equal(part["empty_c"], part["truth_c"])

# Another sensor, and another room: what goes with its temperature is told from the preset's.
spread = {}
for name, options in {
    "preset": ["--vary", "room.ambient_c=25..27"],
    "datasheet": ["--profile", "scenes/profiles/datasheet.toml"],
    "own": ["--like", "recordings/linaige/Session3_2021-07-06_RoomA_v2.csv"],
}.items():
    out = folder / f"sensor-{name}"
    grideye("dataset", "--preset", "counting", "--frames", "200", "--format", "npy", "--vary", "people=0", *options, "--out", out)
    (part,) = (numpy.load(file) for file in out.glob("*.npy"))
    excess = part["excess_c"] - numpy.median(part["excess_c"], axis=(1, 2), keepdims=True)
    spread[name], room = excess.std(), part["vary.room.ambient_c"]
    over = part["vary.object.sun patch.temperature_c"] - room
    assert over.min() >= 2 and over.max() <= 6, "as the scene says"
    if name == "preset":
        assert room.min() >= 25 and room.max() <= 27
# The profiles' sigmas are 0.33 and 0.18 °C; rounding to steps adds to both. The preset's was measured on this session.
assert 0.32 < spread["preset"] < 0.42 and 0.16 < spread["datasheet"] < 0.24, spread
assert abs(spread["own"] / spread["preset"] - 1) < 0.1, spread

# With values that vary, the labels are what is seen: outside the masks nothing is warmer than the room.
people = dataset(
    "people",
    *["--vary", "room.ambient_c=18..22", "--vary", "law=A,B"],
    *[argument for agent in agents for argument in ["--vary", f"agent.{agent}.position=floor", "--vary", f"agent.{agent}.present=on,off"]],
)
varied = ["room.ambient_c"] + [f"agent.{agent}.present" for agent in agents]
arrays = check_readers(people, agents, varied, ["law"])
check_labels(arrays)
(hub,) = [block.split("```")[0] for block in Path("crates/grideye/DATASET.md").read_text().split("```python\n")[1:] if block.startswith("import datasets")]
documented = {}
with contextlib.chdir(folder):
    exec(hub, documented)
assert same(documented["people"]["train"][:32]["excess_c"], arrays["excess_c"][:32])
ambient = arrays["vary"][:, 0][:, None, None]
assert numpy.array_equal(arrays["vary"][:, 1:] == 1, arrays["present"])
assert set(arrays["vary_text"][:, 0]) == {"A", "B"}
seen = arrays["mask"].sum(axis=1)
warmer = arrays["truth_c"] - ambient
assert numpy.abs(warmer[seen == 0]).max() < 1e-5 and (warmer[seen > 1e-3] > 0).all()
absent = ~arrays["present"]
assert all((arrays[name][absent] == 0).all() for name in ["pixels", "visibility", "contrast_c"])
assert numpy.isnan(arrays["position_m"][absent]).all() and (arrays["mask"][absent] == 0).all()
there = arrays["present"]
sums = arrays["mask"].sum(axis=(2, 3))
whole = numpy.where(there, arrays["pixels"], 0)
expected = numpy.divide(sums, whole, out=numpy.zeros_like(sums, dtype="f8"), where=whole > 0)
assert numpy.abs(expected[there] - arrays["visibility"][there]).max() < 1e-5
assert (seen <= 1 + 1e-6).all() and (arrays["mask"] >= 0).all()
in_view = int((arrays["pixels"] > 0).sum())
assert in_view > 10, in_view
print(f"{in_view} of {there.sum()} agents in view, visibility {numpy.nanmin(arrays['visibility']):.2f} to {numpy.nanmax(arrays['visibility']):.2f}")
sizes = {kind: sum(path.stat().st_size for path in people.glob(f"*.{kind}")) / FRAMES for kind in ["npz", "parquet"]}
print("bytes a frame:", {kind: round(size) for kind, size in sizes.items()})
for path in people.glob("*.npz"):
    assert zipfile.ZipFile(path).testzip() is None
