"""The converter, on a file like the data set's of a walk that is known. Arguments: the program, a folder to write into.

The file is made here from frames of a scene with a trajectory of its own; no line of it is the data set's.
"""

import csv
import math
import subprocess
import sys
from datetime import datetime, timedelta
from pathlib import Path

sys.dont_write_bytecode = True

import tables
import walks

program, folder = sys.argv[1], Path(sys.argv[2])


def place(at):
    """Meters to the room's right and back from the sensor: 20 s out of view, then a loop that no symmetry maps to itself."""
    if at < 22:
        return 2.8, min(0.4, 0.4 * at / 22)
    turn = 0.35 * (at - 22)
    return 0.4 + max(2.4 - 0.5 * (at - 22), 0.8 * math.cos(turn)), 0.4 + 0.9 * math.sin(1.3 * turn)


trajectory = [f"{k / 10:.1f},{5000 + 1000 * place(k / 10)[0]:.0f},{3000 + 1000 * place(k / 10)[1]:.0f}" for k in range(601)]
(folder / "known.csv").write_text("\n".join(["t_s,x_mm,y_mm", *trajectory]) + "\n")
(folder / "known.toml").write_text("""model = "physical"
collisions = "ignore"
[room]
size_mm = [10000, 8000, 2500]
ambient_c = 21
[[agent]]
name = "walker"
person = {}
trajectory = "known.csv"
[[sensor]]
name = "ceiling"
preset = "grid-eye"
position_mm = [5000, 3000, 2500]
elevation_deg = 90
azimuth_deg = 0
""")
subprocess.run([program, "simulate", folder / "known.toml", "--out", folder / "frames.csv"], check=True)
with open(folder / "frames.csv", newline="", encoding="utf-8") as file:
    frames = list(csv.DictReader(file))
wrong = 400
with open(folder / "walker.csv", "w", newline="", encoding="utf-8") as file:
    rows = csv.writer(file)
    rows.writerow(["index", *(f"p{pixel}" for pixel in range(64)), "thermistor", "time", "x", "y"])
    for index, frame in enumerate(frames):
        time = datetime(2020, 1, 1, 12) + timedelta(seconds=index / 10)
        # The frames lag the tracker by a quarter of a second.
        x, y = place(index / 10 + 0.25) if index != wrong else (2.0, -2.0)
        pixels = [frame[f"pixel{pixel}"] for pixel in range(1, 65)]
        rows.writerow([index, *pixels, "24.81", time.isoformat(" ", "milliseconds"), x, 2.5 - y])

(walk,) = walks.read([folder / "walker.csv"])
assert len(walk.tracked_s) == len(frames) - 1, "the tracker's wrong row is dropped, no other"
assert (walk.stretches(), walk.ambient_c) == ([slice(0, 600)], 21.0), (walk.stretches(), walk.ambient_c)
said = {}
for what in ("right", "mirrored in x", "mirrored in y", "turned by 90°", "nobody", tables.GONE):
    celsius = walk.with_gap(slice(0, 600)) if what == tables.GONE else None
    said[what], _ = walks.Program(program, folder).compared(walk, slice(0, 600), None, celsius, **tables.CLAIMS[what])
assert [what for what, code in said.items() if code == 0] == ["right"], said
print(f"{len(walk.tracked_s)} of {len(frames)} places kept; the right scene agrees, none of {len(said) - 1} wrong ones")
