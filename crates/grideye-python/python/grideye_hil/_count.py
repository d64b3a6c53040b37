"""How many people a recording shows."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import NamedTuple, Optional, Union

import numpy as np
import numpy.typing as npt

from ._recording import Recording

_Path = Union[str, "os.PathLike[str]"]


class Counts(NamedTuple):
    """The people in N frames."""

    people: npt.NDArray[np.int8]
    """(N,): 0, 1, 2, or 3 for three and more; -1 where a frame is missing or the empty room is not known yet."""
    p: npt.NDArray[np.float32]
    """(N, 4): the chance of each number; not-a-number where it is not known."""
    entered: npt.NDArray[np.uint32]
    """(N,): how many entered over the line so far."""
    left: npt.NDArray[np.uint32]
    """(N,): how many left over the line so far."""


def count(
    recording: Union[Recording, npt.ArrayLike],
    *,
    profile: Optional[_Path] = None,
    live: bool = False,
    weights: Optional[_Path] = None,
    line: Optional[Sequence[float]] = None,
) -> Counts:
    """Counts the people in frames, as `grideye count` does.

    Args:
        recording: a recording, or frames in order, (N, 8, 8) or (N, 64), degrees Celsius, 10 a second.
        profile: a profile whose `[background]` is the empty room; by default it is learned from all frames.
        live: learn the empty room from the first half minute, as the collector does.
        weights: another network, as tests/peers/counting trains it.
        line: x1, y1, x2, y2 in pixels, (0, 0) being the middle of pixel 1; who goes from its left to its right has entered.

    Raises:
        InputError: what is wrong, with its hint.
    """
    frames = recording if isinstance(recording, Recording) else Recording.from_array(recording)
    across = None if line is None else ",".join(str(float(number)) for number in line)
    people, p, crossed = frames._native.people(profile, live, weights, across)
    both = np.frombuffer(crossed, np.uint32).reshape(-1, 2)
    chances = np.frombuffer(p, np.float32).reshape(-1, 4)
    return Counts(np.frombuffer(people, np.int8), chances, both[:, 0], both[:, 1])
