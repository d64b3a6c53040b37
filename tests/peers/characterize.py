"""Noise and Allan deviation of a LINAIGE session by numpy, as JSON: written from the definitions, not from our code.

    python characterize.py SESSION.csv

- sigma: of the differences of neighboring frames less their median over the pixels, the width of the middle of the
  distribution over 1.349 (a Gaussian's), over the root of 2. People walk through the tails.
- allan: overlapping is not used: means over m frames in a row, half the mean square of the differences of neighbors, its
  root, of the level (mean of the middle three quarters of the pixels, each less the middle of its first hundred frames).
"""

import csv
import json
import sys

import numpy as np


def load(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    pixels = np.array([[float(row[f"pixel{i}"]) for i in range(64)] for row in rows])
    seconds = []
    for row in rows:
        hour, minute, second = row["timestamp"].split("_")
        seconds.append(3600 * int(hour) + 60 * int(minute) + float(second))
    return pixels, np.array(seconds)


def width(values):
    low, high = np.percentile(values, [25, 75])
    return (high - low) / 1.3489795


def trimmed(values):
    ordered = np.sort(values, axis=-1)
    cut = ordered.shape[-1] // 8
    return ordered[..., cut:-cut].mean(axis=-1)


def main():
    pixels, seconds = load(sys.argv[1])
    period = np.median(np.diff(seconds))
    breaks = np.flatnonzero((np.diff(seconds) < 0) | (np.diff(seconds) > 3 * period)) + 1
    runs = np.split(pixels, breaks)

    differences = np.concatenate([np.diff(run, axis=0) for run in runs])
    rounding = np.random.default_rng(1).uniform(-0.125, 0.125, differences.shape)
    alone = differences - trimmed(differences)[:, None]
    # Steps of a quarter make percentiles jump; a draw inside the step smooths them and adds its own variance.
    sigma = np.array([width(column) for column in (alone + rounding).T])
    sigma = np.sqrt(np.maximum(sigma**2 - 0.25**2 / 12, 0) / 2)

    center = np.sort(runs[0][:100], axis=0)[25:-25].mean(axis=0)
    allan = []
    length = 1
    while True:
        common = []
        for run in runs:
            whole = len(run) // length
            levels = trimmed(run[: whole * length] - center).reshape(whole, length).mean(axis=1)
            common.append(np.diff(levels))
        common = np.concatenate(common)
        if len(common) < 8:
            break
        allan.append(
            {
                "tau_s": length * float(period),
                "common_c": float(np.sqrt(np.mean(common**2) / 2)),
            }
        )
        length *= 2
    json.dump(
        {
            "frames": len(pixels),
            "rate_hz": float(1 / np.mean(np.concatenate([np.diff(part) for part in np.split(seconds, breaks)]))),
            "sigma_c": sigma.tolist(),
            "allan": allan,
            "jump_s": float(np.diff(seconds).min()),
        },
        sys.stdout,
    )


main()
