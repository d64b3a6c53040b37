"""Recordings of open-thermopile-dataset as this project's recordings, trajectories and scenes."""

import csv
import json
import resource
import subprocess
from datetime import datetime, timezone
from pathlib import Path

import numpy as np

# The data set's sensor hangs 2.5 m above the floor and looks straight down at x = 0, y = 2.5 m. Here it hangs in a room
# so large that the walker never meets a wall.
AXIS_M = (0.0, 2.5)
SENSOR_MM = (5000, 3000)
ROOM_MM = np.array([10000, 8000])
WALL_MM = 400
# The frames lag the tracker by 0.2 to 0.3 s.
LAG_S = 0.25
# People here walk at most 0.9 m/s (99 %); the tracker's wrong rows are meters off.
SPEED_MAX_M_PER_S = 3.0
NEAR_M = 1.5
# Nobody is in view while the tracker is farther away than this.
EMPTY_M = 2.6
EMPTY_ROWS_MIN = 200
HEADER = "device,sensor,boot,seq,t_boot_ns,t_utc_ns,clock,t_arrival_ns,missing,thermistor"


class Walk:
    """One file of the data set: frames, and where the person was."""

    def __init__(self, path, name):
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.name, self.clothing = name, "coat" if "coat" in name else "indoor"
        self.celsius = np.array([[float(row[f"p{pixel}"]) for pixel in range(64)] for row in rows])
        self.thermistor_c = np.round(16 * np.array([float(row["thermistor"]) for row in rows])) / 16
        # Local times without a zone. Only differences matter, so they are taken for UTC.
        stamps = [datetime.fromisoformat(row["time"]).replace(tzinfo=timezone.utc) for row in rows]
        self.time_s = np.array([stamp.timestamp() for stamp in stamps])
        place = np.array([[float(row[axis] or "nan") for axis in "xy"] for row in rows]) - AXIS_M
        kept = steady(self.time_s, place)
        self.tracked_s = self.time_s[kept] + LAG_S
        self.tracked_mm = SENSOR_MM + 1000 * place[kept] * (1, -1)
        # Where the person is when each row is recorded, in meters from the axis.
        self.place_m = np.stack([np.interp(self.time_s, self.tracked_s, axis) for axis in place[kept].T], axis=1)
        after = np.clip(np.searchsorted(self.tracked_s, self.time_s), 1, len(self.tracked_s) - 1)
        self.is_tracked = np.diff(self.tracked_s)[after - 1] < 1
        self.distance_m = np.where(self.is_tracked, np.hypot(*self.place_m.T), np.nan)
        self.near = self.distance_m < NEAR_M
        empty = np.flatnonzero(self.distance_m > EMPTY_M)
        self.empty = empty if len(empty) >= EMPTY_ROWS_MIN else empty[:0]
        # The room's temperature, as the sensor measures it.
        background = np.median(self.celsius[self.empty], axis=0) if len(self.empty) else np.full(64, np.median(self.celsius))
        self.ambient_c = float(np.median(background))
        self.background_c = background - self.ambient_c

    def stretches(self, length=600, near=180):
        """Consecutive stretches with the person near in enough rows."""
        starts = range(0, len(self.time_s) - length + 1, length)
        return [slice(start, start + length) for start in starts if self.near[start : start + length].sum() >= near]

    def with_gap(self, rows):
        """The frames of these rows, without the person in the fifth of them with most of the person in view."""
        frames, fifth = self.celsius[rows].copy(), (rows.stop - rows.start) // 5
        first = int(np.argmax(np.convolve(self.near[rows], np.ones(fifth), "valid")))
        gap, empty = slice(first, first + fifth), self.celsius[np.resize(self.empty, fifth)]
        level = np.median(frames[gap], axis=1) - np.median(empty, axis=1)
        frames[gap] = empty + np.round(4 * level[:, None]) / 4
        return frames


def steady(time_s, place):
    """The rows with a new place, which a person can have reached from the last kept one."""
    kept = []
    # A tracker that lost its target repeats a place to the micrometer; one that sees it jitters by far more.
    is_new = np.isfinite(place).all(axis=1) & np.append(True, np.abs(np.diff(place, axis=0)).max(axis=1) > 1e-6)
    for row in np.flatnonzero(is_new):
        if kept:
            step_s, step_m = time_s[row] - time_s[kept[-1]], np.hypot(*(place[row] - place[kept[-1]]))
            # A second later the place is believed again: the kept one may have been wrong.
            if step_s <= 0 or (step_s < 1 and step_m > SPEED_MAX_M_PER_S * step_s):
                continue
        kept.append(row)
    return np.array(kept)


def read(paths):
    files = [file for path in paths for file in (sorted(path.rglob("*.csv")) if path.is_dir() else [path])]
    stems = [file.stem for file in files]
    return [Walk(file, file.stem if stems.count(file.stem) == 1 else f"{file.parent.name}-{file.stem}") for file in files]


def write_recording(path, walk, rows, celsius=None):
    """Leaves out the rows for which the tracker does not say where the person is."""
    times, lines = walk.time_s[rows], [HEADER + "".join(f",pixel{pixel}" for pixel in range(1, 65))]
    frames = walk.celsius[rows] if celsius is None else celsius
    for seq in np.flatnonzero(walk.is_tracked[rows]):
        at, thermistor, frame = times[seq], walk.thermistor_c[rows][seq], frames[seq]
        boot_ns, utc_ns = round(1e3 * (at - times[0])) * 10**6, round(1e3 * at) * 10**6
        pixels = ",".join(f"{value:g}" for value in frame)
        lines.append(f"{walk.name},ceiling,walk,{seq},{boot_ns},{utc_ns},synced,,,{thermistor:g},{pixels}")
    path.write_text("\n".join(lines) + "\n")
    return path


def as_tracked(t, x, y):
    return t, x, y


def write_scene(path, walk, rows, change=as_tracked, person=None, second=False, sensor_mm=SENSOR_MM, tilt_deg=(0, 0), end=""):
    """Writes a scene and its trajectory; `change` maps seconds, x and y in mm, or is None for nobody. Returns second 0."""
    times = walk.time_s[rows]
    text = f'model = "physical"\ncollisions = "ignore"\n[room]\nsize_mm = [{ROOM_MM[0]}, {ROOM_MM[1]}, 2500]\n'
    text += f"ambient_c = {walk.ambient_c}\n"
    if change:
        at, *place = change(walk.tracked_s, *walk.tracked_mm.T)
        place = np.clip(np.stack(place, axis=1), WALL_MM, ROOM_MM - WALL_MM)
        inside = np.flatnonzero((at >= times[0]) & (at <= times[-1]))
        lines = ["utc,x_mm,y_mm", *(f"{at[row]:.3f},{place[row, 0]:.0f},{place[row, 1]:.0f}" for row in inside)]
        path.with_suffix(".csv").write_text("\n".join(lines) + "\n")
        keys = {"clothing": walk.clothing} | (person or {})
        keys = ", ".join(f"{key} = {json.dumps(value)}" for key, value in keys.items())
        text += f'[[agent]]\nname = "one"\nperson = {{ {keys} }}\ntrajectory = "{path.stem}.csv"\n'
    if second:
        text += f'[[agent]]\nname = "two"\nposition_mm = [{SENSOR_MM[0] + 400}, {SENSOR_MM[1] + 300}, 0]\nperson = {{}}\n'
    text += f'[[sensor]]\nname = "ceiling"\npreset = "grid-eye"\nposition_mm = [{sensor_mm[0]}, {sensor_mm[1]}, 2500]\n'
    text += f"elevation_deg = 90\nazimuth_deg = 0\ntilt_deg = [{tilt_deg[0]}, {tilt_deg[1]}]\n"
    path.write_text(text + end)
    return at[inside[0]] if change else times[0]


class Program:
    """The command line, and a folder for what it reads and writes."""

    def __init__(self, program, folder):
        self.program, self.folder = Path(program).absolute(), folder

    def run(self, *arguments, codes=(0,)):
        """Exit code and CPU seconds."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        ended = subprocess.run([self.program, *arguments], capture_output=True, text=True, check=False)
        if ended.returncode not in codes:
            raise SystemExit(f"{' '.join(map(str, arguments))}\n{ended.stdout}{ended.stderr}")
        return ended.returncode, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before

    def simulated(self, walk, start_s=0.0, **claim):
        """The claim's noise-free frames at the walk's rows, °C above the room."""
        scene, out = self.folder / f"{walk.name}.toml", self.folder / f"{walk.name}.npz"
        zero_s = write_scene(scene, walk, slice(None), end="noise_sigma_c = 0\n", **claim)
        self.run("simulate", scene, "--out", out)
        arrays = np.load(out)
        frames, at = arrays["frames"].reshape(-1, 64) - walk.ambient_c, walk.time_s + start_s - zero_s
        return np.stack([np.interp(at, arrays["time_s"], pixel) for pixel in frames.T], axis=1)

    def profile(self, walk):
        recording = write_recording(self.folder / f"{walk.name}-empty.csv", walk, walk.empty)
        self.run("characterize", recording, "--empty", "yes", "--profile", recording.with_suffix(".toml"))
        return recording.with_suffix(".toml")

    def compared(self, walk, rows, profile, celsius=None, **claim):
        """The exit code of compare for these rows and the claim, and its headline."""
        path = self.folder / f"{walk.name}-{rows.start}.toml"
        write_scene(path, walk, rows, **claim)
        recording = write_recording(path.with_name(path.stem + "-frames.csv"), walk, rows, celsius)
        out, more = path.with_suffix(".json"), ["--profile", profile] if profile else []
        code, _ = self.run("compare", "--scene", path, "--recording", recording, "--json", out, *more, codes=(0, 1, 3))
        return code, json.loads(out.read_text())["headline"]
