"""Trains the people counter on simulated frames alone, tests it on rooms it never saw, and writes its weights.

README.md explains the choices and has the tables.
"""

import argparse
import tempfile
import time
from pathlib import Path

import integers
import network
import numpy as np
import tell
from frames import COUNTS, SESSIONS, VOTES, balanced, is_far, majority, presence, recalls, row, session, simulated, smoothed, spread, symmetries
from network import read, train
from PIL import Image, ImageDraw

# Of a count's frames, where both kinds have it: a session is three minutes of one room.
REAL_SHARE = 0.1
# Every tenth simulated frame tells how sure the counter may be.
HELD_OUT = 10
VECTORS = 200
# Somebody is there unless the counter is this sure that nobody is.
SOMEBODY = 0.8


def counter(sets, seed, steps=network.STEPS):
    """Trained on all counts equally often; a count's frames come from the sets (frames, counts, share) that have it."""
    frames = np.concatenate([frames for frames, _, _ in sets])
    counts = np.concatenate([counts for _, counts, _ in sets])
    source = np.repeat(np.arange(len(sets)), [len(counts) for _, counts, _ in sets])
    groups = []
    for count in np.unique(counts):
        having = [number for number, (_, counts, _) in enumerate(sets) if count in counts]
        whole = sum(sets[number][2] for number in having)
        groups += [(np.flatnonzero((counts == count) & (source == number)), sets[number][2] / whole) for number in having]
    return train(frames, counts, groups, seed, steps)


def chances(logits):
    powers = np.exp(logits - logits.max(axis=1, keepdims=True))
    return powers / powers.sum(axis=1, keepdims=True)


def table(real, ours, seeds):
    """Prints how well networks count; returns those that were trained on simulated frames alone."""
    easy = {number: (frames[sure], counts[sure]) for number, (frames, counts, sure) in real.items()}
    kinds = {
        "simulated frames alone": lambda other: [(*ours, 1)],
        "the other real session": lambda other: [(*easy[other], 1)],
        "both": lambda other: [(*ours, 1 - REAL_SHARE), (*easy[other], REAL_SHARE)],
    }
    ends = ["", f", majority of {VOTES}", ", far from a change", "; empty called occupied", "; occupied called empty"]
    row("trained on", "session", *(f"single frames{end}" if not end.startswith(";") else end[2:] for end in ends), *(f"of {count}" for count in COUNTS))
    row(*["---"] * (7 + len(COUNTS)))
    alone = [counter(kinds["simulated frames alone"](None), seed) for seed in seeds]
    for kind, sets in kinds.items():
        for number, other in zip(SESSIONS, reversed(SESSIONS)):
            counters = alone if kind == "simulated frames alone" else [counter(sets(other), seed) for seed in seeds]
            frames, counts, _ = real[number]
            found, far = [read(one, frames).argmax(axis=1) for one in counters], is_far(counts)
            wrong = [presence(counts[far], one[far]) for one in found]
            right = [recalls(counts, one) for one in found]
            row(
                kind,
                number,
                spread([balanced(counts, one) for one in found]),
                spread([balanced(counts, majority(one)) for one in found]),
                spread([balanced(counts[far], one[far]) for one in found]),
                *(f"{np.mean(ways):.1f}" for ways in zip(*wrong)),
                *(f"{np.mean([one[count] for one in right]):.0f}" if count in right[0] else "" for count in COUNTS),
            )
    return alone


def write(folder, real, ours, seed, steps):
    """Writes the counter as integers, with vectors to test a reader of them, and says how it does."""
    frames, people = ours
    held = np.arange(len(people)) % HELD_OUT == 0
    layers = counter([(frames[~held], people[~held], 1)], seed, steps)
    layers, temperature = integers.calibrated(layers, read(layers, frames[held]), people[held])
    whole = integers.rounded(layers)
    integers.write_weights(folder / "weights/counter.gec", whole)
    integers.write_vectors(folder / "tests/vectors.csv", whole, integers.inputs(frames[held][:VECTORS]))

    def logits(frames):
        return integers.logits(whole, integers.inputs(frames)) / integers.ONE

    same = np.mean(logits(frames[held]).argmax(axis=1) == read(layers, frames[held]).argmax(axis=1))
    print(f"seed {seed}, temperature {temperature:.2f}, {100 * same:.1f} % of counts as without rounding")
    for name, (seen, counts) in {"held out": (frames[held], people[held]), **{f"session {number}": of[:2] for number, of in real.items()}}.items():
        chance = chances(logits(seen))
        sure, right = chance.max(axis=1), chance.argmax(axis=1) == counts
        bins = [f"{100 * sure[inside].mean():.0f}/{100 * right[inside].mean():.0f}" for inside in (sure < 0.7, (sure >= 0.7) & (sure < 0.95), sure >= 0.95)]
        print(f"{name}: {balanced(counts, chance.argmax(axis=1)):.1f}; said/right below 70 %, to 95 %, above: {', '.join(bins)}")
        if name != "held out":
            far, mean = is_far(counts), smoothed(chance)
            here, there = presence(counts[far], mean[far, 0] < SOMEBODY)
            single, smooth = (balanced(counts[far], of[far].argmax(axis=1)) for of in (chance, mean))
            print(f"  far from a change {single:.1f}, by the mean of {VOTES} frames {smooth:.1f}; nobody from {100 * SOMEBODY:.0f} % on:")
            print(f"  empty called occupied {here:.1f}, occupied called empty {there:.1f}")


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
        chance = chances(read(counter, seen))
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
    parser.add_argument("--like", type=Path, help="a recording of the sensor that shall count")
    parser.add_argument("--vary", action="append", default=[], help="as for grideye dataset: the sensor's height, the room")
    parser.add_argument("--seeds", type=int, default=3, help="networks per cell of the table; 0 for no table; default %(default)s")
    parser.add_argument("--steps", type=int, default=network.STEPS, help="steps of the training of --weights; default %(default)s")
    parser.add_argument("--tell", action="store_true", help="also whether a network tells real frames from simulated ones")
    parser.add_argument("--weights", type=Path, metavar="FOLDER", help="write weights/counter.gec and tests/vectors.csv")
    parser.add_argument("--mistakes", type=Path, metavar="FILE.png", help="draw the worst mistakes beside the nearest simulated frames")
    given = parser.parse_args()
    began = time.monotonic()
    more = ["--like", given.like.resolve()] if given.like else []
    more += [word for vary in given.vary for word in ("--vary", vary)]
    with tempfile.TemporaryDirectory() as temporary:
        ours = simulated(given.program.resolve(), (given.out or Path(temporary)).resolve(), given.frames, *more)
    real, seeds = {number: session(number) for number in SESSIONS}, range(1, given.seeds + 1)
    print(f"{given.steps} steps of {network.BATCH}; clear frames with 0 to 3 people: {np.bincount(ours[1]).tolist()}; {time.monotonic() - began:.0f} s\n")
    if given.weights:
        write(given.weights, real, ours, 1, given.steps)
    alone = table(real, ours, seeds) if seeds else []
    if given.tell:
        tell.table(real, ours, seeds)
    if given.mistakes and alone:
        draw_mistakes(given.mistakes, alone[0], real, ours)
    print(f"\n{time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()
