"""Whether a small network tells real frames from simulated ones of the same number of people, in a room that it never saw.

The lower the area under the curve (AUC), the more alike; 0.5 is a coin.
"""

import numpy as np
from frames import SESSIONS, row
from network import read, train

# Three people are in 11 real frames.
PEOPLE = range(3)
STEPS = 800


def area(real, simulated):
    """The chance that a real frame scores higher than a simulated one."""
    scores = np.concatenate([real, simulated])
    ranks = scores.argsort(kind="stable").argsort(kind="stable") + 1.0
    return (ranks[: len(real)].sum() - len(real) * (len(real) + 1) / 2) / (len(real) * len(simulated))


def areas(real, ours, seed):
    """By test session and number of people; the other session and half of the simulated frames train."""
    frames, people = ours
    half = np.random.default_rng(seed).random(len(people)) < 0.5
    found = {}
    for test, other in zip(SESSIONS, reversed(SESSIONS)):
        seen, counts, easy = real[other]
        both, counted = np.concatenate([seen[easy], frames[half]]), np.concatenate([counts[easy], people[half]])
        is_real = np.arange(len(both)) < easy.sum()
        groups = [(np.flatnonzero((counted == count) & (is_real == kind)), 1) for count in PEOPLE for kind in (True, False)]
        layers = train(both, is_real.astype(int), groups, seed, STEPS)
        seen, counts, easy = real[test]
        for count in PEOPLE:
            sides = seen[easy & (counts == count)], frames[~half & (people == count)]
            found[test, count] = area(*(np.subtract(*read(layers, side).T[::-1]) for side in sides))
    return found


def features(frames):
    """Of frames with their warmest pixel among the middle 16: that pixel, the 5 x 5 sum over it, its two rings over it."""
    found = []
    for frame in frames:
        row, column = divmod(int(frame.argmax()), 8)
        if 2 <= row <= 5 and 2 <= column <= 5:
            around, peak = frame[row - 2 : row + 3, column - 2 : column + 3], frame[row, column]
            inner = around[1:4, 1:4].sum()
            found.append((peak, around.sum() / peak, (inner - peak) / 8 / peak, (around.sum() - inner) / 16 / peak))
    return np.array(found)


def table(real, ours, seeds):
    found = [areas(real, ours, seed) for seed in seeds]
    row("AUC", *("1 person" if count == 1 else f"{count} people" for count in PEOPLE), "mean")
    row(*["---"] * (2 + len(PEOPLE)))
    for test in SESSIONS:
        means = [np.mean([one[test, count] for one in found]) for count in PEOPLE]
        row(f"session {test}", *(f"{mean:.2f}" for mean in [*means, np.mean(means)]))
    print()
    row("one person, 10/50/90 %", "warmest pixel, °C", "5 x 5 sum / warmest", "inner ring / warmest", "outer ring / warmest")
    row(*["---"] * 5)
    sides = {f"session {number}": seen[easy & (counts == 1)] for number, (seen, counts, easy) in real.items()}
    for name, frames in {**sides, "simulated": ours[0][ours[1] == 1][:5000]}.items():
        quantiles = np.quantile(features(frames), [0.1, 0.5, 0.9], axis=0).T
        row(name, *(" / ".join(f"{value:.2f}" for value in of) for of in quantiles))
