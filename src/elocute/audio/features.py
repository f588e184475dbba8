"""Features over time, and the overlapping windows that VOCA takes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError
from elocute.numerics.input_checks import NUMBERS_MAX, floats_of, real_number, whole_number
from elocute.numerics.resampling import frame_places, read_rows
from elocute.one_line_repr import brief, one_line

WINDOW_MAX = 10_000


@dataclass(frozen=True, eq=False)
class Features:
    """Features over time; row k is at (first + k) / rate seconds.

    Parameters
    ----------
    values : (row, feature) float32
        At least one row.
    rate : float
        Rows per second.
    encoder : str
        The name of the encoder that made them.
    first : int
        How many rows of a longer sound lie before these.

    Raises
    ------
    InputError
        Where shape, rate or numbers are wrong.
    """

    values: NDArray[np.float32]
    rate: float
    encoder: str
    first: int = field(default=0, repr=False)

    __repr__ = one_line

    def __post_init__(self) -> None:
        allowed = "(frame, feature) of floats"
        values = floats_of(self.values, "features", error=InputError, allowed=allowed)
        fault = "" if np.isfinite(values).all() else " with NaN or infinity"
        if values.ndim != 2 or not len(values) or fault:
            raise InputError.about(
                "features",
                found=f"shape {values.shape}{fault}",
                allowed="(frame, feature), at least one frame, finite",
            )
        _check_rate(self.rate)
        if whole_number(self.first) is None:
            raise InputError.about("features", found=f"first {brief(self.first)}", allowed="a row")
        object.__setattr__(self, "values", values)

    def resample(self, rate: float) -> Features:
        """Linear interpolation to another rate.

        The duration stays, rounded to a row; the last value holds where nothing follows it.

        Parameters
        ----------
        rate : float
            Rows per second of the result; its row k is the value at k / rate.

        Returns
        -------
        Features

        Raises
        ------
        InputError
            For a rate that is not above zero, or more rows than fit in memory.
        """
        _check_rate(rate)
        count = max(1, round(min(len(self.values) * rate / self.rate, 2.0**62)))
        if count * self.values.shape[1] > NUMBERS_MAX:
            raise InputError.about(
                "features",
                found=f"{count} rows at {rate:g} Hz",
                allowed=f"up to {NUMBERS_MAX // self.values.shape[1]}",
            )
        return replace(self, values=self.at(0, count, rate), rate=rate)

    def at(self, first: int, count: int, rate: float) -> NDArray[np.float32]:
        """(count, feature) at (first + k) / rate, linear between rows, held beyond both ends."""
        return read_rows(self.values, frame_places(first, count, self.rate, rate) - self.first)

    def windows(self, size: int = 16) -> NDArray[np.float32]:
        """Overlapping windows, one per row: window i covers rows i - size/2 to i + size/2 - 1.

        Parameters
        ----------
        size : int
            Rows per window, 1 to 10000.

        Returns
        -------
        (row, size, feature) float32
            A read-only view that takes no memory; zeros stand beyond both ends.

        Raises
        ------
        InputError
            For a size out of range.

        References
        ----------
        VOCA 2019, section 4 (60T × W × D, W = 16), padded as in the code released with the paper.
        """
        if not 1 <= (whole_number(size) or 0) <= WINDOW_MAX:
            raise InputError.about(
                "features",
                found=f"windows of {brief(size)}",
                allowed=f"1 or more, up to {WINDOW_MAX}",
            )
        before = size // 2
        padded = np.pad(self.values, ((before, size - before - 1), (0, 0)))
        return np.lib.stride_tricks.sliding_window_view(padded, size, axis=0).swapaxes(1, 2)


def _check_rate(rate: float) -> None:
    if not (real_number(rate) or 0) > 0:
        raise InputError.about("features", found=f"rate {brief(rate)}", allowed="above 0 Hz")
