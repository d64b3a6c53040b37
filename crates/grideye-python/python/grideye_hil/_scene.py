"""Scenes: rooms with people, objects and sensors."""

from __future__ import annotations

import contextlib
import importlib
import io
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Literal, Optional, Union, overload

import numpy as np
import numpy.typing as npt

from . import _native


class Scene:
    """A room with people, objects and sensors, from a scene file (TOML).

    Make one with `Scene.load`, `Scene.parse`, `Scene.from_dict` or `Scene.room`. Jupyter draws it.
    """

    def __init__(self, native: _native.Scene) -> None:
        self._native = native
        self._path: Optional[str] = None
        self._text = ""
        self._folder = "."

    @staticmethod
    def load(path: Union[str, os.PathLike[str]]) -> Scene:
        """Reads a scene file, and the files beside it that it names.

        Raises:
            InputError: what is wrong, with file, line and hint.
        """
        scene = Scene(_native.Scene.load(path))
        scene._path = os.fspath(path)
        return scene

    @staticmethod
    def parse(
        text: str, name: str = "scene.toml", folder: Union[str, os.PathLike[str]] = "."
    ) -> Scene:
        """Reads a scene from its text.

        Args:
            text: the TOML.
            name: what errors call it.
            folder: where the files are that it names.

        Raises:
            InputError: what is wrong, with file, line and hint.
        """
        scene = Scene(_native.Scene.parse(text, name, folder))
        scene._text, scene._folder = text, os.fspath(folder)
        return scene

    @staticmethod
    def from_dict(
        tables: Mapping[str, Any], *, name: str = "scene.toml", folder: Union[str, os.PathLike[str]] = "."
    ) -> Scene:
        """Makes a scene of dictionaries and lists, as `tomllib.load` gives them of a scene file.

        Args:
            tables: "room", "agent", "object", "sensor" and the others that scenes/README.md lists; each of a value's line in
                errors is that of its key here.
            name: what errors call it.
            folder: where the files are that it names.

        Raises:
            InputError: what is wrong, with line and hint.
        """
        text = "".join(f"{json.dumps(key)} = {_toml(value)}\n" for key, value in tables.items())
        return Scene.parse(text, name, folder)

    @staticmethod
    def room(
        size_m: tuple[float, float, float] = (4.0, 6.0, 2.7),
        *,
        ambient_c: float = 22.0,
        people: Sequence[tuple[float, float]] = (),
        objects: Sequence[Mapping[str, Any]] = (),
        sensors: Optional[Sequence[Mapping[str, Any]]] = None,
    ) -> Scene:
        """Makes a scene of one room.

        Args:
            size_m: width, depth and height, meters.
            ambient_c: the temperature of walls and air, degrees Celsius.
            people: where they stand, meters from the corner. They are called person-1, person-2 and so on.
            objects: tables as in a scene file's `[[object]]`.
            sensors: tables as in its `[[sensor]]`; by default a Grid-EYE in the middle of the ceiling, called ceiling.

        Raises:
            InputError: what is wrong, with its hint.
        """
        width, depth, height = (1000 * side for side in size_m)
        ceiling = {
            "name": "ceiling",
            "preset": "grid-eye",
            "position_mm": [width / 2, depth / 2, height],
            "elevation_deg": 90,
            "azimuth_deg": -90,
        }
        agents = [
            {"name": f"person-{number}", "person": {}, "position_mm": [1000 * x, 1000 * y, 0]}
            for number, (x, y) in enumerate(people, 1)
        ]
        tables = {
            "room": {"size_mm": [width, depth, height], "ambient_c": ambient_c},
            "agent": agents,
            "object": list(objects),
            "sensor": [ceiling] if sensors is None else list(sensors),
        }
        return Scene.from_dict({key: table for key, table in tables.items() if table}, name="room")

    @property
    def sensors(self) -> list[str]:
        """The names of its sensors."""
        return self._native.sensors()

    @property
    def warnings(self) -> list[str]:
        """What to check in it, for example an object outside the room."""
        return self._native.warnings()

    @property
    def duration(self) -> float:
        """Seconds until everything has moved and changed; 0 if nothing does."""
        return self._native.duration_s()

    @overload
    def simulate(
        self, frames: Optional[int] = ..., seed: int = ..., *, sensor: Optional[str] = ..., labels: Literal[False] = ...
    ) -> npt.NDArray[np.float32]: ...

    @overload
    def simulate(
        self, frames: Optional[int] = ..., seed: int = ..., *, sensor: Optional[str] = ..., labels: Literal[True]
    ) -> tuple[npt.NDArray[np.float32], npt.NDArray[Any]]: ...

    def simulate(
        self,
        frames: Optional[int] = None,
        seed: int = 1,
        *,
        sensor: Optional[str] = None,
        labels: bool = False,
    ) -> Union[npt.NDArray[np.float32], tuple[npt.NDArray[np.float32], npt.NDArray[Any]]]:
        """What a sensor measures, with its noise, as `grideye simulate`. A long call shows its progress if tqdm is installed.

        Args:
            frames: how many; by default 10 of a scene in which nothing moves, otherwise until its end.
            seed: of the noise, from 0. Equal seeds give equal bytes on every machine.
            sensor: its name; may be left out if there is one.
            labels: whether to say what each frame shows.

        Returns:
            float32 of shape (frames, rows, columns), (frames, 8, 8) for a Grid-EYE, in degrees Celsius. The first is at the
            scene's start, the others follow at the sensor's rate. With
            `labels` also one record per frame, by name: `people` in view, and of each agent, in the scene's order, `present`,
            `position_m`, `box_px`, `mask` (its share of each pixel) and the rest of crates/grideye/DATASET.md.

        Raises:
            InputError: if the scene has several sensors and none is named, or none of this name; if the frames would take more
                than 1 GiB, which are 4 million of a Grid-EYE.
        """
        with _progress(frames) as show:
            if labels:
                records = labeled(np.load(io.BytesIO(self._native.labeled(frames, seed, sensor, show))))
                return records["celsius"], records
            data, shape = self._native.simulate(frames, seed, sensor, show)
            return np.frombuffer(data, np.float32).reshape(shape)

    def _repr_svg_(self) -> str:
        return self._native.svg(0.0)

    def __repr__(self) -> str:
        return f"Scene({self._native.name!r}, sensors={self.sensors})"


@contextlib.contextmanager
def _progress(frames: Optional[int]) -> Iterator[Optional[Callable[[int], None]]]:
    """A bar of tqdm, if that is installed and the call takes more than a second."""
    try:
        tqdm: Any = importlib.import_module("tqdm.auto").tqdm
    except ImportError:
        yield None
        return
    with tqdm(total=frames, unit=" frames", delay=1, leave=False) as bar:
        yield lambda done: bar.update(done - bar.n)


def labeled(records: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The records without the title that tells the files of a data set apart: numpy joins only equal ones."""
    of_all: Any = records.dtype.fields
    names = records.dtype.names
    formats, offsets = zip(*(of_all[name][:2] for name in names or ()))
    plain = {"names": names, "formats": formats, "offsets": offsets, "itemsize": records.dtype.itemsize}
    return records.view(np.dtype(plain))  # type: ignore[call-overload]


def _toml(value: Any) -> str:
    """In one line: TOML takes JSON's numbers, texts and lists as they are."""
    if isinstance(value, Mapping):
        inside = ", ".join(f"{json.dumps(str(key))} = {_toml(one)}" for key, one in value.items())
        return f"{{{inside}}}"
    if isinstance(value, (np.ndarray, np.generic)):
        return _toml(value.tolist())
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, float):
        return repr(value)
    return json.dumps(os.fspath(value) if isinstance(value, os.PathLike) else value)
