"""Frames that are missing from a recording: filled in, so that the others keep their times."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.corpus.importers.import_report import count_of
from elocute.corpus.length_units import longest_side
from elocute.errors import CorpusError
from elocute.numerics.resampling import GAP_MAX_S

FAR_HEADS, FACE_SHARE = 40.0, 0.25
"""Frames are no faces that reach further than so many heads, or are smaller than that of one."""


def frame_rows(
    numbers: Sequence[int], first: int, fps: float, sound_s: float | None
) -> tuple[NDArray[np.int64], str]:
    """The row of each frame in a recording whose gaps are filled, and what to say of them.

    Parameters
    ----------
    numbers : sequence of int
        Of the frames that are there, rising.
    first : int
        The number of a recording's first frame: 0 or 1.
    fps : float
        Frames per second.
    sound_s : float or None
        Length of the sound, s, which tells whether it was cut to frames that begin later.

    Returns
    -------
    rows : (frame,) int64
        From 0, rising.
    note : str
        "" without a gap.

    Raises
    ------
    CorpusError
        For a number that occurs twice, a gap of more than `GAP_MAX_S`, and frames that are missing
        at the beginning.
    """
    steps = np.diff(numbers)
    if (steps < 1).any():
        raise CorpusError(f"frame {numbers[int(np.argmin(steps))]} twice")
    widest = int(steps.max()) - 1 if len(steps) else 0
    if widest > GAP_MAX_S * fps:
        before = numbers[int(np.argmax(steps))]
        raise CorpusError(f"{widest} frames missing in a row, after frame {before}")
    late, count = numbers[0] - first, numbers[-1] - numbers[0] + 1
    if late > 0 and sound_s is not None:
        heard = sound_s * fps
        if abs(heard - late - count) < abs(heard - count):
            raise CorpusError(f"the first {count_of(late, 'frame')} missing")
    missing = count - len(numbers)
    note = f"{count_of(missing, 'frame')} missing between others, interpolated" if missing else ""
    return np.asarray(numbers, np.int64) - numbers[0], note


def filled(frames: Float32Array, rows: NDArray[np.int64]) -> Float32Array:
    """Frames with straight lines through their gaps.

    Parameters
    ----------
    frames : (known, vertex, 3) float32
        Those that are there.
    rows : (known,) int64
        Where they belong, as `frame_rows` gives them.

    Returns
    -------
    (frame, vertex, 3) float32
    """
    count = int(rows[-1]) + 1
    if count == len(frames):
        return frames
    after = np.searchsorted(rows, np.arange(count))
    before = np.where(rows[after] > np.arange(count), after - 1, after)
    span = np.maximum(rows[after] - rows[before], 1)
    share = ((np.arange(count) - rows[before]) / span).astype(np.float32)[:, None, None]
    mixed = frames[before] * (1 - share) + frames[after] * share
    return mixed.astype(np.float32, copy=False)


def check_finite(frames: Float32Array, source: str | Path) -> None:
    """Raise CorpusError where a frame (from 0) is not finite.

    Parameters
    ----------
    frames : (frame, vertex, 3) float32
        Of one recording.
    source : str or Path
        Where they are from, for the message.
    """
    wrong = ~np.isfinite(frames).all(axis=(1, 2))
    if wrong.any():
        more = f", the first of {wrong.sum()}" if wrong.sum() > 1 else ""
        raise CorpusError.about(
            source,
            found=f"NaN or infinity in frame {int(wrong.argmax())} of {len(frames)}{more}",
            allowed="finite numbers",
        )


def check_frames(frames: Float32Array, source: str | Path, template: NDArray[np.floating]) -> None:
    """Raise CorpusError where frames are no faces: not finite, far off, or displacements.

    Parameters
    ----------
    frames, source
        As for `check_finite`.
    template : (vertex, 3) float
        The neutral face, in the same unit.
    """
    check_finite(frames, source)
    size = longest_side(template)
    furthest = np.maximum(frames.max(axis=(1, 2)), -frames.min(axis=(1, 2)))
    if furthest.max(initial=0) > np.abs(template).max() + FAR_HEADS * size:
        frame = int(furthest.argmax())
        raise CorpusError.about(
            source,
            found=f"{furthest[frame]:.3g} in frame {frame}, beside a head of {size:.3g}",
            allowed="vertices in the unit of the neutral face",
        )
    shown = max(map(longest_side, frames[:: max(1, len(frames) // 8)]), default=size)
    if shown < FACE_SHARE * size:
        raise CorpusError.about(
            source,
            found=f"points {shown:.3g} apart at most, beside a head of {size:.3g}: displacements",
            allowed="vertices",
            remedy="add the neutral face to every frame",
        )
