"""The frame rate of imported motion, from the lengths of its sounds and its mesh."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median

from elocute.corpus.topologies import Topology

USUAL_FPS = 30.0
KNOWN_FPS = (24.0, 25.0, 30.0, 50.0, 60.0, 100.0, 120.0)
TOLERANCE = 0.03
"""Sounds and motion differ in length by this share at most where a rate fits."""


def choose_frame_rate(
    lengths: Sequence[tuple[int, float]],
    topology: Topology | None,
    given: float | None,
    notes: list[str],
) -> float:
    """The frame rate of motion that does not say it, by (frames, seconds of sound) of some clips.

    A rate that the user gives is taken, with a note where another one fits; `notes` gets a line
    that says what was assumed.
    """
    measured = median(frames / seconds for frames, seconds in lengths) if lengths else None
    fitting = fitting_rate(measured, topology.rates if topology else (USUAL_FPS,))
    if given is not None:
        if fitting is not None and abs(given / fitting - 1) > TOLERANCE:
            notes.append(
                f"frames/s: {given:g} as `fps` says, but the lengths of the sounds fit {fitting:g}"
            )
        return given
    usual = topology.rates[0] if topology else USUAL_FPS
    if fitting is None:
        why = (
            "there are no sounds to tell it by"
            if measured is None
            else (f"the lengths of the sounds fit no usual rate ({measured:.4g})")
        )
        notes.append(f"frames/s: {usual:g} assumed, {why}; `fps` sets another")
        return usual
    notes.append(f"frames/s: {fitting:g}, by the lengths of the sounds; `fps` sets another")
    return fitting


def fitting_rate(measured: float | None, usual: Sequence[float] = ()) -> float | None:
    """The known rate that is nearest to a measured one; None where none is within `TOLERANCE`.

    `usual` rates are tried before those of `KNOWN_FPS`.
    """
    if measured is None:
        return None
    for rates in (usual, KNOWN_FPS):
        near = [rate for rate in rates if abs(measured / rate - 1) <= TOLERANCE]
        if near:
            return min(near, key=lambda rate: abs(measured / rate - 1))
    return None
