"""Simulated and real frames as the counter sees them, and how well counts of them are read."""

import csv
import subprocess
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
SESSIONS = {2: "Session2_2021-07-01_RoomB_v2.csv", 3: "Session3_2021-07-06_RoomA_v2.csv"}
COUNTS = range(4)
VOTES = 7
# Half a second of frames.
FAR = 5


def level(frames):
    """Without the change that all pixels share."""
    return (frames - np.median(frames, axis=(1, 2), keepdims=True)).astype(np.float32)


def simulated(program, folder, frames, *more):
    """Simulated frames less their empty room and unit's pattern, and how many people are in view; only clear ones."""
    words = [program, "dataset", "--preset", "counting", "--frames", str(frames), "--format", "npy", *more, "--out", folder]
    subprocess.run(words, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    parts = [np.load(part, mmap_mode="r") for part in sorted(folder.glob("part-*.npy"))]
    excess_c, people, clear = (np.concatenate([part[name] for part in parts]) for name in ("excess_c", "people", "clear"))
    return level(excess_c)[clear], people[clear].astype(int)


def session(number):
    """A real session's frames less its median of each pixel, how many people are in view, and whether that was easy to say."""
    with open(ROOT / "recordings/linaige" / SESSIONS[number], newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    celsius = np.array([[float(row[f"pixel{pixel}"]) for pixel in range(64)] for row in rows]).reshape(-1, 8, 8)
    counts, easy = np.array([(int(row["people_number"]), row["confidence"] == "e") for row in rows]).T
    return level(celsius - np.median(celsius, axis=0)), counts, easy.astype(bool)


def symmetries(frames):
    turns = [np.rot90(frames, turn, (-2, -1)) for turn in range(4)]
    return turns + [turn[..., ::-1] for turn in turns]


def majority(counted):
    """Of each frame and those before it, `VOTES` in all; the fewer people of a tie."""
    return np.array([np.bincount(counted[max(0, at + 1 - VOTES) : at + 1]).argmax() for at in range(len(counted))])


def smoothed(chances):
    """The mean of each frame's chances and those before it, `VOTES` in all."""
    return np.array([chances[max(0, at + 1 - VOTES) : at + 1].mean(axis=0) for at in range(len(chances))])


def is_far(counts):
    """Frames more than half a second from a change of label."""
    changes = np.flatnonzero(np.diff(counts)) + 0.5
    return np.abs(np.arange(len(counts))[:, None] - changes).min(axis=1) > FAR


def recalls(counts, counted):
    return {int(count): 100 * np.mean(counted[counts == count] == count) for count in np.unique(counts)}


def balanced(counts, counted):
    return np.mean(list(recalls(counts, counted).values()))


def presence(counts, counted):
    """Per cent of empty frames called occupied, and of occupied ones called empty."""
    return 100 * np.mean(counted[counts == 0] > 0), 100 * np.mean(counted[counts > 0] == 0)


def row(*cells):
    print("| " + " | ".join(map(str, cells)) + " |", flush=True)


def spread(values):
    return f"{np.mean(values):.1f} ({min(values):.1f} to {max(values):.1f})"
