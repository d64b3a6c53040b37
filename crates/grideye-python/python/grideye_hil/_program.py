"""The verbs that the program `grideye` carries out, which this package installs: the same numbers, because it is the same program."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple, Optional, Union

import numpy as np
import numpy.typing as npt

from ._error import InputError
from ._recording import Recording
from ._scene import Scene, labeled

_Path = Union[str, "os.PathLike[str]"]
_PRESETS = ("counting", "falls")
# Of one part of `frames`, at least: enough that starting the program costs little.
_PART = 256
# As many parts as a dataset may have.
_ENDLESS = 1_000_000


class Calibration(NamedTuple):
    """What `calibrate` found."""

    scene: Scene
    """The scene with the values that were found."""
    found: dict[str, Any]
    """Everything, as `grideye calibrate --json` writes it."""


def characterize(
    recording: Recording,
    *,
    profile: Optional[_Path] = None,
    empty: Optional[str] = None,
    scene: Optional[Scene] = None,
    sensor: Optional[str] = None,
    report: Optional[_Path] = None,
) -> dict[str, Any]:
    """A sensor's noise, pattern and drift, as `grideye characterize --json` writes it.

    Args:
        recording: half a minute or more without movement.
        profile: a profile to write, for `compare` and `emulate`.
        empty: when nobody is in view: "yes", "no", "auto" or "FROM..TO"; by default it is detected.
        scene: of the empty room, whose warm things are taken off the background.
        sensor: the scene's; may be left out if there is one.
        report: a page to write.

    Raises:
        InputError: what is wrong, that the recording is too short, or why the profile was not written.
    """
    with _Folder() as folder:
        options = {"profile": profile, "empty": empty, "sensor": sensor, "report": report, "json": "-"}
        options["scene"] = None if scene is None else folder.scene(scene)
        # Without a profile, what is not clear of the room is part of the answer.
        return _json("characterize", folder.recording(recording), is_whole=profile is not None, **options)


def calibrate(
    scene: Scene,
    recording: Recording,
    *,
    sensor: Optional[str] = None,
    profile: Optional[_Path] = None,
    write_profile: Optional[_Path] = None,
    half: Optional[str] = None,
    frames: int = 200,
    starts: int = 8,
    seed: int = 1,
) -> Calibration:
    """Fits what is uncertain in a scene to a recording, as `grideye calibrate`.

    Args:
        scene: with `[[uncertain]]` tables that say what to fit.
        recording: what was seen.
        sensor: the scene's; may be left out if there is one.
        profile: a file that describes this one sensor, from `characterize`.
        write_profile: a profile to write, with what the calibrated scene leaves over.
        half: "first" or "second" half of the recording only.
        frames: how many frames are used, 10 to 1000.
        starts: how many starting points, 1 to 100.
        seed: of the random starting points; another one shows whether the fit depends on them.

    Raises:
        InputError: what is wrong, with its hint.
    """
    with _Folder() as folder:
        out = Path(folder.path, "fitted.toml")
        options: dict[str, Any] = {"sensor": sensor, "profile": profile, "write-profile": write_profile}
        options.update(half=half, frames=frames, starts=starts, seed=seed, out=out, json="-")
        options.update(scene=folder.scene(scene), recording=folder.recording(recording))
        found = _json("calibrate", **options)
        beside = scene._folder if scene._path is None else os.path.dirname(scene._path)
        fitted = Scene.parse(out.read_text("utf-8"), f"fitted {scene._native.name}", beside)
        return Calibration(fitted, found)


def coverage(
    scene: Scene,
    *,
    candidates: Optional[str] = None,
    best: Optional[int] = None,
    keep: bool = False,
    sensors: Optional[Sequence[str]] = None,
    out: Optional[_Path] = None,
) -> dict[str, Any]:
    """Where sensors see a person, or the best places for them, as `grideye coverage --json` writes it.

    Args:
        scene: the room.
        candidates: places to try: "all", "ceiling", "walls" or "corners".
        best: how many to pick from them, 2 by default.
        keep: whether the scene's sensors stay.
        sensors: which of the scene's are rated; by default all.
        out: a map to write, .svg or .csv.

    Raises:
        InputError: what is wrong, with its hint.
    """
    with _Folder() as folder:
        named = None if sensors is None else ",".join(sensors)
        options: dict[str, Any] = {"candidates": candidates, "best": best, "keep": keep, "sensors": named}
        return _json("coverage", folder.scene(scene), out=out, json=True, **options)


def orient(recording: Recording) -> dict[str, Any]:
    """How a sensor is mounted, from a recording in which a hand is held at the left and then at the top of its view.

    Returns:
        As `grideye orient --json` prints it.

    Raises:
        InputError: what is wrong, with its hint.
    """
    with _Folder() as folder:
        return _json("orient", recording=folder.recording(recording), json=True)


def dataset(
    source: Union[str, Scene],
    out: _Path,
    *,
    frames: int,
    vary: Sequence[str] = (),
    clip: int = 1,
    seed: int = 1,
    sensor: Optional[str] = None,
    split: Optional[str] = None,
    formats: Sequence[str] = ("parquet", "npz"),
    in_view: Optional[Sequence[float]] = None,
    threads: Optional[int] = None,
) -> dict[str, Any]:
    """Writes a folder of labeled frames, as `grideye dataset`; `datasets.load_dataset` reads it. Goes on where it was interrupted.

    Args:
        source: a scene, or a built-in one: "counting" or "falls".
        out: the folder.
        frames: how many in all.
        vary: what varies besides the scene's `[[vary]]` tables, as "room.ambient_c=18..26".
        clip: consecutive frames of one situation.
        seed: of all that varies and of the noise. Equal seeds give equal bytes on every machine.
        sensor: the scene's; may be left out if there is one.
        split: as "train=0.8,test=0.2"; no situation is in two splits.
        formats: of "parquet", "npz" and "npy".
        in_view: weights of 0, 1, 2 and more people in view; by default as drawn.
        threads: by default one per core.

    Raises:
        InputError: what is wrong, with its hint.
    """
    with _Folder() as folder:
        varied = _varied(folder, source, vary, in_view)
        options: dict[str, Any] = {"frames": frames, "clip": clip, "seed": seed, "sensor": sensor, "split": split, "threads": threads}
        return _json("dataset", *varied, format=",".join(formats), out=out, json=True, **options)


def frames(
    source: Union[str, Scene],
    *,
    batch: int = 256,
    frames: Optional[int] = None,
    vary: Sequence[str] = (),
    clip: int = 1,
    seed: int = 1,
    sensor: Optional[str] = None,
    in_view: Optional[Sequence[float]] = None,
    labels: bool = False,
) -> Iterator[tuple[npt.NDArray[np.float32], npt.NDArray[Any]]]:
    """Labeled frames in batches, made on all cores while the one before is used. The frames of `dataset` with this seed.

    Args:
        source: a scene, or a built-in one: "counting" or "falls".
        batch: frames of a batch; the last one may have fewer.
        frames: how many in all; by default they do not end.
        vary, clip, seed, sensor, in_view: as of `dataset`.
        labels: all labels, instead of how many people are in view.

    Yields:
        Pixels, float32 (batch, 8, 8), degrees Celsius less the unit's view of the empty room and the frame's median, as a network
        wants them; and people in view, int64 (batch,), or with `labels` records by name
        (`people`, `present`, `position_m`, `box_px`, `mask` and the rest of crates/grideye/DATASET.md).

    Raises:
        InputError: what is wrong, with its hint.
    """
    part = -(-max(_PART, batch) // clip) * clip
    whole = _ENDLESS * part if frames is None else frames
    parts = -(-whole // part)
    with _Folder() as folder, ThreadPoolExecutor(os.cpu_count()) as pool:
        varied = _varied(folder, source, vary, in_view)
        options: dict[str, Any] = {"frames": whole, "clip": clip, "seed": seed, "sensor": sensor, "frames-per-part": part}
        options.update(threads=1, format="npy", json=True)

        def made(number: int) -> npt.NDArray[Any]:
            out = Path(folder.path, f"part-{number}")
            _json("dataset", *varied, shard=f"{number + 1}/{parts}", out=out, **options)
            (file,) = out.glob("*.npy")
            records = labeled(np.load(file))
            shutil.rmtree(out)
            return records

        ahead: deque[Future[npt.NDArray[Any]]] = deque()
        left: Optional[npt.NDArray[Any]] = None
        numbers = iter(range(parts))
        try:
            while True:
                for number in numbers:
                    ahead.append(pool.submit(made, number))
                    if len(ahead) > (os.cpu_count() or 1):
                        break
                if ahead:
                    records = ahead.popleft().result()
                    left = records if left is None else np.concatenate([left, records])
                last = not ahead and (left is None or len(left) <= batch)
                while left is not None and (len(left) >= batch or (not ahead and len(left) > 0)):
                    taken, left = left[:batch], left[batch:]
                    excess_c = taken["excess_c"] - np.median(taken["excess_c"], axis=(1, 2), keepdims=True)
                    yield excess_c, taken if labels else taken["people"].astype(np.int64)
                if last:
                    return
        finally:
            for future in ahead:
                future.cancel()


class _Folder:
    """Files of what is in memory, for as long as the program runs."""

    def __enter__(self) -> _Folder:
        self._kept = tempfile.TemporaryDirectory(prefix="grideye-")
        self.path = self._kept.name
        return self

    def __exit__(self, *_: object) -> None:
        self._kept.cleanup()

    def recording(self, recording: Recording) -> Path:
        stem = Path(os.fspath(recording._native.path())).stem
        path = Path(self.path, f"{stem}.csv")
        recording.to_csv(path)
        return path

    def scene(self, scene: Scene) -> Path:
        """The scene's file, with links to what it names."""
        if scene._path is not None:
            return Path(scene._path)
        path = Path(self.path, "scene.toml")
        path.write_text(scene._text, "utf-8")
        for file in scene._native.files():
            named = Path(self.path, os.path.relpath(file, scene._folder))
            if named.resolve().is_relative_to(Path(self.path).resolve()) and Path(file).exists():
                named.parent.mkdir(parents=True, exist_ok=True)
                if not named.exists():
                    named.symlink_to(Path(file).resolve())
        return path


def _varied(
    folder: _Folder, source: Union[str, Scene], vary: Sequence[str], in_view: Optional[Sequence[float]]
) -> list[str]:
    if isinstance(source, Scene):
        words = [str(folder.scene(source))]
    elif source in _PRESETS:
        words = ["--preset", source]
    else:
        raise InputError(f"no preset is called {source!r}", f"a Scene, or one of {', '.join(_PRESETS)}")
    for key in vary:
        words += ["--vary", key]
    if in_view is not None:
        words += ["--in-view", ",".join(str(weight) for weight in in_view)]
    return words


def _json(verb: str, *arguments: Union[str, Path], is_whole: bool = False, **options: Any) -> dict[str, Any]:
    """What the program answers; with `is_whole`, only if it could do all. What it remarks goes to standard error, as its progress
    does on a terminal.
    """
    words = [_program(), verb, *map(str, arguments)]
    for name, value in options.items():
        if value is True:
            words.append(f"--{name}")
        elif value is not None and value is not False:
            words += [f"--{name}", os.fspath(value) if isinstance(value, os.PathLike) else str(value)]
    is_watched = sys.stderr is not None and sys.stderr.isatty()
    ended = subprocess.run(words, stdout=subprocess.PIPE, stderr=None if is_watched else subprocess.PIPE, text=True)
    told = ended.stderr or f"grideye {verb} ended with {ended.returncode}"
    if ended.returncode < 0:
        raise KeyboardInterrupt if ended.returncode == -2 else RuntimeError(told)
    if ended.stdout.strip() and not (is_whole and ended.returncode):
        sys.stderr.write(ended.stderr or "")
        return dict(json.loads(ended.stdout))
    problem, _, hint = told.rpartition("error: ")[2].strip().partition("\nhint: ")
    raise InputError(problem, hint or None)


def _program() -> str:
    beside = Path(sysconfig.get_path("scripts"), "grideye")
    found = str(beside) if beside.exists() else shutil.which("grideye")
    if found is None:
        raise InputError("the program grideye is not installed", "the wheel has it: see the README of this package")
    return found
