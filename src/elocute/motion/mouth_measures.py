"""Mouth measures per frame, in millimetres: opening, width, protrusion, jaw."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import HeadError, MotionError
from elocute.files.atomic import write_atomically
from elocute.head.model import HeadModel
from elocute.motion.curves import Curves, data_frame
from elocute.motion.motion import Motion, check_motion
from elocute.numerics.smoothing import smoothstep

MEASURES = ("opening_mm", "width_mm", "protrusion_mm", "jaw_mm")
TRACKED_MEASURES = (*MEASURES, "upper_lip_mm", "lower_lip_mm")
CHIN = 8  # iBUG 68: the lowest point of the jaw line
NOSE, LIP_TOP, LIP_BOTTOM = 33, 51, 57

# Of lips tracked in video, in distances of the outer eye corners: the gap of the inner lips
TRACKED_CLOSED = 0.02  # below it lips count as closed
TRACKED_OPEN = 0.05  # from here on the gap is taken as it is
TRACKED_RESTING = 0.01  # that trackers see between lips that touch


def tracked_opening_share(gap: NDArray[np.float64]) -> NDArray[np.float64]:
    """How much of a tracked lip gap, in distances of the outer eye corners, is a real opening.

    Trackers see a small gap between lips that touch. It is faded out where lips are nearly closed,
    so that closed lips are closed on the head as well: the share is 0 up to `TRACKED_CLOSED`, and
    rises smoothly to 1 at `TRACKED_OPEN`.
    """
    return smoothstep(np.clip((gap - TRACKED_CLOSED) / (TRACKED_OPEN - TRACKED_CLOSED), 0, 1))


@dataclass(frozen=True)
class _Probe:
    """The vertices that the measures use."""

    upper: NDArray[np.integer]
    lower: NDArray[np.integer]
    corners: NDArray[np.integer]
    front: NDArray[np.integer]
    chin: int


def _probe(head: HeadModel) -> _Probe:
    upper, lower = head.inner_lip_upper, head.inner_lip_lower
    if not len(upper) or not len(head.landmarks):
        raise HeadError.about(
            f"head {head.name!r}",
            found="no lips to measure",
            allowed="a head with lips and landmarks, such as the built-in one",
        )
    # The middle third of the lips: what a tracked inner-lip gap looks at.
    third = len(upper) // 3
    return _Probe(
        upper=upper[third : len(upper) - third],
        lower=lower[third : len(lower) - third],
        corners=head.outer_corners,
        front=np.array([head.landmarks[51], head.landmarks[57]]),
        chin=int(head.landmarks[CHIN]),
    )


def measure_mouth(motion: Motion) -> Curves:
    """Measure a mouth in zero pose, frame by frame; joint rotations are left out.

    Parameters
    ----------
    motion : Motion
        On a head with lips and landmarks.

    Returns
    -------
    Curves
        In mm: `opening_mm`, the vertical gap between the inner lips, mean of the middle third, 0
        where they touch or overlap; `width_mm`, the distance of the outer mouth corners;
        `protrusion_mm`, how far the lips stand out in front of their rest, mean of both; `jaw_mm`,
        how far the chin has dropped from its rest.

    Raises
    ------
    HeadError
        For a head without lips or landmarks.
    """
    check_motion(motion)
    head = motion.head
    probe = _probe(head)
    kept = np.concatenate([probe.upper, probe.lower, probe.corners, probe.front, [probe.chin]])
    rest = head.template[kept]
    basis = head.expression_basis[:, kept].reshape(len(head.expression_names), -1)
    points = (motion.weights @ basis).reshape(motion.frame_count, len(kept), 3) + rest
    ends = np.cumsum([len(probe.upper), len(probe.lower), 2, 2])
    upper, lower, corners, front, chin = np.split(points, ends, axis=1)
    front_rest = rest[ends[2] : ends[3], 2]
    columns = [
        np.maximum(upper[:, :, 1] - lower[:, :, 1], 0).mean(axis=1),
        np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1),
        (front[:, :, 2] - front_rest).mean(axis=1),
        rest[-1, 1] - chin[:, 0, 1],
    ]
    return Curves(1000 * np.stack(columns, axis=1), MEASURES, motion.fps)


def measure_as_tracked(motion: Motion) -> Curves:
    """Measure a mouth as trackers of faces in video do, by distances between its points.

    Parameters
    ----------
    motion : Motion
        On a head with lips and landmarks; joint rotations are left out.

    Returns
    -------
    Curves
        `TRACKED_MEASURES` in mm: `opening_mm` and `width_mm` as `measure_mouth` gives them;
        `protrusion_mm`, how far the middle of the lips stands before the corners of the mouth;
        `jaw_mm`, `upper_lip_mm` and `lower_lip_mm`, from the base of the nose to the chin and to
        the outer edges of the lips.

    Raises
    ------
    HeadError
        For a head without lips or landmarks.
    """
    head, plain = motion.head, measure_mouth(motion)
    corners = head.outer_corners
    kept = np.concatenate([head.landmarks[[NOSE, LIP_TOP, LIP_BOTTOM, CHIN]], corners])
    basis = head.expression_basis[:, kept].reshape(len(head.expression_names), -1)
    points = (motion.weights @ basis).reshape(motion.frame_count, len(kept), 3)
    nose, top, bottom, chin, *sides = np.moveaxis(points + head.template[kept], 1, 0)
    front = (top[:, 2] + bottom[:, 2] - sides[0][:, 2] - sides[1][:, 2]) / 2
    below = [np.linalg.norm(point - nose, axis=1) for point in (chin, top, bottom)]
    distances = np.stack([front, *below], axis=1) * 1000
    values = np.concatenate([plain.values[:, :2], distances], axis=1)
    return Curves(values, TRACKED_MEASURES, motion.fps)


@dataclass(frozen=True, eq=False)
class PhoneMeasures:
    """Measures of each phone: over its time, and at its middle.

    Attributes
    ----------
    phones : tuple of (float, float, str)
        Start in s, end in s and phone.
    names : tuple of str
        Of the measures.
    mean, middle : (phone, measure) float64
        The mean of the frames from start to end, and the value halfway; both the latter where no
        frame lies within. In the unit of the measures.
    """

    phones: tuple[tuple[float, float, str], ...]
    names: tuple[str, ...]
    mean: NDArray[np.float64]
    middle: NDArray[np.float64]

    @property
    def columns(self) -> tuple[str, ...]:
        """Of the table: the phone, its start and end, and mean and middle of each measure."""
        of_measures = [f"{name}_{what}" for name in self.names for what in ("mean", "middle")]
        return ("phone", "start_s", "end_s", *of_measures)

    def rows(self) -> list[tuple[str | float, ...]]:
        """The table, a row for each phone."""
        values = np.stack([self.mean, self.middle], axis=2)
        values = values.reshape(len(self.phones), 2 * len(self.names))
        return [
            (phone, start, end, *numbers)
            for (start, end, phone), numbers in zip(self.phones, values.tolist(), strict=True)
        ]

    def to_pandas(self) -> Any:
        """The table as a data frame of pandas. Raises MachineError where that is not installed."""
        return data_frame(self.rows(), columns=self.columns)


def measure_phones(measures: Curves, phones: Sequence[tuple[float, float, str]]) -> PhoneMeasures:
    """Measure each phone: what its frames have on average, and what it has halfway.

    Parameters
    ----------
    measures : Curves
        As `measure_mouth` gives them; any other curves do.
    phones : sequence of (float, float, str)
        Start in s, end in s and phone, such as those of `elocute.speech.find_phones`.

    Returns
    -------
    PhoneMeasures

    Raises
    ------
    MotionError
        For a phone that begins after the last frame, or ends before it begins.
    """
    times, values = measures.times_s, measures.values.astype(np.float64)
    means, middles = [], []
    for start, end, phone in phones:
        if not 0 <= start <= end or start > times[-1] + 1 / measures.fps:
            raise MotionError.about(
                f"phone {phone!r}",
                found=f"{start:g} to {end:g} s",
                allowed=f"a stretch of these {len(values) / measures.fps:.2f} s",
                remedy="give the phones of this take",
            )
        halfway = (start + end) / 2
        middles.append([np.interp(halfway, times, column) for column in values.T])
        first, last = np.searchsorted(times, [start, end])
        means.append(values[first:last].mean(axis=0) if first < last else middles[-1])
    shape = (len(means), len(measures.names))
    return PhoneMeasures(
        tuple((float(start), float(end), str(phone)) for start, end, phone in phones),
        measures.names,
        np.reshape(np.array(means, np.float64), shape),
        np.reshape(np.array(middles, np.float64), shape),
    )


def _write_table(path: str | Path, names: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    with write_atomically(path) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([names, *rows])


def write_phone_measures(measures: PhoneMeasures, path: str | Path) -> None:
    """Write the table of `measure_phones` as CSV.

    Parameters
    ----------
    measures : PhoneMeasures
        The table.
    path : str or Path
        The file; one of that name is replaced.

    Raises
    ------
    OutputError
        For a place that cannot be written.
    """
    rows = (
        [phone, f"{start:.4f}", f"{end:.4f}", *(f"{n:.3f}" for n in numbers)]
        for phone, start, end, *numbers in measures.rows()
    )
    _write_table(path, measures.columns, rows)


def write_measures(measures: Curves, path: str | Path) -> None:
    """Write the time of each frame and its measures as CSV.

    Parameters
    ----------
    measures : Curves
        As `measure_mouth` gives them.
    path : str or Path
        The file; one of that name is replaced.

    Raises
    ------
    OutputError
        For a place that cannot be written.
    """
    rows = (
        [f"{frame / measures.fps:.4f}", *(f"{value:.3f}" for value in values)]
        for frame, values in enumerate(measures.values)
    )
    _write_table(path, ["time_s", *measures.names], rows)
