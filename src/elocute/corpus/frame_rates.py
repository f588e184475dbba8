"""How many frames a second foreign motion has, told by its sounds and its mesh."""

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
    told: float | None,
    notes: list[str],
) -> float:
    """The rate that `told` says, or that fits; a note says what was assumed.

    lengths  of some clips, frames and seconds of sound
    """
    measured = median(frames / seconds for frames, seconds in lengths) if lengths else None
    fitting = fitting_rate(measured, topology.rates if topology else (USUAL_FPS,))
    if told is not None:
        if fitting is not None and abs(told / fitting - 1) > TOLERANCE:
            notes.append(
                f"frames/s: {told:g} as `fps` says, but the lengths of the sounds fit {fitting:g}"
            )
        return told
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
    """The usual rate within TOLERANCE of what was measured, else the nearest of RATES, or None."""
    if measured is None:
        return None
    for rates in (usual, KNOWN_FPS):
        near = [rate for rate in rates if abs(measured / rate - 1) <= TOLERANCE]
        if near:
            return min(near, key=lambda rate: abs(measured / rate - 1))
    return None
