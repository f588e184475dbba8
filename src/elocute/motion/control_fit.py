"""Weights of any set of mouth shapes that come nearest to a motion of the built-in head.

Each shape is told as weights of the head's own: a viseme is the look that the head has for it. The
weights are non-negative, few at a time, and as smooth as the motion: each frame is a strictly
convex problem, so that its solution changes no faster than what it is solved for, and a take that
is cut has the same weights. Whole mouths (visemes, vowels) share a weight of one, and where the
motion's lips seal, the one that seals them is taken in full.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from elocute.array_types import Float32Array, Float64Array
from elocute.head.model import HeadModel
from elocute.head.viseme_shapes import VISEME_SHAPES
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from elocute.numerics.bounded_least_squares import solve_box_sum

MOUTH = ("jaw", "mouth", "tongue")
SIDEWAYS = frozenset(("jawLeft", "jawRight", "mouthLeft", "mouthRight"))
"""What only moves as far as the motion does."""
MOVED_M = 1e-4
"""What no shape of the mouth moves further than this is left out."""
LIPS, GAP, SHUT = 4.0, 12.0, 200.0
"""How much more a vertex of the lips counts, the gap between them, and that of lips that touch."""
TOUCH_M = 1e-3
"""Lips this far apart count about a third of the way to those that touch."""
CLOSED_MM = 0.05
"""Lips that are this near touch."""
SEALED_M, APART_M = 1e-3, 2e-3
"""Lips pressed on each other are sealed up to the one, and not at all from the other on."""
PRESS = ("mouthPressLeft", "mouthPressRight")
ROLLED = 0.15
"""Of `mouthClose`: from here on lips that it closes over an open jaw are sealed."""
JAW_SEEN = 0.3  # share of a jaw behind shut lips that visemes are fitted to
RIDGE = 1e-3  # of the mean squared length of a shape
SPARSE = 0.01  # of the same: what a weight costs, whatever the fit


@dataclass(frozen=True, eq=False)
class ControlFit:
    """Weights of mouth shapes, and how far they are from the motion.

    Attributes
    ----------
    weights : (frame, control) float32
        0 to 1.
    skin_mm : float
        Root mean square of what the skin around the mouth is off, over places that move and frames.
    opening_mm : float
        How far the opening of the lips is off, on average.
    closed_mm : float
        The widest opening where the motion's lips touch.
    """

    weights: Float32Array
    skin_mm: float
    opening_mm: float
    closed_mm: float


def is_of_mouth(curve: str) -> bool:
    """Whether a curve of the built-in head moves its mouth.

    Parameters
    ----------
    curve : str
        A name.

    Returns
    -------
    bool
    """
    return curve.startswith(MOUTH)


def is_whole_mouth(look: dict[str, float]) -> bool:
    """Whether a shape is a whole mouth, a viseme or a vowel, which others share a weight with.

    Parameters
    ----------
    look : dict of str to float
        Weights of the built-in head's curves.

    Returns
    -------
    bool
    """
    return 0 < look.get("jawOpen", 0.0) < 1


def fit_controls(motion: Motion, looks: Sequence[dict[str, float]]) -> ControlFit:
    """Fit weights of mouth shapes to a motion.

    Parameters
    ----------
    motion : Motion
        Of a head with the built-in head's shapes.
    looks : sequence of dict of str to float
        For each shape the curves of the head that it is, at weight one.

    Returns
    -------
    ControlFit
    """
    head = motion.head
    names = [name for name in head.expression_names if is_of_mouth(name)]
    columns = [head.expression_index(name) for name in names]
    taken = motion.weights[:, columns].astype(np.float64)
    curves = _with_less_hidden_jaw(taken, names)
    mixes = np.array([[look.get(name, 0.0) for name in names] for look in looks], np.float64)
    parts, gaps, rows = _rows(head, columns)
    # (curve, curve): all that the fit needs of the mesh
    skin, gap = rows @ rows.T, gaps @ gaps.T
    plain, close = (mixes @ each @ mixes.T for each in (skin, gap))
    mean = float(np.trace(plain)) / max(1, len(plain))
    plain[np.diag_indices_from(plain)] += RIDGE * mean
    shares = _gap_counts(curves, gaps)
    sides = (curves @ skin + shares[:, None] * (curves @ gap)) @ mixes.T - SPARSE * mean
    low, high = np.zeros((len(curves), len(looks))), np.ones(len(looks))
    for place, look in enumerate(looks):
        if look and SIDEWAYS.issuperset(look):  # two that pull against each other are no mouth
            high[place] = min(1.0, max(float(_curve(motion, name).max()) for name in look))
    sealing = [VISEME_SHAPES["PP"].get(name, 0.0) for name in names]
    for place in np.flatnonzero(np.abs(mixes - sealing).max(axis=1, initial=0) < 1e-6)[:1]:
        low[:, place] = _seals(motion, curves, gaps)
    mouths = np.array([float(is_whole_mouth(look)) for look in looks])
    weights = np.stack(
        [
            solve_box_sum(plain + share * close, side, least, high, mouths)
            for share, side, least in zip(shares, sides, low, strict=True)
        ]
    )
    off = weights @ mixes - taken
    places = max(1, parts.shape[1] // 3)
    squares = np.einsum("fc,cd,fd->f", off, parts @ parts.T, off) / places
    moved = motion.weights.copy()
    moved[:, columns] = weights @ mixes
    had, wanted = (
        measure_mouth(each)["opening_mm"] for each in (replace(motion, weights=moved), motion)
    )
    return ControlFit(
        weights.astype(np.float32),
        1000 * float(np.sqrt(max(0.0, squares.mean()))),
        float(np.abs(had - wanted).mean()),
        float(had[wanted < CLOSED_MM].max(initial=0.0)),
    )


def _with_less_hidden_jaw(curves: Float64Array, names: list[str]) -> Float64Array:
    """Curves with `JAW_SEEN` of the jaw that `mouthClose` hides, which no viseme has."""
    if not {"jawOpen", "mouthClose"} <= set(names):
        return curves
    pair = [names.index("jawOpen"), names.index("mouthClose")]
    found = curves.copy()
    found[:, pair] -= (1 - JAW_SEEN) * curves[:, pair].min(axis=1, keepdims=True)
    return found


def _apart(curves: Float64Array, gaps: Float64Array) -> Float64Array:
    """(frame,) how far the lips are from where they are at rest, towards each other, m."""
    return np.linalg.norm((curves @ gaps).reshape(len(curves), -1, 3), axis=2).mean(axis=1)


def _seals(motion: Motion, curves: Float64Array, gaps: Float64Array) -> Float64Array:
    """(frame,) how far lips that touch are sealed, as for a p: pressed, or closed over the jaw."""
    pressed = np.max([_curve(motion, name) for name in PRESS], axis=0)
    pressed = pressed / VISEME_SHAPES["PP"][PRESS[0]]
    jaw, over = _curve(motion, "jawOpen"), _curve(motion, "mouthClose")
    closed = np.minimum(over / np.maximum(jaw, 1e-6), 1) * np.minimum(over / ROLLED, 1)
    near = (APART_M - _apart(curves, gaps)) / (APART_M - SEALED_M)
    return np.clip(np.maximum(pressed, closed), 0, 1) * np.clip(near, 0, 1)


def _curve(motion: Motion, name: str) -> Float64Array:
    """(frame,) of a curve; zeros where the head has none."""
    if name not in motion.names:
        return np.zeros(motion.frame_count)
    return motion.weights[:, motion.names.index(name)].astype(np.float64)


def _gap_counts(curves: Float64Array, gaps: Float64Array) -> Float64Array:
    """(frame,) how much the gap counts: more the nearer the lips are."""
    touching = np.exp(-((_apart(curves, gaps) / TOUCH_M) ** 2))
    return GAP**2 + (SHUT**2 - GAP**2) * touching


def _rows(head: HeadModel, columns: list[int]) -> tuple[Float64Array, Float64Array, Float64Array]:
    """What the shapes of a mouth do, m: to the skin, to the gap of the lips, and as it counts."""
    basis = head.expression_basis[columns].astype(np.float64)
    moved = np.linalg.norm(basis, axis=2).max(axis=0) > MOVED_M
    lips = np.zeros(head.vertex_count)
    lips[head.regions.get("lips", [])] = 1
    parts = basis[:, moved].reshape(len(columns), -1)
    counts = np.repeat(1 + (LIPS - 1) * lips[moved], 3)
    upper, lower = head.inner_lip_upper, head.inner_lip_lower
    gaps = (basis[:, upper] - basis[:, lower]).reshape(len(columns), -1)
    return parts, gaps, parts * counts
