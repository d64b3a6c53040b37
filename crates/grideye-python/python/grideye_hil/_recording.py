"""Recordings: what a sensor measured, frame by frame."""

from __future__ import annotations

import base64
import datetime
import html
import importlib
import os
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _native
from ._error import InputError

if TYPE_CHECKING:
    import matplotlib.axes
    import pandas
    import xarray

_Path = Union[str, "os.PathLike[str]"]


class Recording:
    """What one sensor measured. N counts all frames, also the missing ones.

    Make one with `Recording.read`, `from_array`, `from_pandas` or `from_xarray`. `rec[100:200]`, `rec["2026-11-30T10:00":]` and
    `rec[:np.timedelta64(30, "s")]` (since its first frame) are recordings too. Jupyter shows a strip of its frames.
    """

    def __init__(self, native: _native.Recording) -> None:
        self._native = native

    @staticmethod
    def read(
        path: Union[str, os.PathLike[str]], *, sensor: Optional[str] = None, columns: Optional[str] = None
    ) -> Recording:
        """Reads a recording of any layout that `grideye convert` reads. A file that breaks off is read up to there, with a warning.

        Args:
            path: the file.
            sensor: SENSOR or DEVICE/SENSOR; may be left out if the file holds one.
            columns: what its columns are, as `grideye convert --columns` takes it; guessed if left out, see `account`.

        Raises:
            InputError: what is wrong, with file, line and hint.
        """
        native = _native.Recording.read(path, sensor, columns)
        broken = native.broken()
        if broken is not None:
            warnings.warn(broken, stacklevel=2)
        return Recording(native)

    @staticmethod
    def from_array(
        celsius: npt.ArrayLike,
        *,
        rate_hz: float = 10.0,
        time: Optional[npt.ArrayLike] = None,
        thermistor: Optional[npt.ArrayLike] = None,
        missing: Optional[Sequence[str]] = None,
        labels: Optional[Mapping[str, npt.ArrayLike]] = None,
        device: str = "array",
        sensor: str = "grid-eye",
    ) -> Recording:
        """Makes a recording of frames in memory. What lies between the sensor's steps of 0.25 °C is rounded, with a warning.

        Args:
            celsius: pixels, (N, 8, 8) or (N, 64), degrees Celsius, from the image's top left. A frame with not-a-number is missing.
            rate_hz: frames a second, where no time is given.
            time: when each frame was read, (N,): datetime64 (UTC) or seconds since any moment; it never goes back.
            thermistor: the chip's own temperature, (N,), degrees Celsius; not-a-number where it was not read.
            missing: why a frame is missing, N names as of `missing_reasons`; by default "short-transfer".
            labels: further columns by name, N values each.
            device: a name for the device.
            sensor: a name for the sensor.

        Raises:
            InputError: what is wrong, with its hint.
        """
        pixels = _numbers("celsius", celsius, np.float32)
        count = len(pixels)
        if pixels.shape not in ((count, 8, 8), (count, 64)) or count == 0:
            raise InputError(f"celsius has the shape {pixels.shape}", "frames are (N, 8, 8) or (N, 64), with N of 1 or more")
        between = np.abs(4 * pixels - np.round(4 * pixels)) > 0.01
        if between.any():
            told = f"{int(between.sum())} pixels lie between the sensor's steps of 0.25 °C and are rounded"
            warnings.warn(told, stacklevel=2)
        boot, utc = _times(time, count, rate_hz)
        own = None if thermistor is None else _each("thermistor", thermistor, count, np.float32).tolist()
        columns = {name: np.asarray(values).ravel() for name, values in (labels or {}).items()}
        for name, values in {**columns, "missing": [""] * count if missing is None else missing}.items():
            if len(values) != count:
                raise InputError(f"{name} has {len(values)} values for {count} frames", "one for each frame")
        given = {
            "celsius": np.ascontiguousarray(pixels).tobytes(),
            "t_boot_ns": boot.tolist(),
            "t_utc_ns": None if utc is None else utc.tolist(),
            "thermistor": own,
            "reasons": [] if missing is None else [str(reason) for reason in missing],
            "labels": [(name, [_text(value) for value in values.tolist()]) for name, values in columns.items()],
            "device": device,
            "sensor": sensor,
        }
        return Recording(_native.Recording.of_arrays(given))

    @staticmethod
    def from_pandas(frame: pandas.DataFrame, *, rate_hz: float = 10.0) -> Recording:
        """Makes a recording of a table as `to_pandas` gives it: pixel1 to pixel64, and thermistor and missing if there are any; other
        columns are labels. An index of times says when; otherwise `rate_hz` does.

        Raises:
            InputError: what is wrong, with its hint.
        """
        import pandas

        names = [f"pixel{number + 1}" for number in range(64)]
        lacking = [name for name in names if name not in frame.columns]
        if lacking:
            raise InputError(f"the table lacks {', '.join(lacking[:3])}", "pixel1 to pixel64 are the image, row by row")
        index = frame.index
        time: Optional[npt.ArrayLike] = None
        if isinstance(index, pandas.DatetimeIndex):
            utc = index if index.tz is None else index.tz_convert("UTC").tz_localize(None)
            time = utc.to_numpy(dtype="datetime64[ns]")
        reasons = frame["missing"].fillna("").astype(str).tolist() if "missing" in frame.columns else None
        others = [name for name in frame.columns if name not in (*names, "thermistor", "missing")]
        return Recording.from_array(
            frame[names].to_numpy(np.float32),
            rate_hz=rate_hz,
            time=time,
            thermistor=frame["thermistor"].to_numpy(np.float32) if "thermistor" in frame.columns else None,
            missing=reasons,
            labels={str(name): frame[name].fillna("").to_numpy() for name in others},
        )

    @staticmethod
    def from_xarray(data: xarray.Dataset, *, rate_hz: float = 10.0) -> Recording:
        """Makes a recording of a Dataset as `to_xarray` gives it: celsius (time, row, column), and thermistor and missing if there
        are any. A coordinate `time` says when; otherwise `rate_hz` does.

        Raises:
            InputError: what is wrong, with its hint.
        """
        if "celsius" not in data:
            raise InputError("the data set lacks celsius", "it is (time, row, column), degrees Celsius")
        return Recording.from_array(
            data["celsius"].to_numpy(),
            rate_hz=rate_hz,
            time=data["time"].to_numpy() if "time" in data.coords else None,
            thermistor=data["thermistor"].to_numpy() if "thermistor" in data else None,
            missing=[str(reason) for reason in data["missing"].to_numpy()] if "missing" in data else None,
            device=str(data.attrs.get("device", "array")),
            sensor=str(data.attrs.get("sensor", "grid-eye")),
        )

    @property
    def account(self) -> str:
        """What was taken for what in the file."""
        return self._native.account()

    @property
    def labels(self) -> dict[str, npt.NDArray[Any]]:
        """Further columns by name, (N,): int64 or float64 if all are numbers (not-a-number where there is none), otherwise texts."""
        return {name: _array(texts) for name, texts in self._native.labels()}

    @property
    def celsius(self) -> npt.NDArray[np.float32]:
        """Pixels, float32 (N, 8, 8), degrees Celsius in steps of 0.25; not-a-number where a frame is missing."""
        return np.frombuffer(self._native.celsius(), np.float32).reshape(-1, 8, 8)

    @property
    def raw(self) -> npt.NDArray[np.uint16]:
        """Pixels, uint16 (N, 8, 8), the sensor's words of 12 bits in two's complement; 0 where a frame is missing."""
        return np.frombuffer(self._native.raw(), np.uint16).reshape(-1, 8, 8)

    @property
    def thermistor(self) -> npt.NDArray[np.float32]:
        """The chip's own temperature, float32 (N,), degrees Celsius; not-a-number where it was not read."""
        return np.frombuffer(self._native.thermistor(), np.float32)

    @property
    def time(self) -> npt.NDArray[np.datetime64]:
        """When each frame was read, datetime64[ns] (N,), UTC, by the recording device's wall clock."""
        return np.frombuffer(self._native.t_utc_ns(), "datetime64[ns]")

    @property
    def boot_time(self) -> npt.NDArray[np.timedelta64]:
        """When each frame was read, timedelta64[ns] (N,), since the device booted: a clock that is never set."""
        return np.frombuffer(self._native.t_boot_ns(), "timedelta64[ns]")

    @property
    def missing(self) -> npt.NDArray[np.bool_]:
        """Which frames are missing, bool (N,)."""
        return np.array([reason != "" for reason in self._native.reasons()], dtype=np.bool_)

    @property
    def missing_reasons(self) -> list[str]:
        """Why each frame is missing, such as "nack" or "bus-timeout"; "" where it is not."""
        return self._native.reasons()

    @property
    def device(self) -> str:
        """The device that recorded it."""
        return self._native.stream()[0]

    @property
    def sensor(self) -> str:
        """The device's name of the sensor."""
        return self._native.stream()[1]

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas DataFrame: N rows by time (UTC); thermistor, pixel1 to pixel64 in degrees Celsius, missing, and labels."""
        import pandas

        pixels = self.celsius.reshape(-1, 64)
        columns = {f"pixel{number + 1}": pixels[:, number] for number in range(64)}
        index = pandas.DatetimeIndex(self.time, tz="UTC", name="time")
        return pandas.DataFrame(
            {"thermistor": self.thermistor, **columns, "missing": self.missing_reasons, **self.labels}, index=index
        )

    def to_xarray(self) -> xarray.Dataset:
        """An xarray Dataset: celsius (time, row, column), thermistor (time) and missing (time)."""
        import xarray

        unit = {"units": "degC"}
        return xarray.Dataset(
            {
                "celsius": (("time", "row", "column"), self.celsius, unit),
                "thermistor": ("time", self.thermistor, unit),
                "missing": ("time", np.array(self.missing_reasons)),
            },
            coords={"time": self.time, "row": np.arange(8), "column": np.arange(8)},
            attrs={"device": self.device, "sensor": self.sensor},
        )

    def to_csv(self, path: _Path) -> None:
        """Writes the recording in this project's format, as `grideye convert`. The file appears whole, as of all these."""
        self._write(path, "csv")

    def to_npz(self, path: _Path) -> None:
        """Writes arrays for numpy, as `grideye convert`."""
        self._write(path, "npz")

    def to_parquet(self, path: _Path) -> None:
        """Writes Apache Parquet, as `grideye convert`."""
        self._write(path, "parquet")

    def to_mcap(self, path: _Path) -> None:
        """Writes MCAP with the messages of ROS 2, for Rerun, Foxglove and ROS 2 itself, as `grideye convert`."""
        self._write(path, "mcap")

    def to_rerun(self, path: Optional[str] = None) -> None:
        """Logs the frames into the current recording of Rerun (`rerun-sdk`), by wall clock if there is one, else since the first.

        Args:
            path: the entity's; by default DEVICE/SENSOR.
        """
        rerun: Any = importlib.import_module("rerun")
        entity = path or f"{self.device}/{self.sensor}"
        has_clock = bool((self.time.astype(np.int64) != 0).any())
        since = self.boot_time - self.boot_time[:1]
        for frame, when, passed, missing in zip(self.celsius, self.time, since, self.missing):
            if not missing:
                rerun.set_time("time", **({"timestamp": when} if has_clock else {"duration": passed}))
                rerun.log(entity, rerun.Tensor(frame, dim_names=("row", "column")))

    def plot(self, frame: int = 0, *, ax: Optional[matplotlib.axes.Axes] = None) -> matplotlib.axes.Axes:
        """Draws a frame with matplotlib, in the colors of the page, with a bar of degrees Celsius."""
        import matplotlib.pyplot as plt

        if ax is None:
            _, ax = plt.subplots()
        image = ax.imshow(self.celsius[frame], cmap="inferno")
        ax.figure.colorbar(image, ax=ax, label="°C")
        ax.set(xticks=[], yticks=[], title=f"{self.sensor}, frame {range(len(self))[frame]}")
        return ax

    def _write(self, path: _Path, end: str) -> None:
        write(path, self._native.written(end))

    def _repr_html_(self) -> str:
        there = np.flatnonzero(~self.missing)
        told = html.escape(repr(self))
        if len(there) == 0:
            return f"<p>{told}</p>"
        chosen = there[np.linspace(0, len(there) - 1, min(8, len(there))).astype(int)]
        strip = Recording.from_array(self.celsius[chosen])
        png = base64.b64encode(strip._native.written("png")).decode()
        return f'<p>{told}</p><img alt="{len(chosen)} of its frames" src="data:image/png;base64,{png}">'

    def __getitem__(self, part: slice) -> Recording:
        if not isinstance(part, slice):
            raise TypeError("a recording takes slices, such as rec[10:20]; rec.celsius[10] is a frame")
        start, stop, step = slice(self._index(part.start), self._index(part.stop), part.step).indices(len(self))
        if step < 1:
            raise InputError(f"a recording cannot go by steps of {step}", "time does not go back")
        name = f"{os.fspath(self._native.path())}[{start}:{stop}:{step}]"
        return Recording(self._native.slice(name, start, stop, step))

    def _index(self, bound: Any) -> Any:
        """The first frame from a time on."""
        if isinstance(bound, np.timedelta64):
            return int(np.searchsorted(self.boot_time - self.boot_time[:1], bound))
        if bound is None or isinstance(bound, (int, np.integer)):
            return bound
        if getattr(bound, "tzinfo", None) is not None:
            bound = bound.astimezone(datetime.timezone.utc).replace(tzinfo=None)
        return int(np.searchsorted(self.time, np.datetime64(bound, "ns")))

    def __len__(self) -> int:
        return len(self._native.reasons())

    def __repr__(self) -> str:
        path = os.fspath(self._native.path())
        return f"Recording({path!r}, {len(self)} frames, {int(self.missing.sum())} missing)"


def write(path: _Path, content: bytes) -> None:
    """Writes a file that appears whole."""
    path = os.path.abspath(path)
    with tempfile.NamedTemporaryFile(dir=os.path.dirname(path), delete=False) as file:
        file.write(content)
    os.chmod(file.name, 0o644)
    os.replace(file.name, path)


def _numbers(name: str, values: npt.ArrayLike, dtype: Any) -> npt.NDArray[Any]:
    try:
        return np.asarray(values, dtype)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: {error}", "an array of numbers") from None


def _each(name: str, values: npt.ArrayLike, count: int, dtype: Any) -> npt.NDArray[Any]:
    found = _numbers(name, values, dtype)
    if found.shape != (count,):
        raise InputError(f"{name} has the shape {found.shape} for {count} frames", "one number for each frame")
    return found


def _times(
    time: Optional[npt.ArrayLike], count: int, rate_hz: float
) -> tuple[npt.NDArray[np.int64], Optional[npt.NDArray[np.int64]]]:
    """Nanoseconds since the first frame, and since 1970 if that is known."""
    if time is None:
        if not 0 < rate_hz <= 1000:
            raise InputError(f"rate_hz is {rate_hz}", "frames a second, 1 or 10 for a Grid-EYE")
        return np.round(np.arange(count) * 1e9 / rate_hz).astype(np.int64), None
    is_utc = np.asarray(time).dtype.kind == "M"
    scale = "datetime64[ns]" if is_utc else np.float64
    found = _each("time", time, count, scale)
    ns = found.astype(np.int64) if is_utc else np.round(1e9 * (found - found[0])).astype(np.int64)
    if not is_utc and not np.isfinite(found).all():
        raise InputError("time is not a number in places", "a time for each frame, also for those that are missing")
    back = np.flatnonzero(np.diff(ns) < 0)
    if len(back):
        raise InputError(f"time goes back at frame {back[0] + 1}", "sort the frames by time")
    return ns - ns[0], ns if is_utc else None


def _text(value: Any) -> str:
    return "" if value is None or value != value else str(value)


def _array(texts: list[str]) -> npt.NDArray[Any]:
    for kind in (np.int64, np.float64):
        try:
            return np.array([text or "nan" for text in texts]).astype(kind)
        except ValueError:
            continue
    return np.array(texts)
