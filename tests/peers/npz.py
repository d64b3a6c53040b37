"""`grideye simulate --out x.npz` as numpy reads it, beside the .csv of the same frames.

Arguments: the program, a folder to write into.
"""

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy
import pyarrow.parquet

program, folder = sys.argv[1], Path(sys.argv[2])


def simulate(scene, out, *more):
    out = folder / out
    subprocess.run([program, "simulate", f"scenes/{scene}.toml", "--out", out, *more], check=True)
    return out


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


# A recording, in the sensor's own steps of a quarter of a degree.
arrays = numpy.load(simulate("experiment-3", "walk.npz", "--seed", "5"))
of_recordings = ["clock", "frames", "missing", "seq", "stream", "streams", "t_boot_ns", "t_utc_ns", "thermistor_c"]
assert sorted(arrays.files) == sorted([*of_recordings, "metadata", "time_s"]), arrays.files
frames, time_s = arrays["frames"], arrays["time_s"]
assert frames.dtype == numpy.float32 and frames.shape[1:] == (8, 8), (frames.dtype, frames.shape)
assert time_s.dtype == numpy.float64 and time_s.shape == frames.shape[:1]
assert numpy.all(numpy.isfinite(frames))
metadata = json.loads(str(arrays["metadata"]))
assert (metadata["scene"], metadata["seed"]) == ("experiment-3", 5), metadata
recorded = rows(simulate("experiment-3", "walk.csv", "--seed", "5"))
assert len(recorded) == len(frames)
degrees = numpy.array([[float(row[f"pixel{pixel}"]) for pixel in range(1, 65)] for row in recorded])
worst = numpy.abs(degrees.reshape(-1, 8, 8) - frames).max()
assert worst <= 0.125 + 1e-5, worst
ns = numpy.array([int(row["t_boot_ns"]) for row in recorded])
assert numpy.abs(ns * 1e-9 - time_s).max() < 1e-9

# The same in columns, with the frames as they are in the arrays.
table = pyarrow.parquet.read_table(simulate("experiment-3", "walk.parquet", "--seed", "5"))
assert table.column_names == list(recorded[0]), table.column_names
pixels = numpy.array([table[f"pixel{pixel}"].to_pylist() for pixel in range(1, 65)]).T
assert numpy.array_equal(pixels.astype("f4").reshape(-1, 8, 8), frames)
assert json.loads(table.schema.metadata[b"grideye.simulation"]) == metadata

# A table of degrees, three decimals.
arrays = numpy.load(simulate("experiment-5", "face.npz", "--frames", "3"))
assert arrays["frames"].shape == (3, 60, 80), arrays["frames"].shape
table = rows(simulate("experiment-5", "face.csv", "--frames", "3"))
degrees = numpy.array([[float(row[f"r{r}c{c}_c"]) for r in range(60) for c in range(80)] for row in table])
lists = pyarrow.parquet.read_table(simulate("experiment-5", "face.parquet", "--frames", "3"))["celsius"].to_pylist()
assert numpy.array_equal(numpy.array(lists, "f4").reshape(3, 60, 80), arrays["frames"])
finer = numpy.abs(degrees.reshape(3, 60, 80) - arrays["frames"]).max()
assert finer <= 0.0005 + 1e-5, finer
print(f"{len(frames)} frames of 8 x 8 differ from the recording by at most {worst:.4f} K, half a step is 0.125")
print(f"3 frames of 80 x 60 differ from the table by at most {finer:.6f} K, half a step is 0.0005")
