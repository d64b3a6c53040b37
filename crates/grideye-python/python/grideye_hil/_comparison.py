"""The verdict on a recording and a scene."""

from __future__ import annotations

import enum
import html
import json
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np

from . import _native
from ._recording import Recording, write
from ._scene import Scene

if TYPE_CHECKING:
    import matplotlib.figure
    import pandas


class Verdict(str, enum.Enum):
    """What a comparison found. Each equals its text."""

    AGREES = "agrees"
    DISAGREES = "disagrees"
    CANNOT_TELL = "cannot tell"

    def __str__(self) -> str:
        return self.value


class Comparison:
    """What a recording says about its scene. Jupyter shows the verdict, its reasons and the scores."""

    def __init__(self, native: _native.Comparison) -> None:
        self._native = native
        self._result: dict[str, Any] = json.loads(native.json())

    @property
    def verdict(self) -> Verdict:
        """Whether the recording could be one of the scene."""
        return Verdict(str(self._result["verdict"]).replace("-", " ").replace("_", " "))

    @property
    def agrees(self) -> bool:
        """Whether the verdict is that they agree: `assert ge.compare(scene, rec).agrees` shows the headline if not."""
        return self.verdict is Verdict.AGREES

    @property
    def headline(self) -> str:
        """The verdict and its main reason, a sentence."""
        return str(self._result["headline"])

    @property
    def reasons(self) -> list[str]:
        """Why, a sentence each, with the numbers."""
        return [str(reason) for reason in self._result["reasons"]]

    @property
    def next_step(self) -> Optional[str]:
        """What to do first about a scene that does not agree."""
        step: Optional[str] = self._result["next_step"]
        return step

    @property
    def scores(self) -> pandas.DataFrame:
        """A pandas DataFrame of the scores, by name.

        Columns: title, unit and better ("higher" or "lower"); value; what a blank frame and shuffled pixels (their mean)
        would score; ceiling, the sensor against itself; skill, 0 for the better of these and 1 for the ceiling.
        """
        import pandas

        scores = {name: _numbers(score) for name, score in self._result["scores"].items()}
        return pandas.DataFrame.from_dict(scores, orient="index").rename_axis("score")

    def to_dict(self) -> dict[str, Any]:
        """Everything, as `grideye compare --json` writes it."""
        return json.loads(self._native.json())  # type: ignore[no-any-return]

    def report(self, path: Union[str, os.PathLike[str]]) -> None:
        """Writes the report, one page for any browser, as `grideye compare --report`. The file appears whole."""
        write(path, self._native.html().encode())

    def junit(self, path: Union[str, os.PathLike[str]]) -> None:
        """Writes each criterion as a test case in JUnit's XML, as `grideye compare --junit`. The file appears whole."""
        write(path, self._native.junit().encode())

    def plot(self) -> matplotlib.figure.Figure:
        """Draws real frames, simulated ones and real minus simulated with matplotlib, at the times of the report's film and in its
        colors: red where the recording is warmer.
        """
        import matplotlib.colors
        import matplotlib.pyplot as plt

        film = self._result["film"]
        pairs = np.array([[shot["real_c"], shot["simulated_c"]] for shot in film])
        real, simulated = pairs.reshape(len(film), 2, self._result["rows"], self._result["columns"]).swapaxes(0, 1)
        difference = real - simulated
        # The scales of the report: whole degrees, and no noise as warmth.
        most = max(2, np.ceil(np.abs(difference).max()))
        coldest = np.floor(pairs.min())
        figure, axes = plt.subplots(3, len(film), figsize=(1.5 * len(film) + 1, 5), squeeze=False, layout="constrained")
        blue_to_red = matplotlib.colors.LinearSegmentedColormap.from_list("difference", ["#2166ac", "#f7f7f7", "#b2182b"])
        temperatures = {"cmap": "inferno", "vmin": coldest, "vmax": max(coldest + 4, np.ceil(pairs.max()))}
        rows = [("real", real, temperatures), ("simulated", simulated, temperatures)]
        rows += [("real - simulated", difference, {"cmap": blue_to_red, "vmin": -most, "vmax": most})]
        for row, (name, frames, colors) in zip(axes, rows):
            for axis, frame, shot in zip(row, frames, film):
                image = axis.imshow(frame, **colors)
                axis.set(xticks=[], yticks=[], title=f"{shot['time_s']:.1f} s" if name == "real" else "")
            row[0].set_ylabel(name)
            figure.colorbar(image, ax=row, label="°C")
        return figure

    def __str__(self) -> str:
        return self._native.text()

    def __repr__(self) -> str:
        return f"Comparison({self.headline!r})"

    def _repr_html_(self) -> str:
        def cells(kind: str, texts: Sequence[str]) -> str:
            return "".join(f"<{kind}>{html.escape(text)}</{kind}>" for text in texts)

        def number(value: Optional[float]) -> str:
            return "" if value is None else f"{value:.3f}"

        names = ["value", "blank", "shuffled", "ceiling", "skill"]
        rows = [
            cells("th", [score["title"]]) + cells("td", [number(score[name]) for name in names])
            for score in map(_numbers, self._result["scores"].values())
        ]
        head = cells("th", ["", *names])
        table = "".join(f"<tr>{row}</tr>" for row in [head, *rows])
        # The first is the headline's.
        reasons = cells("li", self.reasons[1:])
        headline = html.escape(self.headline)
        return f"<p><strong>{headline}</strong></p><ul>{reasons}</ul><table>{table}</table>"


def _numbers(score: dict[str, Any]) -> dict[str, Any]:
    shuffled = score["shuffled"]
    columns = ("title", "unit", "better", "value", "blank", "ceiling", "skill")
    chosen = {name: score[name] for name in columns}
    return {**chosen, "shuffled": None if shuffled is None else shuffled["mean"]}


def compare(
    scene: Scene,
    recording: Recording,
    *,
    profile: Union[str, os.PathLike[str], None] = None,
    sensor: Optional[str] = None,
    start: Optional[float] = None,
    align: str = "rate",
    max_shift: float = 0.5,
    max_rate: float = 6.0,
    thresholds: Union[str, os.PathLike[str], None] = None,
    seed: int = 2,
) -> Comparison:
    """Compares a recording with what a scene's sensor would see, as `grideye compare`.

    Args:
        scene: what should have been seen.
        recording: what was seen.
        profile: a file that describes this one sensor, from `grideye characterize`.
        sensor: the scene's; may be left out if there is one.
        start: the scene's time at which the recording begins, seconds; by default by UTC if trajectories have it, else 0.
        align: what may be aligned, separated by commas: time by none, shift or rate; orientation; pose.
        max_shift: largest delay in either direction, 0 to 60 seconds.
        max_rate: largest error of the sensor's clock, 0 to 20 %.
        thresholds: a file with other thresholds of the verdict.
        seed: of the simulated noise in the scores; the verdict does not depend on it. Equal seeds give equal scores.

    Raises:
        InputError: what cannot be compared, with file, line and hint.
    """
    asked = {
        "sensor": sensor,
        "profile": profile,
        "thresholds": thresholds,
        "start_s": start,
        "seed": seed,
        "align": [name.strip() for name in align.split(",")],
        "max_shift_s": max_shift,
        "max_rate_percent": max_rate,
        "command": f"grideye_hil.compare({scene!r}, {recording!r})",
    }
    return Comparison(_native.Comparison.of(scene._native, recording._native, asked))
