"""What a head's curves do to its mouth in millimetres, and curves that give a wanted mouth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from elocute.array_types import Float32Array, Float64Array, FloatArray
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.mouth_measures import TRACKED_MEASURES, measure_as_tracked

OPEN = 0.2  # of jawOpen: lips apart, where the measures are straight lines
STEP = 0.05
CLOSE_MOST = 0.1  # of `mouthClose` beyond `jawOpen`: more presses lips that others must part again
ROUNDS = 4  # of correcting and limiting
SEALED_TO, UNSEALED = 0.002, 1e-4  # of a curve, at a whole gate; the gate that is none


@dataclass(frozen=True, eq=False)
class MouthResponse:
    """How measures follow curves.

    Parameters
    ----------
    names : tuple of str
        The curves.
    effects : (curve, measure) float64
        Millimetres for a whole curve, in the order of `TRACKED_MEASURES`.
    rest : (measure,) float64
        Measures without curves, continued from the open mouth: where lips rest on each other, the
        opening is below 0.
    """

    names: tuple[str, ...]
    effects: Float64Array
    rest: Float64Array

    def measures(self, values: FloatArray) -> Float64Array:
        """Measures, mm, of curves (frame, curve) in the order of `names`.

        Returns
        -------
        (frame, measure) float64
            An opening below 0 is that of lips pressed together.
        """
        return values @ self.effects + self.rest


@cache
def builtin_response(names: tuple[str, ...]) -> MouthResponse:
    """The response of the built-in head to curves, `jawOpen` among them."""
    return mouth_response(load_builtin_head(), names)


def mouth_response(head: HeadModel, names: tuple[str, ...]) -> MouthResponse:
    """Measure the response of a head with lips and landmarks to curves, `jawOpen` among them.

    Raises HeadError for a head without lips or landmarks.
    """
    values = np.zeros((1 + len(names), len(names)), np.float32)
    values[:, names.index("jawOpen")] = OPEN
    values[1:] += STEP * np.eye(len(names), dtype=np.float32)
    measured = measure_as_tracked(motion_from_curves(head, Curves(values, names, 1.0))).values
    effects = (measured[1:] - measured[0]).astype(np.float64) / STEP
    return MouthResponse(names, effects, measured[0] - values[0] @ effects)


@dataclass(frozen=True, eq=False)
class Seal:
    """Where lips meet whatever the jaw does: `mouthClose` is `jawOpen` and so much more.

    Parameters
    ----------
    gate : (frame,)
        0 to 1, how strictly.
    beyond_jaw : (frame,)
        `mouthClose` less `jawOpen`.
    """

    gate: FloatArray
    beyond_jaw: FloatArray


def corrected_curves(
    response: MouthResponse,
    values: Float32Array,
    wanted_mm: FloatArray,
    freedom: Mapping[str, float | FloatArray],
    tolerance_mm: Mapping[str, float],
    seal: Seal | None = None,
) -> Float32Array:
    """Change curves as little as possible, so that the mouth measures what is wanted.

    Least squares within the limits 0 and 1.

    Parameters
    ----------
    response : MouthResponse
        Of the head.
    values : (frame, curve) float32
        0 to 1, in the order of `response.names`.
    wanted_mm : (frame, measure)
        In the order of `TRACKED_MEASURES`.
    freedom : dict of str to float, or to (frame,)
        How far each curve may well be moved; others stay.
    tolerance_mm : dict of str to float
        How exactly each measure is wanted, mm; the others are free.
    seal : Seal, optional
        Where `mouthClose` must follow `jawOpen`.

    Returns
    -------
    (frame, curve) float32
        0 to 1.
    """
    used = [TRACKED_MEASURES.index(name) for name in tolerance_mm]
    effects, offset, wanted = response.effects[:, used], response.rest[used], wanted_mm[:, used]
    noise = np.diag([tolerance_mm[name] ** 2 for name in tolerance_mm])
    noise = np.tile(noise, (len(values), 1, 1))
    if seal is not None:
        tie = np.zeros(len(effects))
        tie[response.names.index("mouthClose")], tie[response.names.index("jawOpen")] = 1, -1
        effects, offset = np.column_stack([effects, tie]), np.append(offset, 0.0)
        wanted = np.column_stack([wanted, seal.beyond_jaw])
        noise = np.pad(noise, ((0, 0), (0, 1), (0, 1)))
        noise[:, -1, -1] = (SEALED_TO / np.maximum(seal.gate, UNSEALED)) ** 2
    start = values.astype(np.float64)
    free = np.zeros_like(start)
    for name, far in freedom.items():
        free[:, response.names.index(name)] = np.square(far)
    current = start
    for _ in range(ROUNDS):
        # What has met a limit stays there, and the others take its part.
        held = np.where(free > 0, start, current)
        left = wanted - (held @ effects + offset)
        inner = np.einsum("cm,fc,cn->fmn", effects, free, effects) + noise
        shares = np.linalg.solve(inner, left[..., None])[..., 0]
        unbounded = held + free * (shares @ effects.T)
        current = np.clip(unbounded, 0, 1)
        if seal is not None:
            close, jaw = (response.names.index(name) for name in ("mouthClose", "jawOpen"))
            current[:, close] = np.minimum(current[:, close], current[:, jaw] + CLOSE_MOST)
        within = current == unbounded
        if within.all():
            break  # the next round would give the same
        free = np.where(within, free, 0.0)
    return current.astype(np.float32)
