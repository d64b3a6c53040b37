"""Scenes: rooms with people, objects and sensors."""

from __future__ import annotations

import os
from typing import Optional, Union

import numpy as np
import numpy.typing as npt

from . import _native


class Scene:
    """A room with people, objects and sensors, from a scene file (TOML).

    Make one with `Scene.load` or `Scene.parse`.
    """

    def __init__(self, native: _native.Scene) -> None:
        self._native = native

    @staticmethod
    def load(path: Union[str, os.PathLike[str]]) -> Scene:
        """Reads a scene file, and the files beside it that it names.

        Raises:
            InputError: what is wrong, with file, line and hint.
        """
        return Scene(_native.Scene.load(path))

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
        return Scene(_native.Scene.parse(text, name, folder))

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

    def simulate(
        self,
        frames: Optional[int] = None,
        seed: int = 1,
        *,
        sensor: Optional[str] = None,
    ) -> npt.NDArray[np.float32]:
        """What a sensor measures, with its noise, as `grideye simulate`.

        Args:
            frames: how many; by default 10 of a scene in which nothing moves, otherwise until its end.
            seed: of the noise, from 0. Equal seeds give equal bytes on every machine.
            sensor: its name; may be left out if there is one.

        Returns:
            float32 of shape (frames, rows, columns), (frames, 8, 8) for a Grid-EYE, in degrees Celsius. The first is at the
            scene's start, the others follow at the sensor's rate.

        Raises:
            InputError: if the scene has several sensors and none is named, or none of this name; if the frames would take more
                than 1 GiB, which are 4 million of a Grid-EYE.
        """
        data, shape = self._native.simulate(frames, seed, sensor)
        return np.frombuffer(data, np.float32).reshape(shape)

    def __repr__(self) -> str:
        return f"Scene({self._native.name!r}, sensors={self.sensors})"
