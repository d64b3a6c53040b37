"""Our measures of likeness held against NumPy, SciPy, scikit-learn and scikit-image, and their time beside ours.

usage: metrics.py FIGURES.json

The file holds pairs of frames with what we say of them. Every figure is worked out again here from the frames alone, by
those packages where they have it. Prints a table of the largest deviation per measure; ends with 1 if one is too large.
"""

import json
import math
import sys
import time

import numpy as np
from scipy import ndimage, stats
from skimage.measure import label
from sklearn.metrics import mutual_info_score, root_mean_squared_error

LIMIT = 1e-9


def bins(frame):
    spread = frame.max() - frame.min()
    return half_away(255 * (frame - frame.min()) / spread) if spread > 0 else np.zeros(frame.size, dtype=int)


def half_away(values):
    """Halves away from zero, as a picture is rounded; NumPy's own rint goes to even."""
    return (np.sign(values) * np.floor(np.abs(values) + 0.5)).astype(int)


def entropy(*columns):
    _, counts = np.unique(np.stack(columns), axis=1, return_counts=True)
    return stats.entropy(counts, base=2)


def information(x, y):
    return mutual_info_score(x, y) / math.log(2)


def blob(frame, shape, above):
    excess = (frame - np.median(frame)).reshape(shape)
    labels, number = label(excess > above, connectivity=2, return_num=True)
    if number == 0:
        return None
    warmth = ndimage.sum_labels(excess, labels, range(1, number + 1))
    row, column = ndimage.center_of_mass(excess, labels, int(np.argmax(warmth)) + 1)
    return column, row


def theirs(pair, given):
    x, y = np.array(pair["real"]), np.array(pair["simulated"])
    shape, above = (given["rows"], given["columns"]), given["warm_above_c"]
    difference = y - x
    found = {
        "correlation": None if np.ptp(x) == 0 or np.ptp(y) == 0 else stats.pearsonr(x, y).statistic,
        "image_similarity": np.mean(np.abs(difference) < 5 / 3),
        "evaluation_graph": [np.mean(np.abs(difference) < k / 20) for k in range(101)],
        "rmse": root_mean_squared_error(x, y),
        "bias": -difference.mean(),
        "entropy_real": entropy(bins(x)),
        "entropy_simulated": entropy(bins(y)),
        "joint_entropy": entropy(bins(x), bins(y)),
        "mutual_information": information(bins(x), bins(y)),
    }
    blobs = [blob(frame, shape, above) for frame in (x, y)]
    found["centroid_error_pixels"] = None if None in blobs else math.dist(*blobs)
    return found


def deviation(ours, theirs):
    if ours is None or theirs is None:
        return 0.0 if ours is None and theirs is None else math.inf
    ours, theirs = np.atleast_1d(np.array(ours, dtype=float)), np.atleast_1d(np.array(theirs, dtype=float))
    if ours.shape != theirs.shape or not np.isfinite(ours).all():
        return math.inf
    return float(np.max(np.abs(ours - theirs) / np.maximum(1.0, np.abs(theirs))))


def microseconds_a_pair(pairs):
    """C, entropies, mutual information, IS and evaluation graph, as one would write them."""
    thresholds = np.arange(101) / 20
    arrays = [(np.array(pair["real"]), np.array(pair["simulated"])) for pair in pairs[:50]]

    def score(x, y):
        a, b = bins(x), bins(y)
        difference = np.abs(y - x)
        return (
            np.corrcoef(x, y)[0, 1],
            stats.entropy(np.bincount(a), base=2),
            stats.entropy(np.bincount(b), base=2),
            mutual_info_score(a, b),
            np.mean(difference < 5 / 3),
            np.mean(difference[:, None] < thresholds, axis=0),
        )

    fastest = math.inf
    for _ in range(3):
        # The processor's time and not the clock's: others may be at work on this machine.
        start = time.process_time()
        with np.errstate(invalid="ignore"):
            for x, y in arrays:
                score(x, y)
        fastest = min(fastest, time.process_time() - start)
    return fastest / len(arrays) * 1e6


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        given = json.load(file)
    largest, defined = {}, {}
    for pair in given["pairs"]:
        found = theirs(pair, given)
        assert found.keys() == pair["ours"].keys(), found.keys() ^ pair["ours"].keys()
        for name, value in found.items():
            largest[name] = max(largest.get(name, 0.0), deviation(pair["ours"][name], value))
            defined[name] = defined.get(name, 0) + (value is not None)
    print(f"{len(given['pairs'])} pairs of frames; relative to the figure, or to 1 where it is smaller")
    for name, value in largest.items():
        print(f"{name:36} {value:8.1e}  defined in {defined[name]}")
    if "nanoseconds" in given:
        ours, others = given["nanoseconds"], microseconds_a_pair(given["pairs"]) * 1000
        print(f"a pair: {ours:.0f} ns here, {others:.0f} ns by NumPy, SciPy and scikit-learn: {others / ours:.0f} times")
    wrong = [name for name, value in largest.items() if not value < LIMIT]
    empty = [name for name, number in defined.items() if number == 0]
    if wrong or empty:
        sys.exit(f"deviates: {wrong}; defined nowhere: {empty}")


if __name__ == "__main__":
    main()
