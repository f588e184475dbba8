"""Units of length: as the user says, or recognised by the size of a head."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.corpus.topologies import BIWI, topology_of
from elocute.errors import CorpusError

UNITS = {"mm": 0.001, "cm": 0.01, "dm": 0.1, "inch": 0.0254}
HEIGHT_RANGE_M = (0.1, 0.6)  # from a mask of the face to a head with shoulders
TYPICAL_HEIGHT_M = 0.25


def longest_side(template: NDArray[np.floating]) -> float:
    """Longest side of the box around vertices.

    Parameters
    ----------
    template : (vertex, 3) float
        In any unit; points that are not finite do not count.

    Returns
    -------
    float
        In the same unit; NaN without a finite point.
    """
    finite = template[np.isfinite(template).all(axis=1)]
    return float(np.ptp(finite, axis=0).max()) if len(finite) else float("nan")


def is_head_sized(size: float) -> bool:
    """Whether something whose longest side is `size` m is as large as a head may be."""
    return HEIGHT_RANGE_M[0] <= size <= HEIGHT_RANGE_M[1]


def fitting_unit(size: float) -> str:
    """The unit, of `UNITS`, in which something has most nearly the size of a head; "" for none."""
    fits = {name: size * metres for name, metres in UNITS.items() if is_head_sized(size * metres)}
    return min(fits, key=lambda name: abs(np.log(fits[name] / TYPICAL_HEIGHT_M)), default="")


UNIT_AREA_HEIGHTS = (0.6, 2.0)
"""Longest side of a face whose surface is 1, generously."""
BOX_TOLERANCE = 0.01
METRES_RANGE = (1e-6, 1e3)


def metres_per_unit(template: NDArray[np.floating], notes: list[str], units: str | None) -> float:
    """Find what to multiply lengths by.

    BIWI as FaceFormer's and CodeTalker's preparation leaves it has been scaled to a surface of 1
    (FaceXHuBERT's and FaceDiffuser's: each axis to 1), which no unit undoes: a head of
    `TYPICAL_HEIGHT_M` is assumed.

    Parameters
    ----------
    template : (vertex, 3) float
        A neutral face in the file's unit.
    notes : list of str
        A line is appended where something other than metres was assumed.
    units : str or None
        A name in `UNITS`, `m`, or metres as a number; None goes by the size of the head.

    Returns
    -------
    float
        Metres of one unit.

    Raises
    ------
    CorpusError
        For `units` that are not a unit of length.
    """
    if units is not None:
        return parse_length_unit(units)
    size = longest_side(template)
    if topology_of(len(template)) is BIWI and UNIT_AREA_HEIGHTS[0] <= size <= UNIT_AREA_HEIGHTS[1]:
        return _normalised_biwi_scale(template, size, notes)
    unit = "" if is_head_sized(size) else fitting_unit(size)
    if unit:
        notes.append(
            f"lengths: a head is {size:.4g} units high; taken as {unit}, now metres; "
            "`units` sets another"
        )
    elif not is_head_sized(size):
        notes.append(
            f"lengths: a head is {size:.4g} units high; no unit fits, left as it is; "
            "`units` sets one, in metres"
        )
    return UNITS.get(unit, 1.0)


def parse_length_unit(units: str) -> float:
    """Metres of a unit of length: a name in `UNITS`, `m`, or metres as a number.

    Raises CorpusError for anything else, or a number outside `METRES_RANGE`.
    """
    known = {"m": 1.0, **UNITS}
    try:
        metres = known[units] if units in known else float(units)
    except ValueError:
        metres = float("nan")
    if not METRES_RANGE[0] <= metres <= METRES_RANGE[1]:
        raise CorpusError.about(
            f"`units` {units}",
            found="no unit of length",
            allowed=f"{', '.join(known)}, or metres a unit, {METRES_RANGE[0]:g} to "
            f"{METRES_RANGE[1]:g}",
        )
    return metres


def _normalised_biwi_scale(template: NDArray[np.floating], size: float, notes: list[str]) -> float:
    """Metres per unit of a BIWI mesh whose surface or box was scaled to 1."""
    scale = TYPICAL_HEIGHT_M / size
    boxed = bool(np.abs(np.ptp(template, axis=0) - 1).max() < BOX_TOLERANCE)
    what = "each axis scaled to 1" if boxed else "scaled to a surface of 1"
    lost = "its true size and proportions are" if boxed else "its true size is"
    notes.append(
        f"lengths: {BIWI.title} {what} ({size:.3g} units high): {lost} lost; taken as "
        f"{TYPICAL_HEIGHT_M:g} m high, {scale:.3g} m a unit; `units` sets another (1 keeps "
        "the papers' unit)"
    )
    return scale
