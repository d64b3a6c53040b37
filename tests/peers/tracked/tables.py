"""Prints tables of the recordings of open-thermopile-dataset beside simulated ones. README.md explains them."""

import argparse
import json
import tempfile
from pathlib import Path

import images
import numpy as np
import walks

UNKNOWNS = {
    "agent.one.person.height_mm": "bounds = [1400, 2000]",
    "agent.one.person.clothing": "bounds = [0.1, 3.5]",
    "agent.one.person.build": "bounds = [0.7, 1.6]",
    "sensor.ceiling.position_mm.x": "bounds = [4600, 5400]\nsd = 100",
    "sensor.ceiling.position_mm.y": "bounds = [2600, 3400]\nsd = 100",
    "sensor.ceiling.tilt_deg.x": "bounds = [-10, 10]\nsd = 3",
    "sensor.ceiling.tilt_deg.y": "bounds = [-10, 10]\nsd = 3",
    "recording.start_s": "bounds = [-0.4, 0.4]",
}
CLO = {"indoor": 1.0, "coat": 2.0}


def aside(mm):
    return lambda t, x, y: (t, x + mm, y)


X, Y = walks.SENSOR_MM
GONE = "recording without the person for a fifth"
CLAIMS = {
    "right": {},
    "mirrored in x": {"change": lambda t, x, y: (t, 2 * X - x, y)},
    "mirrored in y": {"change": lambda t, x, y: (t, x, 2 * Y - y)},
    "turned by 90°": {"change": lambda t, x, y: (t, X + y - Y, Y - x + X)},
    "1 m in x": {"change": aside(1000)},
    "1 m in y": {"change": lambda t, x, y: (t, x, y + 1000)},
    "nobody": {"change": None},
    "walk of 20 s earlier": {"change": lambda t, x, y: (t + 20, x, y)},
    "one person more": {"second": True},
    "1.5 s late (0.5 s is aligned)": {"change": lambda t, x, y: (t + 1.5, x, y)},
    "0.5 m aside": {"change": aside(500)},
    "half the size": {"person": {"height_mm": 850}},
    GONE: {},
}
SLIGHT = {
    **{f"{mm / 1000} m aside": {"change": aside(mm)} for mm in (200, 300, 400)},
    "20 cm shorter": {"person": {"height_mm": 1500}},
    **{f"clothing of {clo} clo": {"person": {"clothing": clo}} for clo in (0, 0.25, 0.5, 1, 2, 3, 4)},
}


def row(*cells):
    print("| " + " | ".join(str(cell) for cell in cells) + " |", flush=True)


def head(title, *cells):
    print(f"\n{title}\n")
    row(*cells)
    print("|" + "---|" * len(cells))


def people(program, recordings):
    head("People by distance, real / simulated, nothing fitted: medians, and the real peak's 10th and 90th percentile",
         "recording", "from the axis, m", "rows", "peak, °C", "sum, °C", "width, pixels", "outward, pixels")
    for walk in recordings:
        real = images.looks(walk.celsius - walk.background_c, walk, 3.7, (4.3, 4.2))
        ours = images.looks(program.simulated(walk), walk, 3.5, (4.25, 4.25))
        for low in (0, 0.3, 0.6, 0.9, 1.2):
            rows = (walk.distance_m >= low) & (walk.distance_m < low + 0.3)
            pairs = zip(*(np.nanmedian(looks[rows], axis=0) for looks in (real, ours)))
            cells = [f"{a:{form}} / {b:{form}}" for (a, b), form in zip(pairs, (".2f", ".1f", ".2f", "+.2f"))]
            least, most = np.percentile(real[rows, 0], [10, 90])
            row(walk.name, f"{low:.1f} to {low + 0.3:.1f}", rows.sum(), f"{cells[0]} ({least:.2f} to {most:.2f})", *cells[1:])


def shares(program, recordings):
    """How people differ from their models, beyond noise, as a share of what the pixels show that show 0.5 °C of them."""
    head("Difference from the simulated frames beyond noise, as a share of what they show", "recording",
         "one contrast for all", "contrast and place of each frame")
    for walk in recordings:
        film, real = program.simulated(walk), walk.celsius - walk.background_c
        far = film < 0.1
        noise_c = np.std(np.diff(real, axis=0)[far[1:] & far[:-1]]) / np.sqrt(2)
        rows = np.flatnonzero((film.max(axis=1) > 1) & (far.sum(axis=1) > 20))
        real = np.stack([real[row] - np.median(real[row][far[row]]) for row in rows])
        film = film[rows]
        near, times = film > 0.5, (real * film).sum() / (film**2).sum()
        # To first order, a place is off by the image's slopes.
        slopes = [np.gradient(film.reshape(-1, 8, 8), axis=axis).reshape(film.shape) for axis in (1, 2)]
        fitted = []
        for frame, *parts in zip(real, film, *slopes):
            parts = np.stack(parts, axis=1)
            fitted.append(parts @ np.linalg.lstsq(parts, frame, rcond=None)[0])
        shown = (times * film[near]) ** 2
        left = [(real - explained)[near] ** 2 for explained in (times * film, np.stack(fitted))]
        row(walk.name, *(f"{np.sqrt((squares.mean() - noise_c**2) / shown.mean()):.2f}" for squares in left))


def calibrated(program, walk, rows, part):
    """The claim with the values that calibrate finds on these rows."""
    path, out = (program.folder / f"{walk.name}-{part}{end}" for end in (".toml", ".json"))
    first = {"height_mm": 1700, "clothing": CLO[walk.clothing], "build": 1.0}
    fits = "".join(f'[[uncertain]]\nkey = "{key}"\n{law}\n' for key, law in UNKNOWNS.items())
    walks.write_scene(path, walk, rows, person=first, end=fits)
    recording = walks.write_recording(path.with_name(path.stem + "-frames.csv"), walk, rows)
    # Without a profile, because the level drifts farther than a profile of the empty rows allows.
    _, cpu_s = program.run("calibrate", "--scene", path, "--recording", recording, "--frames", "200", "--json", out)
    found = {fit["key"]: fit for fit in json.loads(out.read_text())["found"]}
    row(walk.name, part, f"{cpu_s:.1f}", *(f"{fit['value']:.6g} ± {fit['half_width_95']:.2g}" for fit in found.values()))
    value = {key: fit["value"] for key, fit in found.items()}
    sensor_mm, tilt_deg = ([value[f"sensor.ceiling.{key}.{axis}"] for axis in "xy"] for key in ("position_mm", "tilt_deg"))
    person = {key: value[f"agent.one.person.{key}"] for key in first}
    return {"person": person, "sensor_mm": sensor_mm, "tilt_deg": tilt_deg, "start_s": value["recording.start_s"]}


def scores(program, recordings):
    head("Calibrated: value ± half the 95 % interval", "recording", "on", "CPU s", *(key.split(".", 1)[1] for key in UNKNOWNS))
    half = {walk.name: len(walk.time_s) // 2 for walk in recordings}
    own = {walk.name: calibrated(program, walk, slice(0, half[walk.name]), "first-half") for walk in recordings}
    whole = {walk.name: calibrated(program, walk, slice(None), "all") for walk in recordings}
    head("Likeness, medians over the rows with the person within 1.5 m of the axis",
         "recording", "simulated frames", "rows", "C, 64 pixels", "C within 3 pixels", "RMSE within 2 pixels, °C")
    for walk in recordings:
        distance, _ = images.distances(walk)
        plain = program.simulated(walk)
        films = {"nothing fitted": (plain, 0), "nothing fitted, second half": (plain, half[walk.name])}
        for other in recordings:
            if other is not walk:
                fitted = whole[other.name]
                films[f"calibrated on {other.name}"] = program.simulated(walk, **fitted), 0
                films[f"sensor and delay alone calibrated on {other.name}"] = program.simulated(walk, **fitted | {"person": None}), 0
        films["calibrated on the first half, second half"] = program.simulated(walk, **own[walk.name]), half[walk.name]
        for what, (film, first) in films.items():
            show(walk, what, walk.celsius - walk.background_c, film, distance, first)
        if len(walk.empty):
            noise = walk.celsius[np.random.default_rng(1).choice(walk.empty, len(plain))] - walk.background_c
            show(walk, "nothing fitted, against itself with the recording's noise", plain + noise, plain, distance, 0)


def show(walk, what, real, film, distance, first):
    rows = first + np.flatnonzero(walk.near[first:])
    real, film = (images.above_far(frames[rows], distance[rows]) for frames in (real, film))
    found = np.nanmedian(images.likeness(real, film, distance[rows]), axis=0)
    row(walk.name, what, len(rows), *(f"{value:.3f}" for value in found))


def count_verdicts(program, recordings, title, claims, with_profile):
    head(f"{title}: stretches of 600 rows that agree / disagree / cannot tell", "scene", *(walk.name for walk in recordings))
    refused, profiles = [], {walk.name: program.profile(walk) for walk in recordings if with_profile and len(walk.empty)}
    for what, claim in claims.items():
        cells = []
        for walk in recordings:
            said = []
            if not len(walk.empty) and (with_profile or what == GONE):
                cells.append("no empty rows")
                continue
            for rows in walk.stretches():
                celsius = walk.with_gap(rows) if what == GONE else None
                code, headline = program.compared(walk, rows, profiles.get(walk.name), celsius, **claim)
                said.append(code)
                if code and not claim and what != GONE:
                    refused.append(f"- {walk.name}, row {rows.start}: {headline}")
            cells.append(" / ".join(str(said.count(code)) for code in (0, 1, 3)))
        row(what, *cells)
    if refused:
        print("\nRight scenes that do not agree:\n", *refused, sep="\n")


def verdicts(program, recordings):
    count_verdicts(program, recordings, "Verdicts with a profile of the empty rows", CLAIMS, True)
    count_verdicts(program, recordings, "Verdicts without a profile", CLAIMS, False)


def curves(program, recordings):
    head("Contrast by clothing, times that of the right scene", "clo", *(walk.name for walk in recordings))
    right = {walk.name: program.simulated(walk)[walk.near].sum() for walk in recordings}
    for what, claim in SLIGHT.items():
        if "clo" in what:
            row(what, *(f"{program.simulated(walk, **claim)[walk.near].sum() / right[walk.name]:.2f}" for walk in recordings))
    count_verdicts(program, recordings, "Slightly wrong scenes, with a profile", SLIGHT, True)


def main():
    tables = {table.__name__: table for table in (people, shares, scores, verdicts, curves)}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program", help="grideye")
    parser.add_argument("files", type=Path, nargs="+", metavar="FILE", help="files of the data set, or folders with them")
    parser.add_argument("--out", type=Path, help="folder for recordings, trajectories and scenes; default: none are kept")
    parser.add_argument("--tables", default=",".join(tables), help="default: %(default)s")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = given.out or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for name in given.tables.split(","):
            tables[name](walks.Program(given.program, folder), walks.read(given.files))


if __name__ == "__main__":
    main()
