"""Recordings: what a sensor measured, frame by frame."""

from __future__ import annotations

import os
import warnings
from typing import TYPE_CHECKING, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _native

if TYPE_CHECKING:
    import pandas
    import xarray


class Recording:
    """What one sensor measured. N counts all frames, also the missing ones.

    Make one with `Recording.read`.
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

    @property
    def account(self) -> str:
        """What was taken for what in the file."""
        return self._native.account()

    @property
    def labels(self) -> dict[str, list[str]]:
        """Further columns of the file by name, N texts each."""
        return dict(self._native.labels())

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

    def __len__(self) -> int:
        return len(self._native.reasons())

    def __repr__(self) -> str:
        path = os.fspath(self._native.path())
        return f"Recording({path!r}, {len(self)} frames, {int(self.missing.sum())} missing)"
