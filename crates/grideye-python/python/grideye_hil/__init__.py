"""Simulate, emulate and validate Panasonic Grid-EYE AMG8833 sensors.

    import grideye_hil as ge

    scene = ge.Scene.load("room.toml")
    frames = scene.simulate(frames=100, seed=1)      # float32 (100, 8, 8), degrees Celsius
    rec = ge.Recording.read("evening.csv")           # rec.celsius: float32 (N, 8, 8)
    assert ge.compare(scene, rec).agrees             # .verdict: "agrees", "disagrees" or "cannot tell"
    for x, y in ge.frames("counting", frames=50_000): ...  # batches of labeled frames
    people = ge.count(rec).people                    # int8 (N,): 0 to 3 and more, -1 where it is not known
    with ge.emulate(scene) as bus:                   # an AMG8833 at 0x69, in this process
        bus.read_byte_data(0x69, 0x80)

Same numbers, bit for bit, as the program ``grideye``, which this package installs too. Long calls release Python's lock
and stop on Ctrl-C. What cannot be used raises `InputError`, with file, line and hint.
"""

from ._bus import Bus, emulate
from ._comparison import Comparison, Verdict, compare
from ._count import Counts, count
from ._error import InputError
from ._program import Calibration, calibrate, characterize, coverage, dataset, frames, orient
from ._recording import Recording
from ._scene import Scene

__all__ = [
    "Bus",
    "Calibration",
    "Comparison",
    "Counts",
    "InputError",
    "Recording",
    "Scene",
    "Verdict",
    "calibrate",
    "characterize",
    "compare",
    "count",
    "coverage",
    "dataset",
    "emulate",
    "frames",
    "orient",
]
