"""Trains a small network to count people on simulated frames, real frames, and both, and tests it on rooms it never saw.

README.md explains the choices and has the table.
"""

import argparse
import csv
import os
import subprocess
import tempfile
import time
from pathlib import Path

os.environ["KERAS_BACKEND"] = "jax"
# Threads cost more than they save on a network this small.
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false")

import keras
import numpy as np
from keras import layers
from PIL import Image, ImageDraw

ROOT = Path(__file__).resolve().parents[3]
SCENE = "scenes/counting.toml"
SESSIONS = {2: "Session2_2021-07-01_RoomB_v2.csv", 3: "Session3_2021-07-06_RoomA_v2.csv"}
COUNTS = range(4)
STEPS, BATCH = 1200, 256
# No frame with somebody who fills this many pixels is trained on: whoever labels it may count that person or not. Of
# real frames, none that the labels call hard.
UNCLEAR_PIXELS = 1, 2.5
# Of a count's frames, where both kinds have it: a session is three minutes of one room.
REAL_SHARE = 0.1
VOTES = 7


def grideye(program, *arguments):
    subprocess.run([program, *map(str, arguments)], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)


def level(frames):
    """Without the change that all pixels share."""
    return (frames - np.median(frames, axis=(1, 2), keepdims=True)).astype(np.float32)


def dataset(program, folder, frames, names, *more):
    grideye(program, "dataset", SCENE, "--frames", frames, "--format", "npy", *more, "--out", folder)
    parts = [np.load(part, mmap_mode="r") for part in sorted(folder.glob("part-*.npy"))]
    return [np.concatenate([part[name] for part in parts]) for name in names]


def simulated(program, folder, frames):
    """Simulated frames less the same rooms with nobody and less the unit's pattern, and how many people are in view."""
    celsius, truth_c, mask, people = dataset(program, folder / "people", frames, ["celsius", "truth_c", "mask", "people"])
    (empty_c,) = dataset(program, folder / "empty", frames, ["truth_c"], "--vary", "people=0")
    pattern_c = np.median(celsius - truth_c, axis=0)
    low, high = UNCLEAR_PIXELS
    pixels = mask.sum(axis=(2, 3))
    clear = ~((pixels >= low) & (pixels < high)).any(axis=1)
    return level(celsius - empty_c - pattern_c)[clear], people[clear].astype(int)


def session(number):
    """A real session's frames less its median of each pixel, how many people are in view, and whether that was easy to say."""
    with open(ROOT / "recordings/linaige" / SESSIONS[number], newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    celsius = np.array([[float(row[f"pixel{pixel}"]) for pixel in range(64)] for row in rows]).reshape(-1, 8, 8)
    counts, easy = np.array([(int(row["people_number"]), row["confidence"] == "e") for row in rows]).T
    return level(celsius - np.median(celsius, axis=0)), counts, easy.astype(bool)


def batches(sets, random):
    """Batches with all counts equally often, in all eight symmetries and with up to 18 % more or less contrast.

    `sets` are (frames, counts, share); a count's frames come from the sets that have it, by their shares.
    """
    frames = np.concatenate([frames for frames, _, _ in sets])
    weight = np.zeros((len(COUNTS), len(frames)))
    first = 0
    for _, counts, share in sets:
        for count in set(counts):
            weight[count, first : first + len(counts)] = (counts == count) * share / (counts == count).sum()
        first += len(counts)
    ladder = [np.cumsum(row) / row.sum() for row in weight if row.any()]
    known = np.flatnonzero(weight.any(axis=1))
    for _ in range(STEPS):
        drawn = random.integers(len(known), size=BATCH)
        picked = np.array([np.searchsorted(ladder[one], u, side="right") for one, u in zip(drawn, random.random(BATCH))])
        batch = frames[np.minimum(picked, len(frames) - 1)] * random.uniform(0.82, 1.18, (BATCH, 1, 1)).astype(np.float32)
        turned = np.concatenate([symmetries(part)[number] for number, part in enumerate(np.split(batch, 8))])
        yield turned[..., None], known[drawn]


def symmetries(frames):
    turns = [np.rot90(frames, turn, (-2, -1)) for turn in range(4)]
    return turns + [turn[..., ::-1] for turn in turns]


def network():
    return keras.Sequential([
        keras.Input((8, 8, 1)),
        layers.Conv2D(8, 3, padding="same", activation="relu"),
        layers.Conv2D(16, 3, padding="same", activation="relu"),
        layers.MaxPooling2D(2),
        layers.Flatten(),
        layers.Dense(16, activation="relu"),
        layers.Dense(len(COUNTS), activation="softmax"),
    ])


def train(sets, seed):
    keras.utils.set_random_seed(seed)
    counter = network()
    # The mean of the last weights: three seeds differ less.
    rate = keras.optimizers.schedules.CosineDecay(2e-3, STEPS)
    adam = keras.optimizers.Adam(rate, use_ema=True, ema_momentum=0.995)
    counter.compile(adam, "sparse_categorical_crossentropy")
    counter.fit(batches(sets, np.random.default_rng(seed)), steps_per_epoch=STEPS, shuffle=False, verbose=0)
    return counter


def probabilities(counter, frames):
    return counter.predict(frames[..., None], batch_size=4096, verbose=0)


def majority(counted):
    """Of each frame and those before it, `VOTES` in all; the fewer people of a tie."""
    return np.array([np.bincount(counted[max(0, at + 1 - VOTES) : at + 1]).argmax() for at in range(len(counted))])


def recalls(counts, counted):
    return {int(count): 100 * np.mean(counted[counts == count] == count) for count in np.unique(counts)}


def balanced(counts, counted):
    return np.mean(list(recalls(counts, counted).values()))


def row(*cells):
    print("| " + " | ".join(map(str, cells)) + " |", flush=True)


def spread(values):
    return f"{np.mean(values):.1f} ({min(values):.1f} to {max(values):.1f})"


def table(real, ours, seeds):
    """Prints the table; returns the networks that were trained on simulated frames alone."""
    easy = {number: (frames[sure], counts[sure]) for number, (frames, counts, sure) in real.items()}
    kinds = {
        "simulated frames alone": lambda other: [(*ours, 1)],
        "the other real session": lambda other: [(*easy[other], 1)],
        "both": lambda other: [(*ours, 1 - REAL_SHARE), (*easy[other], REAL_SHARE)],
    }
    row("trained on", *(f"session {number}{end}" for number in SESSIONS for end in ("", f", majority of {VOTES}")))
    row(*["---"] * (1 + 2 * len(SESSIONS)))
    row("nothing: always the same answer", *(f"{100 / len(set(real[number][1])):.1f}" for number in SESSIONS for _ in range(2)))
    alone, parts = [], []
    for kind, sets in kinds.items():
        cells = []
        for number, other in zip(SESSIONS, reversed(SESSIONS)):
            if kind != "simulated frames alone":
                counters = [train(sets(other), seed) for seed in seeds]
            else:
                counters = alone = alone or [train(sets(other), seed) for seed in seeds]
            frames, counts, _ = real[number]
            found = [probabilities(counter, frames).argmax(axis=1) for counter in counters]
            cells += [spread([balanced(counts, one) for one in found]), spread([balanced(counts, majority(one)) for one in found])]
            right = [recalls(counts, one) for one in found]
            parts.append([kind, number, *(f"{np.mean([one[count] for one in right]):.0f}" if count in right[0] else "" for count in COUNTS)])
        row(kind, *cells)
    print()
    row("trained on", "session", *("1 person" if count == 1 else f"{count} people" for count in COUNTS))
    row(*["---"] * (2 + len(COUNTS)))
    for part in parts:
        row(*part)
    return alone


def draw_mistakes(path, counter, real, ours, rows=8, near=4):
    """Per session the frames that the network was surest of and wrong; then the nearest simulated ones with the label's
    count, then those with the network's."""
    tile, gap = 72, 8
    frames, counts = ours
    flat = frames.reshape(len(frames), 64)
    columns = 1 + 2 * near
    image = Image.new("L", (columns * (tile + gap) + gap, len(SESSIONS) * rows * (tile + 3 * gap)))
    draw = ImageDraw.Draw(image)
    for place, number in enumerate(SESSIONS):
        seen, labels, _ = real[number]
        chance = probabilities(counter, seen)
        counted = chance.argmax(axis=1)
        sure = np.where(counted != labels, chance.max(axis=1), 0)
        for line in range(rows):
            worst = int(sure.argmax())
            # Not the same moment again.
            sure[max(0, worst - 20) : worst + 21] = 0
            shown = [(seen[worst], f"{labels[worst]}, read as {counted[worst]}")]
            turned = np.stack(symmetries(seen[worst])).reshape(8, 1, 64)
            for count in (labels[worst], counted[worst]):
                members = np.flatnonzero(counts == count)
                distance = np.stack([((flat[members] - turn) ** 2).sum(axis=1) for turn in turned])
                nearest = np.argsort(distance.min(axis=0))[:near]
                # Turned as the real frame is: each turn's inverse is among the eight.
                for member in nearest:
                    turns = symmetries(frames[members[member]])
                    best = min(turns, key=lambda turn: ((turn - seen[worst]) ** 2).sum())
                    shown.append((best, f"sim. {count}"))
            top = (place * rows + line) * (tile + 3 * gap)
            for column, (frame, text) in enumerate(shown):
                gray = Image.fromarray(np.uint8(np.clip((frame + 0.5) / 3 * 255, 0, 255))).resize((tile, tile), 0)
                image.paste(gray, (gap + column * (tile + gap), top + 2 * gap))
                draw.text((gap + column * (tile + gap), top), text, fill=255)
    image.save(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program", type=Path, help="grideye")
    parser.add_argument("--out", type=Path, help="folder for the simulated frames; default: they are not kept")
    parser.add_argument("--frames", type=int, default=36000, help="simulated frames; default %(default)s")
    parser.add_argument("--seeds", type=int, default=3, help="networks per cell of the table; default %(default)s")
    parser.add_argument("--mistakes", type=Path, metavar="FILE.png", help="draw the worst mistakes beside the nearest simulated frames")
    given = parser.parse_args()
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as temporary:
        ours = simulated(given.program.resolve(), (given.out or Path(temporary)).resolve(), given.frames)
    real = {number: session(number) for number in SESSIONS}
    print(f"{network().count_params()} weights, {STEPS} steps of {BATCH} frames, {given.seeds} seeds; balanced accuracy in %")
    print(f"simulated frames with 0 to 3 people in view: {np.bincount(ours[1]).tolist()}\n")
    alone = table(real, ours, range(1, given.seeds + 1))
    if given.mistakes:
        draw_mistakes(given.mistakes, alone[0], real, ours)
    print(f"\n{time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()
